//! Strings under a bow: Helmholtz's motion, Schelleng's limit, a force that never pushes, and
//! integers against `ideal` by their regimes.

mod motion;
mod player;
mod steel;

use std::f64::consts::PI;

use whippen_compiler::ideal::RealStrand;
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::model::Reading;
use whippen_compiler::pipeline::Compiled;

use crate::common;
use motion::{Line, Motion, RATE_HZ, played, sticking};
use player::{Bow, Integers, Player, Reals};

/// The string of the test program, one of Desvages's.
const D4: Line = Line {
    name: "D4",
    pitch_hz: 293.6648,
    length_m: 0.32,
    rho: 1.61e-3,
    kappa: 0.2887,
};

/// The test program with another string, which may be pressed as hard as `hardest` (N).
fn bowed(line: &Line, hardest: f64) -> Compiled {
    let text = include_str!("../programs/bowed_string.whip");
    let text = text.replace("in 0 N .. 1 N", &format!("in 0 N .. {hardest} N"));
    let values = [
        ("pitch", format!("{} Hz", line.pitch_hz)),
        ("length", format!("{} m", line.length_m)),
        ("rho", format!("{:e} kg/m", line.rho)),
        ("kappa", format!("{} m^2/s", line.kappa)),
    ];
    let sets = values
        .each_ref()
        .map(|(name, value)| (*name, value.as_str()));
    common::compiled("bowed_string.whip", &text, &sets).remove(0)
}

/// That a bow lets go once a period, sticks for so long as Helmholtz's motion does at 0.12 of the
/// string, and draws its saw at the bridge: four harmonics of it within so much.
fn assert_helmholtz(line: &Line, bow: Bow, motion: &Motion, within: [f64; 4]) {
    println!("{}, {bow:?}: {motion:?}", line.name);
    assert!((motion.slips_per_period - 1.0).abs() < 0.02, "{motion:?}");
    assert!((motion.stuck - 0.85).abs() < 0.03, "{motion:?}");
    for ((n, harmonic), within) in (1..).zip(motion.harmonics).zip(within) {
        let part = harmonic * PI * f64::from(n) / line.limit(bow.speed, bow.beta);
        println!("harmonic {n}: {part:.3} of the formula");
        assert!((part - 1.0).abs() < within, "harmonic {n}: {part}");
    }
}

#[test]
fn a_bow_makes_helmholtz_s_motion() {
    let compiled = bowed(&D4, 1.0);
    let bow = Bow {
        speed: 0.2,
        press: 0.45,
        beta: 0.12,
    };
    for motion in on_both(&D4, &compiled, bow) {
        assert_helmholtz(&D4, bow, &motion, [0.08; 4]);
    }
}

/// What a bow settles to on integers and on `ideal`: the last of three seconds.
fn on_both(line: &Line, compiled: &Compiled, bow: Bow) -> [Motion; 2] {
    [
        played(line, &mut Integers::new(compiled), bow, 3),
        played(line, &mut Reals::new(compiled), bow, 3),
    ]
}

/// Plays it on both and compares what they settle to. Where they let go the least change decides,
/// so that they are never in the same tick for long.
fn settles_alike(line: &Line, compiled: &Compiled, bow: Bow) {
    let [integers, ideal] = on_both(line, compiled, bow);
    let cents = 1200.0 * (integers.pitch_hz / ideal.pitch_hz).log2();
    println!(
        "{}, {bow:?}: {cents:.1} cents, {integers:?} {ideal:?}",
        line.name
    );
    let apart = (integers.slips_per_period - ideal.slips_per_period).abs();
    assert!(apart < 0.01, "{integers:?} {ideal:?}");
    let apart = (integers.stuck - ideal.stuck).abs();
    assert!(apart < 0.02, "{integers:?} {ideal:?}");
    assert!(cents.abs() <= 3.0, "{cents} cents");
}

#[test]
fn integers_and_ideal_settle_to_one_motion() {
    let compiled = bowed(&D4, 1.0);
    for (speed, press, beta) in [(0.1, 0.23, 0.12), (0.3, 0.7, 0.1)] {
        settles_alike(&D4, &compiled, Bow { speed, press, beta });
    }
}

/// What a friction is solved for is rounded before it moves the string. Of the motion that there is
/// then, it may take ten microwatts too little.
fn power(line: &Line, compiled: &Compiled, hardest: f64) {
    let strand = compiled.model.strands.iter().next().expect("a string");
    let mut player = Integers::new(compiled);
    let mut random = Rng::new(23);
    let mut draw = |low: f64, high: f64| low + (high - low) * random.below(4001) as f64 / 4000.0;
    let mut bow = Bow {
        speed: 0.0,
        press: 0.0,
        beta: 0.1,
    };
    let (mut least, mut most, mut before) = (0.0_f64, 0.0_f64, player.state());
    for tick in 0..(5.0 * RATE_HZ) as usize {
        if tick % 441 == 0 {
            bow = Bow {
                speed: draw(-0.4, 0.4),
                press: draw(0.0, hardest),
                beta: draw(0.05, 0.5),
            };
            player.bow(bow);
            player.set("top", 1.0 / (2.0 * 10_f64.powf(draw(0.0, 4.0))).sqrt());
        }
        let [_, force, _] = player.tick();
        let after = player.state();
        let place = bow.beta * line.length_m;
        let rate =
            |state: &RealStrand| state.read(strand, Reading::Rate, place, (RATE_HZ as u32).into());
        let power = force * (0.5 * (rate(&before) + rate(&after)) - bow.speed);
        (least, most) = (least.min(power), most.max(power));
        before = after;
    }
    println!("{}: {least:.1e} to {most:.1e} W", line.name);
    assert!(least >= -1e-5, "{least} W");
    assert!(most > 0.1, "{most} W");
}

#[test]
fn a_friction_takes_power_from_the_rounded_motion() {
    power(&D4, &bowed(&D4, 1.0), 1.0);
}

/// The largest press at which a slip a period is kept, from soft to hard (N).
fn hardest(line: &Line, compiled: &Compiled, bow: Bow, presses: [f64; 2]) -> f64 {
    let mut player = Integers::new(compiled);
    let [soft, hard] = presses;
    let (window, steps) = ((0.1 * RATE_HZ) as usize, 130);
    player.bow(Bow { press: soft, ..bow });
    (0..4 * window).for_each(|_| {
        player.tick();
    });
    let mut last = soft;
    for step in 0..=steps {
        let press = soft + (hard - soft) * f64::from(step) / f64::from(steps);
        player.set("press", press);
        let slips: Vec<f64> = (0..window).map(|_| player.tick()[0]).collect();
        let (slips_per_period, _) = sticking(line, &slips, bow.speed);
        // A window holds 29 periods; a firm bow flattens, and one more or less may be counted.
        if (slips_per_period - 1.0).abs() > 0.1 {
            return last;
        }
        last = press;
    }
    hard
}

#[test]
fn a_bow_is_pressed_no_harder_than_schelleng_says() {
    let text = include_str!("../programs/bowed_string.whip");
    let text = text.replace("in 0 N .. 1 N", "in 0 N .. 3 N");
    let compiled = common::compiled("bowed_string.whip", &text, &[]).remove(0);
    for beta in [0.05, 0.08, 0.12, 0.2] {
        let told = D4.limit(0.1, beta);
        let bow = Bow {
            speed: 0.1,
            press: 0.0,
            beta,
        };
        let found = hardest(&D4, &compiled, bow, [0.5 * told, 1.8 * told]);
        println!("{beta}: {found:.3} N, {:.2} of {told:.3} N", found / told);
        assert!((0.85..1.3).contains(&(found / told)), "{beta}: {found} N");
    }
}

/// Of slip and force at random, and of what moves when the bow has left.
fn never_pushes(compiled: &Compiled, hardest: f64) {
    let mut player = Integers::new(compiled);
    let mut random = Rng::new(11);
    let mut draw = |low: f64, high: f64| low + (high - low) * random.below(4001) as f64 / 4000.0;
    let mut most: f64 = 0.0;
    for tick in 0..(20.0 * RATE_HZ) as usize {
        if tick % 441 == 0 {
            player.bow(Bow {
                speed: draw(-0.4, 0.4),
                press: draw(0.0, hardest),
                beta: draw(0.05, 0.5),
            });
            player.set("top", 1.0 / (2.0 * 10_f64.powf(draw(0.0, 4.0))).sqrt());
        }
        let [slip, force, _] = player.tick();
        assert!(slip * force >= 0.0, "tick {tick}: {force} N at {slip} m/s");
        most = most.max(slip.abs());
    }
    println!("slips up to {most:.2} m/s");
    assert!(most > 1.0 && most < 40.0);
    player.set("press", 0.0);
    let moved = |player: &Integers| -> f64 { player.state().v.iter().map(|v| v * v).sum() };
    // The mean over some periods falls: a tick alone may hold more of it as motion.
    let mut window = || -> f64 {
        (0..4410)
            .map(|_| {
                player.tick();
                moved(&player)
            })
            .sum()
    };
    let mut last = window();
    for _ in 0..10 {
        let now = window();
        assert!(now < last, "{last:e} to {now:e}");
        last = now;
    }
}

#[test]
fn a_friction_never_pushes_and_without_it_energy_falls() {
    never_pushes(&bowed(&D4, 1.0), 1.0);
}

fn engines_are_equal(compiled: &Compiled) {
    let kernel = &compiled.lowered.kernel;
    let mut interp = Interp::checked(kernel, 1).expect("verifies");
    let mut player = Integers::new(compiled);
    interp.init(&[0]);
    let mut random = Rng::new(5);
    let mut drive = [0_i16];
    for tick in 0..30_000 {
        if tick % 147 == 0 {
            for (live, of) in compiled.lowered.lives.iter().enumerate() {
                let width = (of.range.high - of.range.low + 1) as u64;
                let word = of.range.low + random.below(width) as i64;
                interp.set_live(live, word as i32).expect("is live");
                player.jit.set_live(live, word as i32).expect("is live");
            }
        }
        interp.tick(&[0], &mut drive);
        player.jit.tick(&[0], &mut drive);
        assert_eq!(interp.probes(), player.jit.probes(), "tick {tick}");
    }
    assert_eq!(interp.violation(), None);
    assert_eq!(interp.memory(), player.jit.memory());
}

#[test]
fn engines_are_equal_under_a_bow_at_random() {
    engines_are_equal(&bowed(&D4, 1.0));
}
