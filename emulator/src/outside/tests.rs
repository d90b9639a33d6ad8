//! A knob on the pins of a chip whose pins are set by hand.

use super::*;
use crate::boards::{BoardKind, ConverterSetup, build};
use crate::machine::Machine;
use crate::pins::Source;

const PINS: KnobPins = KnobPins {
    select: 3,
    clock: 2,
    data: 4,
    phases: [6, 7, 8],
    enable: 9,
    fault: 10,
};

const PARTS: KnobParts = KnobParts {
    clock_hz: 150e6,
    supply_v: 12.0,
    trip_a: 2.5,
    sensor_delay_s: 5e-6,
    data_delay_cycles: 3,
    motor: MotorParameters {
        resistance_ohm: 5.0,
        inductance_h: 1e-3,
        flux_v_s: 0.006,
        pole_pairs: 7,
        inertia_kg_m2: 15e-6,
        damping_n_m_s: 1e-3,
        friction_n_m: 0.0,
        cogging_n_m: 0.0,
        cogging_per_turn: 84,
        offset_rad: 0.0,
        reversed: false,
    },
    angle_rad: 1.0,
};

/// A chip without a program, and a knob.
struct Bench {
    machine: Machine,
    knob: DeviceId,
    cycle: u64,
    driven: u64,
}

fn bench(parts: KnobParts) -> Bench {
    let kind = BoardKind::Rp2350;
    let (mut machine, _) = build(kind, kind.board(), ConverterSetup::default()).expect("a board");
    for pin in [2, 3, 4, 6, 7, 8, 9, 10] {
        // Not isolated, an input, pulled up.
        machine.bus.pins.set_pad(pin, 1 << 6 | 1 << 3, 0);
        machine.bus.pins.set_function(pin, 5, 0);
    }
    let knob = Knob::attach(&mut machine.bus, PINS, parts);
    Bench {
        machine,
        knob,
        cycle: 0,
        driven: 0x3cc,
    }
}

impl Bench {
    fn set(&mut self, pin: u32, level: bool) {
        self.driven = self.driven & !(1 << pin) | u64::from(level) << pin;
        let (pins, cycle) = (&mut self.machine.bus.pins, self.cycle);
        pins.set(Source::Sio, self.driven, 0x3cc, cycle + 1);
        self.machine.bus.give_notice(cycle);
    }

    fn pass(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.machine.bus.attend(self.cycle);
    }

    fn level(&self, pin: u32) -> bool {
        self.machine.bus.pins.levels() >> pin & 1 != 0
    }

    fn knob(&mut self) -> &mut Knob {
        self.machine.bus.device_mut(self.knob).expect("a knob")
    }

    /// A frame as a chip clocks it, seven cycles a level.
    fn frame(&mut self) -> u32 {
        self.set(3, false);
        self.pass(17);
        let mut word = 0;
        for _ in 0..24 {
            self.set(2, true);
            self.pass(7);
            self.set(2, false);
            word = word << 1 | u32::from(self.level(4));
            self.pass(7);
        }
        self.set(3, true);
        self.pass(100);
        word
    }
}

#[test]
fn a_frame_tells_the_angle_of_the_shaft_some_time_ago() {
    let mut bench = bench(PARTS);
    bench.set(2, false);
    bench.set(9, false);
    bench.set(3, true);
    bench.pass(100);
    assert!(bench.level(4), "nobody drives it, and it is pulled up");
    assert_eq!(
        bench.frame() >> 10,
        (16384.0 / std::f64::consts::TAU) as u32
    );
    // A knob that turns at 100 rad/s, seen 5 us late: 1.3 steps of the sensor.
    bench.knob().hand = Hand {
        torque_n_m: 0.1,
        ..Hand::default()
    };
    bench.pass(150_000 * 30);
    let then = bench.knob().motor().angle_rad();
    let speed = bench.knob().motor().speed_rad_s();
    let steps = f64::from(bench.frame() >> 10) / 16384.0 * std::f64::consts::TAU;
    let wanted = (then - speed * 5e-6).rem_euclid(std::f64::consts::TAU);
    // A step of the shaft is 4 us, one of the sensor 0.38 mrad.
    assert!(
        (steps - wanted).abs() < 0.4e-3 + speed * 4e-6,
        "{steps} {wanted}"
    );
}

#[test]
fn a_driver_drives_while_it_is_enabled_and_trips_by_current() {
    let mut still = PARTS;
    still.motor.inertia_kg_m2 = 1e9;
    let mut bench = bench(still);
    for pin in [6, 7, 8, 9] {
        bench.set(pin, false);
    }
    bench.set(6, true);
    bench.pass(150_000);
    assert_eq!(bench.knob().motor().phase_currents(), [0.0; 3]);
    bench.set(9, true);
    bench.pass(150_000 * 3);
    let flows = bench.knob().motor().phase_currents()[0];
    assert!((flows - 1.6).abs() < 0.01, "{flows}");
    assert!(bench.level(10) && bench.knob().is_driven());
    // The same with a winding of a third of the resistance.
    let mut low = still;
    low.motor.resistance_ohm = 1.7;
    let mut bench = self::bench(low);
    bench.set(7, false);
    bench.set(8, false);
    bench.pass(150_000 * 3);
    assert!(!bench.level(10) && !bench.knob().is_driven());
    assert_eq!(bench.knob().motor().phase_currents(), [0.0; 3]);
    bench.knob().set_tripped(false);
    bench.set(9, false);
    bench.pass(1000);
    assert!(bench.level(10));
}
