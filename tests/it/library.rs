//! The standard library's springs, walls, felts, frictions and detents: each term beside its
//! formula in f64, and what it promises.

use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;

use crate::common::{self, RATE_HZ};
use crate::player::Player;

const ENGINES: [EngineKind; 2] = [EngineKind::Jit, EngineKind::Interp];

/// One word of the sensor (m).
const WORD_M: f64 = 11e-3 / 65_535.0;

/// An instrument whose only force is this, beside `v`, the speed of the key.
fn felt(force: &str) -> Compiled {
    let text = format!(
        "instrument library {{
            sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
            let v = x'
            {force}
        }}"
    );
    common::compiled("library.whip", &text, &[]).remove(0)
}

/// What a tick showed: position and speed as the instrument has them, and its force.
#[derive(Debug, Clone, Copy)]
struct Tick {
    x_m: f64,
    v_m_per_s: f64,
    force_n: f64,
}

/// Moves the key along positions and gives every tick to `each`.
fn moved(player: &mut Player, positions_m: &[f64], mut each: impl FnMut(Tick)) {
    let (x, v, force) = (player.index("x"), player.index("v"), player.index("force"));
    for &position_m in positions_m {
        player.tick(position_m);
        let at = |index| player.value_at(index);
        each(Tick {
            x_m: at(x),
            v_m_per_s: at(v),
            force_n: at(force),
        });
    }
}

/// Random strokes: rests, crawls and jumps between random depths, smooth enough to have a speed.
fn strokes(seed: u64) -> Vec<f64> {
    let mut random = Rng::new(seed);
    let mut number = move || random.next() as u32 as f64 / f64::from(u32::MAX);
    let mut gesture = whippen_runtime::gesture::Gesture::new();
    for _ in 0..40 {
        gesture = gesture
            .to(0.010 * number(), 0.003 * 100f64.powf(number()))
            .hold(0.01 * number());
    }
    gesture.positions(RATE_HZ)
}

/// A term that is a formula of position and speed agrees with it in every tick within
/// `tolerance_n`.
fn agrees(force: &str, tolerance_n: f64, formula: impl Fn(f64, f64) -> f64) {
    let compiled = felt(force);
    for kind in ENGINES {
        let (mut ticks, mut most_n) = (0, 0.0f64);
        moved(&mut Player::new(&compiled, kind), &strokes(0x51), |t| {
            let expected_n = formula(t.x_m, t.v_m_per_s);
            let off_n = (t.force_n - expected_n).abs();
            assert!(
                off_n <= tolerance_n,
                "{kind}: {force}: {t:?}, not {expected_n} N"
            );
            (ticks, most_n) = (ticks + 1, most_n.max(t.force_n.abs()));
        });
        assert!(
            ticks > 10_000 && most_n > 100.0 * tolerance_n,
            "{force}: {ticks} ticks up to {most_n} N"
        );
    }
}

#[test]
fn a_spring_is_k_times_x() {
    agrees(
        "force f = spring(x, k: 75 N/m, rest: 2 mm).push",
        1e-6,
        |x, _| 75.0 * (x - 2e-3),
    );
}

#[test]
fn a_damper_is_b_times_v() {
    agrees("force f = damper(x, B: 2 N*s/m).drag", 1e-5, |_, v| 2.0 * v);
}

fn wall(x_m: f64, v: f64) -> f64 {
    if x_m > 7e-3 {
        (5e3 * (x_m - 7e-3) + 20.0 * v).max(0.0)
    } else {
        0.0
    }
}

#[test]
fn a_wall_is_a_spring_and_a_damper_beyond_a_point() {
    agrees(
        "force f = wall(x, from: 7 mm, k: 5 kN/m, B: 20 N*s/m).push",
        1e-4,
        wall,
    );
}

#[test]
fn a_wall_never_pulls_and_knows_when_it_is_touched() {
    let compiled = felt("let w = wall(x, from: 7 mm, k: 5 kN/m, B: 200 N*s/m) force f = w.push");
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let touching = player.index("w.touching");
        let (mut left_fast, mut inside) = (0, 0);
        for &position_m in &strokes(0x52) {
            player.tick(position_m);
            let (x_m, v, force_n) = (player.value("x"), player.value("v"), player.value("f"));
            assert!(force_n >= 0.0, "{kind}: {force_n} N at {x_m} m, {v} m/s");
            assert_eq!(player.value_at(touching) == 1.0, x_m > 7e-3);
            left_fast += usize::from(x_m > 7e-3 && 5e3 * (x_m - 7e-3) + 200.0 * v < 0.0);
            inside += usize::from(x_m > 7e-3);
        }
        assert!(
            left_fast > 100 && inside > 1000,
            "{left_fast} of {inside} ticks would pull without the clamp"
        );
    }
}

#[test]
fn a_tangent_stays_at_its_strings() {
    agrees(
        "force f = tangent(x, from: 4 mm, k: 860 N/m, B: 0.8 N*s/m).push",
        1e-4,
        |x, v| {
            if x > 4e-3 {
                (860.0 * (x - 4e-3) + 0.8 * v).max(0.0)
            } else {
                0.0
            }
        },
    );
}

#[test]
fn felt_is_a_power_of_its_squeeze() {
    for (p, exponent) in [
        ("1", 1.0),
        ("1.5", 1.5),
        ("2", 2.0),
        ("2.5", 2.5),
        ("3", 3.0),
    ] {
        let force = format!(
            "force f = felt(x, from: 6 mm, depth: 2 mm, height: 4 N, p: {p}, hardens: 0.5 m/s).push"
        );
        agrees(&force, 2e-3, |x, v| {
            let squeeze = (x - 6e-3).max(0.0);
            let rate = if x > 6e-3 { v } else { 0.0 };
            4.0 * (squeeze / 2e-3).powf(exponent) * (1.0 + rate / 0.5).clamp(0.0, 2.0)
        });
    }
}

#[test]
fn felt_takes_energy_and_never_gives_it() {
    let compiled = felt(
        "force f = felt(x, from: 6 mm, depth: 2 mm, height: 4 N, p: 2.5, hardens: 0.5 m/s).push",
    );
    let there_and_back = |s: f64| {
        whippen_runtime::gesture::Gesture::new()
            .hold(0.01)
            .to(0.009, s)
            .to(0.0, s)
            .hold(0.01)
    };
    for kind in ENGINES {
        let lost_j = [1.0, 0.1, 0.03].map(|seconds| {
            let (mut lost_j, mut last_m) = (0.0, 0.0);
            moved(
                &mut Player::new(&compiled, kind),
                &there_and_back(seconds).positions(RATE_HZ),
                |t| {
                    assert!(t.force_n >= 0.0, "{t:?}");
                    lost_j += t.force_n * (t.x_m - last_m);
                    last_m = t.x_m;
                },
            );
            lost_j
        });
        assert!(
            lost_j[0] > 0.0 && lost_j[1] > 5.0 * lost_j[0] && lost_j[2] > 1.5 * lost_j[1],
            "{lost_j:?}"
        );
    }
}

/// Dry friction by its definition: the greatest force that the last turning point allows.
struct Slider {
    foot_m: f64,
    give_m: f64,
}

impl Slider {
    fn bend(&mut self, x_m: f64) -> f64 {
        let stretch_m = (x_m - self.foot_m).clamp(-self.give_m, self.give_m);
        self.foot_m = x_m - stretch_m;
        stretch_m / self.give_m
    }
}

#[test]
fn coulomb_friction_is_bounded_opposes_motion_and_holds_at_rest() {
    let compiled = felt("force f = coulomb(x, level: 0.2 N, give: 0.1 mm).drag");
    for kind in ENGINES {
        let mut slider = Slider {
            foot_m: 0.0,
            give_m: 1e-4,
        };
        let (mut last_m, mut since_turn_m, mut sliding) = (0.0, 0.0f64, 0);
        moved(&mut Player::new(&compiled, kind), &strokes(0x53), |t| {
            let expected_n = 0.2 * slider.bend(t.x_m);
            assert!(
                (t.force_n - expected_n).abs() < 2e-5,
                "{kind}: {t:?}, not {expected_n} N"
            );
            assert!(t.force_n.abs() <= 0.2 + 1e-6);
            let step_m = t.x_m - last_m;
            since_turn_m = if step_m * since_turn_m < 0.0 {
                step_m
            } else {
                since_turn_m + step_m
            };
            if since_turn_m.abs() > 2.01e-4 {
                assert!(
                    (t.force_n - 0.2 * since_turn_m.signum()).abs() < 1e-5,
                    "{kind}: slides at {t:?}"
                );
                sliding += 1;
            }
            last_m = t.x_m;
        });
        assert!(sliding > 5_000, "{sliding} ticks sliding");
    }
}

#[test]
fn friction_does_not_chatter_on_a_key_that_stands_still() {
    let compiled = felt("force f = coulomb(x, level: 0.2 N, give: 0.1 mm).drag");
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let mut seed = Rng::new(7);
        // Down to 5 mm and still, every reading up to a word beside the truth.
        let mut positions_m = whippen_runtime::gesture::Gesture::new()
            .to(0.005, 0.1)
            .positions(RATE_HZ);
        positions_m.extend((0..RATE_HZ).map(|_| 0.005 + WORD_M * ((seed.next() % 3) as f64 - 1.0)));
        let (mut low_n, mut high_n, mut tick) = (f64::INFINITY, f64::NEG_INFINITY, 0);
        moved(&mut player, &positions_m, |t| {
            tick += 1;
            if tick > 5_000 {
                (low_n, high_n) = (low_n.min(t.force_n), high_n.max(t.force_n));
            }
        });
        // Three words of a bristle that is 0.1 mm long: 0.2 N * 3 * 0.168 um / 0.1 mm.
        assert!(
            high_n - low_n < 1.1e-3 && low_n > 0.19,
            "{kind}: {low_n} .. {high_n} N"
        );
    }
}

#[test]
fn stribeck_friction_falls_with_speed_from_stick_to_slip() {
    let compiled =
        felt("force f = stribeck(x, stick: 0.4 N, slip: 0.1 N, fades: 20 mm/s, give: 0.1 mm).drag");
    for kind in ENGINES {
        let mut slider = Slider {
            foot_m: 0.0,
            give_m: 1e-4,
        };
        moved(&mut Player::new(&compiled, kind), &strokes(0x54), |t| {
            let pace = (t.v_m_per_s / 0.02).clamp(-10.0, 10.0);
            let expected_n = (0.1 + 0.3 / (1.0 + pace * pace)) * slider.bend(t.x_m);
            assert!(
                (t.force_n - expected_n).abs() < 1e-4,
                "{kind}: {t:?}, not {expected_n} N"
            );
        });
    }
    // At a steady speed: nearly all at a crawl, half of the way at `fades`, little beyond.
    for (speed_m_per_s, expected_n) in [(0.002, 0.397), (0.02, 0.25), (0.2, 0.103)] {
        let step_m = speed_m_per_s / f64::from(RATE_HZ);
        let positions_m: Vec<f64> = (0..20_000)
            .map(|tick| step_m * f64::from(tick))
            .filter(|x| *x < 0.01)
            .collect();
        let mut last_n = 0.0;
        moved(
            &mut Player::new(&compiled, EngineKind::Jit),
            &positions_m,
            |t| last_n = t.force_n,
        );
        assert!(
            (last_n - expected_n).abs() < 0.01,
            "{speed_m_per_s} m/s: {last_n} N"
        );
    }
}

#[test]
fn detents_pull_to_the_nearest_middle() {
    let compiled = felt("let d = detents(x, pitch: 2 mm, height: 0.5 N) force f = d.pull");
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let (at, moved_to) = (player.index("d.at"), player.index("d.moved"));
        let (mut middle_m, mut changes) = (0.0, 0);
        for &position_m in &strokes(0x55) {
            player.tick(position_m);
            let x_m = player.value("x");
            let u = (x_m - middle_m) / 2e-3;
            let expected_n = 8.0 * 0.5 * u * (1.0 - 2.0 * u.abs());
            // On the borders a tick of the fastest stroke is a few hundredths of a pitch.
            if u.abs() < 0.51 {
                assert!(
                    (player.value("f") - expected_n).abs() < 1e-5,
                    "{kind}: {x_m} m"
                );
            }
            let moves = player.value_at(moved_to) == 1.0;
            assert!(
                moves == (u.abs() > 0.51) || (u.abs() - 0.51).abs() < 1e-5,
                "{kind}: {u} pitches"
            );
            if moves {
                middle_m += 2e-3 * u.signum();
                changes += 1;
            }
            assert!(
                (player.value_at(at) - middle_m).abs() < 1e-8,
                "{kind}: the middle of {x_m} m"
            );
        }
        assert!(changes > 50, "{changes} changes");
    }
}

#[test]
fn a_detent_changes_once_at_a_border_that_trembles() {
    let compiled = felt(
        "let d = detents(x, pitch: 2 mm, height: 0.5 N) event step when d.moved force f = d.pull",
    );
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let mut positions_m = whippen_runtime::gesture::Gesture::new()
            .to(0.001, 0.05)
            .positions(RATE_HZ);
        // Around the border at 1 mm, by half a hundredth of a pitch and as fast as can be.
        positions_m.extend((0..5_000).map(|tick| 0.001 + 1e-5 * f64::from(tick % 3 - 1)));
        positions_m.extend((0..5_000).map(|tick| 0.001 + 1e-7 * f64::from(tick)));
        moved(&mut player, &positions_m, |_| ());
        assert_eq!(player.count("step"), 1, "{kind}: over the border once");
    }
}

#[test]
fn a_knobs_friction_falls_with_its_rate_too() {
    let text = "instrument dial {
        sense angle: angle in -160 deg .. 160 deg over 2 ms
        let rate = angle'
        torque f = rotary_stribeck(angle, stick: 8 mN*m, slip: 2 mN*m, fades: 2 rad/s, give: 1 deg).drag
    }";
    let compiled = common::compiled("dial.whip", text, &[]).remove(0);
    for kind in ENGINES {
        let mut player = Player::new(&compiled, kind);
        let (mut slider, mut fast) = (
            Slider {
                foot_m: 0.0,
                give_m: 1f64.to_radians(),
            },
            0,
        );
        // The strokes of a key, 10 mm for 2.5 rad.
        for position in strokes(0x56) {
            player.tick(250.0 * position);
            let pace = (player.value("rate") / 2.0).clamp(-10.0, 10.0);
            let expected_n_m =
                (2e-3 + 6e-3 / (1.0 + pace * pace)) * slider.bend(player.value("angle"));
            let found_n_m = player.value("f");
            assert!(
                (found_n_m - expected_n_m).abs() < 2e-6,
                "{kind}: {found_n_m} N*m, not {expected_n_m} N*m"
            );
            fast += usize::from(pace.abs() > 1.0);
        }
        assert!(
            fast > 1_000,
            "{fast} ticks beyond the rate at which half is left"
        );
    }
}
