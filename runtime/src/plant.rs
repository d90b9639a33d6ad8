//! The plant: a key with its coil, its converters and what holds it, in f64, much finer than the
//! ticks.
//!
//! ```text
//!   word --delay, hold--> coil --------------.
//!   player (force, or a hand) ---------------+--> mass with friction, felt stops --> position --delay--> sensor
//! ```
//!
//! It shares nothing with the stability analysis but the device file: no linearization, no exact
//! solutions, only small steps of the differential equation. Positions grow downwards; forces of
//! the drive push up, those of the player down. On what turns, positions are angles, masses
//! inertias, forces torques.
//!
//! The **energy observer** adds up what the player does to the key (Hannaford and Ryu 2002, there
//! for control): force times way, what is put in and what comes back. Over a stroke that begins and
//! ends at rest, a passive key gives back less than it got.
//!
//! Not here: the drive's stages (`coil`), the motor's heat (`motor`), the loop around it
//! (`closed`).

use std::collections::VecDeque;
use whippen_compiler::rate::Rate;

use whippen_compiler::stability::Hand;

use crate::coil::{Coil, STEPS, steps};
use crate::device::{Mechanics, Port};
use crate::trajectory::Trajectory;

/// What acts on the key besides the drive.
#[derive(Debug, Clone, PartialEq)]
pub enum Player {
    /// A force at each tick (N, down); nothing after the last.
    Force(Trajectory),
    /// A hand that grips the key and wants it at a place at each tick (m); the last place stays.
    Hand {
        /// Its mass on the key, and its spring and damper to that place.
        hand: Hand,
        /// Where it wants the key.
        target: Trajectory,
    },
}

impl Player {
    /// Nobody.
    pub fn nobody() -> Player {
        Player::Force(Vec::new().into())
    }
}

/// What a player did to the key since the last look (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// What went into the key.
    pub given_j: f64,
    /// What came back.
    pub returned_j: f64,
}

impl Energy {
    /// Adds what was done besides.
    pub fn add(&mut self, more: Energy) {
        self.given_j += more.given_j;
        self.returned_j += more.returned_j;
    }

    /// What the key kept; below 0 it gave more than it got.
    pub fn kept_j(&self) -> f64 {
        self.given_j - self.returned_j
    }
}

/// A key in motion.
#[derive(Debug, Clone)]
pub struct Plant {
    mechanics: Mechanics,
    player: Player,
    /// What the player wants in this tick: a force, or the place of the hand at its beginning and
    /// its end.
    wanted: (f64, f64),
    step_s: f64,
    coil: Coil,
    x: f64,
    v: f64,
    force: f64,
    /// Positions of the last steps, the newest last: as many as the sensor is late.
    seen: VecDeque<f64>,
    /// What lies on the key besides the player (N, down).
    weight: f64,
    step: usize,
    energy: Energy,
}

impl Plant {
    /// A key at rest at a place; `None` if the device does not say how its key moves.
    pub fn new(port: &Port, rate_hz: Rate, player: Player, x: f64) -> Option<Plant> {
        let mechanics = port.mechanics?;
        let step_s = 1.0 / (f64::from(rate_hz) * STEPS as f64);
        let late = steps(port.sensor.delay_samples);
        let wanted = match &player {
            Player::Force(force) => (force.get(0).unwrap_or(0.0), 0.0),
            Player::Hand { target, .. } => (target.at(0), target.at(1)),
        };
        Some(Plant {
            mechanics,
            player,
            wanted,
            step_s,
            coil: Coil::new(port.drive(), rate_hz),
            x,
            v: 0.0,
            force: 0.0,
            seen: VecDeque::from(vec![x; late + 1]),
            weight: 0.0,
            step: 0,
            energy: Energy::default(),
        })
    }

    /// A key that is at rest at a place under a force of the drive (N, up) and as much of somebody
    /// else (down), in a hand that wants it there; then it is pushed, to move with `speed` (m/s).
    pub fn balanced(
        port: &Port,
        rate_hz: Rate,
        player: Player,
        (x, force, speed): (f64, f64, f64),
    ) -> Option<Plant> {
        let rest = Plant::new(port, rate_hz, player, x)?;
        Some(Plant {
            force,
            coil: rest.coil.clone().holding(force),
            weight: force,
            v: speed,
            ..rest
        })
    }

    /// What the sensor measures in this tick (m), late as it is; the converter is
    /// [`Port::word`].
    pub fn sensed(&self) -> f64 {
        self.seen.front().copied().unwrap_or(self.x)
    }

    /// Where the key is (m).
    pub fn position(&self) -> f64 {
        self.x
    }

    /// How fast it goes down (m/s).
    pub fn speed(&self) -> f64 {
        self.v
    }

    /// Where the hand wants the key (m); none where a force acts.
    pub fn target(&self) -> Option<f64> {
        matches!(self.player, Player::Hand { .. }).then_some(self.wanted.0)
    }

    /// What the player pushes at this instant (N, down).
    pub fn player_force(&self) -> f64 {
        self.pull().0
    }

    /// What the coil pushes at this instant (N, up).
    pub fn coil_force(&self) -> f64 {
        self.force
    }

    /// What the felt of a stop pushes at this instant (N, up).
    pub fn stop_force(&self) -> f64 {
        self.stop()
    }

    /// What the player did since the last call.
    pub fn take_energy(&mut self) -> Energy {
        std::mem::take(&mut self.energy)
    }

    /// Takes the drive's word of this tick and goes on to the next.
    pub fn tick(&mut self, word: i16) {
        self.coil.ask(word);
        for _ in 0..STEPS {
            self.advance();
            self.seen.push_back(self.x);
            self.seen.pop_front();
            self.step += 1;
        }
        let tick = self.step / STEPS;
        self.wanted = match &self.player {
            Player::Force(force) => (force.get(tick).unwrap_or(0.0), 0.0),
            Player::Hand { target, .. } => (self.wanted.1, target.at(tick + 1)),
        };
    }

    /// What the player pushes in this step (N, down), and the mass that moves with the key.
    fn pull(&self) -> (f64, f64) {
        let Player::Hand { hand, .. } = &self.player else {
            return (self.wanted.0, 0.0);
        };
        // The hand's place goes straight from tick to tick.
        let (from, to) = self.wanted;
        let part = (self.step % STEPS) as f64 / STEPS as f64;
        let place = from + part * (to - from);
        let speed = (to - from) / (STEPS as f64 * self.step_s);
        let force = hand.stiffness * (place - self.x) + hand.damping * (speed - self.v);
        (force, hand.mass)
    }

    fn advance(&mut self) {
        self.coil.advance(self.v);
        self.force = self.coil.force();
        let Mechanics {
            mass,
            damping,
            friction,
            ..
        } = self.mechanics;
        let (own, added) = self.pull();
        let all = own + self.weight - self.force - damping * self.v - self.stop();
        let before = self.v;
        let free = self.v + self.step_s * all / (mass + added);
        // Dry friction stops the key or slows it, but never turns it round.
        let brake = self.step_s * friction / (mass + added);
        self.v = if free.abs() <= brake {
            0.0
        } else {
            free - brake * free.signum()
        };
        self.x += self.step_s * self.v;
        // What the hand's mass takes does not reach the key. With the mean speed of the step the
        // work is what the mass then has.
        let mean_way = 0.5 * self.step_s * (before + self.v);
        let work = (own - added * (self.v - before) / self.step_s) * mean_way;
        if work > 0.0 {
            self.energy.given_j += work
        } else {
            self.energy.returned_j -= work
        }
    }

    /// What the felt of a stop pushes (N, up): it gives way as a spring with losses, and never
    /// pulls.
    fn stop(&self) -> f64 {
        let Some(stops) = self.mechanics.stops else {
            return 0.0;
        };
        let (below, above) = (self.x - stops.high, stops.low - self.x);
        if below > 0.0 {
            (stops.stiffness * below + stops.damping * self.v).max(0.0)
        } else if above > 0.0 {
            -(stops.stiffness * above - stops.damping * self.v).max(0.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Device;

    const RATE_HZ: u32 = 44_100;

    fn device(change: impl FnOnce(&mut Mechanics)) -> Device {
        let mut device = Device::mikey();
        let mechanics = device.ports[0]
            .mechanics
            .as_mut()
            .expect("mikey says how its key moves");
        mechanics.stops = None;
        change(mechanics);
        device
    }

    /// After so many ticks under a constant word.
    fn after(
        device: &Device,
        player: Player,
        x: f64,
        word: i16,
        ticks: usize,
    ) -> (f64, f64, Energy) {
        let mut plant =
            Plant::new(device.port(), RATE_HZ.into(), player, x).expect("it has mechanics");
        (0..ticks).for_each(|_| plant.tick(word));
        (plant.position(), plant.speed(), plant.energy)
    }

    #[test]
    fn a_force_moves_the_mass_and_friction_holds_it() {
        let smooth = device(|m| (m.friction, m.damping) = (0.0, 0.0));
        let (x, v, energy) = after(&smooth, Player::Force(vec![0.6; 441].into()), 0.0, 0, 441);
        // 0.6 N on 60 g for 10 ms.
        assert!(
            (v - 0.1).abs() < 1e-9 && (x - 0.5e-3).abs() < 1e-6,
            "{x} {v}"
        );
        assert!((energy.given_j - 0.5 * 0.06 * 0.01).abs() < 1e-8 && energy.returned_j == 0.0);
        let dry = device(|m| m.friction = 0.7);
        assert_eq!(
            after(&dry, Player::Force(vec![0.6; 441].into()), 0.0, 0, 441).0,
            0.0
        );
        // With friction alone 0.1 m/s end after v m / f_c = 0.2 s.
        let (_, v, _) = after(
            &device(|m| (m.friction, m.damping) = (0.03, 0.0)),
            Player::Force(vec![0.63; 441].into()),
            0.0,
            0,
            441 + 8820,
        );
        assert!(v.abs() < 1e-3, "{v}");
    }

    #[test]
    fn the_drive_acts_after_its_delay_and_its_coil() {
        let mut fast = device(|m| (m.friction, m.damping) = (0.0, 0.0));
        let drive = fast.ports[0].drive.as_mut().expect("a key is driven");
        drive.bandwidth_hz = None;
        let mut plant =
            Plant::new(fast.port(), RATE_HZ.into(), Player::nobody(), 5e-3).expect("mechanics");
        plant.tick(1024);
        assert_eq!(plant.position(), 5e-3, "one sample late");
        plant.tick(1024);
        let t = 1.0 / f64::from(RATE_HZ);
        assert!(
            (plant.speed() + t / 0.06).abs() < 1e-6 * t / 0.06 && plant.sensed() == 5e-3,
            "1 N up; seen later"
        );
        plant.tick(1024);
        assert!(plant.sensed() < 5e-3 && plant.sensed() > plant.position());
        let slow = device(|m| (m.friction, m.damping) = (0.0, 0.0));
        let (_, lags, _) = after(&slow, Player::nobody(), 5e-3, 1024, 441);
        let (_, leads, _) = after(&fast, Player::nobody(), 5e-3, 1024, 441);
        // The coil's time constant at 3 kHz is 53 us: so much of the force is missing.
        assert!(
            ((lags - leads) * 0.06 / 53.05e-6 - 1.0).abs() < 0.02,
            "{lags} {leads}"
        );
    }

    #[test]
    fn a_hand_leads_the_key_and_its_stops_hold_it() {
        let key = device(|m| m.friction = 0.0);
        let hand = Hand {
            mass: 0.1,
            damping: 3.0,
            stiffness: 500.0,
        };
        let (x, v, energy) = after(
            &key,
            Player::Hand {
                hand,
                target: vec![4e-3].into(),
            },
            0.0,
            0,
            44_100,
        );
        assert!((x - 4e-3).abs() < 1e-6 && v.abs() < 1e-4, "{x} {v}");
        assert!(energy.kept_j() > 0.0, "friction keeps something");
        let mikey = Device::mikey();
        let (x, v, _) = after(
            &mikey,
            Player::Force(vec![2.0; 44_100].into()),
            5e-3,
            0,
            44_100,
        );
        assert!(
            (x - 10.1e-3).abs() < 5e-6 && v.abs() < 1e-9,
            "2 N go 0.1 mm into 20 kN/m: {x}"
        );
        let (x, ..) = after(
            &mikey,
            Player::Force(vec![-2.0; 44_100].into()),
            5e-3,
            0,
            44_100,
        );
        assert!((x + 0.1e-3).abs() < 5e-6, "{x}");
    }
}
