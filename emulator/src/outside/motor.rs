//! A brushless motor with permanent magnets on the shaft of a knob, in the frame of its stator.
//!
//! ```text
//!   L di/dt = v - R i - flux speed_e (-sin, cos)(angle_e)       alpha, beta; the star point floats
//!   J dw/dt = 3/2 p flux (i across the magnet) - b w - friction - cogging + hand
//! ```
//!
//! Currents are solved exactly between two changes of the voltages, with the magnet where it is;
//! the shaft takes small steps. Not here: saturation, iron losses, a flux that is no sine, diodes
//! (without a driver there are no currents at once).

use std::f64::consts::TAU;

/// A motor, its knob, and their bearing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MotorParameters {
    /// Of a phase, from its terminal to the star point.
    pub resistance_ohm: f64,
    /// Of a phase, with what the others add.
    pub inductance_h: f64,
    /// The magnet's flux through a phase: its voltage at an electrical rad/s.
    pub flux_v_s: f64,
    /// Electrical turns a turn.
    pub pole_pairs: u32,
    /// Of all that turns (kg m^2).
    pub inertia_kg_m2: f64,
    /// Torque at a rad/s.
    pub damping_n_m_s: f64,
    /// Dry friction.
    pub friction_n_m: f64,
    /// The most that the magnet pulls to a tooth, and how often a turn.
    pub cogging_n_m: f64,
    /// See `cogging_n_m`.
    pub cogging_per_turn: u32,
    /// Where the magnet's north is at angle 0 (electrical rad).
    pub offset_rad: f64,
    /// Whether its phases are wired the other way round.
    pub reversed: bool,
}

/// What holds the knob: torque, and a spring with a damper to a place.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Hand {
    /// What it turns with.
    pub torque_n_m: f64,
    /// The spring to `place_rad` (N*m/rad).
    pub stiffness: f64,
    /// The damper (N*m*s/rad).
    pub damping: f64,
    /// Where the hand wants the knob.
    pub place_rad: f64,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Motor {
    parameters: MotorParameters,
    /// Across the stator: alpha, beta (A).
    currents: [f64; 2],
    angle_rad: f64,
    speed_rad_s: f64,
}

impl Motor {
    /// At rest at an angle.
    pub fn new(parameters: MotorParameters, angle_rad: f64) -> Self {
        Self {
            parameters,
            currents: [0.0; 2],
            angle_rad,
            speed_rad_s: 0.0,
        }
    }

    /// Where the shaft is, turns counted.
    pub fn angle_rad(&self) -> f64 {
        self.angle_rad
    }

    /// How fast it turns.
    pub fn speed_rad_s(&self) -> f64 {
        self.speed_rad_s
    }

    /// What flows into each phase (A).
    pub fn phase_currents(&self) -> [f64; 3] {
        let [alpha, beta] = self.currents;
        let half = 0.75_f64.sqrt() * beta;
        let [a, b, c] = [alpha, -0.5 * alpha + half, -0.5 * alpha - half];
        if self.parameters.reversed {
            [a, c, b]
        } else {
            [a, b, c]
        }
    }

    /// What the magnet makes of the currents.
    pub fn torque_n_m(&self) -> f64 {
        let MotorParameters {
            pole_pairs,
            flux_v_s,
            ..
        } = self.parameters;
        let (sin, cos) = self.angle_e().sin_cos();
        let across = self.currents[1] * cos - self.currents[0] * sin;
        1.5 * f64::from(pole_pairs) * flux_v_s * across
    }

    fn angle_e(&self) -> f64 {
        f64::from(self.parameters.pole_pairs) * self.angle_rad + self.parameters.offset_rad
    }

    /// Time passes under the voltages of the terminals; without them nothing is driven.
    pub fn pass(&mut self, terminals: Option<[f64; 3]>, hand: &Hand, seconds: f64) {
        match terminals {
            Some(volts) => self.conduct(volts, seconds),
            None => self.currents = [0.0; 2],
        }
        self.turn(hand, seconds);
    }

    fn conduct(&mut self, [a, b, c]: [f64; 3], seconds: f64) {
        let p = &self.parameters;
        let (b, c) = if p.reversed { (c, b) } else { (b, c) };
        let volts = [(2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt()];
        let speed_e = f64::from(p.pole_pairs) * self.speed_rad_s;
        let (sin, cos) = (self.angle_e() + 0.5 * speed_e * seconds).sin_cos();
        let induced = [-sin, cos].map(|part| p.flux_v_s * speed_e * part);
        let kept = (-p.resistance_ohm * seconds / p.inductance_h).exp();
        for ((current, volts), induced) in self.currents.iter_mut().zip(volts).zip(induced) {
            let end = (volts - induced) / p.resistance_ohm;
            *current = end + (*current - end) * kept;
        }
    }

    fn turn(&mut self, hand: &Hand, seconds: f64) {
        let p = &self.parameters;
        let cogging = p.cogging_n_m * (f64::from(p.cogging_per_turn) * self.angle_rad).sin();
        let held = hand.stiffness * (hand.place_rad - self.angle_rad);
        let torque = self.torque_n_m() + hand.torque_n_m + held - cogging;
        let damping = p.damping_n_m_s + hand.damping;
        // Damping is taken at the end of the step, so that a stiff hand cannot ring by it.
        let scale = seconds / p.inertia_kg_m2;
        let free = (self.speed_rad_s + scale * torque) / (1.0 + scale * damping);
        let rubbed = scale * p.friction_n_m / (1.0 + scale * damping);
        // Friction stops the shaft, and never turns it round.
        self.speed_rad_s = free.signum() * (free.abs() - rubbed).max(0.0);
        self.angle_rad += self.speed_rad_s * seconds;
    }

    /// The angle within a turn, as a sensor on the shaft counts it.
    pub(super) fn steps(&self, per_turn: u32) -> u32 {
        let turns = (self.angle_rad / TAU).rem_euclid(1.0);
        (turns * f64::from(per_turn)) as u32 % per_turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: MotorParameters = MotorParameters {
        resistance_ohm: 5.0,
        inductance_h: 1e-3,
        flux_v_s: 0.006,
        pole_pairs: 7,
        inertia_kg_m2: 15e-6,
        damping_n_m_s: 0.0,
        friction_n_m: 0.0,
        cogging_n_m: 0.0,
        cogging_per_turn: 84,
        offset_rad: 0.0,
        reversed: false,
    };
    const STEP_S: f64 = 2e-6;

    fn run(motor: &mut Motor, terminals: Option<[f64; 3]>, hand: Hand, seconds: f64) {
        let steps = (seconds / STEP_S).round() as usize;
        (0..steps).for_each(|_| motor.pass(terminals, &hand, STEP_S));
    }

    fn is_near(found: f64, wanted: f64, within: f64) {
        assert!((found - wanted).abs() <= within, "{found}, not {wanted}");
    }

    #[test]
    fn the_current_of_a_step_rises_by_the_time_constant() {
        let heavy = MotorParameters {
            inertia_kg_m2: 1e9,
            ..PLAIN
        };
        let mut motor = Motor::new(heavy, 0.0);
        // 12 V on one terminal, the others at ground: 8 V on its phase, and 200 us.
        for passed in 1..5 {
            run(&mut motor, Some([12.0, 0.0, 0.0]), Hand::default(), 100e-6);
            let wanted = 1.6 * (1.0 - (-0.5 * f64::from(passed)).exp());
            let [a, b, c] = motor.phase_currents();
            is_near(a, wanted, 1e-9);
            is_near(b + c, -wanted, 1e-9);
        }
        motor.pass(None, &Hand::default(), STEP_S);
        assert_eq!(motor.phase_currents(), [0.0; 3]);
    }

    #[test]
    fn a_shaft_that_is_turned_brakes_by_its_shorted_phases() {
        // Terminals together: i across = -flux w_e / R (L small), torque -3/2 p^2 flux^2 / R w.
        let quick = MotorParameters {
            inductance_h: 1e-7,
            ..PLAIN
        };
        let mut motor = Motor::new(quick, 0.3);
        let hand = Hand {
            torque_n_m: 0.002,
            ..Hand::default()
        };
        run(&mut motor, Some([0.0; 3]), hand, 1.0);
        let brake = 1.5 * 49.0 * 0.006_f64.powi(2) / 5.0;
        is_near(motor.speed_rad_s(), 0.002 / brake, 0.01 * 0.002 / brake);
        is_near(motor.torque_n_m(), -0.002, 2e-5);
    }

    #[test]
    fn a_field_that_stands_still_holds_the_magnet_like_a_spring() {
        // North at the field; under a load T the angle is asin(T / T_max) / p away.
        let damped = MotorParameters {
            damping_n_m_s: 1e-3,
            offset_rad: 1.0,
            ..PLAIN
        };
        for reversed in [false, true] {
            let mut motor = Motor::new(
                MotorParameters { reversed, ..damped },
                -1.0 / 7.0 + if reversed { 0.1 } else { -0.1 },
            );
            let volts = Some([4.0, 0.0, 0.0]);
            run(&mut motor, volts, Hand::default(), 1.0);
            is_near(motor.angle_rad(), -1.0 / 7.0, 1e-6);
            let hand = Hand {
                torque_n_m: 0.01,
                ..Hand::default()
            };
            run(&mut motor, volts, hand, 1.0);
            let most: f64 = 1.5 * 7.0 * 0.006 * (4.0 * 2.0 / 3.0 / 5.0);
            is_near(motor.angle_rad(), ((0.01 / most).asin() - 1.0) / 7.0, 1e-6);
        }
    }

    #[test]
    fn friction_and_cogging_hold_and_let_go() {
        let rough = MotorParameters {
            friction_n_m: 1e-3,
            cogging_n_m: 2e-3,
            damping_n_m_s: 1e-4,
            ..PLAIN
        };
        let push = |torque_n_m| Hand {
            torque_n_m,
            ..Hand::default()
        };
        let mut motor = Motor::new(rough, 0.0);
        run(&mut motor, None, push(0.99e-3), 0.1);
        assert_eq!(motor.angle_rad(), 0.0);
        // So slowly that it does not swing over.
        for tenths in 0..30 {
            run(&mut motor, None, push(1e-4 * f64::from(tenths)), 0.02);
        }
        assert!(
            motor.angle_rad() < TAU / 84.0 / 4.0,
            "before the top of a tooth"
        );
        run(&mut motor, None, push(3.1e-3), 0.2);
        assert!(motor.angle_rad() > TAU / 84.0, "over it");
    }
}
