//! The second set of strings, four equal ones of steel (Onofrei, Fontana and Serafin 2023), under a
//! bow: what the first set does in Helmholtz's and Schelleng's terms, and where their stiffness
//! keeps them from it.
//!
//! They are 2 to 15 times as heavy as those of the first set, so a bow presses them as much harder:
//! presses are given in parts of Schelleng's limit.

use super::motion::{Line, Motion, played};
use super::player::{Bow, Integers};
use super::{
    assert_helmholtz, bowed, engines_are_equal, hardest, never_pushes, on_both, power,
    settles_alike,
};

/// 1 mm thick, 0.5 m long; only their tension tells them apart.
const fn steel(name: &'static str, pitch_hz: f64) -> Line {
    Line {
        name,
        pitch_hz,
        length_m: 0.5,
        rho: 6.165e-3,
        kappa: 1.2619,
    }
}

const G3: Line = steel("G3 of steel", 196.0);
const D4: Line = steel("D4 of steel", 293.66);
const A4: Line = steel("A4 of steel", 440.0);
const E5: Line = steel("E5 of steel", 659.25);

/// Above what any of these bows presses (N).
const HARDEST: f64 = 40.0;

/// The part of Schelleng's limit with which the D4 of the first set is bowed.
const PART: f64 = 0.45;

fn bow(line: &Line, speed: f64, beta: f64) -> Bow {
    let press = PART * line.limit(speed, beta);
    Bow { speed, press, beta }
}

/// The same bow as that of the first set's D4, but for the mass of the string.
/// The fourth harmonic of E5 is low, as it is of the E5 of the first set (0.89 of the formula).
#[test]
fn a_bow_makes_helmholtz_s_motion_of_each() {
    for (line, fourth) in [(G3, 0.08), (D4, 0.08), (A4, 0.08), (E5, 0.13)] {
        let (compiled, bow) = (bowed(&line, HARDEST), bow(&line, 0.2, 0.12));
        let motion = played(&line, &mut Integers::new(&compiled), bow, 3);
        assert_helmholtz(&line, bow, &motion, [0.08, 0.08, 0.08, fourth]);
    }
}

/// One bow, to which each settles alike. Whether a string that is bowed from rest comes to one slip
/// a period or to two may hang on the least change (A4 at 0.2 m/s has two with a press that differs
/// by less than 2e-8 N), and then the two need not settle alike.
#[test]
fn integers_and_ideal_settle_to_one_motion_of_each() {
    for line in [G3, D4, A4, E5] {
        settles_alike(&line, &bowed(&line, HARDEST), bow(&line, 0.1, 0.2));
    }
}

/// How many of the bows below are played, where nobody asks for another number.
const BOWS: usize = 16;

/// Some of 60 bows, of all strings, places and speeds: the place of a string in `lines`, and a bow.
fn bows(lines: &[Line]) -> Vec<(usize, Bow)> {
    let mut all = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        for beta in [0.1, 0.12, 0.15, 0.18, 0.2] {
            all.extend([0.1, 0.2, 0.3].map(|speed| (at, bow(line, speed, beta))));
        }
    }
    let asked = whippen_need::count("WHIPPEN_BOWS", BOWS);
    // 7 and 60 have no divisor in common, so that each comes once.
    let apart = (0..asked.clamp(1, all.len())).map(|at| all[7 * at % all.len()]);
    apart.collect()
}

/// What an engine makes of all bows: how many keep a slip a period, and the mean share of ticks in
/// which the string sticks.
fn on_the_whole(motions: &[Motion]) -> (usize, f64) {
    let keeps = |motion: &&Motion| (motion.slips_per_period - 1.0).abs() < 0.05;
    let stuck: f64 = motions.iter().map(|motion| motion.stuck).sum();
    (
        motions.iter().filter(keeps).count(),
        stuck / motions.len() as f64,
    )
}

/// Which of several motions a bow from rest comes to hangs on the least change under some bows, and
/// integers and `ideal` need not come to the same one there. Of many bows they make the same.
/// All of them: `WHIPPEN_BOWS=60 cargo test --test it many_bows -- --nocapture`.
#[test]
fn integers_and_ideal_make_the_same_of_many_bows() {
    let (mut integers, mut ideal, mut alike) = (Vec::new(), Vec::new(), 0);
    let lines = [G3, D4, A4, E5];
    let compiled = lines.map(|line| bowed(&line, HARDEST));
    for (at, bow) in bows(&lines) {
        let (line, [ours, reals]) = (lines[at], on_both(&lines[at], &compiled[at], bow));
        let is_alike = (ours.slips_per_period - reals.slips_per_period).abs() < 0.01
            && (ours.stuck - reals.stuck).abs() < 0.02;
        alike += usize::from(is_alike);
        if !is_alike {
            println!("{}, {bow:?}: {ours:?} {reals:?}", line.name);
        }
        integers.push(ours);
        ideal.push(reals);
    }
    let all = integers.len();
    let ((ours, our_stuck), (reals, their_stuck)) = (on_the_whole(&integers), on_the_whole(&ideal));
    println!(
        "of {all} bows {alike} alike; a slip a period {ours} and {reals}; \
         stuck {our_stuck:.3} and {their_stuck:.3}"
    );
    assert!(3 * alike >= 2 * all, "{alike} of {all} alike");
    assert!(10 * ours.abs_diff(reals) <= all, "{ours} and {reals}");
    assert!(
        (our_stuck - their_stuck).abs() < 0.02,
        "{our_stuck} and {their_stuck}"
    );
}

/// The hardest press with which a slip a period is kept, by Schelleng's formula.
fn of_limit(line: &Line, beta: f64) -> f64 {
    let told = line.limit(0.1, beta);
    let bow = Bow {
        speed: 0.1,
        press: 0.0,
        beta,
    };
    let compiled = bowed(line, HARDEST);
    let found = hardest(line, &compiled, bow, [0.5 * told, 1.8 * told]) / told;
    println!("{}, kappa {}, {beta}: {found:.2}", line.name, line.kappa);
    found
}

/// The formula is of a flexible string. Those of the highest tension are near one away from the
/// bridge; no string keeps a slip a period much above the limit.
#[test]
fn a_bow_is_pressed_no_harder_than_schelleng_says() {
    for line in [G3, D4, A4, E5] {
        for beta in [0.05, 0.08, 0.12, 0.2] {
            let found = of_limit(&line, beta);
            assert!(found < 1.4, "{}, {beta}: {found}", line.name);
            let is_flexible = line.pitch_hz >= A4.pitch_hz && beta >= 0.08;
            assert!(
                !is_flexible || (0.85..1.3).contains(&found),
                "{}, {beta}: {found}",
                line.name
            );
        }
    }
}

/// The lowest string is the stiffest for its tension: near the bridge half the limit is too much
/// for it. With half of its stiffness it keeps to the formula everywhere.
#[test]
fn stiffness_lowers_the_limit_of_the_lowest() {
    let softer = Line {
        kappa: G3.kappa / 2.0,
        ..G3
    };
    for beta in [0.05, 0.08, 0.12, 0.2] {
        assert!(of_limit(&G3, beta) < 0.85);
        let found = of_limit(&softer, beta);
        assert!((0.85..1.3).contains(&found), "{beta}: {found}");
    }
}

#[test]
fn a_friction_takes_power_from_the_rounded_motion() {
    for line in [G3, E5] {
        power(&line, &bowed(&line, 1.0), 1.0);
    }
}

/// Pressed by 7 m/s of its impedance; a newton on the lightest string of the first set is 5.8 m/s.
/// At 9 m/s the highest string is held to the range of its rate in about every third gesture, and
/// does not come to rest any more.
#[test]
fn a_friction_never_pushes_and_without_it_energy_falls() {
    for line in [G3, E5] {
        let hardest = 7.0 * line.impedance();
        never_pushes(&bowed(&line, hardest), hardest);
    }
}

#[test]
fn engines_are_equal_under_a_bow_at_random() {
    for line in [G3, D4, A4, E5] {
        engines_are_equal(&bowed(&line, HARDEST));
    }
}
