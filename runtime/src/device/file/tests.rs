//! Device files that are good, and those that are not.

use super::super::{Drive, FeltStops, Mechanics, Sensor};
use super::*;
use whippen_compiler::model::Moves;

const GOOD: &str = r#"
name = "test"
[sensor]
bits = "16 bit"
low = "-0.5 mm"
high = "10.5 mm"
delay = "0.5 samples"
[drive]
bits = "16 bits"
full_scale = "500 mN"
delay = "12 samples"
"#;

const MOTOR: &str = r#"[motor]
torque_constant = "0.007 N*m/A"
rated = "0.5 A"
peak = "2 A"
peak_time = "100 ms"
[drive]"#;

const MECHANICS: &str = r#"[mechanics]
mass = "60 g"
damping = "0.2 N*s/m"
friction = "30 mN"
stop_low = "0 mm"
stop_high = "10 mm"
stop_stiffness = "20 kN/m"
stop_damping = "20 N*s/m"
[drive]"#;

fn changed(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    read(Path::new("test.toml"), &GOOD.replace(from, to))
        .unwrap_err()
        .to_string()
}

#[test]
fn units_are_those_of_the_language() {
    let device = read(Path::new("test.toml"), GOOD).unwrap();
    assert_eq!(
        device.sensor(),
        Sensor {
            bits: 16,
            low: -0.0005,
            high: 0.0105,
            delay_samples: 0.5,
            update_hz: None,
            step: None,
            noise_rms: None,
        }
    );
    assert_eq!(
        device.drive(),
        Drive {
            full_scale: 0.5,
            delay_samples: 12.0,
            ..Drive::NONE
        }
    );
}

#[test]
fn the_page_has_every_key_and_a_file_that_can_be_read() {
    let page = include_str!("../../../../docs/how-to/device.md");
    for (key, _) in KEYS {
        // Tables of ports have the keys of those for one.
        let key = key.trim_start_matches("port.*.");
        assert!(page.contains(&format!("`{key}`")), "{key}");
    }
    let (_, rest) = page.split_once("```toml\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("its end");
    let device = read(Path::new("my-key.toml"), example);
    assert_eq!(device.map(|device| device.name).as_deref(), Ok("my key"));
}

#[test]
fn a_motor_is_what_it_stands() {
    let device = read(Path::new("test.toml"), &GOOD.replace("[drive]", MOTOR)).unwrap();
    let motor = Motor {
        torque_constant: 0.007,
        rated_a: 0.5,
        peak_a: 2.0,
        peak_s: 0.1,
        heat: None,
    };
    assert_eq!(device.motor, Some(motor));
    assert_eq!(read(Path::new("test.toml"), GOOD).unwrap().motor, None);
}

#[test]
fn a_motor_may_be_limited_in_what_it_gives() {
    let with = |energy: &str| {
        GOOD.replace(
            "[drive]",
            &format!("[passivity]\nenergy = \"{energy}\"\n[drive]"),
        )
    };
    let device = |energy: &str| read(Path::new("test.toml"), &with(energy));
    assert_eq!(
        device("20 mJ").map(|device| device.passivity_j),
        Ok(Some(0.02))
    );
    assert!(device("0 mJ").is_err() && device("20 mW").is_err());
    assert_eq!(
        read(Path::new("test.toml"), GOOD).unwrap().passivity_j,
        None
    );
}

#[test]
fn a_key_moves_as_its_mechanics_say() {
    let device = read(Path::new("test.toml"), &GOOD.replace("[drive]", MECHANICS)).unwrap();
    let stops = FeltStops {
        low: 0.0,
        high: 0.01,
        stiffness: 2e4,
        damping: 20.0,
    };
    let mechanics = Mechanics {
        mass: 0.06,
        damping: 0.2,
        friction: 0.03,
        stops: Some(stops),
    };
    assert_eq!(device.port().mechanics, Some(mechanics));
    assert_eq!(
        device.port().key(44_100.into()).map(|key| key.delay_ticks),
        Some(12.5)
    );
    assert_eq!(
        read(Path::new("test.toml"), GOOD)
            .unwrap()
            .port()
            .key(44_100.into()),
        None
    );
}

/// The sensor, the coil and the amplifier of the first paper.
const CHAIN: &str = r#"
name = "test"
[sensor]
bits = "12 bit"
low = "-0.5 mm"
high = "10.5 mm"
delay = "1 sample"
noise = "1 um"
curve = "-0.5 mm: 0.9, 3 mm: 0.5, 10.5 mm: 0.1"
[drive]
bits = "10 bit"
full_scale = "0.467 N"
delay = "1 sample"
amplifier = "40 kHz"
resistance = "8 Ohm"
inductance = "1 mH"
mode = "3 kHz"
mode_damping = "2 %"
[motor]
torque_constant = "0.007 N*m/A"
arm = "30 mm"
rated = "0.5 A"
peak = "2 A"
peak_time = "100 ms"
"#;

#[test]
fn a_chain_is_told_stage_by_stage() {
    let device = read(Path::new("test.toml"), CHAIN).unwrap();
    let (sensor, drive) = (device.sensor(), device.drive());
    assert_eq!((sensor.bits, drive.bits), (12, 10));
    assert_eq!(drive.lag_hz(), Some(40e3));
    let mode = drive.mode.map(|mode| (mode.hz, mode.damping));
    assert_eq!(mode, Some((3000.0, 0.02)));
    // By its winding alone: 8 Ohm over 1 mH are 8000/s.
    let voltage = CHAIN.replace("amplifier = \"40 kHz\"\n", "");
    let voltage = read(Path::new("test.toml"), &voltage).unwrap();
    let hz = voltage.drive().lag_hz().expect("a winding");
    assert!((hz - 8000.0 / std::f64::consts::TAU).abs() < 1e-9, "{hz}");
    // Where the curve is flat, above 3 mm, a code is more than where it is straight on average.
    let port = device.port();
    let step = 11e-3 / 4095.0 / 0.8;
    assert!(port.widest_step() > 1.3 * step, "{}", port.widest_step());
    let codes = |from: f64, to: f64| {
        let word = |n: i32| port.word(from + f64::from(n) / 2e4 * (to - from)).0;
        let mut all: Vec<u16> = (0..=20_000).map(word).collect();
        all.dedup();
        all.len()
    };
    let (steep, flat) = (codes(0.0, 1e-3), codes(7e-3, 8e-3));
    assert!(steep > flat && flat > 100, "{steep} {flat}");
    let changed = |from: &str, to: &str| {
        assert!(CHAIN.contains(from), "{from}");
        let read = read(Path::new("test.toml"), &CHAIN.replace(from, to));
        read.unwrap_err().to_string()
    };
    let messages = [
        changed("12 bit", "3 bit"),
        changed("0.1\"", "0.6\""),
        changed("10.5 mm: 0.1", "9 mm: 0.1"),
        changed("3 mm: 0.5", "3 N: 0.5"),
        changed("3 mm: 0.5", "3 mm"),
        changed("8 Ohm", "8 V"),
        changed("inductance = \"1 mH\"\n", ""),
        changed("40 kHz", "0 Hz"),
        changed("2 %", "100 %"),
        changed("mode = \"3 kHz\"\n", ""),
        changed("30 mm", "3 mm"),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_supply_needs_a_winding_and_a_motor_and_drives_the_largest_current() {
    let with = |volts: &str| {
        let told = format!("inductance = \"1 mH\"\nsupply = \"{volts}\"\n");
        CHAIN.replace("inductance = \"1 mH\"\n", &told)
    };
    let read = |text: &str| read(Path::new("test.toml"), text);
    let supply = read(&with("24 V")).unwrap().drive().supply;
    let (volts, amperes_a_newton, rated_a) = (24.0, 2.0 / 0.467, 0.5);
    let found = supply.map(|s| (s.volts, s.amperes_per_force, s.rated_a, s.heat));
    assert_eq!(found, Some((volts, amperes_a_newton, rated_a, None)));
    assert_eq!(read(CHAIN).unwrap().drive().supply, None);
    let without = |from: &str| {
        let text = with("24 V");
        let (before, rest) = text.split_once(from).expect(from);
        before.to_string() + rest.split_once("\n\n").map_or("", |rest| rest.1)
    };
    let winding = "resistance = \"8 Ohm\"\ninductance = \"1 mH\"\n";
    for (text, words) in [
        (with("15 V"), "drives 1.875 A through"),
        (with("0 V"), "must be a number above zero of `V`"),
        (with("24 A"), "must be a number above zero of `V`"),
        (
            with("24 V").replace(winding, ""),
            "needs `drive.resistance`",
        ),
        (without("[motor]"), "`[motor]`, which says"),
    ] {
        let why = read(&text).unwrap_err().to_string();
        assert!(why.contains("drive.supply") && why.contains(words), "{why}");
    }
}

#[test]
fn deep_nesting_is_an_error_and_not_a_crash() {
    for text in [
        format!("{}a = 1", "a.".repeat(200_000)),
        format!("a = {}", "[".repeat(200_000)),
        "a = {b=".repeat(200_000),
    ] {
        assert!(read(Path::new("test.toml"), &text).is_err());
    }
}

const PORTS: &str = r#"
name = "test"
[port.x.sensor]
bits = "16 bit"
low = "-10 mm"
high = "10 mm"
rate = "1 kHz"
step = "0.1 mm"
delay = "1 sample"
[port.x.drive]
bits = "16 bit"
full_scale = "3.3 N"
delay = "1 sample"
[port.push.sensor]
bits = "16 bit"
low = "0 N"
high = "20 N"
delay = "1 sample"
"#;

#[test]
fn ports_measure_anything_and_are_driven_where_they_move() {
    let device = read(Path::new("test.toml"), PORTS).unwrap();
    let [x, push] = &device.ports[..] else {
        panic!("{device:?}")
    };
    assert_eq!(
        (x.name.as_str(), x.moves, x.dim),
        ("x", Moves::Slides, Dim::LENGTH)
    );
    assert_eq!(x.drive.map(|drive| drive.full_scale), Some(3.3));
    assert_eq!(
        (x.sensor.update_hz, x.sensor.step),
        (Some(1000.0), Some(1e-4))
    );
    assert_eq!(
        (push.dim, push.moves, push.drive),
        (Dim::FORCE, Moves::Not, None)
    );
    // A step is told at its middle.
    assert_eq!(x.word(0.04e-3), x.word(0.0));
    assert_eq!(x.word(0.06e-3), x.word(0.1e-3));
    let changed = |from: &str, to: &str| {
        assert!(PORTS.contains(from), "{from}");
        let read = read(Path::new("test.toml"), &PORTS.replace(from, to));
        read.unwrap_err().to_string()
    };
    let messages = [
        changed("[port.x.sensor]", "[port.x.sensors]"),
        changed("\"1 kHz\"", "\"0 Hz\""),
        changed("\"0.1 mm\"", "\"0.1 N\""),
        changed("\"3.3 N\"", "\"3.3 N*m\""),
        changed("\"20 N\"", "\"-20 N\""),
        changed("[port.x.drive]", "[port.push.drive]"),
        changed("[port.x.drive]", "[drive]"),
        changed("[port.push.sensor]", "[port.push]"),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn each_port_that_is_driven_moves_as_its_own_mechanics_say() {
    let with = |of_port: &str, mass: &str| {
        let table = "mass = \"45 g\"\ndamping = \"0.1 N*s/m\"\nfriction = \"0.26 N\"\n";
        let table = table.replace("45 g", mass);
        format!("{PORTS}[port.{of_port}.mechanics]\n{table}")
    };
    let read = |text: &str| read(Path::new("test.toml"), text);
    let device = read(&with("x", "45 g")).unwrap();
    let mechanics = device.ports.iter().map(|port| port.mechanics);
    let x = Mechanics {
        mass: 0.045,
        damping: 0.1,
        friction: 0.26,
        stops: None,
    };
    assert_eq!(mechanics.collect::<Vec<_>>(), [Some(x), None]);
    let refused = [
        with("push", "45 g"),
        with("x", "0 g"),
        with("x", "1 kg*m^2"),
        format!("{PORTS}[mechanics]\nmass = \"45 g\"\n"),
    ];
    let messages = refused.map(|text| read(&text).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn mistakes_are_named_with_their_place() {
    let messages = [
        changed("high =", "hihg ="),
        changed("[sensor]", "[sensors]"),
        changed("low =", "colour ="),
        changed("low = \"-0.5 mm\"\n", ""),
        changed("\"-0.5 mm\"", "-0.5"),
        changed("-0.5 mm", "-0.5"),
        changed("-0.5 mm", "-0.5 N"),
        changed("-0.5 mm", "-0.5 mmm"),
        changed("-0.5 mm", "on"),
        changed("-0.5 mm", "11 mm"),
        changed("500 mN", "0 N"),
        changed("500 mN", "500 mN*m"),
        changed("-0.5 mm", "-30 deg"),
        changed(
            "low = \"-0.5 mm\"\nhigh = \"10.5 mm\"",
            "low = \"-30 deg\"\nhigh = \"30 deg\"",
        ),
        changed("0.5 samples", "1 ms"),
        changed("0.5 samples", "-1 sample"),
        changed("16 bits", "17 bit"),
        changed("16 bits", "12"),
        changed("name = \"test\"", "name = \"test"),
        changed("name = \"test\"", "name = [\"test\"]"),
        changed("[drive]", "[sensor]"),
        changed("[drive]", "[motor]\nrated = \"2 A\"\n[drive]"),
        changed("[drive]", &MOTOR.replace("0.5 A", "2 A")),
        changed("[drive]", &MOTOR.replace("100 ms", "0 ms")),
        changed(
            "[drive]",
            &MOTOR.replace("\"100 ms\"", "\"100 ms\"\nrise = \"60 degC\""),
        ),
        changed(
            "[drive]",
            &MOTOR.replace("\"100 ms\"", "\"100 ms\"\nrise = \"60 K\""),
        ),
        changed("[drive]", "[mechanics]\nweight = \"60 g\"\n[drive]"),
        changed("[drive]", "[mechanics]\nmass = \"60 mN\"\n[drive]"),
        changed("[drive]", "[mechanics]\nmass = \"0 g\"\n[drive]"),
        changed("[drive]", &MECHANICS.replace("10 mm", "-1 mm")),
        changed("500 mN\"", "500 mN\"\nbandwidth = \"0 Hz\""),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}
