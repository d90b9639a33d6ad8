//! Rules 4 and 5: what stops a coordinate.

use super::{T_S, both, close, instrument};
use crate::common;

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
    let narrow = common::compiled(
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
        for (x_m, sensed_m, kept_m) in [
            (0.0, 1e-3, 1e-3),
            (1.5e-3, 1.5e-3, 1.5e-3),
            (9e-3, 4e-3, 2e-3),
        ] {
            p.tick(x_m);
            // A word of the sensor is 0.17 um.
            close(p.value("x"), sensed_m, 2e-7);
            p.tick(x_m);
            close(p.value("s"), kept_m, 2e-7);
        }
    });
}

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
