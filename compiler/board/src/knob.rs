//! The parts of a knob on a board: which GPIO leads to its sensor and its driver, and when it is
//! sampled.
//!
//! ```text
//!   sample ----frame, tick, at most `ahead` cycles----> the carrier's wrap takes the three phases over
//! ```

use std::borrow::Cow;

use crate::{Board, Contradiction};

/// Cycles from a frame's beginning until its word is there: select, 24 bits, a push.
pub const FRAME_CYCLES: u32 = 17 + 24 * 14 + 1;
/// Cycles kept for the way from the word to the interrupt's request: an estimate.
const REQUEST_CYCLES: u32 = 16;
/// GPIO of the smaller package.
const GPIO: u32 = 30;
/// Cycles between two samples, at most and at least: the PWM's counter, and room for a frame.
const PERIODS: [u32; 2] = [1000, 0x1_fffe];

/// A knob.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knob {
    /// To the angle sensor's clock.
    pub clock: u32,
    /// To its select.
    pub select: u32,
    /// From its data.
    pub data: u32,
    /// To the driver's three inputs.
    pub phases: [u32; 3],
    /// To its enable.
    pub enable: u32,
    /// From its fault.
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
    /// What leads where, in the order of the chip's pins.
    pub fn wiring(&self) -> Vec<Wire> {
        let [first, second, third] = self.phases;
        let mut all = [
            (0, "MIDI out, if it is wanted"),
            (1, "MIDI in, if it is wanted"),
            (self.clock, "angle sensor, clock"),
            (self.select, "angle sensor, select"),
            (self.data, "angle sensor, data"),
            (first, "driver, first phase"),
            (second, "driver, second phase"),
            (third, "driver, third phase"),
            (self.enable, "driver, enable; and 10 kOhm to ground"),
            (self.fault, "driver, fault"),
        ];
        all.sort_unstable();
        let wire = |(gpio, to): (u32, &'static str)| Wire {
            gpio,
            pico_pin: pico_pin(gpio),
            to: to.into(),
        };
        all.map(wire).to_vec()
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

    pub(crate) fn wires(&self) -> [(&'static str, u32); 8] {
        let [first, second, third] = self.phases;
        [
            ("clock", self.clock),
            ("select", self.select),
            ("data", self.data),
            ("phases", first),
            ("phases", second),
            ("phases", third),
            ("enable", self.enable),
            ("fault", self.fault),
        ]
    }

    fn contradiction(&self) -> Option<(&'static str, String)> {
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
        let slices = self.phases.map(|pin| Self::slice(pin).0);
        if !self.phases[0].is_multiple_of(2)
            || self.phases[1] != self.phases[0] + 1
            || slices[2] == slices[0]
        {
            let what = "must be an even pin, the pin behind it, and one of another slice of PWM, \
                        as in `6 7 8`";
            return Some(("phases", what.into()));
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
        let (key, what) = self.knob?.contradiction()?;
        Some(Contradiction {
            key: format!("knob.{key}"),
            what,
        })
    }

    /// Cycles that a tick may take where its period has so many.
    pub fn deadline_cycles(&self, period_cycles: u64) -> u64 {
        let knob = self.knob.map(|knob| knob.deadline_cycles());
        let bench = self.bench.as_ref().map(|bench| bench.deadline_cycles());
        knob.or(bench).unwrap_or(u64::MAX).min(period_cycles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: Knob = Knob {
        clock: 2,
        select: 3,
        data: 4,
        phases: [6, 7, 8],
        enable: 9,
        fault: 10,
        period_cycles: 3400,
        ahead_cycles: 1000,
        supply_mv: 12_000,
        align_mv: 2000,
        pole_pairs: 7,
    };

    #[test]
    fn every_wire_has_its_pin() {
        let wires = RIGHT.wiring();
        let pins: Vec<Option<u32>> = wires.iter().map(|wire| wire.pico_pin).collect();
        assert_eq!(pins, [1, 2, 4, 5, 6, 9, 10, 11, 12, 14].map(Some));
        assert_eq!(Knob { fault: 23, ..RIGHT }.wiring()[9].pico_pin, None);
    }

    #[test]
    fn what_cannot_be_wired_is_told() {
        let key = |knob: Knob| knob.contradiction().map(|(key, _)| key);
        assert_eq!((key(RIGHT), RIGHT.deadline_cycles()), (None, 630));
        let wrong = [
            (Knob { data: 9, ..RIGHT }, "enable"),
            (Knob { clock: 0, ..RIGHT }, "clock"),
            (Knob { fault: 30, ..RIGHT }, "fault"),
            (
                Knob {
                    phases: [7, 8, 11],
                    ..RIGHT
                },
                "phases",
            ),
            (
                Knob {
                    phases: [6, 7, 22],
                    ..RIGHT
                },
                "phases",
            ),
            (
                Knob {
                    period_cycles: 3401,
                    ..RIGHT
                },
                "period",
            ),
            (
                Knob {
                    ahead_cycles: 3100,
                    ..RIGHT
                },
                "ahead",
            ),
            (
                Knob {
                    align_mv: 6001,
                    ..RIGHT
                },
                "align",
            ),
            (
                Knob {
                    pole_pairs: 0,
                    ..RIGHT
                },
                "pole_pairs",
            ),
        ];
        for (knob, told) in wrong {
            assert_eq!(key(knob), Some(told), "{knob:?}");
        }
    }
}
