//! Rule 6: primes.

use super::{T_S, both, close, instrument, on_a_word};
use crate::common;

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
                close(
                    p.value("v"),
                    4.0 * (f64::from(tick) - 15.0) * lsb_m / T_S,
                    p.error("v") + 1e-9,
                );
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
            assert_eq!(
                (p.value("v"), p.value("a")),
                (0.0, 0.0),
                "a key that lies still at the start does not move"
            );
        }
    });
}

#[test]
fn a_window_has_the_odd_number_of_ticks_next_to_its_length() {
    // A step of one word shows in the slope for as many ticks as the window is long.
    for (over, ticks) in [
        ("0.7 ms", 31),
        ("1 ms", 45),
        ("0.02 ms", 3),
        ("0.1 ms", 5),
        ("2 ms", 89),
    ] {
        let text =
            format!("instrument w {{ sense x: length in 0 mm .. 10 mm over {over} let v = x' }}");
        let compiled = common::compiled("w.whip", &text, &[]).remove(0);
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
                assert!(
                    (p.value(name) - expected).abs() < 1e-5,
                    "{name} at {x_m} m: {} != {expected}",
                    p.value(name)
                );
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
