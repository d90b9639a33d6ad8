//! What is told of ringing against the closed loop of the Kernel: what rings does so with the
//! frequency that is told, what is advised ends it, and what is called stable does not grow.

use std::fmt::Write;

use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::diag::{Code, Diagnostic};
use whippen_compiler::front::compile_front;
use whippen_compiler::model::Model;
use whippen_compiler::source::SourceMap;
use whippen_compiler::stability::{self, Hand, Oscillation, Seen};
use whippen_runtime::closed;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::plant::Player;
use whippen_runtime::ringing::{self, Bench};

use crate::cli::Shell;
use crate::common;

/// Ticks per second.
const RATE_HZ: f64 = 44_100.0;

fn program(window: &str, forces: &str) -> String {
    format!(
        "instrument probe {{\n    sense x: length in -0.5 mm .. 10.5 mm over {window}\n    {forces}\n}}\n"
    )
}

/// The instruments of a text; none where it is not whole.
fn models(text: &str) -> Vec<Model> {
    let mut map = SourceMap::default();
    map.add("probe.whip", text);
    let (program, _) = compile_front(&mut map, &Options::default());
    program.map_or_else(Vec::new, |p| p.instruments)
}

fn told(text: &str) -> Vec<Diagnostic> {
    let of = |model: &Model| ringing::warnings(model, &Device::of(model));
    models(text).iter().flat_map(of).collect()
}

fn codes(text: &str) -> Vec<&'static str> {
    told(text).iter().map(|d| d.code.number()).collect()
}

/// What is seen to ring.
fn seen(text: &str) -> Vec<Oscillation> {
    let (model, mut found) = (models(text).remove(0), Vec::new());
    let device = Device::of(&model);
    let stability = stability::analyze(
        &model,
        &device.port().key(44_100.into()).expect("mechanics"),
    )
    .expect("bounded");
    let mut bench = Bench::new(&model, &device);
    let all = stability::warnings(&model, &stability, &mut |trial| {
        let seen = bench.see(trial);
        if let Seen::Rings(o) = seen {
            found.push(o);
        }
        seen
    });
    let rings = all.iter().filter(|d| d.code == Code::Unstable).count();
    assert_eq!(rings, found.len());
    found
}

/// The same loop through the Kernel and the runs of the command, with a finger's steady force, or a
/// hand that wants the key deeper by so much: where the key is in the second half.
fn run(text: &str, o: &Oscillation) -> Vec<f64> {
    let compiled = common::compiled("probe.whip", text, &[]).remove(0);
    let device = Device::of(&compiled.model);
    // Who leads the key ends before its end.
    let left = if o.speed > 0.0 {
        9.5e-3 - o.x
    } else {
        o.x - 0.5e-3
    };
    let seconds = if o.speed == 0.0 {
        1.6
    } else {
        left / o.speed.abs()
    };
    let ticks = (seconds * RATE_HZ) as usize;
    // The push, over a few ticks.
    let mass = device.port().key(44_100.into()).expect("mechanics").mass + o.hand.mass;
    let push = |tick: usize| {
        let struck = if tick < 4 { RATE_HZ / 4.0 } else { 0.0 };
        mass * o.push * struck
    };
    let player = if o.hand.stiffness > 0.0 {
        let at = |tick: usize| {
            o.x + (o.force + push(tick)) / o.hand.stiffness + o.speed * tick as f64 / RATE_HZ
        };
        Player::Hand {
            hand: o.hand,
            target: (0..ticks).map(at).collect::<Vec<_>>().into(),
        }
    } else {
        assert_eq!(o.hand, Hand::FREE);
        let force = (0..ticks).map(|tick| o.force + push(tick));
        Player::Force(force.collect::<Vec<_>>().into())
    };
    let closed = closed::run(
        &compiled,
        &device,
        EngineKind::Jit,
        (player, o.x),
        ticks,
        |_| (),
    );
    let closed = closed.expect("it runs");
    let led = |(tick, x): (usize, &f64)| x - o.speed * tick as f64 / RATE_HZ;
    let positions = closed.positions().iter().enumerate().map(led);
    positions.skip(ticks / 2).collect()
}

/// Frequency (Hz) by the largest line of a plain Fourier sum, and half of the way between the ends.
fn measured(positions: &[f64]) -> (f64, f64) {
    let mean = positions.iter().sum::<f64>() / positions.len() as f64;
    let line = |hz: f64| {
        let turn = std::f64::consts::TAU * hz / RATE_HZ;
        let n = positions.len() as f64;
        let (mut re, mut im) = (0.0, 0.0);
        for (i, x) in positions.iter().enumerate().step_by(4) {
            let window = 1.0 - (std::f64::consts::TAU * i as f64 / n).cos();
            let (sin, cos) = (turn * i as f64).sin_cos();
            re += (x - mean) * window * cos;
            im += (x - mean) * window * sin;
        }
        re.hypot(im)
    };
    let lines = (0..900).map(|i| 4.0 * 1.007_f64.powi(i));
    let best = lines.max_by(|a, b| line(*a).total_cmp(&line(*b)));
    let high = positions.iter().fold(f64::MIN, |a, x| a.max(*x));
    let low = positions.iter().fold(f64::MAX, |a, x| a.min(*x));
    (best.expect("some"), 0.5 * (high - low))
}

const STIFF_WALL: &str = "force wall = wall(x, from: 5 mm, k: 4 kN/m, B: 0 N*s/m).push";
const LATE_WALL: &str = "force wall = wall(x, from: 4 mm, k: 20 kN/m, B: 1 N*s/m).push";
const NEGATIVE: &str = "force spring = 300 N/m * (x - 3 mm) force brake = -2 N*s/m * x'";
const LIGHT: &str = "force weight = -0.2 kg * x''";
/// Friction that falls with speed, by hand, through a steep middle.
const STEEP: &str = "let pace = clamp(x' / 20 mm/s, -10, 10)\n    let side = clamp(x' / 2 mm/s, -1, 1)\n    \
                     force brake = side * (0.3 N + 1 N / (1 + pace^2))";

#[test]
fn what_rings_does_so_with_the_frequency_that_is_told() {
    for (window, forces) in [
        ("1 ms", STIFF_WALL),
        ("3 ms", LATE_WALL),
        ("1 ms", NEGATIVE),
        ("1 ms", LIGHT),
        ("1 ms", STEEP),
    ] {
        let text = program(window, forces);
        let found = seen(&text);
        assert!(!found.is_empty(), "{forces}: {:#?}", told(&text));
        for o in found {
            let (hz, amplitude) = measured(&run(&text, &o));
            println!(
                "{forces}: told {:.1} Hz by {:.3e} m, measured {hz:.1} Hz by {amplitude:.3e} m",
                o.hz, o.amplitude
            );
            assert!(
                (hz / o.hz - 1.0).abs() < 0.05,
                "{forces}: {hz} Hz, told {o:?}"
            );
            assert!(
                (amplitude - o.amplitude).abs() < 0.1 * o.amplitude + 2e-6,
                "{forces}: {amplitude} m, told {o:?}"
            );
        }
    }
}

/// The pole of the linear loop as it is, not at its border, is what a key without dry friction
/// does.
#[test]
fn the_pole_is_that_of_the_program_and_not_of_its_border() {
    let mut device = Device::mikey();
    let mechanics = device.ports[0]
        .mechanics
        .as_mut()
        .expect("mikey says how its key moves");
    (mechanics.stops, mechanics.friction) = (None, 0.0);
    for stiffness in [4e3, 10e3, 30e3] {
        let text = program(
            "1 ms",
            &format!("force spring = {stiffness} N/m * (x - 5 mm)"),
        );
        let compiled = common::compiled("probe.whip", &text, &[]).remove(0);
        let key = device.port().key(44_100.into()).expect("mechanics");
        let found = stability::analyze(&compiled.model, &key).expect("bounded");
        let worst = found.modes[0].worst;
        assert_eq!(worst.hand, Hand::FREE);
        // Let go 2 um away, it grows by e two times and more before it meets a limit.
        let ticks = (3.0 / worst.growth_per_s * RATE_HZ) as usize;
        let from = (Player::nobody(), 5.005e-3);
        let closed = closed::run(&compiled, &device, EngineKind::Jit, from, ticks, |_| ());
        let closed = closed.expect("it runs");
        let positions = closed.positions();
        let crossings: Vec<usize> = (1..ticks)
            .filter(|i| positions[i - 1] < 5e-3 && positions[*i] >= 5e-3)
            .collect();
        let (first, last) = (crossings[1], crossings[crossings.len() - 1]);
        let hz = (crossings.len() - 2) as f64 / (last - first) as f64 * RATE_HZ;
        assert!(
            (hz / worst.ring_hz - 1.0).abs() < 0.01,
            "{stiffness}: {hz} Hz, {worst:?}"
        );
        // As stiff a spring swings with the root of its stiffness over the mass.
        let plain = (stiffness / key.mass).sqrt() / std::f64::consts::TAU;
        assert!(
            (worst.ring_hz / plain - 1.0).abs() < 0.02,
            "{plain} {worst:?}"
        );
        let half = |from: usize, to: usize| {
            positions[from..to]
                .iter()
                .fold(0.0_f64, |a, x| a.max((x - 5e-3).abs()))
        };
        let period = (RATE_HZ / hz) as usize + 1;
        let grown = (half(ticks - period, ticks) / half(period, 2 * period)).ln();
        let seconds = (ticks - 2 * period) as f64 / RATE_HZ;
        assert!(
            (grown / seconds / worst.growth_per_s - 1.0).abs() < 0.15,
            "{grown} in {seconds} s, {worst:?}"
        );
    }
}

/// A program by one of its values, with more of a text.
type Text<'t> = dyn Fn(f64, &str) -> String + 't;

/// The number of a hint that begins so.
fn advised(found: &[Diagnostic], begins: &str) -> Option<f64> {
    let hints = found.iter().flat_map(|d| &d.hints);
    let mut rest = hints.filter_map(|hint| hint.strip_prefix(begins));
    rest.next()?.split([' ', '`']).next()?.parse().ok()
}

#[test]
fn what_is_advised_ends_it_and_slightly_less_does_not() {
    let spring = |k: f64, more: &str| {
        program(
            "1 ms",
            &format!("force spring = {k:.4} N/m * (x - 5 mm) {more}"),
        )
    };
    let brake =
        |b: f64, more: &str| program("1 ms", &format!("force brake = {b:.5} N*s/m * x' {more}"));
    let wall = |k: f64, more: &str| {
        program(
            "1 ms",
            &format!("force wall = wall(x, from: 5 mm, k: {k:.4} N/m, B: 0.3 N*s/m).push {more}"),
        )
    };
    let cases: [(&Text, f64); 5] = [
        (&spring, 4e3),
        (&spring, 9e3),
        (&brake, -4.0),
        (&wall, 8e3),
        (&wall, 20e3),
    ];
    for (text, value) in cases {
        let found = told(&text(value, ""));
        assert!(!found.is_empty(), "{value}");
        let most = advised(&found, "up to ").expect("a value that passes");
        assert!(told(&text(most, "")).is_empty(), "{value}: {most}");
        assert!(!told(&text(1.02 * most, "")).is_empty(), "{value}: {most}");
        let damping = advised(&found, "or add damping: `").expect("damping helps");
        let with = |b: f64| text(value, &format!("force more = {b:.6} N*s/m * x'"));
        assert!(
            told(&with(damping)).is_empty(),
            "{value}: {damping} {:#?}",
            told(&with(damping))
        );
        assert!(
            !told(&with(0.98 * damping)).is_empty(),
            "{value}: {damping}"
        );
    }
    let found = told(&program("1 ms", LIGHT));
    assert!(advised(&found, "or add damping: `").is_none());
    let hints = &found[0].hints;
    assert!(
        hints.iter().any(|h| h.starts_with("no damping added")),
        "{hints:?}"
    );
}

/// A shorter window is advised where a speed or an acceleration comes late, and nowhere else.
#[test]
fn a_shorter_window_is_advised_only_where_it_helps() {
    let window = |text: &str| advised(&told(text), "or let `x` be sensed over ");
    assert_eq!(
        window(&program("8 ms", "force spring = 9 kN/m * (x - 5 mm)")),
        None
    );
    let late = |ms: f64| program(&format!("{ms} ms"), "force brake = 60 N*s/m * x'");
    let shorter = window(&late(4.0)).unwrap_or_else(|| panic!("{:#?}", told(&late(4.0))));
    assert!((shorter - 2.0).abs() < 0.1, "{shorter}");
    assert!(told(&late(shorter)).is_empty());
}

#[test]
fn friction_is_told_as_what_it_is() {
    // What sticks is stiff, but nothing is seen to ring, and it is not said to.
    for forces in [
        "force f = stribeck(x, stick: 0.4 N, slip: 0.1 N, fades: 20 mm/s, give: 0.1 mm).drag",
        "force f = coulomb(x, level: 0.3 N, give: 0.1 mm).drag",
        "force f = if x > 6 mm then 2.2 kN/m * (x - 6 mm) else if x < 4 mm then 2.2 kN/m * (x - 4 mm) else 0 N",
    ] {
        assert_eq!(codes(&program("1 ms", forces)), ["WH0704"], "{forces}");
    }
    let found = told(&program("1 ms", "force brake = -5 N*s/m * x'"));
    assert!(found[0].label.contains("it falls with speed"), "{found:#?}");
    assert!(
        codes(&program(
            "1 ms",
            "force f = coulomb(x, level: 0.1 N, give: 0.2 mm).drag"
        ))
        .is_empty()
    );
}

/// Numbers below `n`, always the same.
fn next(seed: &mut u64, n: u64) -> u64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) % n
}

fn random_forces(seed: &mut u64) -> String {
    let mut text = String::new();
    for name in ["a", "b"].iter().take(1 + next(seed, 2) as usize) {
        let k = 200.0 * 1.5_f64.powi(next(seed, 12) as i32);
        let b = 0.2 * 1.6_f64.powi(next(seed, 9) as i32);
        let term = match next(seed, 6) {
            0 => format!("{k:.1} N/m * (x - 5 mm)"),
            1 => format!(
                "wall(x, from: 4 mm, k: {k:.1} N/m, B: {:.3} N*s/m).push",
                0.2 * b
            ),
            2 => format!("{b:.3} N*s/m * x'"),
            3 => format!("-{:.3} N*s/m * x'", 0.3 * b),
            4 => format!("{:.4} kg * x''", 0.01 * b - 0.03),
            _ => format!("coulomb(x, level: {:.3} N, give: 0.2 mm).drag", 1e-4 * k),
        };
        let _ = write!(text, "force {name} = {term}\n    ");
    }
    text
}

/// Whatever is called ringing is seen in the runs of the Kernel, and whatever is called stable does
/// not grow in them.
#[test]
fn random_programs_do_what_is_told_of_them() {
    let (mut seed, mut counts) = (7, [0; 3]);
    for _ in 0..24 {
        let text = program("1 ms", &random_forces(&mut seed));
        let found = codes(&text);
        if found.contains(&"WH0702") {
            counts[0] += 1;
            for o in seen(&text) {
                if o.hand != Hand::FREE && o.hand.stiffness == 0.0 || o.speed != 0.0 {
                    continue;
                }
                let (hz, amplitude) = measured(&run(&text, &o));
                assert!(
                    amplitude > 0.3 * o.amplitude,
                    "{text}: {hz} Hz by {amplitude} m, told {o:?}"
                );
            }
        } else if found.is_empty() {
            counts[1] += 1;
            for hand in [
                Hand {
                    mass: 0.05,
                    damping: 1.0,
                    stiffness: 2000.0,
                },
                Hand {
                    mass: 0.2,
                    damping: 3.0,
                    stiffness: 700.0,
                },
            ] {
                let still = Oscillation {
                    place: 0,
                    hz: 0.0,
                    amplitude: 0.0,
                    grows: false,
                    x: 5e-3,
                    push: 0.1,
                    speed: 0.0,
                    force: 0.0,
                    hand,
                };
                let positions = run(&text, &still);
                let (early, late) = positions.split_at(positions.len() / 2);
                let (early, late) = (measured(early).1, measured(late).1);
                assert!(late <= early + 1e-6, "{text}: {early} m, {late} m");
            }
        } else {
            counts[2] += 1;
        }
    }
    println!(
        "{} ring, {} are stable, {} are not proven",
        counts[0], counts[1], counts[2]
    );
    assert!(counts[0] >= 4 && counts[1] >= 4, "{counts:?}");
}

/// What is said of every bundled instrument, and of every one on the pages for readers.
#[test]
fn what_is_told_of_bundled_programs() {
    let read = |path: &str| {
        let path = format!("{}/{path}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
    };
    let mut texts: Vec<String> = INSTRUMENTS
        .iter()
        .map(|(file, _)| read(&format!("instruments/{file}")))
        .collect();
    for page in ["docs/std.md", "docs/tutorial.md"] {
        let text = read(page);
        let blocks = text
            .split("```whip\n")
            .skip(1)
            .filter_map(|b| b.split("```").next());
        texts.extend(blocks.map(str::to_string));
    }
    let mut all = String::new();
    let all_models = texts.iter().flat_map(|text| models(text));
    for model in all_models.filter(Model::is_of_key) {
        let found = ringing::warnings(&model, &Device::of(&model));
        let _ = writeln!(
            all,
            "{}: {}",
            model.name,
            if found.is_empty() { "stable" } else { "" }
        );
        for d in found {
            let _ = writeln!(all, "  {} {}; {}", d.code.number(), d.message, d.label);
            d.hints
                .iter()
                .for_each(|hint| all += &format!("    {hint}\n"));
        }
    }
    insta::assert_snapshot!(all);
}

#[test]
fn the_pages_show_their_mistakes_and_mend_them() {
    for code in [Code::Unstable, Code::NotProvenStable] {
        for (wrong, text) in code.examples() {
            let expected = if wrong { vec![code.number()] } else { vec![] };
            assert_eq!(codes(text), expected, "{text}");
        }
    }
}

/// Programs can tell the two levels apart, and neither fails a check.
#[test]
fn json_has_the_code_and_the_severity_of_both_levels() {
    let shell = Shell::new()
        .with("wall.whip", &program("1 ms", STIFF_WALL))
        .with(
            "dry.whip",
            &program(
                "1 ms",
                "force f = coulomb(x, level: 0.3 N, give: 0.1 mm).drag",
            ),
        );
    for (file, words) in [
        ("wall.whip", ["WH0702", "warning"]),
        ("dry.whip", ["WH0704", "note"]),
    ] {
        let (out, _) = shell.ends(0, &["check", file, "--json"]);
        assert!(words.iter().all(|w| out.contains(w)), "{out}");
    }
}
