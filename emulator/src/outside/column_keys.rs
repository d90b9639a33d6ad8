//! The keys of a column: what the DAC puts out becomes a current, which pushes a key, whose sensor
//! is what the ADC samples.
//!
//! ```text
//!   code - 32768 --amplifier, a lag--> current --force, up--> key <-- finger, down
//!   volts of the ADC <------------- sensor <----place---------'
//! ```
//!
//! The amplifier takes its middle from the DAC's reference: without one there is no current. Not
//! here: the coil's own voltage and what the supply cannot give, noise, heat.

use super::keys::{BenchKey, KeyParts};

/// What the keys of a column are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ColumnKeyParts {
    /// Key, coil and stops; of its bridge nothing is used.
    pub key: KeyParts,
    /// The current at full code (A).
    pub full_a: f64,
    /// How long an amplifier takes to follow (s), by a factor of e.
    pub lag_s: f64,
    /// What a sensor puts out at the two places that `key.sensed_m` has (V).
    pub sensed_v: [f64; 2],
}

/// Eight keys at work.
#[derive(Clone, Debug)]
pub struct ColumnKeys {
    /// The keys.
    pub keys: [BenchKey; 8],
    parts: ColumnKeyParts,
    /// Up to which cycle they have been.
    now: u64,
}

impl ColumnKeys {
    /// Keys at rest, from a cycle on.
    pub fn new(parts: ColumnKeyParts, cycle: u64) -> Self {
        Self {
            keys: [BenchKey::resting(&parts.key); 8],
            parts,
            now: cycle,
        }
    }

    /// The latest cycle up to which they may be left alone.
    pub(super) fn due(&self) -> u64 {
        let step = super::STEP_S * self.parts.key.clock_hz;
        self.now + (step as u64).max(1)
    }

    /// Goes on to a cycle under these codes; what the sensors put out there.
    pub(super) fn advance(&mut self, cycle: u64, codes: Option<[u16; 8]>) -> [f64; 8] {
        let parts = &self.parts;
        let seconds = cycle.saturating_sub(self.now) as f64 / parts.key.clock_hz;
        self.now = self.now.max(cycle);
        if seconds > 0.0 {
            for (i, key) in self.keys.iter_mut().enumerate() {
                let code = codes.map_or(0.0, |codes| f64::from(codes[i]) - 32768.0);
                let wanted = parts.full_a * code / 32768.0;
                key.follow(&parts.key, wanted, parts.lag_s, seconds);
            }
        }
        let [[low, high], [from, to]] = [parts.key.sensed_m, parts.sensed_v];
        self.keys
            .map(|key| from + (key.place_m() - low) / (high - low) * (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTS: ColumnKeyParts = ColumnKeyParts {
        key: KeyParts {
            mass_kg: 1e9,
            sensed_m: [-1e-3, 11e-3],
            ..super::super::keys::tests::PARTS
        },
        full_a: 2.0,
        lag_s: 20e-6,
        sensed_v: [0.0, 6.0],
    };

    #[test]
    fn codes_are_currents_with_a_lag_and_without_a_reference_there_is_none() {
        let mut keys = ColumnKeys::new(PARTS, 100);
        // 20 us at half of the code.
        let volts = keys.advance(3100, Some([0xc000; 8]));
        assert!(
            volts.iter().all(|own| (own - 0.5).abs() < 1e-9),
            "{volts:?}"
        );
        let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-9, "{found}");
        let wanted = 1.0 - (-1.0_f64).exp();
        near(keys.keys[3].current_a(), wanted);
        assert_eq!(keys.due(), 3100 + 600);
        keys.advance(6100, None);
        near(keys.keys[3].current_a(), wanted * (-1.0_f64).exp());
        keys.advance(2_000_000, Some([0; 8]));
        near(keys.keys[7].current_a(), -2.0);
    }

    #[test]
    fn current_pushes_up_and_a_finger_down() {
        let mut light = PARTS;
        light.key.mass_kg = 0.01;
        let place = |code: u16, finger: f64| {
            let mut keys = ColumnKeys::new(light, 0);
            keys.keys[0].finger.force_n = finger;
            for cycle in (600..30_000_000).step_by(600) {
                keys.advance(cycle, Some([code; 8]));
            }
            keys.keys[0].place_m()
        };
        // Half a newton at full code, against 0.3 N; stops give 50 um for a newton.
        assert!((place(0xffff, 0.3) + 0.2 / 20e3).abs() < 1e-9 + 1e-7);
        assert!((place(0x8000, 0.3) - 0.01 - 0.3 / 20e3).abs() < 1e-7);
    }
}
