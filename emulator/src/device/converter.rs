//! The converter: sensor words of N keys in, drive words out, once per tick.
//!
//! ```text
//!   host --samples--> converter --sense buffer--> program --drive buffer--> converter --drives--> host
//! ```
//!
//! No chip has it; it stands for the converters and their DMA around one. In each tick it takes the
//! drive words out of memory, puts the next sensor words into it, and raises the interrupt of every
//! core that serves it. A tick that comes before all of them have acknowledged the one before is an
//! overrun: counted, flagged, and it changes nothing else.
//!
//! | offset | register | |
//! | --- | --- | --- |
//! | 0x00 | CTRL | bit 0 enable, without which outputs are zero; bit 1 double buffers; bits 9:8 which cores serve (reset: core 0) |
//! | 0x04 | STATUS | bit 0 a tick waits for this core, written 1 to acknowledge; bit 1 overrun, written 1 to clear; bit 2 the samples are over; bit 3 which half of double buffers this tick uses |
//! | 0x08 | KEYS | words each way (reset: what the board has) |
//! | 0x0c | SENSE | address of the sensor words, 16 bits each, in the order of keys |
//! | 0x10 | DRIVE | address of the drive words |
//! | 0x14 | HALF | bytes from the first half of a double buffer to the second |
//! | 0x18 | RATE | ticks per second, or in SECONDS |
//! | 0x1c | TICKS | ticks since it was enabled |
//! | 0x20 | OVERRUNS | ticks that came too early |
//! | 0x24 | SPLIT | from this key on, words lie in buffers of their own (reset: above all keys) |
//! | 0x28, 0x2c, 0x30 | SENSE1, DRIVE1, HALF1 | theirs, as 0x0c to 0x14 |
//! | 0x34 | LEFT | a sample of the left channel, signed |
//! | 0x38 | RIGHT | one of the right channel; both leave |
//! | 0x3c | SECONDS | in which there are RATE ticks (reset: 1) |

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

const ENABLE: u32 = 1;
const DOUBLE: u32 = 2;
const OVERRUN: u32 = 2;
const OVER: u32 = 4;

/// Where words are exchanged.
#[derive(Debug, Clone, Copy, Default)]
struct Buffers {
    sense: u32,
    drive: u32,
    half: u32,
}

/// See the module.
pub struct Converter {
    /// Sensor words to come: KEYS per tick. When they are over, the last ones stay.
    pub samples: VecDeque<u16>,
    /// Whether drive words are kept for the host.
    pub recording: bool,
    /// Drive words so far: KEYS per tick, from the second tick on. Take them whenever you like.
    pub drives: Vec<i16>,
    /// What its outputs hold: the drive words that it took last; zero from the cycle on in which it
    /// is disabled, or reset with the chip. Kept with `drives`.
    outputs: Vec<i16>,
    /// Whether samples of the sound are kept for the host.
    pub listening: bool,
    /// Samples so far, left and right. Take them whenever you like.
    pub heard: Vec<[i32; 2]>,
    /// What the register TICKS shows more than there were: even. A board that has played for days.
    pub ticks_before: u32,
    clock_hz: u64,
    interrupt: usize,
    control: u32,
    keys: u32,
    split: u32,
    /// Of the keys below the split, and of the others.
    buffers: [Buffers; 2],
    /// Ticks in `seconds`.
    rate: u32,
    seconds: u32,
    /// The cycle it was enabled in.
    started: u64,
    ticks: u32,
    overruns: u32,
    overrun: bool,
    over: bool,
    given: usize,
    /// Cores that have not acknowledged.
    waiting: u32,
    last: Vec<u16>,
    /// Left and right.
    samples_out: [u32; 2],
}

impl Converter {
    pub(crate) fn new(
        clock_hz: u32,
        interrupt: usize,
        keys: u32,
        [rate, seconds]: [u32; 2],
    ) -> Self {
        Self {
            samples: VecDeque::new(),
            recording: false,
            drives: Vec::new(),
            outputs: Vec::new(),
            listening: false,
            heard: Vec::new(),
            ticks_before: 0,
            clock_hz: u64::from(clock_hz),
            interrupt,
            control: 1 << 8,
            keys,
            split: KEYS_MAX,
            buffers: [Buffers::default(); 2],
            rate,
            seconds,
            started: 0,
            ticks: 0,
            overruns: 0,
            overrun: false,
            over: false,
            given: 0,
            waiting: 0,
            last: Vec::new(),
            samples_out: [0; 2],
        }
    }

    /// Ticks since it was enabled.
    pub fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Ticks that came before the one before was acknowledged.
    pub fn overruns(&self) -> u32 {
        self.overruns
    }

    /// Whether a tick came for which there were no samples.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// What the outputs hold, a word a key, while drive words are recorded.
    pub fn outputs(&self) -> &[i16] {
        &self.outputs
    }

    /// How many of the host's sensor words the program has been given.
    pub fn words_given(&self) -> usize {
        self.given
    }

    /// Words each way per tick.
    pub fn keys(&self) -> u32 {
        self.keys
    }

    /// The cycle in which a tick is requested, counted from 0: the rate need not divide the clock,
    /// and no fraction is lost.
    pub fn cycle_of(&self, tick: u32) -> u64 {
        let cycles = u128::from(tick + 1) * u128::from(self.clock_hz) * u128::from(self.seconds)
            / u128::from(self.ticks_in_seconds().max(1));
        self.started
            .saturating_add(u64::try_from(cycles).unwrap_or(u64::MAX))
    }

    /// What RATE says, at most [`RATE_MAX`] a second.
    fn ticks_in_seconds(&self) -> u64 {
        u64::from(self.rate).min(u64::from(self.seconds) * RATE_MAX)
    }

    /// The half of double buffers that a tick uses.
    fn half_of(&self, tick: u32) -> u32 {
        if self.control & DOUBLE != 0 {
            tick % 2
        } else {
            0
        }
    }

    fn tick(&mut self, cycle: u64, bus: &mut Bus) {
        if self.waiting != 0 {
            self.overrun = true;
            self.overruns = self.overruns.saturating_add(1);
        }
        if self.ticks > 0 && self.recording {
            self.take_drives(cycle, bus);
        }
        self.give_samples(cycle, bus);
        self.ticks = self.ticks.wrapping_add(1);
        self.waiting = self.control >> 8 & 3;
    }

    /// Where a key's word is in a half of its buffers.
    fn address(&self, key: u32, half: u32, buffer: impl Fn(&Buffers) -> u32) -> u32 {
        let (own, first) = if key < self.split {
            (&self.buffers[0], 0)
        } else {
            (&self.buffers[1], self.split)
        };
        buffer(own)
            .wrapping_add(own.half.wrapping_mul(half))
            .wrapping_add(2 * (key - first))
            & !1
    }

    /// The drive words of the tick before; where there is no memory, zero.
    fn take_drives(&mut self, cycle: u64, bus: &mut Bus) {
        let half = self.half_of(self.ticks.wrapping_sub(1));
        let words = (0..self.keys).map(|key| {
            let from = self.address(key, half, |own| own.drive);
            bus.read(from, 2, cycle).unwrap_or(0) as u16 as i16
        });
        let words: Vec<i16> = words.collect();
        self.drives.extend(&words);
        self.outputs = words;
    }

    fn give_samples(&mut self, cycle: u64, bus: &mut Bus) {
        let keys = self.keys as usize;
        if self.samples.len() >= keys {
            self.last = self.samples.drain(..keys).collect();
            self.given += keys;
        } else {
            self.over = true;
            self.last.resize(keys, 0);
        }
        let half = self.half_of(self.ticks);
        for (key, word) in self.last.iter().enumerate() {
            // A buffer that is not memory is the program's mistake, which it sees as words that do
            // not come.
            let to = self.address(key as u32, half, |own| own.sense);
            let _ = bus.write(to, 2, u32::from(*word), cycle);
        }
    }

    fn interrupts(&self, bus: &mut Bus) {
        (0..2).for_each(|core| {
            bus.lines
                .set(core, self.interrupt, self.waiting >> core & 1 != 0)
        });
    }

    fn status(&self, core: usize) -> u32 {
        let waits = if core < 2 {
            self.waiting >> core & 1
        } else {
            0
        };
        let half = self.half_of(self.ticks.wrapping_sub(1)) << 3;
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        waits | flag(self.overrun, OVERRUN) | flag(self.over, OVER) | half
    }

    fn acknowledge(&mut self, core: usize, value: u32) {
        if value & 1 != 0 && core < 2 {
            self.waiting &= !(1 << core);
        }
        self.overrun &= value & OVERRUN == 0;
    }

    /// The sample of the right channel comes, and both are heard.
    fn play(&mut self, right: u32) {
        self.samples_out[1] = right;
        if self.listening {
            self.heard
                .push(self.samples_out.map(|sample| sample as i32));
        }
    }

    fn enable(&mut self, control: u32, cycle: u64) {
        let begins = control & ENABLE != 0 && self.control & ENABLE == 0;
        self.control = control & 0x303;
        if control & ENABLE == 0 {
            self.outputs.fill(0);
        }
        if begins {
            (self.started, self.ticks, self.waiting) = (cycle, 0, 0);
        }
    }
}

/// More keys than any keyboard has, at a rate that no converter of one reaches: bounds on the work
/// of a cycle.
const KEYS_MAX: u32 = 1024;
const RATE_MAX: u64 = 1_000_000;

impl Device for Converter {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let word = match alias::plain(access.offset) & !3 {
            0x00 => self.control,
            0x04 => self.status(access.core),
            0x08 => self.keys,
            0x0c => self.buffers[0].sense,
            0x10 => self.buffers[0].drive,
            0x14 => self.buffers[0].half,
            0x18 => self.rate,
            0x1c => self.ticks.wrapping_add(self.ticks_before),
            0x20 => self.overruns,
            0x24 => self.split,
            0x28 => self.buffers[1].sense,
            0x2c => self.buffers[1].drive,
            0x30 => self.buffers[1].half,
            0x34 => self.samples_out[0],
            0x38 => self.samples_out[1],
            0x3c => self.seconds,
            _ => return Err(BusError),
        };
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        let whole = |old| alias::written(access, value, old);
        match alias::plain(access.offset) & !3 {
            0x00 => self.enable(whole(self.control), access.cycle),
            0x04 => self.acknowledge(access.core, value),
            0x08 => self.keys = whole(self.keys).min(KEYS_MAX),
            0x0c => self.buffers[0].sense = whole(self.buffers[0].sense),
            0x10 => self.buffers[0].drive = whole(self.buffers[0].drive),
            0x14 => self.buffers[0].half = whole(self.buffers[0].half),
            0x18 => self.rate = whole(self.rate),
            0x1c | 0x20 => {}
            0x24 => self.split = whole(self.split).min(KEYS_MAX),
            0x28 => self.buffers[1].sense = whole(self.buffers[1].sense),
            0x2c => self.buffers[1].drive = whole(self.buffers[1].drive),
            0x30 => self.buffers[1].half = whole(self.buffers[1].half),
            0x34 => self.samples_out[0] = whole(self.samples_out[0]),
            0x38 => self.play(whole(self.samples_out[1])),
            0x3c => self.seconds = whole(self.seconds),
            _ => return Err(BusError),
        }
        self.interrupts(bus);
        Ok(())
    }

    fn keeps_to_itself(&self, offset: u32, _: bool) -> bool {
        (alias::plain(offset) & !3) <= 0x3c
    }

    fn due(&self) -> u64 {
        let runs = self.control & ENABLE != 0 && self.ticks_in_seconds() != 0;
        if runs {
            self.cycle_of(self.ticks)
        } else {
            u64::MAX
        }
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        while self.due() <= cycle {
            self.tick(cycle, bus);
        }
        self.interrupts(bus);
    }

    fn reset(&mut self) {
        self.control = 1 << 8;
        self.outputs.fill(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, CoreKind};

    const RAM: u32 = 0x2000_0000;

    fn converter() -> (Converter, Bus) {
        let mut pair = (
            Converter::new(150_000_000, 46, 2, [44_100, 1]),
            Bus::new(&Board::generic(CoreKind::CortexM33)).unwrap(),
        );
        pair.0.recording = true;
        pair.0.samples.extend([10, 20, 11, 21, 12, 22]);
        [(0x0c, RAM), (0x10, RAM + 0x40), (0x14, 4), (0x00, 0x103)]
            .iter()
            .for_each(|(at, value)| write(&mut pair, *at, 1000, *value));
        pair
    }

    fn write(pair: &mut (Converter, Bus), offset: u32, cycle: u64, value: u32) {
        pair.0
            .write(
                Access {
                    offset,
                    size: 4,
                    core: 0,
                    cycle,
                },
                value,
                &mut pair.1,
            )
            .unwrap();
    }

    fn tick(pair: &mut (Converter, Bus)) -> u64 {
        let cycle = pair.0.due();
        pair.0.attend(cycle, &mut pair.1);
        cycle
    }

    #[test]
    fn ticks_keep_the_rate_without_drift() {
        let mut pair = converter();
        let first = tick(&mut pair);
        assert_eq!(first, 1000 + 3401);
        write(&mut pair, 4, first, 1);
        for _ in 1..44_100 {
            let cycle = tick(&mut pair);
            write(&mut pair, 4, cycle, 1);
        }
        assert_eq!(pair.0.cycle_of(44_099), 1000 + 150_000_000);
        assert_eq!(pair.0.overruns(), 0);
    }

    #[test]
    fn words_go_both_ways_in_halves() {
        let mut pair = converter();
        tick(&mut pair);
        assert_eq!(pair.1.read(RAM, 4, 0), Ok(20 << 16 | 10));
        assert!(pair.1.lines.level(0, 46) && !pair.1.lines.level(1, 46));
        pair.1.write(RAM + 0x40, 4, 0xffff_0005, 0).unwrap();
        write(&mut pair, 4, 5000, 1);
        assert!(!pair.1.lines.level(0, 46));
        tick(&mut pair);
        assert_eq!(pair.1.read(RAM + 4, 4, 0), Ok(21 << 16 | 11));
        assert_eq!(
            (pair.0.drives.as_slice(), pair.0.status(0)),
            (&[5, -1][..], 0b1001)
        );
    }

    #[test]
    fn outputs_hold_the_last_words_until_it_is_disabled_or_reset() {
        for ends in [true, false] {
            let mut pair = converter();
            tick(&mut pair);
            pair.1.write(RAM + 0x40, 4, 0xffff_0005, 0).unwrap();
            assert!(pair.0.outputs().is_empty());
            tick(&mut pair);
            assert_eq!(pair.0.outputs(), [5, -1]);
            match ends {
                true => write(&mut pair, 0, 9000, 0x102),
                false => pair.0.reset(),
            }
            assert_eq!((pair.0.outputs(), pair.0.due()), (&[0, 0][..], u64::MAX));
        }
    }

    #[test]
    fn keys_behind_the_split_have_buffers_of_their_own() {
        let mut pair = converter();
        [(0x24, 1), (0x28, RAM + 0x80), (0x2c, RAM + 0xc0), (0x30, 8)]
            .iter()
            .for_each(|(at, value)| write(&mut pair, *at, 1000, *value));
        tick(&mut pair);
        assert_eq!(
            (pair.1.read(RAM, 4, 0), pair.1.read(RAM + 0x80, 4, 0)),
            (Ok(10), Ok(20))
        );
        pair.1.write(RAM + 0x40, 2, 5, 0).unwrap();
        pair.1.write(RAM + 0xc0, 2, 0xffff, 0).unwrap();
        tick(&mut pair);
        assert_eq!(
            (pair.1.read(RAM + 4, 4, 0), pair.1.read(RAM + 0x88, 4, 0)),
            (Ok(11), Ok(21))
        );
        assert_eq!(pair.0.drives, [5, -1]);
    }

    #[test]
    fn a_late_program_is_told() {
        let mut pair = converter();
        for _ in 0..3 {
            tick(&mut pair);
        }
        assert_eq!(
            (pair.0.overruns(), pair.0.status(0), pair.0.is_over()),
            (2, 0b0011, false)
        );
        tick(&mut pair);
        assert!(pair.0.is_over());
        assert_eq!(
            pair.1.read(RAM + 4, 4, 0),
            Ok(22 << 16 | 12),
            "the last words stay"
        );
        write(&mut pair, 4, 0, 3);
        assert_eq!(pair.0.status(0) & 3, 0);
    }
}
