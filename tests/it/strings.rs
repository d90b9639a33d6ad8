//! Strings: pitch, decay and noise against what is known of them, energy, and integers against
//! `ideal` tick by tick.

use std::f64::consts::{PI, TAU};

use whippen_compiler::ideal::{Ideal, RealStrand};
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::lower::LoweredStrand;
use whippen_compiler::model::Strand;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::common;

const RATE_HZ: f64 = 44_100.0;

/// A string of a violin: length (m), mass per length (kg/m), stiffness over that (m^2/s), pitch
/// (Hz).
type Violin = [f64; 4];

/// The gut and steel strings of one published violin, and the steel strings of another.
const VIOLINS: [Violin; 8] = [
    [0.32, 4.1e-4, 0.2979, 659.2551],
    [0.32, 7.2e-4, 0.4151, 440.0],
    [0.32, 1.61e-3, 0.2887, 293.6648],
    [0.32, 2.79e-3, 0.2097, 195.9977],
    [0.5, 6.165e-3, 1.2619, 196.0],
    [0.5, 6.165e-3, 1.2619, 293.66],
    [0.5, 6.165e-3, 1.2619, 440.0],
    [0.5, 6.165e-3, 1.2619, 659.25],
];

/// One of them, struck in the middle while the key is pressed; live losses, as a player would turn
/// them, or those of a param.
fn violin([length, rho, kappa, pitch]: Violin, live: &str) -> Compiled {
    let text = format!(
        "instrument violin {{
            sense x: length in 0 mm .. 10 mm over 1 ms
            {live} param sigma0 = 1 s^-1 in 0.1 s^-1 .. 10 s^-1
            {live} param sigma1 = 0.005 m^2/s in 0.0001 m^2/s .. 0.015 m^2/s
            live param pull = 0 N in -2 N .. 2 N
            string line along 0 m .. {length} m {{
                position u in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s
                density {rho:e} kg/m
                load    tension * d2(u) - {:e} N*m^2 * d4(u)
                load    {:e} kg/m * (sigma1 * d2(u') - sigma0 * u')
                force   pull at {} m
                ends    pinned
                tuned   tension to {pitch} Hz
            }}
            let heard = u({} m)'
            let aside = u({} m)
            force none = 0 N
        }}",
        rho * kappa * kappa,
        2.0 * rho,
        0.4 * length,
        0.5 * length,
        0.4 * length,
    );
    common::compiled("violin.whip", &text, &[]).remove(0)
}

/// A string in the engine of the desktop.
struct Played<'c> {
    compiled: &'c Compiled,
    jit: JitCode,
    heard: usize,
}

impl Played<'_> {
    fn new(compiled: &Compiled) -> Played<'_> {
        let kernel = &compiled.lowered.kernel;
        let mut jit = JitCode::build(kernel, 1, Options { probes: true }).expect("a kernel");
        jit.init(&[0]);
        let mut exports = compiled.lowered.exports.iter();
        let heard = exports
            .position(|e| e.name == "heard")
            .expect("is exported");
        Played {
            compiled,
            jit,
            heard,
        }
    }

    fn set(&mut self, name: &str, value: f64) {
        let mut lives = self.compiled.model.lives.iter();
        let live = lives.position(|live| live.name == name).expect("is live");
        let word = self.compiled.lowered.lives[live].quantize(value);
        self.jit.set_live(live, word).expect("is live");
    }

    /// The rate in the middle, from a blow of a tick on.
    fn struck(&mut self, force_n: f64, seconds: f64) -> Vec<f64> {
        let heard = &self.compiled.lowered.exports[self.heard];
        let mut drive = [0_i16];
        (0..(seconds * RATE_HZ) as usize)
            .map(|tick| {
                if tick < 2 {
                    self.set("pull", [force_n, 0.0][tick]);
                }
                self.jit.tick(&[0], &mut drive);
                heard.value(self.jit.probes()[self.heard])
            })
            .collect()
    }
}

/// A partial in a Hann window: how large, and its phase (turns).
fn partial(signal: &[f64], start: f64, length: f64, f_hz: f64) -> (f64, f64) {
    let [start, length] = [start, length].map(|s| (s * RATE_HZ) as usize);
    let (mut re, mut im) = (0.0, 0.0);
    for (i, value) in signal[start..start + length].iter().enumerate() {
        let window = 0.5 - 0.5 * (TAU * i as f64 / length as f64).cos();
        let angle = TAU * f_hz * (start + i) as f64 / RATE_HZ;
        re += window * value * angle.cos();
        im -= window * value * angle.sin();
    }
    (re.hypot(im), im.atan2(re) / TAU)
}

/// How far the first mode is from a pitch (cents), and how fast it fades (1/s), from what is heard
/// in 0.3 s.
fn measured(heard: &[f64], f_hz: f64) -> (f64, f64) {
    let (first, second) = (
        partial(heard, 0.05, 0.1, f_hz),
        partial(heard, 0.15, 0.1, f_hz),
    );
    let turns = second.1 - first.1;
    let off_hz = (turns - turns.round()) / 0.1;
    let cents = 1200.0 * (1.0 + off_hz / f_hz).log2();
    (cents, (first.0 / second.0).ln() / 0.1)
}

#[test]
fn all_strings_are_in_tune_at_every_loss() {
    for string in VIOLINS {
        let f_hz = string[3];
        let compiled = violin(string, "live");
        let strand = compiled.model.strands.iter().next().expect("a string");
        let mut worst: f64 = 0.0;
        for knob in 0..9 {
            let part = f64::from(knob) / 8.0;
            let mut played = Played::new(&compiled);
            played.set("sigma0", 0.1 * (part * 100_f64.ln()).exp());
            played.set("sigma1", 1e-4 * (part * 150_f64.ln()).exp());
            let (cents, _) = measured(&played.struck(1.0, 0.3), f_hz);
            worst = worst.max(cents.abs());
        }
        println!(
            "{f_hz} Hz: {} points, sum {:.4}, at most {worst:.4} cents off",
            strand.parts - 1,
            compiled.lowered.strands[0].sum
        );
        assert!(worst < 0.1, "{f_hz} Hz is {worst} cents off");
    }
}

#[test]
fn the_first_mode_fades_as_its_losses_say() {
    for string in VIOLINS {
        let compiled = violin(string, "live");
        let (_, sigma) = measured(&Played::new(&compiled).struck(1.0, 0.3), string[3]);
        let told = 1.0 + 0.005 * (PI / string[0]).powi(2);
        let [t60, formula] = [sigma, told].map(|sigma| 3.0 * 10_f64.ln() / sigma);
        println!(
            "{} Hz: {t60:.4} s, by the formula {formula:.4} s",
            string[3]
        );
        assert!(
            (t60 / formula - 1.0).abs() < 0.01,
            "{t60} s, not {formula} s"
        );
    }
}

#[test]
fn rounding_is_far_below_a_pluck_of_a_tenth_of_a_millimetre() {
    let compiled = violin(VIOLINS[2], "");
    let mut played = Played::new(&compiled);
    let mut ideal = Ideal::new(&compiled.model, &Device::of(&compiled.model).scales(), 1);
    let named = |name: &str| {
        let mut all = compiled.model.named.iter();
        all.find(|n| n.name == name).expect("is named").value
    };
    let (heard, aside) = (named("heard"), named("aside"));
    let export = &compiled.lowered.exports[played.heard];
    let mut drive = [0_i16];
    let (mut level, mut noise, mut displaced): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let settled = (0.5 * RATE_HZ) as usize;
    for tick in 0..3 * settled {
        // Pulled slowly, let go at once.
        let pull = match tick < settled {
            true => 0.0772 * (tick as f64 / settled as f64 * 2.0).min(1.0),
            false => 0.0,
        };
        let word = compiled.lowered.lives[0].quantize(pull);
        played.set("pull", pull);
        ideal.set_live(0, f64::from(word) * compiled.lowered.lives[0].lsb);
        played.jit.tick(&[0], &mut drive);
        ideal.tick(&[0]);
        let real = ideal.value(0, heard);
        let integer = export.value(played.jit.probes()[played.heard]);
        displaced = displaced.max(ideal.value(0, aside));
        if tick >= settled {
            noise += (integer - real).powi(2);
        }
        if (settled..settled + 2205).contains(&tick) {
            level += real.powi(2);
        }
    }
    let [level, noise] = [level / 2205.0, noise / (2 * settled) as f64].map(f64::sqrt);
    let db = 20.0 * (noise / level).log10();
    println!("pulled {displaced:.2e} m aside, {level:.2e} m/s, noise {noise:.2e} m/s: {db:.1} dB");
    assert!((displaced - 1e-4).abs() < 1e-5, "{displaced}");
    assert!(db < -95.0, "{db} dB");
}

/// P, Q, V and R of a string whose losses are constant.
fn coefficients(compiled: &Compiled) -> [f64; 4] {
    let model = &compiled.model;
    let ideal = {
        let mut ideal = Ideal::new(model, &Device::of(model).scales(), 1);
        ideal.tick(&[0]);
        ideal
    };
    let strand = model.strands.iter().next().expect("a string");
    strand.coefficients.map(|c| ideal.value(0, c))
}

/// What a string holds, over half its mass a part: it never grows by itself. The scheme is one with
/// `A = 1/(1 + x)` and coefficients that differ by the third power of x.
fn energy(state: &RealStrand, [p, q, v, r]: [f64; 4]) -> f64 {
    let x = r / (2.0 - r);
    let [tension, stiffness, viscosity] = [p, q, v].map(|k| k * (1.0 + x));
    let last = state.u.len() - 1;
    let before: Vec<f64> = state.u.iter().zip(&state.v).map(|(u, v)| u - v).collect();
    let step = |u: &[f64], l: usize| u[l + 1] - u[l];
    let bend = |u: &[f64], l: usize| u[l + 1] - 2.0 * u[l] + u[l - 1];
    let moved: f64 = state.v.iter().map(|v| v * v).sum();
    let steps = (0..last).map(|l| [step(&state.u, l), step(&before, l)]);
    let stretched: f64 = steps
        .map(|[e, b]| tension * e * b - 0.5 * viscosity * (e - b).powi(2))
        .sum();
    let bent: f64 = (1..last)
        .map(|l| stiffness * bend(&state.u, l) * bend(&before, l))
        .sum();
    moved + stretched + bent
}

/// A string bent at random, softly.
fn bent(strand: &Strand, random: &mut Rng) -> RealStrand {
    let mut state = RealStrand::new(strand);
    let parts = strand.parts as usize;
    for mode in 1..8 {
        let mut draw = || random.below(2001) as f64 / 1000.0 - 1.0;
        let (a, b) = (1e-4 * draw() / f64::from(mode), 1e-6 * draw());
        for l in 1..parts {
            let shape = (PI * f64::from(mode) * l as f64 / parts as f64).sin();
            state.u[l] += a * shape;
            state.v[l] += b * shape;
        }
    }
    state
}

#[test]
fn energy_never_rises_without_a_bow() {
    let mut random = Rng::new(3);
    for string in [VIOLINS[0], VIOLINS[2], VIOLINS[7]] {
        let compiled = violin(string, "");
        let model = &compiled.model;
        let strand = model.strands.iter().next().expect("a string");
        let k = coefficients(&compiled);
        let mut ideal = Ideal::new(model, &Device::of(model).scales(), 1);
        ideal.tick(&[0]);
        let mut state = ideal.state(0).clone();
        state.strands = [bent(strand, &mut random)].into_iter().collect();
        ideal.adopt(0, state);
        let first = energy(of(&ideal), k);
        let mut last = first;
        for tick in 0..4410 {
            ideal.tick(&[0]);
            let now = energy(of(&ideal), k);
            assert!(
                now <= last + 1e-12 * first,
                "tick {tick}: {last:e} to {now:e}"
            );
            last = now;
        }
        println!(
            "{} Hz: {:.3} of the energy is left",
            string[3],
            last / first
        );
        assert!(last < 0.9 * first && last > 0.0);
    }
}

fn of<'i>(ideal: &'i Ideal) -> &'i RealStrand {
    ideal.state(0).strands.iter().next().expect("a string")
}

#[test]
fn energy_of_integers_rises_by_no_more_than_what_they_round() {
    let compiled = violin(VIOLINS[2], "");
    let lowered = compiled.lowered.strands[0];
    let k = coefficients(&compiled);
    let mut played = Played::new(&compiled);
    played.struck(2.0, 0.01);
    let mut drive = [0_i16];
    let off = lowered.error / RATE_HZ;
    let words = |jit: &JitCode| {
        let parts = compiled.model.strands[lowered.strand].parts;
        held(&lowered, parts, |cell, point| {
            let word = jit
                .memory()
                .cell(&compiled.lowered.kernel, 0, cell as usize, point);
            word.expect("is a word of the grid")
        })
    };
    let mut last = energy(&words(&played.jit), k);
    let (first, mut rises) = (last, 0);
    for tick in 0..20_000 {
        played.jit.tick(&[0], &mut drive);
        let state = words(&played.jit);
        let now = energy(&state, k);
        // Each rate is off by so much, and so is each displacement.
        let size = |of: &[f64]| of.iter().map(|x| x.abs()).sum::<f64>();
        let steps: Vec<f64> = state.u.windows(2).map(|u| u[1] - u[0]).collect();
        let reach = size(&state.v) + 2.0 * size(&steps) + state.v.len() as f64 * off;
        let bound = 2.0 * off * (reach + 4.0 * size(&steps));
        assert!(now <= last + bound, "tick {tick}: {last:e} to {now:e}");
        rises += usize::from(now > last);
        last = now;
    }
    println!(
        "{:.2e} of the energy is left, {rises} rises within the bound",
        last / first
    );
    assert!(last < 0.1 * first);
}

/// A string as integers hold it; `word` gives a word of a cell.
pub fn held(lowered: &LoweredStrand, parts: u32, word: impl Fn(u32, usize) -> i64) -> RealStrand {
    let [e, v] = lowered.cells;
    let parts = parts as usize;
    let mut sum = 0_i64;
    let grows = (0..parts).map(|part| {
        sum += word(e, part);
        sum as f64 * 0.5 * lowered.lsb
    });
    let u = std::iter::once(0.0).chain(grows).collect();
    let rates = (0..parts - 1).map(|point| word(v, point) as f64 * lowered.lsb);
    let [first, last] = [0.0; 2].map(std::iter::once);
    let v = first.chain(rates).chain(last).collect();
    RealStrand { u, v }
}

/// The strings of an interpreter.
pub fn adopted(compiled: &Compiled, interp: &Interp) -> Vec<RealStrand> {
    let strands = compiled.lowered.strands.iter();
    let word = |cell: u32, point: usize| {
        let word = interp.cell(0, cell as usize, point);
        word.expect("is a word of the grid")
    };
    strands
        .map(|lowered| held(lowered, compiled.model.strands[lowered.strand].parts, word))
        .collect()
}

/// Compares what a tick left of the strings, and gives how many rates that were.
pub fn stay_within(compiled: &Compiled, interp: &Interp, ideal: &Ideal) -> usize {
    let mut compared = 0;
    for (lowered, integers) in compiled
        .lowered
        .strands
        .iter()
        .zip(adopted(compiled, interp))
    {
        let real = &ideal.state(0).strands[lowered.strand];
        for (point, (integer, real)) in integers.v.iter().zip(&real.v).enumerate() {
            let off = (integer - real).abs() * RATE_HZ;
            let name = &compiled.model.strands[lowered.strand].name;
            assert!(
                off <= lowered.error,
                "`{name}`: point {point} is {off:e} m/s off, more than {:e}",
                lowered.error
            );
            compared += 1;
        }
    }
    compared
}

#[test]
fn what_is_held_lies_straight_and_still() {
    let text = include_str!("../programs/plucked_string.whip");
    let compiled = common::compiled("plucked_string.whip", text, &[]).remove(0);
    let mut interp = Interp::new(&compiled.lowered.kernel, 1).expect("verifies");
    let muted = compiled.model.lives.iter().position(|l| l.name == "muted");
    interp.init(&[0]);
    let mut drive = [0_i16];
    let words = common::gesture_words(&compiled);
    for (tick, word) in words.iter().take(40_000).enumerate() {
        interp.tick(&[*word], &mut drive);
        let is_still = |s: &RealStrand| s.u.iter().chain(&s.v).all(|x| *x == 0.0);
        let still = adopted(&compiled, &interp).iter().all(is_still);
        match tick {
            30_000 => {
                assert!(!still);
                interp
                    .set_live(muted.expect("is live"), 1)
                    .expect("is live");
            }
            30_001..35_000 => assert!(still),
            35_000 => interp
                .set_live(muted.expect("is live"), 0)
                .expect("is live"),
            _ => {}
        }
    }
}

#[test]
fn what_is_read_at_a_moving_place_has_a_bound() {
    let text = include_str!("../programs/plucked_string.whip");
    let compiled = common::compiled("plucked_string.whip", text, &[]).remove(0);
    for name in ["moving", "sloping"] {
        let mut exports = compiled.lowered.exports.iter();
        let export = exports.find(|e| e.name == name).expect("is shown");
        let part = export.error / export.range.high;
        println!("{name}: {part:.1e} of the range");
        assert!(part < 1e-3, "{name}: {part:e} of the range");
    }
}

#[test]
fn a_string_with_as_many_points_as_there_may_be_is_told_so() {
    let text = "instrument slack {
        sense x: length in 0 mm .. 10 mm
        string line along 0 m .. 1 m {
            position u in -8 mm .. 8 mm, rate in -4 m/s .. 4 m/s
            density 1e-3 kg/m
            load    0.1 N * d2(u) - 1e-3 N*s/m^2 * u'
            ends    pinned
        }
        force f = 1 N * d1(u, 0 m)
    }";
    let shell = crate::cli::Shell::new().with("slack.whip", text);
    let (out, told) = shell.ends(0, &["check", "slack.whip"]);
    let told = out + &told;
    assert!(
        told.contains("1023 points (the most that a string may have)"),
        "{told}"
    );
    let few = text.replace("0.1 N", "10 N");
    let shell = crate::cli::Shell::new().with("slack.whip", &few);
    let (out, told) = shell.ends(0, &["check", "slack.whip"]);
    let told = out + &told;
    assert!(!told.contains("the most"), "{told}");
}
