//! The ADC: 12 bits in 96 cycles of 48 MHz (RP2350 datasheet 12.4, RP2040 datasheet 4.9). What it
//! converts is what `Pins` says is on its pins when a conversion begins; its own sensor of
//! temperature gives what it gives at 27 degrees.
//!
//! A conversion begins in the cycle after what starts it, or when the one before ends; that the two
//! clocks have to meet for that is not modelled, nor are errors of conversion.

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

/// Its own clock, and the cycles of that a conversion takes.
const CLOCK_HZ: u64 = 48_000_000;
const CONVERSION: u64 = 96;
/// 0.706 V of 3.3 V.
const TEMPERATURE: u16 = 876;

const ENABLE: u32 = 1;
const START_ONCE: u32 = 4;
const START_MANY: u32 = 8;
const READY: u32 = 1 << 8;
const FIFO_ENABLE: u32 = 1;
const FIFO_SHIFT: u32 = 2;
const FIFO_REQUESTS: u32 = 8;
const UNDER: u32 = 1 << 10;
const OVER: u32 = 1 << 11;

/// In what chips differ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdcLayout {
    pub base: u32,
    pub interrupt: usize,
    /// How many inputs have pins, the first of these, and how many words its queue holds. The
    /// sensor of temperature follows the pins.
    pub inputs: u32,
    pub first_pin: usize,
    pub room: usize,
}

/// See the module.
pub(crate) struct Adc {
    layout: AdcLayout,
    clock_hz: u64,
    control: u32,
    result: u16,
    queue_control: u32,
    queue: VecDeque<u16>,
    divider: u32,
    enabled: bool,
    forced: bool,
    /// What the conversion under way began with, and the cycle in which it is over.
    converts: Option<(u16, u64)>,
    /// When the next one of many begins: in 256ths of a cycle of its own clock since `origin`.
    begins: Option<u64>,
    origin: u64,
}

impl Adc {
    pub(crate) fn new(layout: AdcLayout, clock_hz: u32) -> Self {
        Self {
            layout,
            clock_hz: u64::from(clock_hz),
            control: 0,
            result: 0,
            queue_control: 0,
            queue: VecDeque::new(),
            divider: 0,
            enabled: false,
            forced: false,
            converts: None,
            begins: None,
            origin: 0,
        }
    }

    /// Whether it requests a DMA's transfer.
    pub(crate) fn requests(&self) -> bool {
        self.queue_control & FIFO_REQUESTS != 0 && self.is_filled()
    }

    /// Whether the queue is as full as its threshold, which as 0 means a word.
    fn is_filled(&self) -> bool {
        let threshold = (self.queue_control >> 24 & 0xf).max(1);
        self.queue.len() as u32 >= threshold
    }

    /// Cycles of the chip for 256ths of cycles of its own clock, rounded up.
    fn cycles(&self, own: u64) -> u64 {
        (own * self.clock_hz).div_ceil(CLOCK_HZ << 8)
    }

    fn input(&self) -> u32 {
        self.control >> 12 & 0xf
    }

    /// Begins a conversion of the input that is selected.
    fn begin(&mut self, cycle: u64, bus: &Bus) {
        let input = self.input();
        let sample = match input {
            _ if input < self.layout.inputs => {
                bus.pins.analog(self.layout.first_pin + input as usize)
            }
            _ if input == self.layout.inputs && self.control & 2 != 0 => TEMPERATURE,
            _ => 0,
        };
        self.converts = Some((sample, cycle + self.cycles(CONVERSION << 8)));
    }

    /// A conversion is over: its result, the next input of the round.
    fn end(&mut self, sample: u16, bus: &mut Bus) {
        self.result = sample;
        if self.queue_control & FIFO_ENABLE != 0 {
            if self.queue.len() < self.layout.room {
                let shift = if self.queue_control & FIFO_SHIFT != 0 {
                    4
                } else {
                    0
                };
                self.queue.push_back(sample >> shift);
                bus.requests_changed = true;
            } else {
                self.queue_control |= OVER;
            }
        }
        let round = self.control >> 16 & ((2 << self.layout.inputs) - 1);
        let count = self.layout.inputs + 1;
        let next = (1..=count).map(|by| (self.input() + by) % count);
        if let Some(input) = next.into_iter().find(|input| round >> input & 1 != 0) {
            self.control = self.control & !(0xf << 12) | input << 12;
        }
    }

    /// When the next one of many begins, if any.
    fn next_begin(&self) -> Option<u64> {
        self.begins.map(|own| self.origin + self.cycles(own))
    }

    /// 256ths of its cycles from one of many to the next.
    fn interval(&self) -> u64 {
        u64::from(self.divider + 256).max(CONVERSION << 8)
    }

    fn advance(&mut self, cycle: u64, bus: &mut Bus) {
        while self.due() <= cycle {
            let ends = self.converts.map_or(u64::MAX, |(_, end)| end);
            match self.next_begin().filter(|begin| *begin < ends) {
                Some(begin) => {
                    self.begins = self.begins.map(|own| own + self.interval());
                    self.begin(begin, bus);
                }
                None => {
                    if let Some((sample, _)) = self.converts.take() {
                        self.end(sample, bus);
                    }
                }
            }
        }
        let active = self.enabled && self.is_filled() || self.forced;
        bus.lines.set_all(self.layout.interrupt, active);
    }

    fn word(&mut self, at: u32) -> Option<u32> {
        let filled = u32::from(self.is_filled());
        Some(match at {
            0 => {
                let idle = self.converts.is_none() && self.control & ENABLE != 0;
                self.control | if idle { READY } else { 0 }
            }
            4 => u32::from(self.result),
            8 => {
                let (len, room) = (self.queue.len(), self.layout.room);
                let state = u32::from(len == 0) << 8 | u32::from(len == room) << 9;
                self.queue_control | state | (len as u32) << 16
            }
            0xc => match self.queue.pop_front() {
                Some(sample) => u32::from(sample),
                None => {
                    self.queue_control |= UNDER;
                    0
                }
            },
            0x10 => self.divider,
            0x14 => filled,
            0x18 => u32::from(self.enabled),
            0x1c => u32::from(self.forced),
            0x20 => filled & u32::from(self.enabled) | u32::from(self.forced),
            _ => return None,
        })
    }

    fn set_word(&mut self, at: u32, value: u32, cycle: u64, bus: &Bus) -> Option<()> {
        match at {
            0 => self.set_control(value, cycle, bus),
            8 => {
                let kept = self.queue_control & (UNDER | OVER) & !value;
                self.queue_control = value & 0x0f00_000f | kept;
            }
            0x10 => self.divider = value & 0x00ff_ffff,
            0x18 => self.enabled = value & 1 != 0,
            0x1c => self.forced = value & 1 != 0,
            4 | 0xc | 0x14 | 0x20 => {}
            _ => return None,
        }
        Some(())
    }

    fn set_control(&mut self, value: u32, cycle: u64, bus: &Bus) {
        let many = value & ENABLE != 0 && value & START_MANY != 0;
        self.control = value & 0x01ff_f00b;
        if value & ENABLE == 0 {
            self.converts = None;
        }
        if many && self.begins.is_none() {
            (self.origin, self.begins) = (cycle + 1, Some(0));
        } else if !many {
            self.begins = None;
        }
        // While it converts it takes no other start.
        let once = value & ENABLE != 0 && value & START_ONCE != 0 && !many;
        if once && self.converts.is_none() {
            self.begin(cycle + 1, bus);
        }
    }

    /// What a write to one of the copies changes; where a write is an action, zero.
    fn held(&self, at: u32) -> u32 {
        match at {
            0 => self.control,
            8 => self.queue_control & !(UNDER | OVER),
            0x10 => self.divider,
            0x18 => u32::from(self.enabled),
            0x1c => u32::from(self.forced),
            _ => 0,
        }
    }
}

impl Device for Adc {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.advance(access.cycle, bus);
        let at = alias::plain(access.offset) & !3;
        let word = self.word(at).ok_or(BusError)?;
        self.advance(access.cycle, bus);
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.advance(access.cycle, bus);
        let at = alias::plain(access.offset) & !3;
        let value = alias::written(access, value, self.held(at));
        self.set_word(at, value, access.cycle, bus)
            .ok_or(BusError)?;
        self.advance(access.cycle, bus);
        bus.requests_changed = true;
        Ok(())
    }

    fn due(&self) -> u64 {
        let ends = self.converts.map_or(u64::MAX, |(_, end)| end);
        ends.min(self.next_begin().unwrap_or(u64::MAX))
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.advance(cycle, bus);
    }
}

#[cfg(test)]
mod tests {
    use crate::boards::{BoardKind, ConverterSetup, build};
    use crate::machine::Machine;

    const ADC: u32 = 0x400a_0000;
    const QUEUE: u32 = ADC + 8;

    fn machine() -> Machine {
        let kind = BoardKind::Rp2350;
        let built = build(kind, kind.board(), ConverterSetup::default());
        let (mut machine, _) = built.expect("a board");
        (0..8).for_each(|i| machine.bus.pins.set_analog(40 + i, 100 * i as u16 + 7));
        machine
    }

    fn write(machine: &mut Machine, address: u32, value: u32, cycle: u64) {
        machine.bus.attend(cycle);
        let write = machine.bus.device_write(address, 4, value, 0, cycle);
        write.expect("a register");
    }

    fn read(machine: &mut Machine, address: u32, cycle: u64) -> u32 {
        machine.bus.attend(cycle);
        let read = machine.bus.device_read(address, 4, 0, cycle);
        read.expect("a register").0
    }

    #[test]
    fn one_conversion_takes_300_cycles_of_150_mhz() {
        let mut machine = machine();
        write(&mut machine, ADC, 1 | 3 << 12, 10);
        assert_eq!(read(&mut machine, ADC, 11) >> 8 & 1, 1);
        write(&mut machine, ADC + 0x2000, 4, 100);
        machine.bus.pins.set_analog(43, 9);
        let ready = |machine: &mut Machine, cycle| read(machine, ADC, cycle) >> 8 & 1;
        assert_eq!([400, 401].map(|cycle| ready(&mut machine, cycle)), [0, 1]);
        assert_eq!(
            read(&mut machine, ADC + 4, 402),
            307,
            "sampled when it began"
        );
    }

    #[test]
    fn rounds_go_through_their_inputs_and_the_queue_holds_eight() {
        let mut machine = machine();
        write(&mut machine, QUEUE, 1, 0);
        // Inputs 1, 4 and 6, from 4 on, as fast as it goes.
        write(&mut machine, ADC, 1 | 8 | 4 << 12 | 0x52 << 16, 0);
        assert_eq!(read(&mut machine, QUEUE, 1 + 8 * 300) >> 16 & 0xf, 8);
        assert_eq!(read(&mut machine, QUEUE, 9 * 300) >> 11 & 1, 0);
        assert_eq!(
            read(&mut machine, QUEUE, 1 + 9 * 300) >> 11 & 1,
            1,
            "one too many"
        );
        let found: Vec<u32> = (0..8)
            .map(|_| read(&mut machine, ADC + 0xc, 2800))
            .collect();
        assert_eq!(found, [407, 607, 107, 407, 607, 107, 407, 607]);
        assert_eq!(read(&mut machine, ADC + 0xc, 2800), 0);
        assert_eq!(
            read(&mut machine, QUEUE, 2800) >> 10 & 1,
            1,
            "read when it was empty"
        );
    }

    #[test]
    fn a_divider_is_the_interval_and_a_dma_takes_each_sample() {
        const DMA: u32 = 0x5000_0000;
        let mut machine = machine();
        write(&mut machine, QUEUE, 1 | 8 | 1 << 24, 0);
        // 136 cycles of its own are 425 of the chip's.
        write(&mut machine, ADC + 0x10, 135 << 8, 0);
        let control = 1 | 1 << 2 | 1 << 6 | 48 << 17;
        for (at, value) in [(0, ADC + 0xc), (4, 0x2000_0000), (8, 8), (0xc, control)] {
            write(&mut machine, DMA + at, value, 0);
        }
        write(&mut machine, ADC, 1 | 8 | 0xff << 16, 0);
        for i in 0..8_u32 {
            let over = 1 + 425 * u64::from(i) + 300;
            let mut left = |cycle| read(&mut machine, DMA + 8, cycle);
            assert_eq!([left(over), left(over + 1)], [8 - i, 7 - i]);
        }
        let mut word = |i| machine.bus.read(0x2000_0000 + 2 * i, 2, 5000);
        let words: Vec<u32> = (0_u32..8).map(|i| word(i).expect("memory")).collect();
        assert_eq!(words, (0..8).map(|i| 100 * i + 7).collect::<Vec<_>>());
    }
}
