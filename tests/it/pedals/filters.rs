//! Filters: what they make of noise against the analytic response, and what is left of it in
//! the end.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;

use super::{Complex, RATE_HZ, burst, db, part_of, pedal, played};

/// Where responses are compared (Hz).
const FREQUENCIES_HZ: [f64; 11] = [
    1.0, 10.0, 20.0, 60.0, 200.0, 700.0, 1000.0, 3000.0, 8000.0, 15_000.0, 21_000.0,
];

/// Numerator and denominator of a biquad in rising powers of 1/z, by the formulas of Robert
/// Bristow-Johnson's cookbook.
struct Cookbook {
    b: [f64; 3],
    a: [f64; 3],
}

impl Cookbook {
    fn of(kind: &str, f_hz: f64, q: f64) -> Cookbook {
        let w = std::f64::consts::TAU * f_hz / RATE_HZ;
        let (alpha, cos) = (w.sin() / (2.0 * q), w.cos());
        let b = match kind {
            "low" => [(1.0 - cos) / 2.0, 1.0 - cos, (1.0 - cos) / 2.0],
            "high" => [(1.0 + cos) / 2.0, -1.0 - cos, (1.0 + cos) / 2.0],
            "band" => [alpha, 0.0, -alpha],
            _ => panic!("{kind}"),
        };
        let a = [1.0 + alpha, -2.0 * cos, 1.0 - alpha];
        Cookbook { b, a }
    }

    fn peak(f_hz: f64, gain: f64, q: f64) -> Cookbook {
        let w = std::f64::consts::TAU * f_hz / RATE_HZ;
        let (alpha, cos, root) = (w.sin() / (2.0 * q), w.cos(), gain.sqrt());
        Cookbook {
            b: [1.0 + alpha * root, -2.0 * cos, 1.0 - alpha * root],
            a: [1.0 + alpha / root, -2.0 * cos, 1.0 - alpha / root],
        }
    }

    fn response(&self, f_hz: f64) -> Complex {
        let sum = |c: &[f64; 3]| {
            let delay = |n: usize| Complex::turn(-f_hz * n as f64 / RATE_HZ);
            let terms = c.iter().enumerate().map(|(n, c)| delay(n).scale(*c));
            terms.fold(Complex(0.0, 0.0), Complex::add)
        };
        sum(&self.b).over(sum(&self.a))
    }
}

/// A pedal's response to noise is what is told, within so much of full scale; the largest
/// difference in dB where it passes more than a thousandth.
fn responds(
    compiled: &Compiled,
    name: &str,
    seconds: f64,
    tolerance: f64,
    told: impl Fn(f64) -> Complex,
) -> f64 {
    let signal = burst(0.25, seconds);
    let (fed, [heard]) = played(compiled, EngineKind::Jit, &signal, [name]);
    let mut most_db = 0.0_f64;
    for f_hz in FREQUENCIES_HZ {
        let (found, told) = (part_of(&heard, f_hz).over(part_of(&fed, f_hz)), told(f_hz));
        let off = found.add(told.scale(-1.0)).size();
        assert!(
            off < tolerance * told.size().max(1.0),
            "{name} at {f_hz} Hz: {found:?}, not {told:?}"
        );
        if told.size() > 1e-3 {
            most_db = most_db.max(db(found.size() / told.size()).abs());
        }
    }
    most_db
}

#[test]
fn biquads_respond_as_the_cookbook_says() {
    for (corner_hz, q, seconds) in [
        (20.0, 0.7, 2.0),
        (200.0, 5.0, 1.0),
        (1000.0, 0.5, 0.2),
        (1000.0, 20.0, 1.0),
        (8000.0, 1.0, 0.1),
        (18_000.0, 2.0, 0.1),
    ] {
        let constant = format!("let f = biquad(signal, corner: {corner_hz} Hz, q: {q})");
        let live = format!(
            "live param corner = {corner_hz} Hz in 20 Hz .. 20 kHz
             live param q = {q} in 0.5 .. 20
             let f = biquad(signal, corner: corner, q: q)"
        );
        for (text, tolerance, tolerance_db) in [(constant, 2e-4, 0.01), (live, 5e-3, 0.05)] {
            let compiled = pedal(&format!("{text} sound out = f.low + f.band + f.high"));
            let most_db = ["low", "band", "high"].map(|kind| {
                let told = Cookbook::of(kind, corner_hz, q);
                let name = format!("f.{kind}");
                responds(&compiled, &name, seconds, tolerance, |f| told.response(f))
            });
            println!("{corner_hz} Hz, q {q}: {most_db:.5?} dB");
            assert!(most_db.iter().all(|off_db| *off_db < tolerance_db));
        }
    }
}

#[test]
fn a_band_of_the_equalizer_responds_as_the_cookbook_says() {
    for (centre_hz, gain, q) in [(100.0, 4.0, 1.0), (800.0, 2.0, 0.8), (5000.0, 0.1, 3.0)] {
        let constant = format!(
            "let f = equalizer(signal, centre: {centre_hz} Hz, gain: {gain}, q: {q}) sound out = f"
        );
        let live = format!(
            "live param gain = {gain} in 0.1 .. 10
             let f = equalizer(signal, centre: {centre_hz} Hz, gain: gain, q: {q})
             sound out = f"
        );
        let told = Cookbook::peak(centre_hz, gain, q);
        for (text, tolerance) in [(constant, 1e-4), (live, 2e-3)] {
            let most_db = responds(&pedal(&text), "f", 0.5, tolerance, |f| told.response(f));
            println!("{centre_hz} Hz, {gain} times, q {q}: {most_db:.5} dB");
            assert!(most_db < 0.01);
        }
    }
}

#[test]
fn a_violin_has_the_resonances_that_are_told() {
    let bands = [
        (275.0, 14.0, 1.0),
        (460.0, 20.0, 0.8),
        (545.0, 20.0, 1.0),
        (2500.0, 2.0, 0.8),
    ];
    let compiled = pedal("let f = violin_body(signal) sound out = f");
    responds(&compiled, "f", 0.5, 2e-4, |f_hz| {
        let of = |(corner_hz, q, share)| {
            let band = Cookbook::of("band", corner_hz, q);
            band.response(f_hz).scale(share)
        };
        let parts = bands.into_iter().map(of);
        parts.fold(Complex(0.2, 0.0), Complex::add)
    });
}

/// What is left long after a sound stands still; what moves of it no converter has.
#[test]
fn filters_fall_nearly_silent() {
    let low = |corner: &str| format!("biquad(signal, corner: {corner}, q: 0.7)");
    for (term, name, most_db) in [
        (low("20 Hz"), "f.low", -115.0),
        (low("100 Hz"), "f.low", -125.0),
        (low("1 kHz"), "f.low", -140.0),
        (low("10 kHz"), "f.high", -160.0),
        (low("20 Hz + 10 kHz * turned"), "f.low", -95.0),
        (
            "biquad(signal, corner: 100 Hz, q: 5)".into(),
            "f.low",
            -125.0,
        ),
        (
            "biquad(signal, corner: 1 kHz, q: 20)".into(),
            "f.band",
            -160.0,
        ),
        (
            "equalizer(signal, centre: 100 Hz, gain: 4, q: 1)".into(),
            "f",
            -125.0,
        ),
        ("violin_body(signal)".into(), "f", -145.0),
    ] {
        let text = format!("live param turned = 0 in 0 .. 1 let f = {term} sound out = {name}");
        let signal = burst(0.5, 10.0);
        let (_, [heard]) = played(&pedal(&text), EngineKind::Jit, &signal, [name]);
        let last = &heard[heard.len() - RATE_HZ as usize..];
        let high = last.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = last.iter().copied().fold(f64::INFINITY, f64::min);
        let (left_db, moves_db) = (db(high.abs().max(low.abs())), db(high - low));
        println!("{term}: {left_db:.1} dB, of which {moves_db:.1} dB moves");
        assert!(left_db < most_db && moves_db < -140.0, "{term}");
    }
}

/// Driven far beyond the room that its states have, a filter saturates, and is itself again.
#[test]
fn a_filter_that_is_driven_too_far_saturates_and_recovers() {
    let compiled = pedal(
        "let f = biquad(16 * (signal - 0.5), corner: 1 kHz, q: 20)
         let g = biquad(signal, corner: 1 kHz, q: 20)
         sound out = f.low + g.low",
    );
    let tone = |n: usize| 0.5 + 0.5 * (std::f64::consts::TAU * 1000.0 * n as f64 / RATE_HZ).sin();
    let mut signal: Vec<f64> = (0..8820).map(tone).collect();
    signal.extend([0.5; 44_100]);
    let names = ["f.held", "f.drift", "f.low"];
    let (_, [held, drift, low]) = played(&compiled, EngineKind::Jit, &signal, names);
    for value in held.iter().chain(&drift) {
        assert!(value.abs() <= 8.0 + 1e-6, "{value}");
    }
    let loud = low.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let late = low[30_000..]
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    println!("{loud} {late}");
    assert!(loud > 7.0 && late < 1e-3, "{loud}, then {late}");
}
