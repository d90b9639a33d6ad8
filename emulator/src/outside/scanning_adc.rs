//! An ADC of eight channels that goes through them by itself, as the ADS8688: select, clock,
//! command, data.
//!
//! ```text
//!   select   ~~\__________________________________________________________/~~
//!   clock    ____/~\_/~\_/~\_ .. 32 times                               ____
//!   command      bits 15 .. 0 of a command, then nothing
//!   data     --- low for 16 clocks             | bits 15 .. 0 of the result ---
//! ```
//!
//! A channel is sampled where the select falls. Commands are read at falling edges of the clock;
//! the 16th also puts out the first bit of the result, which is read at the 17th. A command acts
//! where the select rises, and only behind a whole frame. So says the document of the ADS8688W.
//! Not checked against any: that a register's new value is told in the frame that writes it, and
//! that a frame that accesses a register moves the sequence on. Not here: the low-pass before each
//! channel, alarms, the auxiliary channel, times to wake from standby, channels that are turned
//! off, other formats of the data.

/// What is wrong with the data line of an ADC.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ScanFault {
    /// Nothing.
    #[default]
    None,
    /// Nobody drives it: what is at the other end decides.
    Silent,
    /// It lies at this level.
    Stuck(bool),
}

/// Bits of a frame.
pub(super) const BITS: u32 = 32;
/// Bits of a command.
const COMMAND_BITS: u32 = 16;
/// Registers by their addresses, and of these the channels in the sequence and the first channel's
/// range.
const REGISTERS: usize = 0x40;
const SEQUENCE: usize = 1;
const RANGES: usize = 5;
/// The reference (V).
const REFERENCE_V: f64 = 4.096;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Mode {
    /// It waits for a command.
    #[default]
    Idle,
    /// One channel after the other; the next one.
    Sequence(usize),
    /// Always the same.
    Manual(usize),
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct ScanningAdc {
    pub fault: ScanFault,
    mode: Mode,
    registers: [u8; REGISTERS],
    /// The frame: its falling edges so far, what was commanded, what is answered.
    clocks: u32,
    command: u16,
    result: u16,
    selected: bool,
    clock: bool,
    /// What is on its data pin: `None` is nothing.
    put: Option<bool>,
}

impl Default for ScanningAdc {
    fn default() -> Self {
        let mut adc = Self {
            fault: ScanFault::None,
            mode: Mode::Idle,
            registers: [0; REGISTERS],
            clocks: 0,
            command: 0,
            result: 0,
            selected: false,
            clock: false,
            put: None,
        };
        adc.reset();
        adc
    }
}

impl ScanningAdc {
    /// Its three inputs, with a voltage at each channel. What it puts on its data pin from now on,
    /// if that changes: `None` inside is nothing.
    pub fn inputs(
        &mut self,
        select: bool,
        clock: bool,
        command: bool,
        volts: &[f64; 8],
    ) -> Option<Option<bool>> {
        let selected = !select;
        let falls = self.clock && !clock;
        let was_selected = std::mem::replace(&mut self.selected, selected);
        self.clock = clock;
        let mut put = self.put;
        match (was_selected, selected) {
            (false, true) => {
                (self.clocks, self.command) = (0, 0);
                self.result = self.sample(volts);
                put = Some(false);
            }
            (true, false) => {
                if self.clocks >= BITS {
                    self.act();
                }
                put = None;
            }
            (true, true) if falls => put = Some(self.clocked(command)),
            _ => {}
        }
        let put = match self.fault {
            ScanFault::None => put,
            ScanFault::Silent => None,
            ScanFault::Stuck(level) => Some(level),
        };
        let old = std::mem::replace(&mut self.put, put);
        (old != put).then_some(put)
    }

    /// The next frame's channel is the one behind, as if there had been a frame more.
    pub fn slip(&mut self) {
        self.next_channel();
    }

    fn reset(&mut self) {
        self.registers = [0; REGISTERS];
        self.registers[SEQUENCE] = 0xff;
        self.mode = Mode::Idle;
    }

    /// A falling edge; what is on the data pin from then on.
    fn clocked(&mut self, command: bool) -> bool {
        self.clocks += 1;
        if self.clocks <= COMMAND_BITS {
            self.command = self.command << 1 | u16::from(command);
        }
        if self.clocks == COMMAND_BITS
            && let Some((register, written)) = self.accessed()
        {
            let told = written.unwrap_or(self.registers[register]);
            self.result = u16::from(told) << 8;
        }
        match self.clocks {
            COMMAND_BITS..BITS => self.result >> (BITS - 1 - self.clocks) & 1 != 0,
            _ => false,
        }
    }

    /// The register that the command accesses, and what it writes there.
    fn accessed(&self) -> Option<(usize, Option<u8>)> {
        let register = usize::from(self.command >> 9);
        let is_written = self.command >> 8 & 1 != 0;
        let written = is_written.then_some(self.command as u8);
        (1..REGISTERS)
            .contains(&register)
            .then_some((register, written))
    }

    fn act(&mut self) {
        if let Some((register, written)) = self.accessed() {
            self.registers[register] = written.unwrap_or(self.registers[register]);
            return;
        }
        match self.command {
            0x8200 => self.mode = Mode::Idle,
            0x8300 | 0x8500 => self.reset(),
            0xa000 => self.mode = Mode::Sequence(self.in_sequence(0)),
            0xc000..0xe000 => self.mode = Mode::Manual(usize::from(self.command >> 10 & 7)),
            _ => {}
        }
    }

    /// The first channel in the sequence from one on, around.
    fn in_sequence(&self, from: usize) -> usize {
        let enabled = self.registers[SEQUENCE];
        let mut all = (from..from + 8).map(|channel| channel % 8);
        all.find(|channel| enabled >> channel & 1 != 0).unwrap_or(0)
    }

    fn next_channel(&mut self) -> Option<usize> {
        match self.mode {
            Mode::Idle => None,
            Mode::Manual(channel) => Some(channel),
            Mode::Sequence(channel) => {
                self.mode = Mode::Sequence(self.in_sequence(channel + 1));
                Some(channel)
            }
        }
    }

    fn sample(&mut self, volts: &[f64; 8]) -> u16 {
        self.next_channel().map_or(0, |channel| {
            code(self.registers[RANGES + channel], volts[channel])
        })
    }
}

/// What is converted in a range: of both signs, or of one.
fn code(range: u8, volts: f64) -> u16 {
    let (span, zero) = match range & 15 {
        1 => (2.5, 0.5),
        2 => (1.25, 0.5),
        5 => (2.5, 0.0),
        6 => (1.25, 0.0),
        _ => (5.0, 0.5),
    };
    let part = volts / (span * REFERENCE_V) + zero;
    (part * 65536.0).round().clamp(0.0, 65535.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One volt a channel, from 0.5 V on.
    fn volts() -> [f64; 8] {
        std::array::from_fn(|channel| 0.5 + channel as f64)
    }

    /// A frame of so many clocks; what was read at the last 16 falling edges of 32.
    fn frame(adc: &mut ScanningAdc, command: u16, clocks: u32) -> u16 {
        let volts = volts();
        let mut level = true;
        let mut word = 0_u32;
        let mut put = |select, clock, bit| {
            let was = level;
            if let Some(put) = adc.inputs(select, clock, bit, &volts) {
                level = put.unwrap_or(true);
            }
            was
        };
        put(true, false, false);
        put(false, false, false);
        for clock in 0..clocks {
            let bit = clock < 16 && command >> (15 - clock) & 1 != 0;
            put(false, true, bit);
            // What was there before the edge.
            word = word << 1 | u32::from(put(false, false, bit));
        }
        put(true, false, false);
        assert_eq!(word >> 16 & u32::from(clocks == 32), 0, "low for 16 clocks");
        word as u16
    }

    /// Of +-10.24 V.
    fn wide(channel: usize) -> u16 {
        (32768.0 + (0.5 + channel as f64) * 3200.0) as u16
    }

    #[test]
    fn a_sequence_begins_with_the_frame_behind_its_command_and_goes_round() {
        let mut adc = ScanningAdc::default();
        assert_eq!(frame(&mut adc, 0, 32), 0, "it waits for a command");
        assert_eq!(frame(&mut adc, 0xa000, 32), 0);
        for number in 0..19 {
            assert_eq!(frame(&mut adc, 0, 32), wide(number % 8), "{number}");
        }
        // Channel 3 in the frame of the command, then from the beginning.
        assert_eq!(frame(&mut adc, 0xa000, 32), wide(3));
        assert_eq!(frame(&mut adc, 0, 32), wide(0));
        adc.slip();
        assert_eq!(frame(&mut adc, 0xa000, 32), wide(2));
        assert_eq!(frame(&mut adc, 0, 32), wide(0), "a slip is over by then");
    }

    #[test]
    fn commands_choose_channels_ranges_and_the_sequence() {
        let mut adc = ScanningAdc::default();
        frame(&mut adc, 0xc000 | 5 << 10, 32);
        assert_eq!([0; 2].map(|own| frame(&mut adc, own, 32)), [wide(5); 2]);
        // Range of channel 5: 0 to 10.24 V; then it is read, and used.
        assert_eq!(frame(&mut adc, 10 << 9 | 1 << 8 | 5, 32), 5 << 8);
        assert_eq!(frame(&mut adc, 10 << 9, 32), 5 << 8);
        assert_eq!(frame(&mut adc, 0, 32), (5.5 * 6400.0) as u16);
        // Channels 1 and 6.
        frame(&mut adc, 1 << 9 | 1 << 8 | 0x42, 32);
        frame(&mut adc, 0xa000, 32);
        let found = [0; 4].map(|own| frame(&mut adc, own, 32));
        assert_eq!(found, [1, 6, 1, 6].map(wide));
        // Everything is as at first.
        frame(&mut adc, 0x8500, 32);
        assert_eq!(frame(&mut adc, 1 << 9, 32), 0xff00);
        assert_eq!(frame(&mut adc, 10 << 9, 32), 0);
        assert_eq!(frame(&mut adc, 0, 32), 0);
    }

    #[test]
    fn a_command_in_a_short_frame_does_nothing() {
        let mut adc = ScanningAdc::default();
        frame(&mut adc, 0xa000, 31);
        assert_eq!(frame(&mut adc, 0, 32), 0);
        frame(&mut adc, 0xa000, 32);
        assert_eq!(frame(&mut adc, 0, 32), wide(0));
        // A clock less: the bits are read a place too low.
        assert_eq!(frame(&mut adc, 0, 31), wide(1) >> 1);
    }

    #[test]
    fn codes_end_where_their_range_does() {
        let ends = |range| [code(range, -20.0), code(range, 0.0), code(range, 20.0)];
        for range in [0, 1, 2] {
            assert_eq!(ends(range), [0, 0x8000, 0xffff]);
        }
        for range in [5, 6] {
            assert_eq!(ends(range), [0, 0, 0xffff]);
        }
        assert_eq!(
            [0, 1, 2, 5, 6].map(|range| code(range, 1.28)),
            [0x9000, 0xa000, 0xc000, 0x2000, 0x4000]
        );
    }

    #[test]
    fn lines_that_are_broken_or_short_show() {
        let seen = |fault| {
            let mut adc = ScanningAdc::default();
            frame(&mut adc, 0xa000, 32);
            adc.fault = fault;
            adc.inputs(true, false, false, &volts());
            let mut levels = Vec::new();
            for (select, clock) in [(false, false), (false, true), (true, false)] {
                levels.extend(adc.inputs(select, clock, false, &volts()));
            }
            (adc.put, levels)
        };
        assert_eq!(seen(ScanFault::None), (None, vec![Some(false), None]));
        assert_eq!(seen(ScanFault::Silent), (None, vec![]));
        assert_eq!(seen(ScanFault::Stuck(true)), (Some(true), vec![]));
    }
}
