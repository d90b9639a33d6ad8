//! Strings under a bow: Helmholtz's motion, Schelleng's limit, a force that never pushes, and
//! integers against `ideal` by their regimes.

use std::f64::consts::{PI, TAU};

use whippen_compiler::ideal::{Ideal, RealStrand};
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::model::Reading;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::{common, strings};

const RATE_HZ: f64 = 44_100.0;
const PITCH_HZ: f64 = 293.6648;
/// Mass per length (kg/m) and length (m) of the test program's string.
const RHO: f64 = 1.61e-3;
const LENGTH: f64 = 0.32;

fn bowed_string() -> Compiled {
    let text = include_str!("../programs/bowed_string.whip");
    common::compiled("bowed_string.whip", text, &[]).remove(0)
}

/// Live values of a run.
#[derive(Debug, Clone, Copy)]
struct Bow {
    speed: f64,
    press: f64,
    beta: f64,
}

/// One of both engines.
trait Player {
    fn set(&mut self, name: &str, value: f64);
    /// One tick: slip, force and the force on the bridge.
    fn tick(&mut self) -> [f64; 3];

    fn bow(&mut self, bow: Bow) {
        self.set("speed", bow.speed);
        self.set("press", bow.press);
        self.set("beta", bow.beta);
    }
}

const NAMES: [&str; 3] = ["slips", "rubs", "bridge"];

struct Integers<'c> {
    compiled: &'c Compiled,
    jit: JitCode,
    shown: [usize; 3],
}

impl Integers<'_> {
    fn new(compiled: &Compiled) -> Integers<'_> {
        let kernel = &compiled.lowered.kernel;
        let mut jit = JitCode::build(kernel, 1, Options { probes: true }).expect("a kernel");
        jit.init(&[0]);
        let exports = &compiled.lowered.exports;
        let at = |name: &str| {
            exports
                .iter()
                .position(|e| e.name == name)
                .expect("is shown")
        };
        Integers {
            compiled,
            jit,
            shown: NAMES.map(at),
        }
    }
}

impl Integers<'_> {
    /// The string.
    fn state(&self) -> RealStrand {
        let lowered = self.compiled.lowered.strands[0];
        let parts = self.compiled.model.strands[lowered.strand].parts;
        let memory = self.jit.memory();
        strings::held(&lowered, parts, |cell, point| {
            let word = memory.cell(&self.compiled.lowered.kernel, 0, cell as usize, point);
            word.expect("is a word of the grid")
        })
    }
}

fn live(compiled: &Compiled, name: &str) -> usize {
    let mut lives = compiled.model.lives.iter();
    lives.position(|live| live.name == name).expect("is live")
}

impl Player for Integers<'_> {
    fn set(&mut self, name: &str, value: f64) {
        let live = live(self.compiled, name);
        let word = self.compiled.lowered.lives[live].quantize(value);
        self.jit.set_live(live, word).expect("is live");
    }

    fn tick(&mut self) -> [f64; 3] {
        self.jit.tick(&[0], &mut [0_i16]);
        let exports = &self.compiled.lowered.exports;
        self.shown
            .map(|at| exports[at].value(self.jit.probes()[at]))
    }
}

struct Reals<'c> {
    compiled: &'c Compiled,
    ideal: Ideal<'c>,
}

impl Reals<'_> {
    fn new(compiled: &Compiled) -> Reals<'_> {
        let scales = Device::of(&compiled.model).scales();
        let ideal = Ideal::new(&compiled.model, &scales, 1);
        Reals { compiled, ideal }
    }
}

impl Player for Reals<'_> {
    fn set(&mut self, name: &str, value: f64) {
        self.ideal.set_live(live(self.compiled, name), value);
    }

    fn tick(&mut self) -> [f64; 3] {
        self.ideal.tick(&[0]);
        NAMES.map(|name| {
            let mut named = self.compiled.model.named.iter();
            let node = named.find(|n| n.name == name).expect("is named").value;
            self.ideal.value(0, node)
        })
    }
}

/// What a bow has made of a string.
#[derive(Debug)]
struct Motion {
    slips_per_period: f64,
    stuck: f64,
    /// What sounds.
    pitch_hz: f64,
    /// Harmonics of the force on the bridge (N).
    harmonics: [f64; 4],
}

/// How often a row of slips leaves what sticks, and the share of ticks in which it does.
fn sticking(slips: &[f64], speed: f64) -> (f64, f64) {
    let (mut stuck, mut is_stuck, mut count) = (0_usize, true, 0_usize);
    for slip in slips {
        let size = slip.abs();
        stuck += usize::from(size < 0.2 * speed);
        count += usize::from(is_stuck && size > 0.5 * speed);
        is_stuck = size < 0.2 * speed || is_stuck && size <= 0.5 * speed;
    }
    let periods = slips.len() as f64 / RATE_HZ * PITCH_HZ;
    (count as f64 / periods, stuck as f64 / slips.len() as f64)
}

/// The last second of so many.
fn played(player: &mut impl Player, bow: Bow, seconds: usize) -> Motion {
    player.bow(bow);
    let rate = RATE_HZ as usize;
    (0..(seconds - 1) * rate).for_each(|_| {
        player.tick();
    });
    let heard: Vec<[f64; 3]> = (0..rate).map(|_| player.tick()).collect();
    let slips: Vec<f64> = heard.iter().map(|h| h[0]).collect();
    let (slips_per_period, stuck) = sticking(&slips, bow.speed);
    // The pitch under the bow, from how often it slips, is near that of the string.
    let bridge: Vec<f64> = heard.iter().map(|h| h[2]).collect();
    let pitch = loudest(&bridge);
    Motion {
        slips_per_period,
        stuck,
        pitch_hz: pitch,
        harmonics: [1.0, 2.0, 3.0, 4.0].map(|n| partial(&bridge, n * pitch)),
    }
}

/// Size of a partial in a Hann window over all.
fn partial(signal: &[f64], f_hz: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (i, value) in signal.iter().enumerate() {
        let window = 1.0 - (TAU * i as f64 / signal.len() as f64).cos();
        let angle = TAU * f_hz * i as f64 / RATE_HZ;
        re += window * value * angle.cos();
        im -= window * value * angle.sin();
    }
    2.0 * re.hypot(im) / signal.len() as f64
}

/// The frequency near the pitch at which most is heard.
fn loudest(signal: &[f64]) -> f64 {
    let all = (-40..=20).map(|step| PITCH_HZ * (f64::from(step) / 1200.0).exp2());
    let louder = |a: &f64, b: &f64| partial(signal, *a).total_cmp(&partial(signal, *b));
    all.max_by(louder).unwrap_or(PITCH_HZ)
}

/// The wave impedance (kg/s), from the pitch.
fn impedance() -> f64 {
    2.0 * LENGTH * PITCH_HZ * RHO
}

#[test]
fn a_bow_makes_helmholtz_s_motion() {
    let compiled = bowed_string();
    let bow = Bow {
        speed: 0.2,
        press: 0.45,
        beta: 0.12,
    };
    let integers = played(&mut Integers::new(&compiled), bow, 3);
    let ideal = played(&mut Reals::new(&compiled), bow, 3);
    println!("{integers:?}\n{ideal:?}");
    for motion in [integers, ideal] {
        assert!((motion.slips_per_period - 1.0).abs() < 0.02, "{motion:?}");
        assert!((motion.stuck - 0.85).abs() < 0.03, "{motion:?}");
        for (n, harmonic) in (1..).zip(motion.harmonics) {
            let told = 2.0 * impedance() * bow.speed / (bow.beta * PI * f64::from(n));
            let part = harmonic / told;
            println!("harmonic {n}: {part:.3} of the formula");
            assert!((part - 1.0).abs() < 0.08, "harmonic {n}: {part}");
        }
    }
}

/// Where they let go the least change decides, so that they are never in the same tick for long.
#[test]
fn integers_and_ideal_settle_to_one_motion() {
    let compiled = bowed_string();
    for (speed, press, beta) in [(0.1, 0.23, 0.12), (0.3, 0.7, 0.1)] {
        let bow = Bow { speed, press, beta };
        let integers = played(&mut Integers::new(&compiled), bow, 3);
        let ideal = played(&mut Reals::new(&compiled), bow, 3);
        let cents = 1200.0 * (integers.pitch_hz / ideal.pitch_hz).log2();
        println!("{bow:?}: {cents:.1} cents, {integers:?} {ideal:?}");
        let apart = (integers.slips_per_period - ideal.slips_per_period).abs();
        assert!(apart < 0.01, "{integers:?} {ideal:?}");
        assert!(
            (integers.stuck - ideal.stuck).abs() < 0.02,
            "{integers:?} {ideal:?}"
        );
        assert!(cents.abs() <= 3.0, "{cents} cents");
    }
}

/// What a friction is solved for is rounded before it moves the string. Of the motion that there is
/// then, it may take ten microwatts too little.
#[test]
fn a_friction_takes_power_from_the_rounded_motion() {
    let compiled = bowed_string();
    let strand = compiled.model.strands.iter().next().expect("a string");
    let mut player = Integers::new(&compiled);
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
                press: draw(0.0, 1.0),
                beta: draw(0.05, 0.5),
            };
            player.bow(bow);
            player.set("top", 1.0 / (2.0 * 10_f64.powf(draw(0.0, 4.0))).sqrt());
        }
        let [_, force, _] = player.tick();
        let after = player.state();
        let place = bow.beta * LENGTH;
        let rate =
            |state: &RealStrand| state.read(strand, Reading::Rate, place, (RATE_HZ as u32).into());
        let power = force * (0.5 * (rate(&before) + rate(&after)) - bow.speed);
        (least, most) = (least.min(power), most.max(power));
        before = after;
    }
    println!("{least:.1e} to {most:.1e} W");
    assert!(least >= -1e-5, "{least} W");
    assert!(most > 0.1, "{most} W");
}

/// The largest press at which a slip a period is kept, from soft to hard (N).
fn hardest(compiled: &Compiled, bow: Bow, presses: [f64; 2]) -> f64 {
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
        let (slips_per_period, _) = sticking(&slips, bow.speed);
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
        let told = 2.0 * impedance() * 0.1 / beta;
        let bow = Bow {
            speed: 0.1,
            press: 0.0,
            beta,
        };
        let found = hardest(&compiled, bow, [0.5 * told, 1.8 * told]);
        println!("{beta}: {found:.3} N, {:.2} of {told:.3} N", found / told);
        assert!((0.85..1.3).contains(&(found / told)), "{beta}: {found} N");
    }
}

#[test]
fn a_friction_never_pushes_and_without_it_energy_falls() {
    let compiled = bowed_string();
    let mut player = Integers::new(&compiled);
    let mut random = Rng::new(11);
    let mut draw = |low: f64, high: f64| low + (high - low) * random.below(4001) as f64 / 4000.0;
    let mut most: f64 = 0.0;
    for tick in 0..(20.0 * RATE_HZ) as usize {
        if tick % 441 == 0 {
            player.bow(Bow {
                speed: draw(-0.4, 0.4),
                press: draw(0.0, 1.0),
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
fn engines_are_equal_under_a_bow_at_random() {
    let compiled = bowed_string();
    let kernel = &compiled.lowered.kernel;
    let mut interp = Interp::checked(kernel, 1).expect("verifies");
    let mut player = Integers::new(&compiled);
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
