//! The parts of knobs on a board: which GPIO leads to their sensors and their drivers, and when
//! they are sampled.
//!
//! ```text
//!   sample ----frame, tick, at most `ahead` cycles----> the carrier's wrap takes the three phases over
//! ```

use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::{Board, Contradiction, Memory};

/// Cycles from a frame's beginning until its word is there: select, 24 bits, a push.
pub const FRAME_CYCLES: u32 = 17 + 24 * 14 + 1;
/// Cycles kept for the way from the word to the interrupt's request: an estimate.
const REQUEST_CYCLES: u32 = 16;
/// GPIO of the smaller package.
const GPIO: u32 = 30;
/// Cycles between two samples, at most and at least: the PWM's counter, and room for a frame.
const PERIODS: [u32; 2] = [1000, 0x1_fffe];

/// Where the chip shows its flash, and what of it is erased at once.
const FLASH: std::ops::Range<u32> = 0x1000_0000..0x1100_0000;
const SECTOR_BYTES: u32 = 4096;

/// State machines of a block of PIO: each reads the data of one sensor.
const MACHINES: usize = 4;

/// What a knob has for itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shaft {
    /// From its angle sensor's data.
    pub data: u32,
    /// To its driver's three inputs.
    pub phases: [u32; 3],
}

/// A knob, or several with the same parts.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Knob {
    /// To the clock of all angle sensors.
    pub clock: u32,
    /// To their select.
    pub select: u32,
    /// Each knob, one to four.
    pub shafts: Vec<Shaft>,
    /// To the enable of all drivers.
    pub enable: u32,
    /// From their fault, which is low where one of them has one.
    pub fault: u32,
    /// Cycles from tick to tick, which are those of the carrier.
    pub period_cycles: u32,
    /// Cycles from a sample to the wrap that takes its force over, at least.
    pub ahead_cycles: u32,
    /// The driver's supply (mV).
    pub supply_mv: u32,
    /// What turns the magnet while the motor is found at the start (mV of a phase).
    pub align_mv: u32,
    /// Electrical turns of the motor a turn.
    pub pole_pairs: u32,
    /// The first address of the sector of flash that keeps what a start finds, if one does.
    pub store: Option<u32>,
}

/// A wire from the chip to a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// The chip's GPIO.
    pub gpio: u32,
    /// The pin of a Raspberry Pi Pico 2 that it leads to, if it leads to one.
    pub pico_pin: Option<u32>,
    /// What is at its other end.
    pub to: Cow<'static, str>,
}

/// The GPIO of each of the 40 pins of a Raspberry Pi Pico 2 that has one, in order; 99 for supply,
/// ground and the like (Raspberry Pi Pico 2 datasheet, pinout).
const PICO_PINS: [u32; 40] = [
    0, 1, 99, 2, 3, 4, 5, 99, 6, 7, 8, 9, 99, 10, 11, 12, 13, 99, 14, 15, 16, 17, 99, 18, 19, 20,
    21, 99, 22, 99, 26, 27, 99, 28, 99, 99, 99, 99, 99, 99,
];

/// The pin of a Raspberry Pi Pico 2 that a GPIO leads to.
pub(crate) fn pico_pin(gpio: u32) -> Option<u32> {
    let mut pins = (1..).zip(PICO_PINS);
    pins.find_map(|(pin, own)| (own == gpio).then_some(pin))
}

impl Knob {
    /// How many knobs there are.
    pub fn count(&self) -> u32 {
        self.shafts.len() as u32
    }

    /// What leads where, in the order of the chip's pins.
    pub fn wiring(&self) -> Vec<Wire> {
        let mut all: Vec<(u32, Cow<'static, str>)> = vec![
            (0, "MIDI out, if it is wanted".into()),
            (1, "MIDI in, if it is wanted".into()),
        ];
        let [sensors, drivers] = match self.count() {
            1 => ["angle sensor", "driver"],
            _ => ["all angle sensors", "all drivers"],
        };
        let pull = format!("{drivers}, enable; and 10 kOhm to ground");
        all.extend([
            (self.clock, format!("{sensors}, clock").into()),
            (self.select, format!("{sensors}, select").into()),
            (self.enable, pull.into()),
            (self.fault, format!("{drivers}, fault").into()),
        ]);
        for (number, shaft) in (1..).zip(&self.shafts) {
            let whose = match self.count() {
                1 => String::new(),
                _ => format!("knob {number}: "),
            };
            let [first, second, third] = shaft.phases;
            all.extend([
                (shaft.data, format!("{whose}angle sensor, data").into()),
                (first, format!("{whose}driver, first phase").into()),
                (second, format!("{whose}driver, second phase").into()),
                (third, format!("{whose}driver, third phase").into()),
            ]);
        }
        all.sort();
        let wire = |(gpio, to)| Wire {
            gpio,
            pico_pin: pico_pin(gpio),
            to,
        };
        all.into_iter().map(wire).collect()
    }

    /// Cycles that a tick may take from its request to its end.
    pub fn deadline_cycles(&self) -> u64 {
        let spent = FRAME_CYCLES + REQUEST_CYCLES;
        self.ahead_cycles.saturating_sub(spent).into()
    }

    /// The slice of a pin, and whether it is the second one of it.
    pub fn slice(pin: u32) -> (u32, bool) {
        (pin / 2 % 8, pin % 2 == 1)
    }

    pub(crate) fn wires(&self) -> Vec<(&'static str, u32)> {
        let mut all = vec![("clock", self.clock), ("select", self.select)];
        for shaft in &self.shafts {
            all.push(("data", shaft.data));
            all.extend(shaft.phases.map(|pin| ("phases", pin)));
        }
        all.extend([("enable", self.enable), ("fault", self.fault)]);
        all
    }

    /// Why its pins cannot be wired.
    fn miswired(&self) -> Option<(&'static str, String)> {
        if !(1..=MACHINES).contains(&self.shafts.len()) {
            let what = format!(
                "has {} lines, but must have one to {MACHINES}: so many state machines has a block \
                 of PIO, and each reads one",
                self.shafts.len()
            );
            return Some(("data", what));
        }
        let wires = self.wires();
        for (at, (key, pin)) in wires.iter().enumerate() {
            if *pin < 2 || *pin >= GPIO {
                let what = format!("has pin {pin}, but must be of 2 to 29: 0 and 1 are MIDI");
                return Some((key, what));
            }
            if let Some((other, _)) = wires[..at].iter().find(|(_, own)| own == pin) {
                return Some((key, format!("has pin {pin}, which `knob.{other}` has too")));
            }
        }
        let mut taken = BTreeSet::new();
        for Shaft { phases, .. } in &self.shafts {
            let [pair, second, single] = phases.map(|pin| Self::slice(pin).0);
            if !phases[0].is_multiple_of(2) || phases[1] != phases[0] + 1 || single == pair {
                let what = "must be an even pin, the pin behind it, and one of another slice of \
                            PWM, as in `6 7 8`";
                return Some(("phases", what.into()));
            }
            debug_assert_eq!(pair, second);
            for slice in [pair, single] {
                if !taken.insert(slice) {
                    let what = format!(
                        "has slice {slice} of PWM twice, but each of the two slices of a knob is \
                         its own: a pin belongs to slice (pin / 2) modulo 8"
                    );
                    return Some(("phases", what));
                }
            }
        }
        None
    }

    fn contradiction(&self) -> Option<(&'static str, String)> {
        if let Some(why) = self.miswired() {
            return Some(why);
        }
        let [least, most] = PERIODS;
        if !(least..=most).contains(&self.period_cycles) || !self.period_cycles.is_multiple_of(2) {
            let what = format!("must be an even number of {least} to {most} cycles");
            return Some(("period", what));
        }
        if !(FRAME_CYCLES..self.period_cycles - FRAME_CYCLES).contains(&self.ahead_cycles) {
            let what = format!(
                "must leave room for a frame of {FRAME_CYCLES} cycles on both sides of it, within \
                 the period"
            );
            return Some(("ahead", what));
        }
        let most_mv = self.supply_mv / 2;
        if !(1..=most_mv).contains(&self.align_mv) {
            let what = format!("must be up to {most_mv} mV, half of the supply");
            return Some(("align", what));
        }
        (!(1..=64).contains(&self.pole_pairs))
            .then(|| ("pole_pairs", "must be a number from 1 to 64".into()))
    }
}

impl Board {
    /// What no knob can be.
    pub(crate) fn knob_that_cannot_be(&self) -> Option<Contradiction> {
        let knob = self.knob.as_ref()?;
        let wrong = knob.contradiction();
        let (key, what) = wrong.or_else(|| self.misplaced_store(knob))?;
        Some(Contradiction {
            key: format!("knob.{key}"),
            what,
        })
    }

    /// A sector that is none, or that an image may lie in.
    fn misplaced_store(&self, knob: &Knob) -> Option<(&'static str, String)> {
        let at = knob.store?;
        if !FLASH.contains(&at) || !at.is_multiple_of(SECTOR_BYTES) {
            let what = "must be the beginning of a sector of flash, a multiple of 0x1000 from \
                        0x10000000 to 0x10fff000";
            return Some(("store", what.into()));
        }
        let overlaps = |own: &&Memory| own.base < at + SECTOR_BYTES && at < own.base + own.size;
        let memory = self.memory.iter().find(overlaps)?;
        let what = format!(
            "lies inside `memory.{}`, where an image may lie: make that end before it",
            memory.name
        );
        Some(("store", what))
    }

    /// Cycles that a tick may take where its period has so many.
    pub fn deadline_cycles(&self, period_cycles: u64) -> u64 {
        let knob = self.knob.as_ref().map(Knob::deadline_cycles);
        let bench = self.bench.as_ref().map(|bench| bench.deadline_cycles());
        knob.or(bench).unwrap_or(u64::MAX).min(period_cycles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right() -> Knob {
        Knob {
            clock: 2,
            select: 3,
            shafts: vec![shaft(4, [6, 7, 8])],
            enable: 9,
            fault: 10,
            period_cycles: 3400,
            ahead_cycles: 1000,
            supply_mv: 12_000,
            align_mv: 2000,
            pole_pairs: 7,
            store: None,
        }
    }

    fn shaft(data: u32, phases: [u32; 3]) -> Shaft {
        Shaft { data, phases }
    }

    /// As many as a Pico 2 takes.
    fn four() -> Vec<Shaft> {
        vec![
            shaft(4, [6, 7, 8]),
            shaft(11, [12, 13, 14]),
            shaft(15, [16, 17, 18]),
            shaft(19, [20, 21, 26]),
        ]
    }

    #[test]
    fn every_wire_has_its_pin() {
        let pins = |knob: &Knob| -> Vec<Option<u32>> {
            knob.wiring().iter().map(|wire| wire.pico_pin).collect()
        };
        assert_eq!(pins(&right()), [1, 2, 4, 5, 6, 9, 10, 11, 12, 14].map(Some));
        let far = Knob {
            fault: 23,
            ..right()
        };
        assert_eq!(far.wiring()[9].pico_pin, None);
        let all = Knob {
            shafts: four(),
            ..right()
        };
        assert!(all.contradiction().is_none() && pins(&all).iter().all(Option::is_some));
        assert_eq!(all.wiring()[10].to, "knob 2: angle sensor, data");
    }

    #[test]
    fn what_cannot_be_wired_is_told() {
        let key = |knob: &Knob| knob.contradiction().map(|(key, _)| key);
        let knob = right();
        assert_eq!((key(&knob), knob.deadline_cycles()), (None, 630));
        let with = |shafts: Vec<Shaft>| Knob { shafts, ..right() };
        let also = |one: Shaft| with([four(), vec![one]].concat());
        let second = |one: Shaft| with(vec![four()[0], one]);
        let wrong = [
            (with(vec![shaft(9, [6, 7, 8])]), "enable"),
            (
                Knob {
                    clock: 0,
                    ..right()
                },
                "clock",
            ),
            (
                Knob {
                    fault: 30,
                    ..right()
                },
                "fault",
            ),
            (with(vec![shaft(4, [7, 8, 11])]), "phases"),
            (with(vec![shaft(4, [6, 7, 22])]), "phases"),
            (with(vec![]), "data"),
            (also(shaft(22, [27, 28, 29])), "data"),
            // The pins of another knob, and its slice: 22 and 23 are of slice 3, 24 of slice 4.
            (second(shaft(4, [12, 13, 14])), "data"),
            (second(shaft(11, [12, 13, 22])), "phases"),
            (second(shaft(11, [12, 13, 24])), "phases"),
            (
                Knob {
                    period_cycles: 3401,
                    ..right()
                },
                "period",
            ),
            (
                Knob {
                    ahead_cycles: 3100,
                    ..right()
                },
                "ahead",
            ),
            (
                Knob {
                    align_mv: 6001,
                    ..right()
                },
                "align",
            ),
            (
                Knob {
                    pole_pairs: 0,
                    ..right()
                },
                "pole_pairs",
            ),
        ];
        for (knob, told) in wrong {
            assert_eq!(key(&knob), Some(told), "{knob:?}");
        }
    }
}
