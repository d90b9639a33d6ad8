//! Keys on a bench: for each a linear sensor at an input of the ADC, and a bridge with a coil that
//! pushes it.
//!
//! ```text
//!   chip --IN1, IN2--> bridge --> coil --force, up--> key <-- finger, down
//!   chip <--ADC-- sensor <------------------place-----'          all bridges: sleep, fault
//!
//!   L di/dt = v - R i + k v_key        i flows from OUT2 to OUT1 and pushes up; down is positive
//!   m dv/dt = finger - k i - b v - friction - stops
//! ```
//!
//! Currents are solved exactly between two changes of the voltages; keys take small steps. Not
//! here: noise of sensor and converter, resistance and dead times of switches, heat.

use crate::bus::{Access, Bus, BusError, Device, DeviceId, Notices, Waits};

use super::STEP_S;

/// The pins of a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeyPins {
    /// From its sensor, an input of the ADC.
    pub sensor: u32,
    /// To the first input of its bridge; the second one is at the next pin.
    pub bridge: u32,
}

/// The pins of a bench.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BenchPins {
    /// Of each key.
    pub keys: Vec<KeyPins>,
    /// To all bridges: low where they sleep.
    pub sleep: u32,
    /// From all bridges, low where there is a fault; somebody must pull it up.
    pub fault: u32,
}

/// What each key of a bench is. Places grow downwards.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KeyParts {
    /// Cycles of the chip a second.
    pub clock_hz: f64,
    /// The bridge's supply (V), and the current at which it turns itself off (A).
    pub supply_v: f64,
    /// See `supply_v`.
    pub trip_a: f64,
    /// The coil's resistance.
    pub resistance_ohm: f64,
    /// Its inductance.
    pub inductance_h: f64,
    /// Its force at the key for an ampere, which is also its voltage at a metre a second.
    pub force_n_per_a: f64,
    /// All that moves with the key (kg).
    pub mass_kg: f64,
    /// Force at a metre a second.
    pub damping_n_s_m: f64,
    /// Dry friction.
    pub friction_n: f64,
    /// Where it rests, and where it ends (m).
    pub stops_m: [f64; 2],
    /// What a stop pushes for a metre.
    pub stop_n_m: f64,
    /// And for a metre a second.
    pub stop_n_s_m: f64,
    /// Places at which the converter reads 0 and 4095 (m).
    pub sensed_m: [f64; 2],
}

/// What a finger does to a key: a force, and a spring with a damper to a place. Down is positive.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Finger {
    /// What it pushes with (N).
    pub force_n: f64,
    /// The spring to `place_m` (N/m).
    pub stiffness: f64,
    /// The damper (N s/m).
    pub damping: f64,
    /// Where it wants the key (m).
    pub place_m: f64,
}

/// A key at work.
#[derive(Clone, Copy, Debug, Default)]
pub struct BenchKey {
    /// What presses it.
    pub finger: Finger,
    /// What its sensor says, whatever the key does.
    pub stuck_code: Option<u16>,
    current_a: f64,
    place_m: f64,
    speed_m_s: f64,
}

impl BenchKey {
    /// At its upper stop.
    pub(super) fn resting(parts: &KeyParts) -> Self {
        Self {
            place_m: parts.stops_m[0],
            ..Self::default()
        }
    }

    /// So many seconds with an amplifier that follows a current with a lag.
    pub(super) fn follow(&mut self, parts: &KeyParts, amperes: f64, lag_s: f64, seconds: f64) {
        let kept = (-seconds / lag_s).exp();
        self.current_a = amperes + (self.current_a - amperes) * kept;
        self.go(parts, seconds);
    }

    /// What flows in its coil, from the second output to the first one.
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Where it is.
    pub fn place_m(&self) -> f64 {
        self.place_m
    }

    /// How fast it goes down.
    pub fn speed_m_s(&self) -> f64 {
        self.speed_m_s
    }

    /// The current after so many seconds under a voltage from the second output to the first one.
    fn conduct(&mut self, parts: &KeyParts, volts: f64, seconds: f64) {
        let end = (volts + parts.force_n_per_a * self.speed_m_s) / parts.resistance_ohm;
        let kept = (-parts.resistance_ohm * seconds / parts.inductance_h).exp();
        self.current_a = end + (self.current_a - end) * kept;
    }

    /// The current without anybody who drives: diodes lead it into the supply until it is over.
    fn coast(&mut self, parts: &KeyParts, seconds: f64) {
        let before = self.current_a;
        if before != 0.0 {
            self.conduct(parts, -before.signum() * parts.supply_v, seconds);
        }
        if before * self.current_a <= 0.0 {
            self.current_a = 0.0;
        }
    }

    fn go(&mut self, parts: &KeyParts, seconds: f64) {
        let [rest, end] = parts.stops_m;
        let stop = match self.place_m {
            place if place < rest => Some(rest),
            place if place > end => Some(end),
            _ => None,
        };
        let pressed = stop.map_or(0.0, |at| parts.stop_n_m * (at - self.place_m));
        let felt = if stop.is_some() {
            parts.stop_n_s_m
        } else {
            0.0
        };
        let finger = &self.finger;
        let held = finger.stiffness * (finger.place_m - self.place_m);
        let force = finger.force_n + held + pressed - parts.force_n_per_a * self.current_a;
        let damping = parts.damping_n_s_m + finger.damping + felt;
        // Damping is taken at the end of the step, so that it cannot ring by it.
        let scale = seconds / parts.mass_kg;
        let free = (self.speed_m_s + scale * force) / (1.0 + scale * damping);
        let rubbed = scale * parts.friction_n / (1.0 + scale * damping);
        self.speed_m_s = free.signum() * (free.abs() - rubbed).max(0.0);
        self.place_m += self.speed_m_s * seconds;
    }

    /// What the converter reads of it.
    fn code(&self, parts: &KeyParts) -> u16 {
        let [low, high] = parts.sensed_m;
        let part = (self.place_m - low) / (high - low);
        let code = (part.clamp(0.0, 1.0) * 4095.0).round() as u16;
        self.stuck_code.unwrap_or(code)
    }
}

/// See the module.
pub struct KeyBench {
    keys: Vec<BenchKey>,
    parts: KeyParts,
    pins: BenchPins,
    /// Whether a bridge has turned itself off, which it remembers while it is awake.
    tripped: bool,
    levels: u64,
    /// Up to which cycle everything has been.
    now: u64,
    /// Whether the fault pin is held low.
    shows_fault: bool,
}

impl KeyBench {
    /// Wires keys to a chip's pins; they are at rest.
    pub fn attach(bus: &mut Bus, pins: BenchPins, parts: KeyParts) -> DeviceId {
        let bench = Self {
            keys: vec![BenchKey::resting(&parts); pins.keys.len()],
            parts,
            pins,
            tripped: false,
            levels: bus.pins.levels(),
            now: 0,
            shows_fault: false,
        };
        bench.show(bus);
        let id = bus.attach(0, 0, Waits::default(), Box::new(bench));
        let watches = Notices {
            pins: true,
            requests: false,
        };
        bus.watch(id, watches);
        id
    }

    /// The keys.
    pub fn keys(&self) -> &[BenchKey] {
        &self.keys
    }

    /// A key, to press it.
    pub fn key_mut(&mut self, key: usize) -> Option<&mut BenchKey> {
        self.keys.get_mut(key)
    }

    /// Whether bridges drive.
    pub fn is_awake(&self) -> bool {
        !self.tripped && self.level(self.pins.sleep)
    }

    /// A bridge gets too warm, and all turn themselves off; or they are as they were.
    pub fn set_tripped(&mut self, tripped: bool) {
        self.tripped = tripped;
    }

    fn level(&self, pin: u32) -> bool {
        self.levels >> pin & 1 != 0
    }

    /// Currents and keys go on to a cycle.
    fn advance(&mut self, cycle: u64) {
        let seconds = cycle.saturating_sub(self.now) as f64 / self.parts.clock_hz;
        if seconds == 0.0 {
            return;
        }
        let awake = self.is_awake();
        let parts = self.parts;
        for (key, pins) in self.keys.iter_mut().zip(&self.pins.keys) {
            let inputs = [0, 1].map(|input| self.levels >> (pins.bridge + input) & 1 != 0);
            match inputs {
                _ if !awake => key.coast(&parts, seconds),
                [false, false] => key.coast(&parts, seconds),
                [first, second] => {
                    let volts = f64::from(u8::from(second)) - f64::from(u8::from(first));
                    key.conduct(&parts, volts * parts.supply_v, seconds);
                }
            }
            key.go(&parts, seconds);
            self.tripped |= key.current_a.abs() > parts.trip_a;
        }
        self.now = cycle;
    }

    fn show(&self, bus: &mut Bus) {
        for (key, pins) in self.keys.iter().zip(&self.pins.keys) {
            bus.pins
                .set_analog(pins.sensor as usize, key.code(&self.parts));
        }
    }
}

impl Device for KeyBench {
    fn read(&mut self, _: Access, _: &mut Bus) -> Result<u32, BusError> {
        Err(BusError)
    }

    fn write(&mut self, _: Access, _: u32, _: &mut Bus) -> Result<(), BusError> {
        Err(BusError)
    }

    fn due(&self) -> u64 {
        let step = (STEP_S * self.parts.clock_hz) as u64;
        self.now + step.max(1)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.advance(cycle);
        self.levels = bus.pins.levels();
        self.show(bus);
        if self.shows_fault != self.tripped {
            self.shows_fault = self.tripped;
            let mask = 1 << self.pins.fault;
            bus.pins
                .set_outside(mask, self.tripped.then_some(0), cycle + 1);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub const PARTS: KeyParts = KeyParts {
        clock_hz: 150e6,
        supply_v: 12.0,
        trip_a: 5.0,
        resistance_ohm: 4.0,
        inductance_h: 1e-3,
        force_n_per_a: 0.25,
        mass_kg: 0.06,
        damping_n_s_m: 0.2,
        friction_n: 0.0,
        stops_m: [0.0, 0.01],
        stop_n_m: 20e3,
        stop_n_s_m: 20.0,
        sensed_m: [-0.5e-3, 10.5e-3],
    };
    const STEP: f64 = 2e-6;

    fn is_near(found: f64, wanted: f64, within: f64) {
        assert!((found - wanted).abs() <= within, "{found}, not {wanted}");
    }

    #[test]
    fn a_current_rises_by_its_time_constant_and_is_gone_without_a_bridge() {
        let held = KeyParts {
            mass_kg: 1e9,
            ..PARTS
        };
        let mut key = BenchKey::default();
        for passed in 1..5 {
            (0..50).for_each(|_| key.conduct(&held, 12.0, STEP));
            is_near(
                key.current_a,
                3.0 * (1.0 - (-0.4 * f64::from(passed)).exp()),
                1e-9,
            );
        }
        let before = key.current_a;
        // -12 V: from i towards -3 A; at 0 after L / R * ln(1 + i / 3).
        let over = (1.0 + before / 3.0).ln() * 250e-6;
        let steps = (over / STEP).ceil() as usize;
        (0..steps - 1).for_each(|_| key.coast(&held, STEP));
        assert!(key.current_a > 0.0);
        key.coast(&held, STEP);
        assert_eq!(key.current_a, 0.0);
    }

    #[test]
    fn a_key_that_falls_ends_at_a_speed_and_brakes_by_its_shorted_coil() {
        let deep = KeyParts {
            stops_m: [0.0, 1e3],
            inductance_h: 1e-7,
            ..PARTS
        };
        let mut key = BenchKey {
            finger: Finger {
                force_n: 0.1,
                ..Finger::default()
            },
            ..BenchKey::default()
        };
        for _ in 0..1_500_000 {
            key.conduct(&deep, 0.0, STEP);
            key.go(&deep, STEP);
        }
        // damping + k^2 / R
        let speed = 0.1 / (0.2 + 0.25 * 0.25 / 4.0);
        is_near(key.speed_m_s, speed, 1e-3 * speed);
    }

    #[test]
    fn a_stop_a_current_and_a_finger_are_in_balance() {
        let mut key = BenchKey {
            finger: Finger {
                force_n: 1.0,
                ..Finger::default()
            },
            ..BenchKey::default()
        };
        for _ in 0..500_000 {
            key.conduct(&PARTS, 8.0, STEP);
            key.go(&PARTS, STEP);
        }
        // 2 A push up with 0.5 N of the finger's 1 N.
        is_near(key.place_m, 0.01 + 0.5 / 20e3, 1e-9);
        let code = (key.place_m + 0.5e-3) / 11e-3 * 4095.0;
        assert_eq!(key.code(&PARTS), code.round() as u16);
        let stuck = BenchKey {
            stuck_code: Some(77),
            ..key
        };
        assert_eq!(stuck.code(&PARTS), 77);
    }

    #[test]
    fn friction_holds_a_key() {
        let rough = KeyParts {
            friction_n: 0.03,
            ..PARTS
        };
        let mut key = BenchKey {
            finger: Finger {
                force_n: 0.029,
                ..Finger::default()
            },
            ..BenchKey::default()
        };
        (0..10_000).for_each(|_| key.go(&rough, STEP));
        assert_eq!(key.place_m, 0.0);
    }
}
