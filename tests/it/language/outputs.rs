//! Rules 7, 11, 13 and 16: pulses, terms, forces, slew.

use super::{T_S, both, close, instrument, on_a_word};
use crate::common;

#[test]
fn a_pulse_lasts_its_duration_rounded_to_ticks() {
    // 0.1 ms are 4.41 ticks, 0.125 ms 5.51; a tenth of a tick is still one.
    for (lasting, ticks) in [
        ("0.1 ms", 4),
        ("0.125 ms", 6),
        ("8 ms", 353),
        ("0.002 ms", 1),
    ] {
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
            assert!(
                levels[1..=ticks]
                    .iter()
                    .all(|level| (level - 2.0).abs() < 1e-6),
                "{lasting}"
            );
            assert!(
                levels[ticks + 1..].iter().all(|level| *level == 0.0),
                "{lasting}"
            );
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
        assert_eq!(
            levels(4.5e-3, 9),
            [3000, 3000, 3000, 3000, 3000, 3000, 3000, 3000, 0],
            "ten ticks after the third"
        );
        // At rest a smaller value is no longer held up by the last one; levels are clamped to the
        // range.
        assert_eq!(levels(0.0, 2), [0; 2]);
        assert_eq!(
            levels(2.5e-3, 12)[1..],
            [
                2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 2000, 0
            ]
        );
        assert_eq!(levels(3.5e-3, 3), [0, 1000, 1000]);
        assert_eq!(levels(4.5e-3, 1), [1000]);
        assert_eq!(levels(5.5e-3, 3), [3000, 5000, 5000]);
        assert_eq!(
            levels(6.5e-3, 12),
            [5000; 11].into_iter().chain([0]).collect::<Vec<_>>()
        );
    });
}

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
    let compiled = common::compiled("two.whip", text, &[]).remove(0);
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

#[test]
fn what_moves_too_fast_is_held_back() {
    let text =
        "instrument slow { sense x: length in 0 mm .. 10 mm slew 2 m/s over 0.7 ms let v = x' }";
    let compiled = common::compiled("slow.whip", text, &[]).remove(0);
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
