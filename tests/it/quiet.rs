//! Quiet at rest: what the noise of a sensor becomes at a key that nobody plays.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::{resting, session};

use crate::cli::{Shell, bundled};
use crate::common::{self, RATE_HZ};
use crate::pictures::compare_picture;
use crate::played::play;

/// No bundled key hums louder while it rests, at 1 um of noise (N, root of the mean square).
const QUIET_N: f64 = 20e-3;

fn noise_of(compiled: &Compiled, device: &Device) -> resting::RestingNoise {
    let noise = resting::noise(compiled, device);
    noise.expect("an engine").expect("a key")
}

#[test]
fn every_bundled_key_is_quiet_at_rest() {
    for compiled in common::of_keys() {
        let device = Device::of(&compiled.model);
        let noise = noise_of(&compiled, &device);
        println!("{}: {}", compiled.model.name, noise.told(device.turns()));
        let allowed = match device.turns() {
            // The same at the rim of a knob of 40 mm.
            true => QUIET_N * 20e-3,
            false => QUIET_N,
        };
        assert!(noise.force_rms > 0.0 && noise.force_rms < allowed);
    }
}

#[test]
fn the_noise_at_rest_is_that_of_the_formula() {
    let text = "instrument damper { sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms\n force drag = 10 N*s/m * x' }";
    let damper = common::compiled("damper.whip", text, &[]).remove(0);
    let device = Device::of(&damper.model);
    let slope_per_m = f64::from(RATE_HZ) * (12.0 / (31.0 * (31.0 * 31.0 - 1.0_f64))).sqrt();
    for (stated, rms) in [(None, 1e-6), (Some(3e-6), 3e-6)] {
        let device = stated.map_or(device.clone(), |rms| device.with_noise(rms));
        let noise = noise_of(&damper, &device);
        assert_eq!((noise.sensor_rms, noise.is_stated), (rms, stated.is_some()));
        let wanted_n = 10.0 * slope_per_m * rms;
        let ratio = noise.force_rms / wanted_n;
        assert!((ratio - 1.0).abs() < 0.07, "{ratio}");
    }
}

/// A curve makes noise larger where it is flat, a converter of few bits makes steps of it.
#[test]
fn a_sensors_curve_and_its_converter_are_in_the_noise_at_rest() {
    let text = "instrument damper { sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms\n force drag = 10 N*s/m * x' }";
    let damper = common::compiled("damper.whip", text, &[]).remove(0);
    let device = |sensor: &str| {
        let text = format!(
            "name = \"a\"\n[sensor]\nlow = \"-0.5 mm\"\nhigh = \"10.5 mm\"\ndelay = \"1 sample\"\nnoise = \"1 um\"\n{sensor}\n\
             [drive]\nbits = \"12 bit\"\nfull_scale = \"5 N\"\ndelay = \"1 sample\"\n"
        );
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.toml");
        std::fs::write(&path, text).expect("writable");
        Device::load(&path).expect("a good device")
    };
    let rms = |sensor: &str| noise_of(&damper, &device(sensor)).force_rms;
    let straight = rms("bits = \"16 bit\"");
    // At rest its slope is a quarter of the steepest.
    let curve = "bits = \"16 bit\"\ncurve = \"-0.5 mm: 0, 0.5 mm: 0.05, 1 mm: 0.075, 2 mm: 0.175, 4 mm: 0.575, 10.5 mm: 1\"";
    let curved = rms(curve);
    assert!(curved > 2.0 * straight, "{curved} {straight}");
    // A step of 2.7 um hides 1 um of noise in part, and makes what is left larger than it was.
    let coarse = rms("bits = \"12 bit\"");
    assert!(coarse > 0.0 && coarse != straight, "{coarse} {straight}");
    let told = device("bits = \"12 bit\"").told_converters();
    assert_eq!(
        told,
        [
            "a step of the sensor's 12 bits is 2.686 um",
            "a step of the drive's 12 bits is 2.44 mN"
        ]
    );
}

#[test]
fn a_stated_noise_is_played_and_is_the_same_in_every_run() {
    let spring = &common::instruments("virtual-spring.whip", &[])[0];
    let device = Device::of(&spring.model).with_noise(2e-6);
    let positions_m = vec![0.005; RATE_HZ as usize];
    let run = || {
        let run = session::run(spring, &device, EngineKind::Jit, &positions_m, |_| ());
        run.expect("an engine").trace
    };
    let (once, again) = (run(), run());
    let column = |trace: &whippen_runtime::trace::Trace| {
        let column = trace.column("x_m").expect("it is traced");
        column.values().to_vec()
    };
    let read_m = column(&once);
    assert_eq!(read_m, column(&again));
    let squares: f64 = read_m.iter().map(|x| (x - 0.005).powi(2)).sum();
    let rms = (squares / read_m.len() as f64).sqrt();
    assert!((rms / 2e-6 - 1.0).abs() < 0.03, "{rms}");
}

#[test]
fn a_dead_band_makes_a_noisy_recording_quiet() {
    let Some(noisy) = common::recording() else {
        return;
    };
    let banded = common::recording_with(2e-4).expect("it is there");
    let grand = common::instruments("grand-piano.whip", &[]).remove(0);
    let played = |positions_m: &[f64]| {
        let played = play(&grand, positions_m);
        let resting = &played.column("drive_n")[RATE_HZ as usize / 2..4 * RATE_HZ as usize];
        let mean = resting.iter().sum::<f64>() / resting.len() as f64;
        let squares: f64 = resting.iter().map(|force| (force - mean).powi(2)).sum();
        let rms_n = (squares / resting.len() as f64).sqrt();
        (rms_n, played.times("note"), played.speeds())
    };
    let (noisy_n, times, speeds) = played(&noisy);
    let (quiet_n, quiet_times, quiet_speeds) = played(&banded);
    println!("at rest {noisy_n:.3} N, with a dead band {quiet_n:.3} N");
    assert!(quiet_n < noisy_n / 5.0);
    assert_eq!((times.len(), quiet_times.len()), (5, 5));
    for (a, b) in times.iter().zip(&quiet_times) {
        assert!((a - b).abs() < 1e-3, "{a} and {b} s");
    }
    for (a, b) in speeds.iter().zip(&quiet_speeds) {
        assert!((a / b - 1.0).abs() < 0.02, "{a} and {b} m/s");
    }
    println!("5 cases");
}

/// What quiet costs the grand: beside the window and the friction that it had, its strikes of the
/// recording come no more than 0.06 ms later and no more than 1 % softer.
#[test]
fn a_quiet_grand_strikes_hardly_later_or_softer() {
    let Some(positions_m) = common::recording() else {
        return;
    };
    let quiet = common::instruments("grand-piano.whip", &[]).remove(0);
    let mut text = std::fs::read_to_string(bundled("grand-piano.whip")).expect("readable");
    for (now, before) in [
        ("over 0.97 ms", "over 0.7 ms"),
        (
            "coulomb(x, level: rub, give: 0.1 mm).drag",
            "clamp(30 N*s/m * x', -rub, rub)",
        ),
    ] {
        assert!(text.contains(now), "{now}");
        text = text.replace(now, before);
    }
    let loud = common::compiled("loud.whip", &text, &[]).remove(0);
    let (quiet, loud) = (play(&quiet, &positions_m), play(&loud, &positions_m));
    let (times, speeds) = (quiet.times("note"), quiet.speeds());
    assert_eq!((times.len(), loud.times("note").len()), (5, 5));
    for (a, b) in times.iter().zip(loud.times("note")) {
        println!("{:.3} ms later", 1e3 * (a - b));
        assert!((-0.01e-3..0.06e-3).contains(&(a - b)), "{a} and {b} s");
    }
    for (a, b) in speeds.iter().zip(loud.speeds()) {
        println!("{:.2} % softer", 1e2 * (1.0 - a / b));
        assert!((0.99..1.0).contains(&(a / b)), "{a} and {b} m/s");
    }
}

/// The pictures of `instruments/grand-piano.md`.
#[test]
fn the_recording_at_rest_looks_as_its_page_shows() {
    let Some(folder) = whippen_need::recordings("kawai-grand") else {
        return;
    };
    let file = |name: &str| std::fs::read_to_string(folder.join(name)).expect("readable");
    let mut shell = Shell::new();
    for name in ["key_and_hammer_2kHz.txt", "calibration_key.csv"] {
        shell = shell.with(name, &file(name));
    }
    let grand = bundled("grand-piano.whip");
    let as_recorded = "--motion key_and_hammer_2kHz.txt --rate 2000 --column 2 --calibration calibration_key.csv \
                       --rest 0.88mm --full 12.7mm --dip 10mm --lowpass 200Hz --seconds 0.2";
    let args: Vec<&str> = ["run", grand.as_str()]
        .into_iter()
        .chain(as_recorded.split_whitespace())
        .collect();
    let banded = ["--deadband", "0.0002"];
    for (name, options) in [("noisy-rest.svg", &[][..]), ("quiet-rest.svg", &banded[..])] {
        shell.ends(0, &[&args[..], options, &["--plot", name]].concat());
        let drawn = std::fs::read_to_string(shell.path(name)).expect("a picture");
        compare_picture(&format!("instruments/pictures/{name}"), &drawn);
    }
}
