//! Rule 1: the order of a tick.

use super::{T_S, both, close, instrument};

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
            let (a, b) = if tick % 2 == 0 {
                (1e-3, 2e-3)
            } else {
                (2e-3, 1e-3)
            };
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
    // 1 N on 1 g: 1000 m/s^2. After n ticks the rate is n T a, the coordinate T^2 a (1 + 2 + .. +
    // n): not n^2 / 2.
    let thrown = instrument(
        "body b { position y in 0 mm .. 10 mm, rate in -10 m/s .. 10 m/s mass 1 g force 1 N }",
    );
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

#[test]
fn what_happens_every_period_happens_first_after_one() {
    let compiled = instrument("event report every 5 * tick { emit even() }");
    both(&compiled, |p| {
        let mut ticks = Vec::new();
        for tick in 0..23 {
            p.tick(1e-3);
            ticks.extend((p.count("even") > 0).then_some(tick));
        }
        assert_eq!(ticks, [5, 10, 15, 20]);
    });
}
