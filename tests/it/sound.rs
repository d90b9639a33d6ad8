//! Noise, delay lines, glides and sound.

use std::f64::consts::TAU;

use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::lower::ExportKind;
use whippen_compiler::model::Noise;
use whippen_compiler::pipeline::Compiled;

use crate::cli::Shell;
use crate::common;

const RATE_HZ: f64 = 44_100.0;

/// The value of an export in every tick, of a key that is pressed at once.
fn pressed(compiled: &Compiled, name: &str, seconds: f64) -> Vec<f64> {
    let exports = &compiled.lowered.exports;
    let at = exports
        .iter()
        .position(|e| e.name == name)
        .expect("is exported");
    let options = Options { probes: true };
    let mut jit = JitCode::build(&compiled.lowered.kernel, 1, options).expect("a kernel");
    jit.init(&[0]);
    let outputs = compiled.lowered.kernel.outputs.len();
    let mut drive = vec![0_i16; outputs];
    let ticks = (seconds * RATE_HZ) as usize;
    let tick = |tick: usize| {
        jit.tick(&[if tick < 100 { 0 } else { 65_535 }], &mut drive);
        exports[at].value(jit.probes()[at])
    };
    (0..ticks).map(tick).collect()
}

fn sound(sets: &[(&str, &str)]) -> Compiled {
    let text = include_str!("../programs/sound.whip");
    common::compiled("sound.whip", text, sets).remove(0)
}

/// Phase (turns) of a partial in a Hann window.
fn phase(signal: &[f64], start: usize, length: usize, f_hz: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (i, value) in signal[start..start + length].iter().enumerate() {
        let window = 0.5 - 0.5 * (TAU * i as f64 / length as f64).cos();
        let angle = TAU * f_hz * (start + i) as f64 / RATE_HZ;
        re += window * value * angle.cos();
        im -= window * value * angle.sin();
    }
    im.atan2(re) / TAU
}

/// How far the first partial of what is heard is from a pitch (cents).
fn cents_off(signal: &[f64], f_hz: f64) -> f64 {
    let length = (0.1 * RATE_HZ) as usize;
    let (first, second) = ((0.1 * RATE_HZ) as usize, (0.2 * RATE_HZ) as usize);
    let turns = phase(signal, second, length, f_hz) - phase(signal, first, length, f_hz);
    let off_hz = (turns - turns.round()) / (0.1 * 1.0);
    1200.0 * (1.0 + off_hz / f_hz).log2()
}

#[test]
fn a_plucked_string_is_in_tune_and_ends_in_silence() {
    for (pitch, f_hz, ring, seconds) in [
        ("82.4069 Hz", 82.4069, "0.9", 12.0),
        ("329.6276 Hz", 329.6276, "0.997", 8.0),
        ("1318.51 Hz", 1318.51, "0.997", 3.0),
    ] {
        let compiled = sound(&[("pitch", pitch), ("ring", ring)]);
        let heard = pressed(&compiled, "string", seconds);
        let loud = heard.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let off = cents_off(&heard, f_hz);
        let last = heard.iter().rposition(|v| *v != 0.0).expect("is heard");
        let silent_s = last as f64 / RATE_HZ;
        println!("{pitch}: {off:.4} cents, {loud:.2}, silent after {silent_s:.2} s");
        assert!(loud > 0.1, "{pitch}: {loud}");
        assert!(off.abs() < 0.1, "{pitch}: {off} cents");
        assert!(
            silent_s < seconds - 0.1,
            "{pitch}: still heard after {silent_s} s"
        );
    }
}

#[test]
fn a_glide_makes_no_step_however_it_is_set() {
    let compiled = sound(&[]);
    let kernel = &compiled.lowered.kernel;
    let live = compiled.model.lives.iter().position(|l| l.name == "volume");
    let live = live.expect("is live");
    let exports = &compiled.lowered.exports;
    let at = exports
        .iter()
        .position(|e| e.name == "volume.glide")
        .expect("is exported");
    let mut interp = Interp::new(kernel, 1).expect("verifies");
    let mut random = Rng::new(7);
    interp.init(&[0]);
    let (mut drive, mut last, mut moved) = ([0_i16], 0.5, 0.0_f64);
    // Over the whole range in 20 ms, and the last bit of what is kept.
    let step = 1.0 / (0.02 * RATE_HZ) + exports[at].lsb;
    for tick in 0..40_000 {
        if tick % 97 == 0 {
            let value = random.below(1 << 20) as f64 / f64::from(1 << 20);
            let meaning = compiled.lowered.lives[live];
            interp
                .set_live(live, meaning.quantize(value))
                .expect("is a live value");
        }
        interp.tick(&[0], &mut drive);
        let value = exports[at].value(interp.probes()[at]);
        assert!(
            (value - last).abs() <= step,
            "tick {tick}: {last} to {value}"
        );
        moved = moved.max((value - last).abs());
        last = value;
    }
    assert!(moved > 0.9 * step, "{moved}");
}

#[test]
fn noise_differs_from_member_to_member_of_a_bank() {
    let text = "instrument i {
        sense x: length in 0 mm .. 10 mm
        bank all over n in 0 .. 2 { noise hiss let loud = hiss }
        force f = 1 N * sum(all.loud)
    }";
    let compiled = common::compiled("noise.whip", text, &[]).remove(0);
    let mut words: Vec<u32> = compiled.model.noises.iter().map(|n| n.first(0)).collect();
    assert_eq!(words.len(), 3);
    let correlation = |words: &mut Vec<u32>, a: usize, b: usize| -> f64 {
        let mut sum = 0.0;
        for _ in 0..10_000 {
            words.iter_mut().for_each(|word| *word = Noise::stir(*word));
            sum += Noise::value(words[a]) * Noise::value(words[b]);
        }
        3.0 * sum / 10_000.0
    };
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        let found = correlation(&mut words, a, b);
        assert!(found.abs() < 0.05, "{a} {b}: {found}");
    }
    assert!((correlation(&mut words, 1, 1) - 1.0).abs() < 0.05);
}

#[test]
fn noise_is_the_same_words_everywhere_and_differs_from_key_to_key() {
    let text = "instrument i { noise hiss sense x: length in 0 mm .. 10 mm force f = 1 N * hiss }
                keyboard k { board rp2350 rate 44100 Hz keys C4 .. D4 programs i }";
    let compiled = common::compiled("noise.whip", text, &[]).remove(0);
    let noise = compiled.model.noises.iter().next().expect("a noise");
    assert_eq!(noise.seeds.len(), 3);
    let mut words: Vec<u32> = (0..3).map(|key| noise.first(key)).collect();
    assert!(words[0] != words[1] && words[1] != words[2]);
    let total = compiled
        .lowered
        .exports
        .iter()
        .position(|e| matches!(e.kind, ExportKind::Total(_)));
    let total = total.expect("is exported");
    let export = &compiled.lowered.exports[total];
    let mut interp = Interp::new(&compiled.lowered.kernel, 3).expect("verifies");
    interp.init(&[0; 3]);
    let (mut drive, mut sums) = ([0_i16; 3], [0.0; 2]);
    for _ in 0..20_000 {
        interp.tick(&[0; 3], &mut drive);
        for (key, word) in words.iter_mut().enumerate() {
            let of_key = interp.probes()[key * compiled.lowered.exports.len() + total];
            let (seen, told) = (export.value(of_key), Noise::value(*word));
            assert!((seen - told).abs() <= export.error + 1e-12, "{seen} {told}");
            *word = Noise::stir(*word);
            sums = [sums[0] + told, sums[1] + told * told];
        }
    }
    // White between -1 and 1: no mean, a variance of a third.
    let [mean, square] = sums.map(|sum| sum / 60_000.0);
    assert!(
        mean.abs() < 0.01 && (square - 1.0 / 3.0).abs() < 0.01,
        "{mean} {square}"
    );
}

#[test]
fn a_delay_line_gives_what_was_fed_between_ticks_too() {
    let text = "instrument i {
        sense x: length in 0 mm .. 10 mm
        live param back = 3 ms in 1 ms .. 10 ms
        delay past: length in 0 mm .. 10 mm lasting 10 ms
        feed past = x
        let whole = past(441 * tick)
        let half  = past(100.5 * tick)
        let moved = past(back)
        force f = 1 N/m * (whole + half + moved)
    }";
    let compiled = common::compiled("delay.whip", text, &[]).remove(0);
    let exports = &compiled.lowered.exports;
    let at = |name: &str| {
        exports
            .iter()
            .position(|e| e.name == name)
            .expect("is exported")
    };
    let mut interp = Interp::new(&compiled.lowered.kernel, 1).expect("verifies");
    let mut random = Rng::new(3);
    let words: Vec<u16> = (0..4000).map(|_| random.next() as u16).collect();
    let mut drive = [0_i16];
    interp.init(&[words[0]]);
    let mut fed: Vec<f64> = Vec::new();
    // 24 bits of the range, cut off, and what is between two ticks.
    let (lsb, width) = (2e-9, 0.01);
    for (tick, word) in words.iter().enumerate() {
        let back_s = 1e-3 + 9e-3 * (random.below(1000) as f64 / 999.0);
        interp
            .set_live(0, compiled.lowered.lives[0].quantize(back_s))
            .expect("is a live value");
        interp.tick(&[*word], &mut drive);
        let value = |name: &str| exports[at(name)].value(interp.probes()[at(name)]);
        let ago = |ticks: f64| {
            let of = |n: usize| match tick.checked_sub(n) {
                Some(then) => fed[then],
                None => 0.0,
            };
            let (near, far) = (ticks.floor() as usize, ticks.floor() as usize + 1);
            let [near, far] = [near, far].map(of);
            near + ticks.fract() * (far - near)
        };
        let error = |name: &str, told: f64| {
            let error = (value(name) - told).abs();
            assert!(
                error <= exports[at(name)].error + lsb,
                "tick {tick}, {name}: {error:e}"
            );
        };
        error("whole", ago(441.0));
        error("half", ago(100.5));
        error("moved", ago(back_s * RATE_HZ));
        assert!(exports[at("moved")].error < 1e-4 * width);
        fed.push(value("x"));
    }
}

#[test]
fn a_run_writes_what_is_heard() {
    let text = "instrument i {
        sense x: length in 0 mm .. 10 mm
        force spring = 80 N/m * x
        sound a on left = 300 m^-1 * x
        sound b = 10 m^-1 * x
    }";
    let shell = Shell::new().with("i.whip", text).with(
        "click.whip",
        "instrument c { sense x: length in 0 mm .. 10 mm force f = 1 N/m * x }",
    );
    let files = ["--out", "i.wav", "--out", "i.csv", "--exact"];
    let (out, err) = shell.ends(
        0,
        &[&["run", "i.whip", "--seconds", "2"], &files[..]].concat(),
    );
    assert_eq!(err, "");
    assert!(
        out.contains("sound: i.wav") && out.contains("clipped at full scale"),
        "{out}"
    );
    let bytes = std::fs::read(shell.path("i.wav")).expect("is written");
    let word = |at: usize, len: usize| {
        let bytes = bytes[at..at + len].iter().rev();
        bytes.fold(0_u32, |word, byte| word << 8 | u32::from(*byte))
    };
    // Two channels, the rate, 24 bits; an extensible header has 68 bytes.
    assert_eq!((&bytes[..4], &bytes[8..12]), (&b"RIFF"[..], &b"WAVE"[..]));
    assert_eq!((word(22, 2), word(24, 4), word(34, 2)), (2, 44_100, 24));
    let data = bytes
        .windows(4)
        .position(|four| four == b"data")
        .expect("samples");
    let samples: Vec<i32> = bytes[data + 8..]
        .chunks(3)
        .map(|s| i32::from_le_bytes([0, s[0], s[1], s[2]]) >> 8)
        .collect();
    let rows = shell.lines("i.csv");
    let titles: Vec<&str> = rows[0].split(',').collect();
    let column = |title: &str| titles.iter().position(|t| *t == title).expect(title);
    let (left, right) = (column("channel_left"), column("channel_right"));
    assert_eq!(samples.len(), 2 * (rows.len() - 1));
    for (row, sample) in rows[1..].iter().zip(samples.chunks(2)) {
        let values: Vec<f64> = row
            .split(',')
            .map(|v| v.parse().expect("a number"))
            .collect();
        for (value, sample) in [values[left], values[right]].into_iter().zip(sample) {
            assert!(
                (value * 8_388_607.0 - f64::from(*sample)).abs() <= 0.51,
                "{row}"
            );
        }
    }
    // A picture has the panel of the sound, and a spectrogram of each channel.
    shell.ends(0, &["run", "i.whip", "--plot", "i.svg"]);
    let picture = shell.lines("i.svg").concat();
    for text in [
        ">sound<",
        ">channel left: spectrum (Hz)<",
        ">channel right: spectrum (Hz)<",
    ] {
        assert!(picture.contains(text), "{text}");
    }
    assert_eq!(picture.matches("href=\"data:image/png;base64,").count(), 2);
    let none = ["run", "click.whip", "--out", "c.wav"];
    shell.refuses(2, &none, &["`c` has no sound", "sound out = .."]);
    let twice = ["run", "i.whip", "--out", "a.wav", "--out", "b.wav"];
    shell.refuses(2, &twice, &["`b.wav` is a second file of its kind"]);
}

/// A key, of which each core has one at least, and an instrument that is played once.
#[test]
fn boards_let_hear_what_the_reference_does() {
    let (_, bead) = common::PROGRAMS
        .into_iter()
        .find(|(name, _)| *name == "two-axis-spring.whip")
        .expect("a program");
    let click = "    noise hiss
    sound far on left = 8 m^-1 * x + 0.01 * hiss
    sound low = 12 m^-1 * y
}";
    let bead = bead
        .trim_end()
        .strip_suffix('}')
        .expect("a bracket")
        .to_string()
        + click;
    let shell = Shell::new()
        .with("bead.whip", &bead)
        .with("plucked.whip", include_str!("../programs/sound.whip"))
        .with("loud.whip", "instrument l { sense x: length in 0 mm .. 10 mm force f = 9 N/m * x noise hiss sound a = 1.5 * hiss + 150 m^-1 * x }");
    let play = |file: &str, seconds: &str, more: &[&str]| {
        let run = ["run", file, "--seconds", seconds, "--out", "heard.wav"];
        let (out, _) = shell.ends(0, &[&run[..], more].concat());
        let clipped = out.lines().find(|line| line.contains("clipped at full"));
        let bytes = std::fs::read(shell.path("heard.wav")).expect("is written");
        (bytes, clipped.map(str::to_string))
    };
    // The string is plucked after 0.4 s; two lines and an allpass are too much for an M0+.
    let every = ["rp2350", "stm32f4", "rp2040"];
    for (file, seconds, boards) in [
        ("bead.whip", "0.1", &every[..]),
        ("plucked.whip", "0.45", &every[..2]),
        ("loud.whip", "0.1", &every[..]),
    ] {
        let expected = play(file, seconds, &["--engine", "interp"]);
        let samples = expected.0[100..].chunks(3);
        let sounds = samples.filter(|sample| **sample != [0; 3]).count();
        assert!(sounds > 1000, "{file}: {sounds} samples that are not 0");
        assert_eq!(expected.1.is_some(), file == "loud.whip", "{file}");
        assert!(play(file, seconds, &[]) == expected, "{file}: jit");
        for board in boards {
            let on_board = ["--engine", "emulated", "--board", board];
            let found = play(file, seconds, &on_board);
            assert!(found == expected, "{file} on {board}");
        }
    }
    let found = play("loud.whip", "0.1", &["--engine", "emulated", "--keys", "5"]);
    let expected = play("loud.whip", "0.1", &[]);
    assert!(found == expected, "of five keys one is heard");
}
