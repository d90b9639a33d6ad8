//! The rules of `docs/language.md`, one by one, on small instruments, through `interp` and `ideal`.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;

use crate::common::{RATE_HZ, compiled};
use crate::play::Player;

/// Tick length (s).
const T_S: f64 = 1.0 / RATE_HZ as f64;

/// An instrument that senses `x` and holds these declarations.
fn instrument(declarations: &str) -> Compiled {
    let sense = "sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms";
    compiled("rule.whip", &format!("instrument rule {{ {sense}\n{declarations} }}"), &[]).remove(0)
}

/// Tells the same story to both engines.
fn both(compiled: &Compiled, story: impl Fn(&mut Player)) {
    for kind in [EngineKind::Interp, EngineKind::Ideal] {
        println!("engine {kind}");
        story(&mut Player::new(compiled, kind));
    }
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

// Rule 1: the tick

#[test]
fn next_values_are_worked_out_from_the_state_at_the_tick_s_start() {
    // If one were taken over before the other is worked out, both would soon be equal.
    let swap = instrument(
        "state a: length in 0 mm .. 10 mm = 1 mm
         state b: length in 0 mm .. 10 mm = 2 mm
         next a = b
         next b = a
         let sum = a + 2 * b",
    );
    both(&swap, |p| {
        for tick in 0..6 {
            p.tick(0.0);
            let (a, b) = if tick % 2 == 0 { (1e-3, 2e-3) } else { (2e-3, 1e-3) };
            close(p.value("a"), a, 1e-9);
            close(p.value("b"), b, 1e-9);
            close(p.value("sum"), a + 2.0 * b, 1e-9);
        }
    });
}

#[test]
fn semi_implicit_euler_moves_bodies_as_by_hand() {
    let spring = instrument(
        "body b {
             position y in -10 mm .. 10 mm = 1 mm, rate in -10 m/s .. 10 m/s
             mass  10 g
             force -4 kN/m * y
             force 2 N
         }",
    );
    both(&spring, |p| {
        let (mut y_m, mut v) = (1e-3, 0.0);
        for _ in 0..500 {
            p.tick(0.0);
            close(p.value("y"), y_m, 1e-7);
            close(p.value("y'"), v, 1e-4);
            // The rate first, from the old coordinate; then the coordinate, with the new rate.
            v += T_S * (2.0 - 4e3 * y_m) / 0.01;
            y_m += T_S * v;
        }
    });
}

#[test]
fn the_first_steps_of_a_body_are_the_hand_computed_ones() {
    // 1 N on 1 g: 1000 m/s^2. After n ticks the rate is n T a, the coordinate T^2 a (1 + 2 + .. + n): not n^2 / 2.
    let thrown = instrument("body b { position y in 0 mm .. 10 mm, rate in -10 m/s .. 10 m/s mass 1 g force 1 N }");
    both(&thrown, |p| {
        for n in 0..10 {
            p.tick(0.0);
            let n = f64::from(n);
            close(p.value("y'"), n * T_S * 1000.0, 1e-6);
            close(p.value("y"), T_S * T_S * 1000.0 * n * (n + 1.0) / 2.0, 2e-9);
        }
    });
}

#[test]
fn writes_replace_what_the_motion_gave() {
    let written = instrument(
        "body b { position y in -10 mm .. 10 mm, rate in -10 m/s .. 10 m/s mass 1 g force 5 N }
         event set when x > 5 mm { y := -3 mm y' := 0.25 m/s }",
    );
    both(&written, |p| {
        (0..4).for_each(|_| p.tick(0.0));
        p.tick(6e-3);
        p.tick(6e-3);
        close(p.value("y"), -3e-3, 1e-8);
        close(p.value("y'"), 0.25, 1e-6);
        // And from there the motion goes on.
        p.tick(6e-3);
        let v = 0.25 + T_S * 5000.0;
        close(p.value("y'"), v, 1e-5);
        close(p.value("y"), -3e-3 + T_S * v, 1e-8);
    });
}

#[test]
fn written_values_are_those_of_the_tick_s_start() {
    // Both rules act in one tick; the second sees the state as it was, not what the first wrote.
    let chain = instrument(
        "state a: length in 0 mm .. 10 mm = 1 mm
         state b: length in 0 mm .. 10 mm = 5 mm
         event first  when x > 5 mm { a := 7 mm }
         event second when x > 5 mm { b := a }",
    );
    both(&chain, |p| {
        for x_m in [0.0, 6e-3, 6e-3] {
            p.tick(x_m);
        }
        close(p.value("a"), 7e-3, 1e-8);
        close(p.value("b"), 1e-3, 1e-8);
    });
}

#[test]
fn the_later_of_two_writes_wins_and_a_write_beats_next() {
    let writers = instrument(
        "state s: length in 0 mm .. 10 mm
         next s = 1 mm
         event up   when x > 5 mm { s := 2 mm }
         event down when x > 6 mm { s := 3 mm }
         event twice when x > 7 mm { s := 4 mm s := 5 mm }",
    );
    both(&writers, |p| {
        let mut after = |from_m: f64, to_m: f64| {
            (0..3).for_each(|_| p.tick(from_m));
            close(p.value("s"), 1e-3, 1e-8);
            p.tick(to_m);
            p.tick(to_m);
            let s = p.value("s");
            p.tick(0.0);
            s
        };
        close(after(0.0, 5.5e-3), 2e-3, 1e-8);
        close(after(0.0, 6.5e-3), 3e-3, 1e-8);
        close(after(0.0, 7.5e-3), 5e-3, 1e-8);
        // Only the first rule's guard turns true.
        close(after(4e-3, 5.5e-3), 2e-3, 1e-8);
    });
}

#[test]
fn forces_are_those_worked_out_before_the_motion() {
    let heard = instrument(
        "state s: force in 0 N .. 5 N = 1 N
         next s = 2 N
         states m { a -> b when x > 5 mm }
         force s = s
         force m = if m is b then 3 N else 0 N",
    );
    both(&heard, |p| {
        p.tick(6e-3);
        close(p.value("force"), 1.0, 1e-6);
        assert_eq!(p.drive, 1024, "1 N of 32 N full scale");
        p.tick(6e-3);
        close(p.value("force"), 5.0, 1e-6);
    });
}

// Rule 2: machines

#[test]
fn a_machine_takes_one_step_a_tick() {
    let three = instrument(
        "states m {
             a -> b when x > 1 mm
             b -> c when x > 1 mm
             c -> a when x > 1 mm
         }
         let in_b = m is b",
    );
    both(&three, |p| {
        p.tick(0.0);
        for expected in ["a", "b", "c", "a", "b"] {
            p.tick(2e-3);
            assert_eq!(p.state("m"), expected);
            assert_eq!(p.value("in_b") == 1.0, expected == "b", "`is` asks for the state of the tick's start");
        }
    });
}

#[test]
fn the_first_transition_that_may_go_goes() {
    let fork = instrument(
        "state which: number in 0 .. 10
         states m {
             a -> b when x > 6 mm { which := 1 }
             a -> c when x > 3 mm { which := 2 }
             a -> d when x > 1 mm { which := 3 }
             b -> a when x < 1 mm
             c -> a when x < 1 mm
             d -> a when x < 1 mm
         }",
    );
    both(&fork, |p| {
        for (x_m, state, which) in [(7e-3, "b", 1.0), (4e-3, "c", 2.0), (2e-3, "d", 3.0)] {
            p.tick(0.0);
            p.tick(0.0);
            assert_eq!(p.state("m"), "a");
            p.events();
            p.tick(x_m);
            assert_eq!(p.events(), [(format!("m: a -> {state}"), vec![])]);
            p.tick(x_m);
            assert_eq!(p.state("m"), state);
            close(p.value("which"), which, 1e-8);
            p.tick(0.0);
        }
    });
}

#[test]
fn machines_do_not_see_each_other_s_step() {
    let pair = instrument(
        "states m { a -> b when x > 1 mm }
         states n { a -> b when m is b }",
    );
    both(&pair, |p| {
        let seen: Vec<_> = (0..4)
            .map(|_| {
                p.tick(2e-3);
                (p.state("m"), p.state("n"))
            })
            .collect();
        assert_eq!(seen, [("a", "a"), ("b", "a"), ("b", "b"), ("b", "b")]);
    });
}

// Rule 3: events

#[test]
fn an_event_is_an_edge_and_the_first_tick_is_none() {
    let tap = instrument("event tap when x > 5 mm { emit tapped(at: x) }");
    both(&tap, |p| {
        let mut at = |x_m: f64| {
            p.tick(x_m);
            p.count("tapped")
        };
        assert_eq!([6e-3, 6e-3, 0.0, 6e-3, 7e-3, 4e-3, 5.1e-3].map(&mut at), [0, 0, 0, 1, 0, 0, 1]);
    });
    both(&tap, |p| {
        let mut at = |x_m: f64| {
            p.tick(x_m);
            p.count("tapped")
        };
        assert_eq!([0.0, 6e-3, 6e-3].map(&mut at), [0, 1, 0], "true in the second tick is an edge");
    });
}

#[test]
fn an_event_tells_the_values_of_its_tick() {
    let tap = instrument("event tap when x > 5 mm { emit tapped(at: x, twice: 2 * x) }");
    both(&tap, |p| {
        p.tick(0.0);
        p.tick(6.5e-3);
        let (_, args) = p.events().into_iter().find(|(name, _)| name == "tapped").expect("an event");
        close(args[0], 6.5e-3, 1e-6);
        close(args[1], 13e-3, 2e-6);
    });
}

// Rule 4: clamping

#[test]
fn a_coordinate_at_its_end_loses_an_outward_rate_only() {
    let pushed = instrument(
        "body b { position y in 0 mm .. 1 mm, rate in -10 m/s .. 10 m/s mass 1 g
                  force if x > 5 mm then -1 N else 1 N }
         event beyond when x > 9 mm { y := 3 mm y' := -0.5 m/s }
         event under  when x < -0.2 mm { y := -3 mm y' := -0.5 m/s }",
    );
    both(&pushed, |p| {
        (0..200).for_each(|_| p.tick(0.0));
        close(p.value("y"), 1e-3, 1e-9);
        assert_eq!(p.value("y'"), 0.0, "stopped at the end");
        // Away from the end nothing is lost: the first tick inward already moves.
        p.tick(6e-3);
        p.tick(6e-3);
        close(p.value("y'"), -T_S * 1000.0, 1e-6);
        close(p.value("y"), 1e-3 - T_S * T_S * 1000.0, 2e-9);
        // Written beyond the end with an inward rate: the coordinate is clamped, the rate stays.
        p.tick(9.5e-3);
        p.tick(6e-3);
        close(p.value("y"), 1e-3, 1e-9);
        close(p.value("y'"), -0.5, 1e-6);
        // Written beyond the other end with an outward rate.
        p.tick(-0.3e-3);
        p.tick(6e-3);
        close(p.value("y"), 0.0, 1e-9);
        assert_eq!(p.value("y'"), 0.0);
    });
}

#[test]
fn states_and_senses_are_clamped() {
    let narrow = compiled(
        "narrow.whip",
        "instrument narrow {
             sense x: length in 1 mm .. 4 mm
             state s: length in 0 mm .. 2 mm
             next s = x
         }",
        &[],
    )
    .remove(0);
    both(&narrow, |p| {
        for (x_m, sensed_m, kept_m) in [(0.0, 1e-3, 1e-3), (1.5e-3, 1.5e-3, 1.5e-3), (9e-3, 4e-3, 2e-3)] {
            p.tick(x_m);
            // A word of the sensor is 0.17 um.
            close(p.value("x"), sensed_m, 2e-7);
            p.tick(x_m);
            close(p.value("s"), kept_m, 2e-7);
        }
    });
}

// Rule 5: hold

#[test]
fn a_held_body_stands_still_and_can_be_written() {
    let held = instrument(
        "body b { position y in -10 mm .. 10 mm, rate in -10 m/s .. 10 m/s mass 1 g force 1 N }
         hold b when x > 5 mm
         event move when x > 7 mm { y := 4 mm }
         event kick when x > 8 mm { y' := 2 m/s }",
    );
    both(&held, |p| {
        (0..10).for_each(|_| p.tick(0.0));
        p.tick(6e-3);
        let stood_m = p.value("y");
        assert!(stood_m > 0.0 && p.value("y'") > 0.0);
        for _ in 0..5 {
            p.tick(6e-3);
            assert_eq!(p.value("y"), stood_m);
            assert_eq!(p.value("y'"), 0.0);
        }
        p.tick(7.5e-3);
        p.tick(7.5e-3);
        close(p.value("y"), 4e-3, 1e-8);
        assert_eq!(p.value("y'"), 0.0);
        // A written rate shows, moves nothing while held, and is gone with the next tick.
        p.tick(8.5e-3);
        p.tick(8.5e-3);
        close(p.value("y'"), 2.0, 1e-6);
        p.tick(8.5e-3);
        assert_eq!(p.value("y'"), 0.0);
        close(p.value("y"), 4e-3, 1e-8);
        // Let go, it starts from rest.
        p.tick(0.0);
        p.tick(0.0);
        close(p.value("y'"), T_S * 1000.0, 1e-6);
    });
}

// Rule 6: primes

/// Positions that fall on words of the sensor, so that a slope has no quantisation in it (m).
fn on_a_word(words: u32) -> f64 {
    -0.5e-3 + 11e-3 / 65_535.0 * f64::from(words)
}

#[test]
fn primes_of_ramps_and_parabolas_are_exact() {
    // 0.7 ms are 30.87 ticks: the window has 31.
    let motion = instrument("let v = x' let a = x''");
    let lsb_m = on_a_word(1) - on_a_word(0);
    both(&motion, |p| {
        for tick in 0..200 {
            p.tick(on_a_word(10_000 + 7 * tick));
            if tick >= 30 {
                close(p.value("v"), 7.0 * lsb_m / T_S, p.error("v") + 1e-9);
                close(p.value("a"), 0.0, p.error("a") + 1e-6);
            }
        }
    });
    both(&motion, |p| {
        for tick in 0..120 {
            p.tick(on_a_word(5_000 + 2 * tick * tick));
            if tick >= 30 {
                // The slope is the one in the middle of the window, 15 ticks ago.
                close(p.value("v"), 4.0 * (f64::from(tick) - 15.0) * lsb_m / T_S, p.error("v") + 1e-9);
                close(p.value("a"), 4.0 * lsb_m / T_S / T_S, p.error("a") + 1e-6);
            }
        }
    });
}

#[test]
fn the_window_is_filled_with_the_first_sample() {
    let motion = instrument("let v = x' let a = x''");
    both(&motion, |p| {
        for _ in 0..40 {
            p.tick(7e-3);
            assert_eq!((p.value("v"), p.value("a")), (0.0, 0.0), "a key that lies still at the start does not move");
        }
    });
}

#[test]
fn a_window_has_the_odd_number_of_ticks_next_to_its_length() {
    // A step of one word shows in the slope for as many ticks as the window is long.
    for (over, ticks) in [("0.7 ms", 31), ("1 ms", 45), ("0.02 ms", 3), ("0.1 ms", 5), ("2 ms", 89)] {
        let text = format!("instrument w {{ sense x: length in 0 mm .. 10 mm over {over} let v = x' }}");
        let compiled = compiled("w.whip", &text, &[]).remove(0);
        both(&compiled, |p| {
            p.tick(on_a_word(20_000));
            let mut shows = 0;
            for _ in 0..200 {
                p.tick(on_a_word(20_100));
                shows += usize::from(p.value("v") != 0.0);
            }
            // The step stands between two samples of the window: one position fewer than samples.
            assert_eq!(shows, ticks - 1, "over {over}");
        });
    }
}

#[test]
fn the_prime_takes_the_branch_that_min_max_and_abs_take() {
    let branches = instrument(
        "live param doubled = on
         states m { near -> far when x > 4 mm }
         let least   = (min(x, 3 mm))'
         let most    = (max(2 * x, 6 mm))'
         let between = (clamp(x, 1 mm, 3 mm))'
         let size    = (abs(x - 3 mm))'
         let chosen  = (if m is far then 5 * x else x)'
         let by_bool = (if doubled then 2 * x else x)'
         let product = (x * x / 1 mm)'
         let quotient = (1 mm * 1 mm / (x + 1 mm))'
         let v = x'",
    );
    let lsb_m = on_a_word(1) - on_a_word(0);
    both(&branches, |p| {
        let v = 10.0 * lsb_m / T_S;
        for tick in 0..4_000 {
            p.tick(on_a_word(6_000 + 10 * tick));
            let x_m = p.value("x");
            if tick < 31 || (x_m - 3e-3).abs() < 1e-5 || (x_m - 4e-3).abs() < 1e-5 {
                continue;
            }
            let near = x_m < 3e-3;
            let expected = [
                ("least", if near { v } else { 0.0 }),
                ("most", if near { 0.0 } else { 2.0 * v }),
                ("between", if near && x_m > 1e-3 { v } else { 0.0 }),
                ("size", if near { -v } else { v }),
                ("chosen", if x_m > 4e-3 { 5.0 * v } else { v }),
                ("by_bool", 2.0 * v),
                ("product", 2.0 * x_m * v / 1e-3),
                ("quotient", -v * 1e-6 / ((x_m + 1e-3) * (x_m + 1e-3))),
            ];
            for (name, expected) in expected {
                assert!((p.value(name) - expected).abs() < 1e-5, "{name} at {x_m} m: {} != {expected}", p.value(name));
            }
        }
    });
}

#[test]
fn the_prime_of_a_coordinate_is_its_rate() {
    let body = instrument(
        "body b { position y in -10 mm .. 10 mm, rate in -10 m/s .. 10 m/s = 0.5 m/s mass 1 kg }
         let lag = (3 * (x - y))'",
    );
    both(&body, |p| {
        p.tick(0.0);
        close(p.value("lag"), -1.5, 1e-6);
    });
}

// Rule 7: pulses

#[test]
fn a_pulse_lasts_its_duration_rounded_to_ticks() {
    // 0.1 ms are 4.41 ticks, 0.125 ms 5.51; a tenth of a tick is still one.
    for (lasting, ticks) in [("0.1 ms", 4), ("0.125 ms", 6), ("8 ms", 353), ("0.002 ms", 1)] {
        let compiled = instrument(&format!(
            "pulse p: force in -1 N .. 5 N lasting {lasting}
             event e when x > 5 mm {{ fire p at 2 N }}
             force p = p"
        ));
        both(&compiled, |p| {
            p.tick(0.0);
            let mut levels = Vec::new();
            for _ in 0..400 {
                p.tick(6e-3);
                levels.push(p.value("force"));
            }
            assert_eq!(levels[0], 0.0, "it begins with the tick after");
            assert!(levels[1..=ticks].iter().all(|level| (level - 2.0).abs() < 1e-6), "{lasting}");
            assert!(levels[ticks + 1..].iter().all(|level| *level == 0.0), "{lasting}");
        });
    }
}

#[test]
fn firing_again_restarts_with_the_larger_value() {
    let twice = instrument(
        "pulse p: force in 0 N .. 5 N lasting 0.227 ms
         event two   when x > 2 mm { fire p at 2 N }
         event one   when x > 3 mm { fire p at 1 N }
         event three when x > 4 mm { fire p at 3 N }
         event much  when x > 5 mm { fire p at 50 N }
         event less  when x > 6 mm { fire p at -1 N }
         force p = p",
    );
    // 10 ticks; each row: the position from a tick on, and the level in the ticks that follow.
    both(&twice, |p| {
        let mut levels = |x_m: f64, ticks: usize| -> Vec<i64> {
            let mut one = || {
                p.tick(x_m);
                (p.value("force") * 1e3).round() as i64
            };
            (0..ticks).map(|_| one()).collect()
        };
        assert_eq!(levels(0.0, 2), [0; 2]);
        assert_eq!(levels(2.5e-3, 6), [0, 2000, 2000, 2000, 2000, 2000]);
        // The fifth tick has passed: restarted with 2 N, not 1 N, for ten more.
        assert_eq!(levels(3.5e-3, 4), [2000; 4]);
        assert_eq!(levels(4.5e-3, 3), [2000, 3000, 3000]);
        assert_eq!(levels(4.5e-3, 9), [3000, 3000, 3000, 3000, 3000, 3000, 3000, 3000, 0], "ten ticks after the third");
        // At rest a smaller value is no longer held up by the last one; levels are clamped to the range.
        assert_eq!(levels(0.0, 2), [0; 2]);
        assert_eq!(levels(2.5e-3, 12)[1..], [2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 0]);
        assert_eq!(levels(3.5e-3, 3), [0, 1000, 1000]);
        assert_eq!(levels(4.5e-3, 1), [1000]);
        assert_eq!(levels(5.5e-3, 3), [3000, 5000, 5000]);
        assert_eq!(levels(6.5e-3, 12), [5000; 11].into_iter().chain([0]).collect::<Vec<_>>());
    });
}

// Rule 11: terms

#[test]
fn every_call_of_a_term_has_its_own_memory_and_runs_always() {
    let text = "term peak(x: length, reset: bool) -> deepest: length, count: number {
            state most: length in 0 mm .. 10 mm
            state n: number in 0 .. 1000
            next most = if reset then 0 mm else max(most, x)
            next n    = n + 1
            deepest   = most
            count     = n
        }
        instrument two {
            sense x: length in 0 mm .. 10 mm
            let keeps   = peak(x, reset: off)
            let forgets = peak(x / 2, reset: x < 1 mm)
            let either  = if x > 5 mm then keeps.count else forgets.count
        }";
    let compiled = compiled("two.whip", text, &[]).remove(0);
    both(&compiled, |p| {
        for x_m in [0.0, 8e-3, 0.0, 3e-3, 0.0] {
            p.tick(x_m);
        }
        // The memory at the start of the last tick: after 0, 8, 0 and 3 mm.
        close(p.value("keeps.deepest"), 8e-3, 1e-6);
        close(p.value("forgets.deepest"), 1.5e-3, 1e-6);
        close(p.value("keeps.count"), 4.0, 1e-6);
        close(p.value("either"), 4.0, 1e-6);
    });
}

// Rule 13: force

#[test]
fn force_terms_add_up_and_the_drive_clips() {
    let strong = instrument(
        "live param weight = 0.5 N in 0 N .. 1 N
         force spring = 4 kN/m * x
         force weight = -weight",
    );
    both(&strong, |p| {
        p.tick(1e-3);
        close(p.value("force"), 3.5, 1e-3);
        close(f64::from(p.drive) * 32.0 / 32_768.0, 3.5, 1.5e-3);
        p.tick(9e-3);
        close(p.value("force"), 35.5, 1e-2);
        assert_eq!(p.drive, i16::MAX, "clipped at the device's limit");
        p.tick(0.0);
        assert!(p.drive < 0, "positive pushes up, so a weight is negative");
    });
}

// Rule 16: slew

#[test]
fn what_moves_too_fast_is_held_back() {
    let text = "instrument slow { sense x: length in 0 mm .. 10 mm slew 2 m/s over 0.7 ms let v = x' }";
    let compiled = compiled("slow.whip", text, &[]).remove(0);
    let lsb_m = on_a_word(1) - on_a_word(0);
    // Whole words of the sensor per tick that do not exceed 2 m/s.
    let step_m = (2.0 * T_S / lsb_m).floor() * lsb_m;
    both(&compiled, |p| {
        p.tick(on_a_word(10_000));
        let start_m = p.value("x");
        close(start_m, on_a_word(10_000), 1e-9);
        for tick in 1..=50 {
            p.tick(on_a_word(40_000));
            let expected_m = (start_m + step_m * f64::from(tick)).min(on_a_word(40_000));
            close(p.value("x"), expected_m, 1e-9);
            assert!(p.value("v") <= 2.0);
        }
        // It is the sensed value that is limited, so the way back starts from there.
        p.tick(on_a_word(0));
        close(p.value("x"), start_m + step_m * 49.0, 1e-9);
    });
    both(&compiled, |p| {
        p.tick(on_a_word(30_000));
        close(p.value("x"), on_a_word(30_000), 1e-9);
        p.tick(on_a_word(30_000 + 200));
        close(p.value("x"), on_a_word(30_200), 1e-9);
    });
}
