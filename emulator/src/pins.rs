//! The pins: where a chip ends. What cores, PIO, PWM and the world outside do to a pin meets here
//! as one level, with the cycle from which on it holds.
//!
//! ```text
//!   SIO, PIO, PWM .. --drive--> function select, overrides --> pad (isolation, disable) --\
//!                                                                            pulls --> level --> inputs
//!   models outside --drive-------------------------------------------------------------/
//! ```
//!
//! A level belongs to whole cycles: what is driven in one cycle holds from the next. Of two who
//! drive a pin the chip wins over the outside. A pin that nobody drives or pulls keeps its level.
//!
//! Not here: what drive strength, slew and Schmitt triggers do, interrupts of pins.

use std::collections::VecDeque;

/// Levels that inputs may still ask for: as many changes back, which are at least as many cycles.
const REMEMBERED: usize = 8;

/// Whoever drives pins, in the order of its numbers in `Pins`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Source {
    Sio,
    /// A block of state machines.
    Pio(usize),
    Pwm,
}

/// The function select of a pin that no function has.
const NO_FUNCTION: u32 = 31;

impl Source {
    const COUNT: usize = 5;

    fn index(self) -> usize {
        match self {
            Self::Sio => 0,
            Self::Pio(block) => 1 + block.min(2),
            Self::Pwm => 4,
        }
    }

    /// The one that a pin's function select chooses; the numbers are the same on both chips as far
    /// as they go.
    fn selected(function: u32, blocks: usize) -> Option<Self> {
        match function {
            4 => Some(Self::Pwm),
            5 => Some(Self::Sio),
            6..=8 => Some(Self::Pio(function as usize - 6)).filter(|s| s.index() <= blocks),
            _ => None,
        }
    }
}

/// A bit a pin: what is driven, and where anything is.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
struct Drive {
    levels: u64,
    enable: u64,
}

/// What an override makes of a signal: nothing, inverted, low, high.
#[derive(Clone, Copy, Default, Debug)]
struct Override {
    invert: u64,
    low: u64,
    high: u64,
}

impl Override {
    fn choose(&mut self, pin: u64, kind: u32) {
        for (mask, number) in [
            (&mut self.invert, 1),
            (&mut self.low, 2),
            (&mut self.high, 3),
        ] {
            *mask = *mask & !pin | if kind == number { pin } else { 0 };
        }
    }

    fn of(&self, signal: u64) -> u64 {
        (signal ^ self.invert) & !self.low | self.high
    }
}

/// A bit a pin: what its pad is told. While a pad is isolated it holds what it was told before.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
struct Pads {
    out: Drive,
    input_enable: u64,
    pull_up: u64,
    pull_down: u64,
}

impl Pads {
    /// These pads, but for those in the mask, which are as they were.
    fn but(self, isolated: u64, before: Self) -> Self {
        let mix = |new: u64, old: u64| new & !isolated | old & isolated;
        Self {
            out: Drive {
                levels: mix(self.out.levels, before.out.levels),
                enable: mix(self.out.enable, before.out.enable),
            },
            input_enable: mix(self.input_enable, before.input_enable),
            pull_up: mix(self.pull_up, before.pull_up),
            pull_down: mix(self.pull_down, before.pull_down),
        }
    }
}

/// In what the pins of chips differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct PinLayout {
    pub count: usize,
    /// Blocks of state machines, which may be chosen.
    pub blocks: usize,
    /// Where the overrides of output, enable and input lie in a pin's CTRL.
    pub overrides: [u32; 3],
    /// What pads hold after reset.
    pub pad_reset: u32,
}

/// The level of every pin from a cycle on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PinChange {
    /// The first cycle in which these are the levels.
    pub cycle: u64,
    /// A bit a pin.
    pub levels: u64,
}

/// See the module.
pub struct Pins {
    layout: PinLayout,
    drives: [Drive; Source::COUNT],
    /// The pins that each source has been given.
    given: [u64; Source::COUNT],
    overrides: [Override; 3],
    output_disable: u64,
    isolated: u64,
    asked: Pads,
    pads: Pads,
    outside: Drive,
    /// What is on each pin for whoever measures it: 12 bits of the reference.
    analog: Vec<u16>,
    history: VecDeque<PinChange>,
    recorded: Option<Vec<PinChange>>,
    /// Pins that have had a function, or been driven from outside.
    used: u64,
    /// Whether a level has changed since somebody looked.
    changed: bool,
}

impl Pins {
    pub(crate) fn new(layout: PinLayout) -> Self {
        let start = PinChange {
            cycle: 0,
            levels: 0,
        };
        let mut pins = Self {
            layout,
            drives: [Drive::default(); Source::COUNT],
            given: [0; Source::COUNT],
            overrides: [Override::default(); 3],
            output_disable: 0,
            isolated: 0,
            asked: Pads::default(),
            pads: Pads::default(),
            outside: Drive::default(),
            analog: vec![0; layout.count],
            history: VecDeque::from([start]),
            recorded: None,
            used: 0,
            changed: false,
        };
        pins.reset_pads(0);
        pins
    }

    /// What a reset of the chip makes of pins: nobody drives them.
    pub(crate) fn reset(&mut self, cycle: u64) {
        (0..self.layout.count).for_each(|pin| self.set_function(pin, NO_FUNCTION, cycle));
        self.reset_pads(cycle);
    }

    fn reset_pads(&mut self, cycle: u64) {
        // Isolated pads hold what reset told them.
        let told = self.layout.pad_reset;
        for pad in [told & !ISOLATED, told] {
            (0..self.layout.count).for_each(|pin| self.set_pad(pin, pad, cycle));
        }
    }

    /// A board without pins that are known.
    pub(crate) fn none() -> Self {
        Self::new(PinLayout {
            count: 0,
            blocks: 0,
            overrides: [0; 3],
            pad_reset: 0,
        })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.layout.count
    }

    /// The levels now, a bit a pin.
    pub fn levels(&self) -> u64 {
        self.last().levels
    }

    /// A bit for each pin that has had a function, or been driven from outside.
    pub fn used(&self) -> u64 {
        self.used
    }

    /// From now on keeps every change for [`Pins::take_changes`].
    pub fn record(&mut self) {
        let now = self.last();
        self.recorded.get_or_insert_with(|| vec![now]);
    }

    /// The changes since they were taken last; the first one is what was when recording began.
    pub fn take_changes(&mut self) -> Vec<PinChange> {
        self.recorded
            .as_mut()
            .map(std::mem::take)
            .unwrap_or_default()
    }

    /// Drives pins from outside, `mask` of them, from a cycle on; without `drive` lets them go.
    pub fn set_outside(&mut self, mask: u64, drive: Option<u64>, cycle: u64) {
        self.outside.enable = self.outside.enable & !mask | drive.map_or(0, |_| mask);
        self.outside.levels = self.outside.levels & !mask | drive.unwrap_or(0) & mask;
        self.used |= mask;
        self.settle(cycle);
    }

    /// What the ADC finds on a pin from now on, of 4095 at its reference. A pin that is not there
    /// is ignored.
    pub fn set_analog(&mut self, pin: usize, code: u16) {
        if let Some(held) = self.analog.get_mut(pin) {
            *held = code.min(0xfff);
        }
    }

    /// What the ADC finds on a pin.
    pub(crate) fn analog(&self, pin: usize) -> u16 {
        self.analog.get(pin).copied().unwrap_or(0)
    }

    /// A source of the chip drives `levels` where `enable` says, from a cycle on.
    pub(crate) fn set(&mut self, source: Source, levels: u64, enable: u64, cycle: u64) {
        let drive = Drive { levels, enable };
        let old = std::mem::replace(&mut self.drives[source.index()], drive);
        if old != drive {
            self.settle(cycle);
        }
    }

    /// CTRL of a pin: its function and overrides.
    pub(crate) fn set_function(&mut self, pin: usize, control: u32, cycle: u64) {
        let bit = 1 << pin;
        let chosen = Source::selected(control & 0x1f, self.layout.blocks);
        for (index, given) in self.given.iter_mut().enumerate() {
            let is_chosen = chosen.is_some_and(|source| source.index() == index);
            *given = *given & !bit | if is_chosen { bit } else { 0 };
        }
        for (kind, shift) in self.overrides.iter_mut().zip(self.layout.overrides) {
            kind.choose(bit, control >> shift & 3);
        }
        self.used |= if control & 0x1f == 0x1f { 0 } else { bit };
        self.settle(cycle);
    }

    /// A pad's register.
    pub(crate) fn set_pad(&mut self, pin: usize, pad: u32, cycle: u64) {
        let bit = 1 << pin;
        let put = |mask: &mut u64, shift: u32| {
            *mask = *mask & !bit | if pad >> shift & 1 != 0 { bit } else { 0 };
        };
        put(&mut self.asked.pull_down, 2);
        put(&mut self.asked.pull_up, 3);
        put(&mut self.asked.input_enable, 6);
        put(&mut self.output_disable, 7);
        put(&mut self.isolated, 8);
        self.settle(cycle);
    }

    /// The level of every pin in a cycle, whatever comes behind it; not long ago.
    pub(crate) fn levels_in(&self, cycle: u64) -> u64 {
        let then = self.history.iter().rev().find(|past| past.cycle <= cycle);
        then.or(self.history.front()).map_or(0, |past| past.levels)
    }

    /// What inputs see of the levels that were in a cycle.
    pub(crate) fn inputs(&self, cycle: u64) -> u64 {
        self.overrides[2].of(self.levels_in(cycle) & self.pads.input_enable)
    }

    /// The cycle from which on the levels are what they are.
    pub(crate) fn last_change(&self) -> u64 {
        self.last().cycle
    }

    /// Whether a level has changed since this was asked last.
    pub(crate) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// What a pin's STATUS tells: output and enable at the pad, and the pad's input.
    pub(crate) fn pad_signals(&self, pin: usize) -> [bool; 3] {
        let inputs = self.levels() & self.pads.input_enable;
        [self.pads.out.levels, self.pads.out.enable, inputs].map(|bits| bits >> pin & 1 != 0)
    }

    fn last(&self) -> PinChange {
        self.history.back().copied().unwrap_or(PinChange {
            cycle: 0,
            levels: 0,
        })
    }

    /// What sources drive, before the pads.
    fn driven(&self) -> Drive {
        let mut sum = Drive::default();
        for (drive, given) in self.drives.iter().zip(self.given) {
            sum.levels |= drive.levels & given;
            sum.enable |= drive.enable & given;
        }
        Drive {
            levels: self.overrides[0].of(sum.levels),
            enable: self.overrides[1].of(sum.enable) & !self.output_disable,
        }
    }

    /// Levels from what everybody drives, which hold from a cycle on.
    fn settle(&mut self, cycle: u64) {
        self.asked.out = self.driven();
        self.pads = self.asked.but(self.isolated, self.pads);
        let pads = &self.pads;
        let mut levels = self.last().levels;
        let mut put = |mask: u64, to: u64| levels = levels & !mask | to & mask;
        put(pads.pull_up & !pads.pull_down, u64::MAX);
        put(pads.pull_down & !pads.pull_up, 0);
        put(self.outside.enable, self.outside.levels);
        put(pads.out.enable, pads.out.levels);
        levels &= (1 << self.layout.count) - 1;
        self.note(PinChange { cycle, levels });
    }

    fn note(&mut self, change: PinChange) {
        let last = self.last();
        if last.levels == change.levels {
            return;
        }
        // Two cores may come out of order by the cycles of an instruction.
        let change = PinChange {
            cycle: change.cycle.max(last.cycle),
            ..change
        };
        if change.cycle == last.cycle {
            self.history.pop_back();
        } else if self.history.len() == REMEMBERED {
            self.history.pop_front();
        }
        self.history.push_back(change);
        self.changed = true;
        if let Some(recorded) = &mut self.recorded {
            if recorded
                .last()
                .is_some_and(|last| last.cycle == change.cycle)
            {
                recorded.pop();
            }
            recorded.push(change);
        }
    }
}

/// The bit of a pad's register that isolates it.
const ISOLATED: u32 = 1 << 8;

#[cfg(test)]
mod tests {
    use super::*;

    const RP2350: PinLayout = PinLayout {
        count: 48,
        blocks: 3,
        overrides: [12, 14, 16],
        pad_reset: 0x116,
    };
    /// An input that is not isolated, without pulls; pulled up; pulled down; as after reset but
    /// for isolation.
    const INPUT: u32 = 1 << 6;
    const UP: u32 = INPUT | 1 << 3;
    const DOWN: u32 = INPUT | 1 << 2;

    #[test]
    fn the_chip_wins_over_the_outside_and_both_over_pulls() {
        let mut pins = Pins::new(RP2350);
        pins.set_pad(3, UP, 10);
        assert_eq!((pins.levels(), pins.inputs(9), pins.inputs(10)), (8, 0, 8));
        pins.set_outside(8, Some(0), 20);
        assert_eq!((pins.inputs(19), pins.inputs(20)), (8, 0));
        pins.set_function(3, 5, 30);
        pins.set(Source::Sio, 8, 8, 30);
        assert_eq!(pins.levels(), 8);
        pins.set(Source::Sio, 8, 0, 40);
        assert_eq!(pins.levels(), 0);
        pins.set_outside(8, None, 50);
        assert_eq!(pins.levels(), 8, "pulled up again");
        pins.set_pad(3, INPUT, 60);
        assert_eq!(pins.levels(), 8, "kept");
        pins.set_pad(3, DOWN, 70);
        assert_eq!((pins.levels(), pins.used()), (0, 8));
    }

    #[test]
    fn an_isolated_pad_holds_what_it_was_told() {
        let mut pins = Pins::new(RP2350);
        pins.set_function(0, 5, 1);
        pins.set(Source::Sio, 1, 1, 2);
        assert_eq!((pins.levels(), pins.pad_signals(0)), (0, [false; 3]));
        pins.set_pad(0, INPUT, 3);
        assert_eq!((pins.levels(), pins.pad_signals(0)), (1, [true; 3]));
        pins.set_pad(0, INPUT | ISOLATED, 4);
        pins.set(Source::Sio, 0, 1, 5);
        assert_eq!(pins.levels(), 1);
        pins.set_pad(0, INPUT, 6);
        assert_eq!(pins.levels(), 0);
    }

    #[test]
    fn overrides_and_functions() {
        let mut pins = Pins::new(RP2350);
        (0..4).for_each(|pin| pins.set_pad(pin, DOWN, 0));
        pins.set(Source::Pio(2), 0b1111, 0b1111, 0);
        pins.set_function(0, 8, 1);
        pins.set_function(1, 8 | 1 << 12, 1);
        pins.set_function(2, 31 | 3 << 12 | 3 << 14, 1);
        pins.set_function(3, 8 | 2 << 14, 1);
        assert_eq!(pins.levels(), 0b0101);
        pins.set_function(0, 8 | 1 << 16, 2);
        assert_eq!(pins.inputs(2), 0b0100, "its input inverted");
        pins.set_pad(0, DOWN & !INPUT | 1 << 7, 3);
        assert_eq!((pins.levels(), pins.inputs(3)), (0b0100, 0b0101));
    }

    #[test]
    fn changes_are_recorded_once_a_cycle() {
        let mut pins = Pins::new(RP2350);
        pins.record();
        pins.set_outside(3, Some(1), 5);
        pins.set_outside(3, Some(3), 5);
        pins.set_outside(3, Some(3), 6);
        pins.set_outside(3, Some(2), 9);
        let changes: Vec<(u64, u64)> = pins
            .take_changes()
            .iter()
            .map(|change| (change.cycle, change.levels))
            .collect();
        assert_eq!(changes, [(0, 0), (5, 3), (9, 2)]);
        assert!(pins.take_changed() && !pins.take_changed());
        assert_eq!(
            [4, 5, 8, 9].map(|cycle| pins.levels_in(cycle)),
            [0, 3, 3, 2]
        );
    }
}
