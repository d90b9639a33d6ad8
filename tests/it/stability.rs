//! The stability budget against the plant: what it says rings rings, what it says is stable does
//! not, in the real loop of Kernel, converters, delays and coil.

use std::path::Path;

use whippen_compiler::pipeline::Compiled;
use whippen_compiler::stability::{Borders, Hand, Resonance, analyze, hands};
use whippen_runtime::closed;
use whippen_runtime::device::{Device, Winding};
use whippen_runtime::engine::EngineKind;
use whippen_runtime::plant::Player;
use whippen_runtime::plot::{Curve, Map};

use crate::common;
use crate::pictures::compare_picture;

/// Ticks per second.
const RATE_HZ: f64 = 44_100.0;
/// The window of `over 1 ms`.
const WINDOW: u32 = 45;
/// Where the key is held, and how far from there it is let go (m).
const MIDDLE_M: f64 = 5e-3;
const AWAY_M: f64 = 0.05e-3;

/// `mikey` without stops, and without dry friction: that ends small swings by itself, and the
/// border is one of linear loops.
fn device(friction: bool) -> Device {
    let mut device = Device::mikey();
    let mechanics = device.ports[0]
        .mechanics
        .as_mut()
        .expect("mikey says how its key moves");
    mechanics.stops = None;
    if !friction {
        mechanics.friction = 0.0;
    }
    device
}

fn borders(device: &Device) -> Borders {
    Borders::new(
        &device.port().key(44_100.into()).expect("mechanics"),
        RATE_HZ,
        WINDOW,
    )
}

fn spring(stiffness: f64, damping: f64) -> Compiled {
    let text = format!(
        "instrument probe {{\n    sense x: length in -0.5 mm .. 10.5 mm over 1 ms\n    force spring = {stiffness:.6} N/m * (x - 5 mm)\n    \
         force damper = {damping:.6} N*s/m * x'\n}}\n"
    );
    common::compiled("probe.whip", &text, &[]).remove(0)
}

/// How much larger the swing is at the end than in the beginning.
fn growth(compiled: &Compiled, device: &Device, hand: &Hand, seconds: f64) -> f64 {
    let ticks = (seconds * RATE_HZ) as usize;
    let player = if *hand == Hand::FREE {
        Player::nobody()
    } else {
        Player::Hand {
            hand: *hand,
            target: vec![MIDDLE_M].into(),
        }
    };
    let closed = closed::run(
        compiled,
        device,
        EngineKind::Jit,
        (player, MIDDLE_M + AWAY_M),
        ticks,
        |_| (),
    );
    let closed = closed.unwrap_or_else(|e| panic!("{e}"));
    let speed = |from: f64, to: f64| {
        let part =
            &closed.positions()[(from * ticks as f64) as usize..(to * ticks as f64) as usize];
        part.windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .fold(0.0, f64::max)
    };
    speed(0.7, 1.0) / speed(0.1, 0.4).max(1e-15)
}

#[test]
fn no_spring_rings_below_its_border_and_one_does_beyond_in_every_hand() {
    let device = device(false);
    let borders = borders(&device);
    let (mut below, mut bordered, mut beyond) = (0, 0, 0);
    for (number, hand) in hands(false).iter().enumerate() {
        let damping = [0.0, 1.0, 3.0][number % 3];
        let border = borders.stable(hand, damping);
        assert!(border > 100.0, "{hand:?} {damping}: {border}");
        let quiet = growth(&spring(0.9 * border, damping), &device, hand, 1.2);
        assert!(
            quiet < 1.0,
            "{hand:?}, {damping} N*s/m: {quiet} at 0.9 of {border} N/m"
        );
        below += 1;
        // The stiffest that is looked for is no border.
        if border < 99e3 {
            let loud = growth(&spring(1.2 * border, damping), &device, hand, 1.2);
            (bordered, beyond) = (bordered + 1, beyond + usize::from(loud > 1.0));
        }
    }
    println!("{below} hands quiet at 0.9 of the border; {beyond} of {bordered} ring at 1.2");
    assert_eq!(below, 49);
    assert!(
        bordered > 30 && beyond * 10 >= bordered * 9,
        "nearly every border is one, not only the least of them"
    );
}

#[test]
fn what_is_passive_is_stable_and_keeps_what_it_gets() {
    let device = device(false);
    let borders = borders(&device);
    let passive = borders.passive(0.0).expect("a spring can be passive");
    assert!(borders.passive(5.0).is_none());
    for hand in hands(false).iter().step_by(4) {
        assert!(passive < borders.stable(hand, 0.0), "{hand:?}");
        let compiled = spring(passive, 0.0);
        let ratio = growth(&compiled, &device, hand, 0.6);
        assert!(ratio < 1.0, "{hand:?}: {ratio}");
    }
    // A hand that shakes the key at 8 Hz puts more in than it gets back, beyond what the spring
    // held when it was let go.
    let target: Vec<f64> = (0..88_200)
        .map(|i| MIDDLE_M + 3e-3 * (50.0 * f64::from(i) / RATE_HZ).sin())
        .collect();
    let player = Player::Hand {
        hand: Hand {
            mass: 0.05,
            damping: 1.0,
            stiffness: 2000.0,
        },
        target: target.into(),
    };
    let closed = closed::run(
        &spring(passive, 0.0),
        &device,
        EngineKind::Jit,
        (player, MIDDLE_M),
        88_200,
        |_| (),
    );
    let strokes = closed.expect("it runs").loops.remove(0).strokes;
    assert!(
        strokes.count > 0 && strokes.first.iter().all(|s| s.energy.kept_j() > 0.0),
        "{strokes:?}"
    );
}

/// Whole programs: the analysis of the Model finds the border that the map draws, and the wall of
/// the library has the same.
#[test]
fn the_analysis_of_a_program_agrees_with_the_map() {
    let device = device(true);
    let key = device.port().key(44_100.into()).expect("mechanics");
    let borders = borders(&device);
    let least = |damping: f64| {
        hands(false)
            .iter()
            .map(|h| borders.stable(h, damping))
            .fold(f64::INFINITY, f64::min)
    };
    for damping in [0.0, 2.0] {
        let border = least(damping);
        for (part, stable) in [(0.97, true), (1.03, false)] {
            let k = part * border;
            let wall = format!(
                "instrument wall {{\n    sense x: length in -0.5 mm .. 10.5 mm over 1 ms\n    \
                 force wall = wall(x, from: 4 mm, k: {k:.6} N/m, B: {damping:.6} N*s/m).push\n}}\n"
            );
            for compiled in [
                spring(k, damping),
                common::compiled("wall.whip", &wall, &[]).remove(0),
            ] {
                let found = analyze(&compiled.model, &key).expect("bounded");
                assert_eq!(
                    found.is_stable(),
                    stable,
                    "{} {damping}: {part} of {border}",
                    compiled.model.name
                );
                assert!((found.largest[0].high / k - 1.0).abs() < 1e-6 && found.undecided == 0);
            }
        }
    }
}

/// Amplifier, winding and first mode are in the margin as they are in the loop: what the analysis
/// calls the border is where the simulated key begins to ring.
#[test]
fn stages_of_a_drive_are_in_the_margin() {
    let plain = borders(&device(false)).stable(&Hand::FREE, 2.0);
    let winding = Winding {
        resistance_ohm: 8.0,
        inductance_h: 1e-3,
    };
    let ring = Resonance {
        hz: 3000.0,
        damping: 0.05,
    };
    let stages = [
        (Some(winding), None),
        (None, Some(ring)),
        (Some(winding), Some(ring)),
    ];
    for (winding, mode) in stages {
        let mut device = device(false);
        let drive = device.ports[0].drive.as_mut().expect("driven");
        (drive.winding, drive.mode, drive.bandwidth_hz) = (winding, mode, None);
        let border = borders(&device).stable(&Hand::FREE, 2.0);
        let found = simulated(&device, &Hand::FREE, 2.0, border);
        assert!(
            (found / border - 1.0).abs() < 0.03,
            "{winding:?} {mode:?}: {found} {border}"
        );
        assert!(border != plain);
    }
}

/// A body that moves along is part of the loop: the two-body action has no loss, so its spring is
/// too much for a free key; with losses it is not.
#[test]
fn a_hammer_in_contact_is_part_of_the_loop() {
    let device = device(false);
    let key = device.port().key(44_100.into()).expect("mechanics");
    let hammer = |loss: f64| {
        let text = format!(
            "instrument action {{\n    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms\n    let squeeze = x - phi * 20 mm\n    \
             body hammer {{\n        angle phi in -2 rad .. 2 rad = 0.25 rad, rate in -80 rad/s .. 80 rad/s\n        inertia 1.5e-4 kg*m^2\n        \
             torque 20 mm * (4000 N/m * squeeze + {loss:.3} N*s/m * squeeze')\n    }}\n    \
             force contact = 4000 N/m * squeeze + {loss:.3} N*s/m * squeeze'\n}}\n"
        );
        common::compiled("action.whip", &text, &[]).remove(0)
    };
    for loss in [0.0, 20.0] {
        let compiled = hammer(loss);
        let found = analyze(&compiled.model, &key).expect("bounded");
        assert_eq!(found.modes[0].coupled, 2);
        let ratio = growth(&compiled, &device, &Hand::FREE, 1.0);
        assert_eq!(
            found.is_stable(),
            ratio < 1.0,
            "loss {loss}: {ratio}, factor {}",
            found.factor()
        );
        assert_eq!(found.is_stable(), loss > 0.0);
    }
}

/// Every verdict on a bundled instrument of a key, so that a change of any is seen.
#[test]
fn verdicts_on_the_bundled_instruments() {
    let mut told = String::new();
    for compiled in common::of_keys() {
        let device = Device::of(&compiled.model);
        let found = analyze(
            &compiled.model,
            &device.port().key(44_100.into()).expect("mechanics"),
        )
        .expect("bounded");
        told += &format!(
            "{}: {} modes, {}, factor {:.2} at {:.0} Hz, passive with {:.3}\n",
            compiled.model.name,
            found.modes.len(),
            match (found.is_stable(), found.undecided > 0) {
                (true, _) => "stable",
                (false, true) => "not decided",
                (false, false) => "rings",
            },
            found.factor(),
            found.modes.first().map_or(0.0, |mode| mode.worst.ring_hz),
            found.damping_needed()
        );
    }
    insta::assert_snapshot!(told);
}

/// The largest stiffness that does not ring in a simulated loop, by halving.
fn simulated(device: &Device, hand: &Hand, damping: f64, guess: f64) -> f64 {
    let (mut low, mut high) = (0.7 * guess, 1.4 * guess);
    for _ in 0..5 {
        let middle = 0.5 * (low + high);
        if growth(&spring(middle, damping), device, hand, 0.8) > 1.0 {
            high = middle
        } else {
            low = middle
        }
    }
    0.5 * (low + high)
}

#[test]
fn the_map_of_borders_is_as_pictured() {
    let device = device(false);
    let borders = borders(&device);
    let shown = [
        ("nobody, least of all 49", Hand::FREE),
        (
            "0.05 kg, 1 N·s/m",
            Hand {
                mass: 0.05,
                damping: 1.0,
                stiffness: 0.0,
            },
        ),
        (
            "0.2 kg, 3 N·s/m, 700 N/m",
            Hand {
                mass: 0.2,
                damping: 3.0,
                stiffness: 700.0,
            },
        ),
    ];
    let steps = (0..=64).map(|i| f64::from(i) / 8.0);
    let mut curves: Vec<Curve> = Vec::new();
    for (name, hand) in &shown {
        let points = steps
            .clone()
            .map(|b| (b, borders.stable(hand, b) / 1e3))
            .collect();
        curves.push(Curve {
            name: (*name).to_string(),
            points,
            dots: false,
        });
    }
    for b in [0.0, 1.0, 4.0, 8.0] {
        assert!(
            hands(false)
                .iter()
                .all(|hand| borders.stable(hand, b) >= borders.stable(&Hand::FREE, b)),
            "{b} N*s/m"
        );
    }
    let fine = (0..=100).map(|i| f64::from(i) / 200.0);
    let points: Vec<(f64, f64)> = fine
        .filter_map(|b| Some((b, borders.passive(b)? / 1e3)))
        .collect();
    curves.push(Curve {
        name: "passive below".to_string(),
        points,
        dots: false,
    });
    let mut dots = Vec::new();
    for (_, hand) in &shown[..2] {
        for damping in [0.0, 2.0, 4.0, 6.0] {
            let border = borders.stable(hand, damping);
            let found = simulated(&device, hand, damping, border);
            assert!(
                (found / border - 1.0).abs() < 0.1,
                "{hand:?} {damping}: {found} {border}"
            );
            dots.push((damping, found / 1e3));
        }
    }
    curves.push(Curve {
        name: "simulated".to_string(),
        points: dots,
        dots: true,
    });
    let map = Map {
        title: "how stiff a virtual spring may be on mikey (x' over 1 ms)".to_string(),
        abscissa: "damping (N·s/m)".to_string(),
        ordinate: "virtual stiffness (kN/m)".to_string(),
        starts: (0.0, 0.0),
        ends: (8.0, 60.0),
        curves,
    };
    if let Some(path) = std::env::var_os("WHIPPEN_MAP") {
        std::fs::write(path, map.png().expect("it fits")).expect("writable");
    }
    compare_picture("docs/pictures/stability.svg", &map.svg());
}

/// Its four parameters per key and the live one are taken in all combinations.
#[test]
fn a_register_is_stable() {
    let register = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/register/grand-88.whip");
    let args = [
        "check",
        &register.display().to_string(),
        &crate::cli::bundled("grand-piano.whip"),
    ];
    let (_, told) = crate::cli::Shell::new().ends(0, &args);
    assert!(
        !told.contains("WH0704") && !told.contains("WH0702"),
        "{told}"
    );
}
