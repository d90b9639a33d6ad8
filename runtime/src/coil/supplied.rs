//! A winding behind a supply: its current changes no faster than the voltage lets it, and its
//! resistance grows as it gets warm.
//!
//! ```text
//!   U >= |L di/dt + R (1 + 0.39 % a kelvin) i - c v|      c: force of a current, v: speed of the key
//! ```
//!
//! What a current pushes with, c, is also the voltage that a speed induces. The winding warms as
//! the device says (`motor.rise`, `motor.heat_time`), from cold; over a step all but the current
//! stands still, so a step is exact.
//!
//! Not here: what the firmware does about heat (`motor` tells when it would).

use libm::exp;

use crate::device::{Supply, Winding};

/// By which part the resistance of copper grows for a kelvin, from room temperature on (IEC 60028).
const COPPER_PER_K: f64 = 0.003_93;

/// A winding at work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Supplied {
    supply: Supply,
    winding: Winding,
    /// How much of the way to what is asked for an amplifier of current goes in a step; none where
    /// a voltage is asked for.
    follows: Option<f64>,
    step_s: f64,
    current_a: f64,
    /// How much warmer than at the start (K).
    rise_k: f64,
}

impl Supplied {
    /// Cold, without a current.
    pub(super) fn new(
        supply: Supply,
        winding: Winding,
        follows: Option<f64>,
        step_s: f64,
    ) -> Supplied {
        Supplied {
            supply,
            winding,
            follows,
            step_s,
            current_a: 0.0,
            rise_k: 0.0,
        }
    }

    /// The same with the current of a force (N or N*m).
    pub(super) fn at(self, force: f64) -> Supplied {
        Supplied {
            current_a: force * self.supply.amperes_per_force,
            ..self
        }
    }

    /// A step towards the force that is asked for (N or N*m, up), of a key that goes down at a
    /// speed (m/s or rad/s); gives the force.
    pub(super) fn advance(&mut self, asked: f64, speed: f64) -> f64 {
        let Supply {
            volts,
            amperes_per_force,
            ..
        } = self.supply;
        let ohms = self.winding.resistance_ohm * (1.0 + COPPER_PER_K * self.rise_k);
        let follows = 1.0 - exp(-ohms / self.winding.inductance_h * self.step_s);
        let (from, asked_a) = (self.current_a, asked * amperes_per_force);
        let under =
            |volts: f64| from + follows * ((volts + speed / amperes_per_force) / ohms - from);
        let wanted = match self.follows {
            Some(part) => from + part * (asked_a - from),
            // The voltage knows of the cold winding alone.
            None => under(self.winding.resistance_ohm * asked_a),
        };
        self.current_a = wanted.clamp(under(-volts), under(volts));
        self.warm();
        self.current_a / amperes_per_force
    }

    fn warm(&mut self) {
        if let Some(heat) = self.supply.heat {
            let rated = self.current_a / self.supply.rated_a;
            let goal = heat.rise_k * rated * rated;
            self.rise_k += (goal - self.rise_k) * self.step_s / heat.time_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Heat;

    const STEP_S: f64 = 1.0 / (16.0 * 44_100.0);
    const WINDING: Winding = Winding {
        resistance_ohm: 8.0,
        inductance_h: 1e-3,
    };
    /// 2 A at 2 N, warmed by 60 K at 0.5 A.
    const SUPPLY: Supply = Supply {
        volts: 24.0,
        amperes_per_force: 1.0,
        rated_a: 0.5,
        heat: None,
    };

    /// The force after a time of asking for 2 N.
    fn after(mut winding: Supplied, seconds: f64, speed: f64) -> f64 {
        let steps = (seconds / STEP_S).round() as usize;
        (0..steps)
            .map(|_| winding.advance(2.0, speed))
            .last()
            .unwrap_or(0.0)
    }

    #[test]
    fn an_amplifier_is_as_fast_as_its_supply() {
        let fast = Supplied::new(SUPPLY, WINDING, Some(1.0), STEP_S);
        // i(t) = U/R (1 - exp(-t R/L)) up to 2 A, 137 us later.
        for t_us in [20.0, 60.0, 120.0_f64] {
            let steps = (t_us * 1e-6 / STEP_S).round();
            let exact = 3.0 * (1.0 - (-steps * STEP_S * 8e3).exp());
            let force = after(fast, t_us * 1e-6, 0.0);
            assert!((force - exact).abs() < 1e-9, "{t_us} us: {force} {exact}");
        }
        assert_eq!(after(fast, 150e-6, 0.0), 2.0);
        // A key that comes up fast induces a voltage against it: 24 V less 10 drive 1.75 A.
        let held = after(fast, 5e-3, -10.0);
        assert!((held - 14.0 / 8.0).abs() < 1e-9, "{held}");
    }

    #[test]
    fn a_warm_winding_gets_less_of_a_voltage_and_as_much_of_a_current() {
        let heat = Heat {
            rise_k: 60.0,
            time_s: 0.1,
        };
        let warm = Supply {
            heat: Some(heat),
            ..SUPPLY
        };
        // What 2 A of a stiff voltage come to: R (1 + a T) i = 16 V, T = 240 K/A^2 i^2.
        let mut i = 2.0;
        for _ in 0..200 {
            i = 0.5 * (i + 2.0 / (1.0 + COPPER_PER_K * 240.0 * i * i));
        }
        let force = after(Supplied::new(warm, WINDING, None, STEP_S), 3.0, 0.0);
        assert!((force - i).abs() < 1e-6, "{force} {i}");
        let cold = after(Supplied::new(SUPPLY, WINDING, None, STEP_S), 3.0, 0.0);
        assert!((cold - 2.0).abs() < 1e-9, "{cold}");
        // An amplifier of current keeps it as long as the voltage is enough: R is 8 to 11.8 Ohm at
        // 1 A. At 2 A it would be 38 Ohm.
        let amplified = Supplied::new(warm, WINDING, Some(1.0), STEP_S);
        let mut one = amplified;
        let steady = (0..2_000_000).map(|_| one.advance(1.0, 0.0)).last();
        assert_eq!(steady, Some(1.0));
        assert!((one.rise_k - 240.0).abs() < 1e-3, "{}", one.rise_k);
        assert!(after(amplified, 3.0, 0.0) < 1.9);
    }
}
