//! A knob on a Pico 2, whole: the image of the bundled program on the emulated chip, with models of
//! sensor, driver and motor on its pins.

use std::f64::consts::TAU;

use whippen_compiler::firmware::{core_block, knob_block};
use whippen_emulator::{Hand, Register, SensorFault};

use crate::knob_bench::{Bench, PARTS, PERIOD, PINS, START_MS};

/// From wherever the knob stands, however its magnet and its phases are: the electrical angle is
/// found within 5 degrees, which costs 0.4 % of the torque.
#[test]
fn every_start_finds_the_motor() {
    let start = |number: u32| {
        let mut parts = PARTS;
        parts.angle_rad = 0.55 * f64::from(number);
        parts.motor.offset_rad = TAU * 0.381_966 * f64::from(number);
        parts.motor.reversed = number % 3 == 1;
        parts.motor.cogging_n_m = if number % 4 == 2 { 1e-3 } else { 0.0 };
        let mut bench = Bench::new(parts);
        bench.pass_ms(START_MS);
        let error = bench.electrical_error(&parts).to_degrees();
        println!("start {number}: {error:.2} electrical degrees");
        assert_eq!(bench.faults(), 0, "{number}");
        assert!(error.abs() < 5.0, "{number}: {error}");
        assert!(bench.word("core0", core_block::TICK) > 0);
    };
    std::thread::scope(|threads| {
        for half in 0..2 {
            threads.spawn(move || (0..6).for_each(|number| start(2 * number + half)));
        }
    });
}

/// Detents, a stop, and the driver's fault while it plays.
#[test]
fn a_hand_feels_what_the_program_says() {
    let mut bench = Bench::started();
    let from = bench.angle();
    assert_eq!((bench.faults(), bench.knob().is_driven()), (0, true));
    bench.knob().hand.place_rad = from;
    // 8 h u (1 - 2 |u|) at h = 12 mN*m; friction of program and bearing is 2.5 mN*m.
    for (part, wanted) in [(0.125, 9e-3), (0.25, 12e-3), (-0.125, -9e-3)] {
        let place = part * 15_f64.to_radians();
        let torque = bench.held(from, place);
        // Where the hand's spring has let it: the law at the angle that is.
        println!("at {part} of a pitch: {torque} N*m, of {wanted}");
        assert!((torque - wanted).abs() < 3.5e-3, "{part}: {torque}");
    }
    // Let go in the next pitch it falls into that place.
    bench.held(from, 11_f64.to_radians());
    bench.knob().hand = Hand::default();
    bench.pass_ms(150);
    let place = (bench.angle() - from).to_degrees();
    assert!((place - 15.0).abs() < 1.5, "{place}");
    timing(&mut bench);
    bench.knob().set_tripped(true);
    bench.pass(2 * PERIOD);
    assert_eq!(bench.faults(), 32);
    bench.knob().set_tripped(false);
    bench.pass_ms(1);
    assert!(!bench.knob().is_driven(), "until the next start");
}

/// Samples are exactly a period apart, and 900 cycles or a few more before a wrap: the
/// middle of a phase's pulse.
fn timing(bench: &mut Bench) {
    bench.machine.bus.pins.record();
    bench.pass(20 * PERIOD);
    let changes = bench.machine.bus.pins.take_changes();
    let edges = |pin: u32, up: bool| -> Vec<u64> {
        let level = |levels: u64| levels >> pin & 1 != 0;
        let pairs = changes.windows(2);
        let edges = pairs.filter(|pair| level(pair[1].levels) == up && level(pair[0].levels) != up);
        edges.map(|pair| pair[1].cycle).collect()
    };
    let samples = edges(PINS.select, false);
    assert!(samples.len() > 15);
    assert!(samples.windows(2).all(|two| two[1] - two[0] == PERIOD));
    let (rises, falls) = (edges(PINS.phases[0], true), edges(PINS.phases[0], false));
    for rise in rises.iter().skip(1).take(10) {
        let fall = falls.iter().find(|fall| *fall > rise).expect("it falls");
        let wrap = (rise + fall) / 2;
        let sample = samples.iter().rfind(|sample| **sample < wrap);
        let ahead = wrap - sample.expect("there is one");
        assert!((900..=924).contains(&ahead), "{ahead}");
    }
}

/// How far a stop lets itself be pressed in, some 145 degrees from the start.
#[test]
fn a_stop_is_as_stiff_as_the_program_says() {
    let mut bench = Bench::started();
    let from = bench.angle();
    bench.knob().hand.place_rad = from;
    for quarter in 1..=4 {
        bench.held(from, f64::from(quarter) * 36_f64.to_radians());
    }
    // 0.5 N*m/rad on top of the detent, of which a slope is between these two places.
    let [near, far] = [145.0_f64, 148.0].map(f64::to_radians);
    let law = |angle: f64| {
        let u = angle.to_degrees() / 15.0;
        let u = u - u.round();
        0.096 * u * (1.0 - 2.0 * u.abs()) + 0.5 * (angle - 142.5_f64.to_radians())
    };
    for place in [near, far] {
        let torque = bench.held(from, place);
        let angle = bench.angle() - from;
        println!(
            "{} deg: {torque} N*m, of {}",
            angle.to_degrees(),
            law(angle)
        );
        // Dry friction is 2.5 mN*m, of program and bearing.
        assert!((torque - law(angle)).abs() < 4e-3, "{torque}");
    }
    assert_eq!(bench.faults(), 0);
}

/// What is wrong, how long until the driver is disabled at most (ms), and what is told.
const FAULTS: &[(SensorFault, u64, i32)] = &[
    (SensorFault::WrongCrc, 11, 64),
    (SensorFault::ShortToGround, 11, 64),
    (SensorFault::Broken, 11, 64),
    (SensorFault::Jumped(4000), 11, 64),
    (SensorFault::Field(1), 1, 64),
    (SensorFault::Field(2), 1, 64),
    (SensorFault::LostTrack, 1, 64),
];

#[test]
fn a_sensor_that_fails_disables_the_driver() {
    for &(fault, ms, told) in FAULTS {
        let mut bench = Bench::new(PARTS);
        bench.pass_ms(20);
        assert!(bench.knob().is_driven());
        // For a while nothing follows from it but what is immediate.
        bench.knob().set_sensor_fault(fault);
        bench.pass_ms(if ms > 1 { 5 } else { 0 });
        assert!(bench.knob().is_driven(), "{fault:?}");
        if ms > 1 {
            bench.knob().set_sensor_fault(SensorFault::None);
            bench.pass_ms(1);
            assert!(bench.word("knob", knob_block::WRONG) > 200, "{fault:?}");
            assert_eq!(
                (bench.word("knob", knob_block::AGE), bench.faults()),
                (0, 0)
            );
            bench.knob().set_sensor_fault(fault);
        }
        bench.pass_ms(ms);
        let found = (bench.knob().is_driven(), bench.faults());
        assert_eq!(found, (false, told), "{fault:?}");
    }
}

/// Without a magnet from the beginning it is never enabled, not even for a tick.
#[test]
fn a_sensor_without_its_magnet_enables_nothing() {
    let mut bench = Bench::new(PARTS);
    bench.knob().set_sensor_fault(SensorFault::Field(1));
    bench.machine.bus.pins.record();
    bench.pass_ms(20);
    let changes = bench.machine.bus.pins.take_changes();
    let enabled = |levels: u64| levels >> PINS.enable & 1 != 0;
    assert!(changes.len() > 100 && !changes.iter().any(|own| enabled(own.levels)));
    assert_eq!(bench.faults(), 64);
}

#[test]
fn a_driver_or_a_processor_that_fails_disables_it() {
    let mut bench = Bench::new(PARTS);
    bench.pass_ms(20);
    bench.knob().set_tripped(true);
    bench.pass(2 * PERIOD);
    bench.knob().set_tripped(false);
    assert_eq!((bench.knob().is_driven(), bench.faults()), (false, 32));
    let mut bench = Bench::new(PARTS);
    bench.pass_ms(20);
    assert!(bench.knob().is_driven());
    bench
        .machine
        .cpu_mut(0)
        .set(Register::core(15), 0x3000_0000);
    bench.pass(2000);
    assert!(!bench.knob().is_driven());
    assert_eq!(bench.word("status", 8), 16);
}

/// A motor that does not follow its field: too few pole pairs, a shaft that is stuck.
#[test]
fn a_motor_that_does_not_follow_is_not_driven() {
    let mut other = PARTS;
    other.motor.pole_pairs = 11;
    let mut stuck = PARTS;
    stuck.motor.friction_n_m = 0.1;
    for parts in [other, stuck] {
        let mut bench = Bench::new(parts);
        bench.pass_ms(START_MS);
        assert_eq!((bench.knob().is_driven(), bench.faults()), (false, 128));
    }
}
