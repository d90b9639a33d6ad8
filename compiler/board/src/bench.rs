//! The parts of a key bench on a board: which GPIO leads to the sensors and bridges of up to eight
//! keys, and when they are sampled.
//!
//! ```text
//!   eight conversions, an eighth of a period apart --> tick, at most `ahead` cycles --> the carrier's wrap takes the forces over
//! ```
//!
//! The keys' sensors are the last of the eight conversions, in the order of the keys.

use crate::knob::{Wire, pico_pin};
use crate::{Board, Contradiction};

/// Conversions in a period.
pub const CONVERSIONS: u32 = 8;
/// Cycles from a request for a conversion until its word is there, at 150 MHz: 96 cycles of 48 MHz,
/// and 40 for both ways over the bridge, whose crossing to the ADC's clock nobody documents (an
/// estimate).
pub const CONVERSION_CYCLES: u32 = 300 + 40;
/// Cycles kept for the way from the slice that counts ticks to the interrupt's request: an
/// estimate.
const REQUEST_CYCLES: u32 = 16;
/// GPIO of the larger package, the first that its ADC converts, and those of the slices that pace
/// conversions and ticks.
const GPIO: u32 = 48;
const FIRST_INPUT: u32 = 40;
/// The slice of PWM that counts ticks, and the one that paces conversions.
pub const TICK_SLICE: u32 = 8;
/// See [`TICK_SLICE`].
pub const PACE_SLICE: u32 = 9;
/// Cycles between two ticks, at least and at most: room for eight conversions, and compare values
/// of 13 bits.
const PERIODS: [u32; 2] = [CONVERSIONS * CONVERSION_CYCLES, 8184];

/// A bench.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Bench {
    /// From each key's sensor.
    pub sensors: Vec<u32>,
    /// To the first input of each key's bridge; the second one is at the next pin.
    pub bridges: Vec<u32>,
    /// To all bridges: low where they sleep.
    pub sleep: u32,
    /// From all bridges: low where one tells of a fault.
    pub fault: u32,
    /// The pin of a PSRAM's select, where the board has one.
    pub psram: Option<u32>,
    /// Cycles from tick to tick, which are those of the carriers.
    pub period_cycles: u32,
    /// Cycles from the last sample to the wrap of the carriers that takes the forces over, but for
    /// the conversion.
    pub ahead_cycles: u32,
    /// The bridges' supply (mV).
    pub supply_mv: u32,
}

/// What a DMA accesses in a tick, and how long it holds the bridge there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DmaTraffic {
    /// The device behind the bridge.
    pub device: &'static str,
    /// Reads there.
    pub reads: u32,
    /// Writes there.
    pub writes: u32,
    /// Cycles of one of these, at most.
    pub cycles: u16,
    /// Reads and writes of memory.
    pub in_memory: u32,
}

/// Eight commands from memory to the ADC, eight words from there to memory. That crossing to the
/// ADC's clock takes no more than 16 cycles is an estimate: it is not documented.
const TRAFFIC: DmaTraffic = DmaTraffic {
    device: "adc",
    reads: CONVERSIONS,
    writes: CONVERSIONS,
    cycles: 16,
    in_memory: 2 * CONVERSIONS,
};

impl Bench {
    /// How many keys it has room for.
    pub fn keys(&self) -> u32 {
        self.sensors.len() as u32
    }

    /// The conversion of the first of so many keys; it is even, so that words are moved two by two.
    pub fn first_conversion(keys: u32) -> u32 {
        (CONVERSIONS - keys.min(CONVERSIONS)) & !1
    }

    /// The input of the ADC that a pin leads to.
    pub fn input(pin: u32) -> u32 {
        pin.wrapping_sub(FIRST_INPUT)
    }

    /// The slice of PWM of a pin.
    pub fn slice(pin: u32) -> u32 {
        match pin {
            0..32 => pin / 2 % 8,
            _ => 8 + pin / 2 % 4,
        }
    }

    /// Cycles from the sample of a key, of so many, to the wrap that takes its force over, at most.
    pub fn latency_cycles(&self, key: u32, keys: u32) -> u32 {
        let later = CONVERSIONS - 1 - Self::first_conversion(keys).saturating_add(key).min(7);
        later * (self.period_cycles / CONVERSIONS) + CONVERSION_CYCLES + self.ahead_cycles
    }

    /// Cycles that a tick may take from its request to its end.
    pub fn deadline_cycles(&self) -> u64 {
        self.ahead_cycles.saturating_sub(REQUEST_CYCLES).into()
    }

    /// What leads where, for so many keys, in the order of the chip's pins.
    pub fn wiring(&self, keys: u32) -> Vec<Wire> {
        let wire = |gpio: u32, to: String| Wire {
            gpio,
            pico_pin: pico_pin(gpio),
            to: to.into(),
        };
        let mut all = vec![
            wire(0, "MIDI out, if it is wanted".into()),
            wire(1, "MIDI in, if it is wanted".into()),
            wire(
                self.sleep,
                "all bridges, nSLEEP; and 10 kOhm to ground".into(),
            ),
            wire(self.fault, "all bridges, nFAULT".into()),
        ];
        for (key, (sensor, bridge)) in (0..keys).zip(self.sensors.iter().zip(&self.bridges)) {
            all.push(wire(
                *sensor,
                format!("sensor of key {key}; and 10 nF to ground"),
            ));
            all.push(wire(*bridge, format!("bridge of key {key}, IN1")));
            all.push(wire(bridge + 1, format!("bridge of key {key}, IN2")));
        }
        all.sort_unstable_by_key(|wire| wire.gpio);
        all
    }

    /// Pins with the keys of the file that say them.
    pub(crate) fn wires(&self) -> Vec<(&'static str, u32)> {
        let sensors = self.sensors.iter().map(|pin| ("sensors", *pin));
        let bridges = self
            .bridges
            .iter()
            .flat_map(|pin| [("bridges", *pin), ("bridges", pin + 1)]);
        let others = [("sleep", self.sleep), ("fault", self.fault)];
        sensors.chain(bridges).chain(others).collect()
    }

    /// What its DMA does in a tick.
    pub(crate) fn traffic(&self) -> DmaTraffic {
        TRAFFIC
    }

    fn contradiction(&self) -> Option<(&'static str, String)> {
        self.pins_that_cannot_be()
            .or_else(|| self.times_that_cannot_be())
    }

    fn pins_that_cannot_be(&self) -> Option<(&'static str, String)> {
        let keys = self.sensors.len();
        if !(1..=CONVERSIONS as usize).contains(&keys) {
            let what = format!("names {keys} pins, but a bench has 1 to {CONVERSIONS} keys");
            return Some(("sensors", what));
        }
        if self.bridges.len() != keys {
            let what = format!("names {} pins for {keys} sensors", self.bridges.len());
            return Some(("bridges", what));
        }
        if let Some(pin) = self
            .sensors
            .iter()
            .find(|pin| !(FIRST_INPUT..GPIO).contains(*pin))
        {
            let what = format!(
                "has pin {pin}, which is no input of the ADC: on RP2350B these are 40 to 47"
            );
            return Some(("sensors", what));
        }
        for pin in &self.bridges {
            let slice = Self::slice(*pin);
            let what = match slice {
                _ if *pin >= FIRST_INPUT || !pin.is_multiple_of(2) => {
                    format!("has pin {pin}, but must have even pins of 2 to 38")
                }
                TICK_SLICE | PACE_SLICE => format!(
                    "has pin {pin}, of slice {slice} of PWM, which counts ticks or paces the ADC: \
                     pins 32 to 35 cannot be taken"
                ),
                _ => continue,
            };
            return Some(("bridges", what));
        }
        let wires = self.wires();
        for (at, (key, pin)) in wires.iter().enumerate() {
            if *pin < 2 || *pin >= GPIO || ["sleep", "fault"].contains(key) && *pin >= 30 {
                let most = if *key == "sensors" { 47 } else { 29 };
                let what = format!("has pin {pin}, but must be of 2 to {most}: 0 and 1 are MIDI");
                return Some((key, what));
            }
            if let Some((other, _)) = wires[..at].iter().find(|(_, own)| own == pin) {
                return Some((key, format!("has pin {pin}, which `bench.{other}` has too")));
            }
            if self.psram == Some(*pin) {
                let what = format!("has pin {pin}, which is the select of the board's PSRAM");
                return Some((key, what));
            }
        }
        let slices: Vec<u32> = self.bridges.iter().map(|pin| Self::slice(*pin)).collect();
        let twice = (0..slices.len()).find(|at| slices[..*at].contains(&slices[*at]))?;
        let (pin, slice) = (self.bridges[twice], slices[twice]);
        let what = format!("has pin {pin}, of slice {slice} of PWM, which another key has");
        Some(("bridges", what))
    }

    fn times_that_cannot_be(&self) -> Option<(&'static str, String)> {
        let [least, most] = PERIODS;
        let period = self.period_cycles;
        if !(least..=most).contains(&period) || !period.is_multiple_of(CONVERSIONS) {
            let what = format!("must be a multiple of {CONVERSIONS} of {least} to {most} cycles");
            return Some(("period", what));
        }
        if !(REQUEST_CYCLES..=period - CONVERSION_CYCLES).contains(&self.ahead_cycles) {
            let what = format!(
                "must be {REQUEST_CYCLES} to {} cycles: within the period, with room for a \
                 conversion before it",
                period - CONVERSION_CYCLES
            );
            return Some(("ahead", what));
        }
        (!(1000..=60_000).contains(&self.supply_mv))
            .then(|| ("supply", "must be 1 V to 60 V".into()))
    }
}

impl Board {
    /// What no bench can be.
    pub(crate) fn bench_that_cannot_be(&self) -> Option<Contradiction> {
        let bench = self.bench.as_ref()?;
        let (key, what) = match &self.knob {
            Some(_) => (
                "sensors",
                "are beside a `[knob]`: a board has one or the other".into(),
            ),
            None => bench.contradiction()?,
        };
        Some(Contradiction {
            key: format!("bench.{key}"),
            what,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right() -> Bench {
        Bench {
            sensors: (40..48).collect(),
            bridges: (16..32).step_by(2).collect(),
            sleep: 8,
            fault: 9,
            psram: None,
            period_cycles: 3400,
            ahead_cycles: 1800,
            supply_mv: 12_000,
        }
    }

    #[test]
    fn every_wire_has_its_pin() {
        let wires = right().wiring(2);
        let pins: Vec<u32> = wires.iter().map(|wire| wire.gpio).collect();
        assert_eq!(pins, [0, 1, 8, 9, 16, 17, 18, 19, 40, 41]);
    }

    #[test]
    fn the_last_key_s_sample_is_the_youngest() {
        let ages = [0, 6, 7].map(|key| right().latency_cycles(key, 8));
        assert_eq!(ages, [340 + 1800 + 7 * 425, 340 + 1800 + 425, 340 + 1800]);
        assert_eq!(right().latency_cycles(0, 1), 340 + 1800 + 425);
        assert_eq!(right().deadline_cycles(), 1784);
    }

    #[test]
    fn what_cannot_be_wired_is_told() {
        let told = |change: &dyn Fn(&mut Bench)| {
            let mut bench = right();
            change(&mut bench);
            let told = bench.contradiction();
            told.map_or(String::new(), |(key, what)| format!("{key} {what}"))
        };
        assert_eq!(told(&|_| {}), "");
        type Change<'a> = &'a dyn Fn(&mut Bench);
        let mistakes: [(Change, &str); 11] = [
            (&|b| b.sensors.extend([40]), "sensors names 9 pins"),
            (&|b| b.bridges.truncate(7), "bridges names 7 pins for 8"),
            (
                &|b| b.sensors[3] = 26,
                "sensors has pin 26, which is no input",
            ),
            (
                &|b| b.sensors[3] = 40,
                "sensors has pin 40, which `bench.sensors` has too",
            ),
            (&|b| b.bridges[0] = 32, "bridges has pin 32, of slice 8"),
            (&|b| b.bridges[0] = 15, "bridges has pin 15, but"),
            (&|b| b.bridges[0] = 2, "bridges has pin 18, of slice 1"),
            (&|b| b.fault = 8, "fault has pin 8, which `bench.sleep`"),
            (
                &|b| b.psram = Some(47),
                "sensors has pin 47, which is the select",
            ),
            (&|b| b.period_cycles = 3404, "period must"),
            (&|b| b.ahead_cycles = 3100, "ahead must"),
        ];
        for (change, wanted) in mistakes {
            let told = told(change);
            assert!(told.starts_with(wanted), "{told}, not {wanted}");
        }
    }
}
