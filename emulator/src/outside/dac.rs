//! A DAC on three wires, as a PCM510x takes I2S: bit clock, side, data.
//!
//! ```text
//!   clock  _/~\_/~\_/~\_ .. 64 times                          a bit is read where it rises
//!   side   ~~~~\_____________ 32 clocks ____/~~~~ 32 clocks   low is left, and a bit ahead
//!   data   ..  | left, the highest bit first | right ..
//! ```
//!
//! It remembers each frame that it was given, and what of these wires its datasheet forbids
//! (PCM510x, table of the slave timing of its audio interface): a level of the clock or its cycle
//! that is too short, side or data that change too near to where the clock rises. Not here: how it
//! makes its system clock, its filter, which adds to the delay, what it does without clocks.

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices, Waits};

/// Which pins lead to it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DacPins {
    /// To its bit clock (BCK).
    pub clock: u32,
    /// To its word clock (LRCK).
    pub side: u32,
    /// To its data (DIN).
    pub data: u32,
}

/// What it was given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HeardFrame {
    /// The cycle in which the last bit of the right word was read.
    pub cycle: u64,
    /// Left and right, as 32 bits.
    pub words: [i32; 2],
}

/// What was forbidden, how often.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DacErrors {
    /// A level of the clock for less than 16 ns, or a cycle of it for less than 40 ns.
    pub clock: u32,
    /// Side or data changed less than 8 ns before the clock rose, or after.
    pub near: u32,
    /// A word that had not 32 bits, behind the first one that had.
    pub length: u32,
}

/// Bits of a word.
const BITS: u32 = 32;

/// A DAC at work.
pub struct SoundDac {
    pins: DacPins,
    /// Cycles of 8 ns, 16 ns and 40 ns, rounded up.
    cycles: [u64; 3],
    levels: u64,
    /// When the clock rose, and fell.
    rose: Option<u64>,
    fell: Option<u64>,
    /// When side or data changed.
    changed: u64,
    /// The word so far, and its bits; none before the first change of the side.
    word: u32,
    bits: Option<u32>,
    /// Whether there has been a whole word.
    has_begun: bool,
    /// The side of the last bit.
    side: bool,
    left: Option<i32>,
    frames: Vec<HeardFrame>,
    errors: DacErrors,
}

impl SoundDac {
    /// Wires a DAC to a chip's pins.
    pub fn attach(bus: &mut Bus, pins: DacPins, clock_hz: f64) -> DeviceId {
        let dac = Self {
            pins,
            cycles: [8e-9, 16e-9, 40e-9].map(|seconds| (seconds * clock_hz).ceil() as u64),
            levels: bus.pins.levels(),
            rose: None,
            fell: None,
            changed: 0,
            word: 0,
            bits: None,
            has_begun: false,
            side: false,
            left: None,
            frames: Vec::new(),
            errors: DacErrors::default(),
        };
        let id = bus.attach(0, 0, Waits::default(), Box::new(dac));
        let notices = Notices {
            pins: true,
            requests: false,
        };
        bus.watch(id, notices);
        id
    }

    /// The frames since the last time.
    pub fn take_frames(&mut self) -> Vec<HeardFrame> {
        std::mem::take(&mut self.frames)
    }

    /// What was forbidden.
    pub fn errors(&self) -> DacErrors {
        self.errors
    }

    fn rises(&mut self, cycle: u64, side: bool, data: bool) {
        let [near, level, period] = self.cycles;
        let short = |since: Option<u64>, least| since.is_some_and(|since| cycle - since < least);
        self.errors.clock += u32::from(short(self.fell, level) || short(self.rose, period));
        self.errors.near += u32::from(cycle - self.changed < near);
        self.rose = Some(cycle);
        self.word = self.word << 1 | u32::from(data);
        self.bits = self.bits.map(|bits| bits + 1);
        if side == self.side {
            return;
        }
        // The last bit of the other side's word.
        let complete = self.bits == Some(BITS);
        self.errors.length += u32::from(self.has_begun && !complete);
        self.has_begun |= complete;
        let word = complete.then_some(self.word as i32);
        match self.side {
            false => self.left = word,
            true => {
                if let (Some(left), Some(right)) = (self.left.take(), word) {
                    let words = [left, right];
                    self.frames.push(HeardFrame { cycle, words });
                }
            }
        }
        (self.side, self.bits) = (side, Some(0));
    }
}

impl Device for SoundDac {
    fn read(&mut self, _: Access, _: &mut Bus) -> Result<u32, BusError> {
        Err(BusError)
    }

    fn write(&mut self, _: Access, _: u32, _: &mut Bus) -> Result<(), BusError> {
        Err(BusError)
    }

    fn due(&self) -> u64 {
        u64::MAX
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        let before = std::mem::replace(&mut self.levels, bus.pins.levels());
        let changed = before ^ self.levels;
        let is = |levels: u64, pin: u32| levels >> pin & 1 != 0;
        let (side, data) = (
            is(self.levels, self.pins.side),
            is(self.levels, self.pins.data),
        );
        let [near, level, _] = self.cycles;
        if is(changed, self.pins.side) || is(changed, self.pins.data) {
            self.changed = cycle;
            let too_near = self.rose.is_some_and(|rose| cycle - rose < near);
            self.errors.near += u32::from(too_near);
        }
        if is(changed, self.pins.clock) {
            if is(self.levels, self.pins.clock) {
                self.rises(cycle, side, data);
            } else {
                let short = self.rose.is_some_and(|rose| cycle - rose < level);
                self.errors.clock += u32::from(short);
                self.fell = Some(cycle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boards::{BoardKind, ConverterSetup, build};
    use crate::machine::Machine;
    use crate::pins::Source;

    const PINS: DacPins = DacPins {
        clock: 18,
        side: 19,
        data: 20,
    };

    /// A chip whose pins are set by hand, and a DAC.
    struct Bench {
        machine: Machine,
        dac: DeviceId,
        cycle: u64,
    }

    impl Bench {
        fn new() -> Bench {
            let kind = BoardKind::Rp2350;
            let (mut machine, _) =
                build(kind, kind.board(), ConverterSetup::default()).expect("a board");
            for pin in [18, 19, 20] {
                machine.bus.pins.set_pad(pin, 1 << 6, 0);
                machine.bus.pins.set_function(pin, 5, 0);
            }
            let dac = SoundDac::attach(&mut machine.bus, PINS, 150e6);
            Bench {
                machine,
                dac,
                cycle: 100,
            }
        }

        fn set(&mut self, clock: bool, side: bool, data: bool, cycles: u64) {
            let levels = u64::from(clock) << 18 | u64::from(side) << 19 | u64::from(data) << 20;
            let pins = &mut self.machine.bus.pins;
            pins.set(Source::Sio, levels, 7 << 18, self.cycle + 1);
            self.machine.bus.give_notice(self.cycle);
            self.cycle += cycles;
            self.machine.bus.attend(self.cycle);
        }

        /// A frame in I2S: each bit is put where the clock falls, the side a bit ahead.
        fn frame(&mut self, words: [u32; 2], bits: u32, cycles: u64) {
            for (right, word) in [false, true].into_iter().zip(words) {
                for bit in (0..bits).rev() {
                    let side = right != (bit == 0);
                    let data = word >> bit & 1 != 0;
                    self.set(false, side, data, cycles);
                    self.set(true, side, data, cycles);
                }
            }
        }

        fn dac(&mut self) -> &mut SoundDac {
            self.machine.bus.device_mut(self.dac).expect("a DAC")
        }
    }

    #[test]
    fn frames_are_what_was_sent() {
        let mut bench = Bench::new();
        let words = [
            [0x8000_0001, 0x7fff_fffe],
            [1, 0xffff_ffff],
            [0x1234_5678, 0],
        ];
        // The first word may be a part of one; a left word without its beginning is none.
        for own in [[[7, 8]].as_slice(), &words].concat() {
            bench.frame(own, 32, 20);
        }
        let heard: Vec<[i32; 2]> = bench
            .dac()
            .take_frames()
            .iter()
            .map(|own| own.words)
            .collect();
        assert_eq!(heard, words.map(|own| own.map(|word| word as i32)));
        assert_eq!(bench.dac().errors(), DacErrors::default());
    }

    #[test]
    fn what_is_forbidden_is_counted() {
        let errors = |bits, cycles| {
            let mut bench = Bench::new();
            (0..3).for_each(|_| bench.frame([5, 6], bits, cycles));
            bench.dac().errors()
        };
        let none = DacErrors::default();
        assert_eq!(errors(32, 3), none);
        let short = errors(32, 2);
        assert!(short.clock > 100 && short.near == 0, "{short:?}");
        assert!(errors(32, 1).near > 3);
        // Words of another length before the first whole one may be a part of one.
        let mut bench = Bench::new();
        bench.frame([5, 6], 31, 20);
        bench.frame([5, 6], 32, 20);
        bench.frame([5, 6], 31, 20);
        let length = bench.dac().errors();
        assert_eq!((length.clock, length.near, length.length), (0, 0, 2));
    }
}
