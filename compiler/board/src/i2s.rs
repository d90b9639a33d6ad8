//! The sound output of a board: the three pins that lead to a DAC with an I2S port, and when its
//! words leave.
//!
//! ```text
//!   tick n + 1 --> both samples of tick n into the queue --> left --half a period--> right     every period, from one clock
//! ```

use crate::knob::{Wire, pico_pin};
use crate::{Board, Contradiction};

/// GPIO of the smaller package, which state machines reach in both.
const GPIO: u32 = 30;
/// Bits of a frame: two words of 32.
const BITS: u32 = 64;
/// Bits of the right word that the state machine begins with, at the first tick: so far behind a
/// tick's samples the left word is taken.
const FIRST_BITS: u32 = 22;

/// A port of three wires to a DAC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SoundPort {
    /// Bit clock (BCK).
    pub clock: u32,
    /// Which word: low is left (LRCK).
    pub side: u32,
    /// The bits.
    pub data: u32,
}

impl SoundPort {
    /// Cycles of the board between two frames, which are those between two ticks.
    pub fn period_cycles(board: &Board) -> u32 {
        let knob = board.knob.as_ref().map(|knob| knob.period_cycles);
        let bench = board.bench.as_ref().map(|bench| bench.period_cycles);
        let columns = board.columns.as_ref().map(|columns| columns.period_cycles);
        knob.or(bench).or(columns).unwrap_or(0)
    }

    /// Bits of the right word with which the state machine begins.
    pub const fn first_bits() -> u32 {
        FIRST_BITS
    }

    /// Cycles from the moment in which a tick has given its samples to that in which the left one
    /// is taken, for a period of so many.
    pub fn taken_cycles(period_cycles: u32) -> u32 {
        FIRST_BITS * period_cycles / BITS
    }

    /// What leads where.
    pub fn wiring(&self) -> Vec<Wire> {
        let wires = [
            (self.clock, "DAC, BCK"),
            (self.side, "DAC, LRCK"),
            (self.data, "DAC, DIN"),
        ];
        let wire = |(gpio, to): (u32, &'static str)| Wire {
            gpio,
            pico_pin: pico_pin(gpio),
            to: to.into(),
        };
        wires.map(wire).to_vec()
    }

    /// The keys of the file with their pins.
    fn wires(&self) -> [(&'static str, u32); 3] {
        [
            ("clock", self.clock),
            ("side", self.side),
            ("data", self.data),
        ]
    }

    fn contradiction(&self, others: &[(String, u32)]) -> Option<(&'static str, String)> {
        for (at, (key, pin)) in self.wires().iter().enumerate() {
            if *pin < 2 || *pin >= GPIO {
                let what = format!("has pin {pin}, but must be of 2 to 29: 0 and 1 are MIDI");
                return Some((key, what));
            }
            let own = self.wires();
            let mut own = own[..at].iter();
            if let Some((other, _)) = own.find(|(_, own)| own == pin) {
                return Some((key, format!("has pin {pin}, which `i2s.{other}` has too")));
            }
            if let Some((other, _)) = others.iter().find(|(_, own)| own == pin) {
                return Some((key, format!("has pin {pin}, which `{other}` has too")));
            }
        }
        (self.side != self.clock + 1).then(|| {
            let what = format!(
                "must be pin {}, the one behind `i2s.clock`: both are set together",
                self.clock + 1
            );
            ("side", what)
        })
    }
}

impl Board {
    /// What no sound output can be.
    pub(crate) fn sound_that_cannot_be(&self) -> Option<Contradiction> {
        let port = self.i2s?;
        let own = |table: &str, wires: Vec<(&str, u32)>| -> Vec<(String, u32)> {
            let name = |(key, pin): (&str, u32)| (format!("{table}.{key}"), pin);
            wires.into_iter().map(name).collect()
        };
        let (key, what) = match (&self.knob, &self.bench, &self.columns) {
            (Some(knob), ..) => port.contradiction(&own("knob", knob.wires()))?,
            (_, Some(bench), _) => port.contradiction(&own("bench", bench.wires()))?,
            (.., Some(columns)) => port.contradiction(&own("columns", columns.wires()))?,
            (None, None, None) => (
                "clock",
                "is on a board without `[knob]`, `[bench]` and `[columns]`: the emulator's \
                 converter has a sound output of its own"
                    .into(),
            ),
        };
        Some(Contradiction {
            key: format!("i2s.{key}"),
            what,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: SoundPort = SoundPort {
        clock: 18,
        side: 19,
        data: 20,
    };

    #[test]
    fn every_wire_has_its_pin() {
        let pins: Vec<Option<u32>> = RIGHT.wiring().iter().map(|wire| wire.pico_pin).collect();
        assert_eq!(pins, [24, 25, 26].map(Some));
        assert_eq!(SoundPort::taken_cycles(3400), 1168);
    }

    #[test]
    fn what_cannot_be_wired_is_told() {
        let others = [("knob.fault".to_string(), 10)];
        let told = |port: SoundPort| {
            let told = port.contradiction(&others);
            told.map_or(String::new(), |(key, what)| format!("{key} {what}"))
        };
        assert_eq!(told(RIGHT), "");
        let mistakes = [
            (SoundPort { clock: 0, ..RIGHT }, "clock has pin 0"),
            (SoundPort { data: 30, ..RIGHT }, "data has pin 30"),
            (
                SoundPort { data: 19, ..RIGHT },
                "data has pin 19, which `i2s.side`",
            ),
            (
                SoundPort { data: 10, ..RIGHT },
                "data has pin 10, which `knob.fault`",
            ),
            (SoundPort { side: 21, ..RIGHT }, "side must be pin 19"),
        ];
        for (port, wanted) in mistakes {
            let told = told(port);
            assert!(told.starts_with(wanted), "{told}, not {wanted}");
        }
    }
}
