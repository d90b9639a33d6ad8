//! Kernels in C against the interpreter, bit for bit: outputs, probes, events, cells, through
//! GCC and Clang, here and on a Cortex-M33 in QEMU.
//!
//! ```text
//! cargo test --test c                             every instrument, on everything recorded; 5000 random kernels here, and in QEMU
//! WHIPPEN_KERNELS=100000 cargo test --test c      so many
//! WHIPPEN_TICKS=2646000 cargo test --test c minute    a minute of noise for what has strings
//! WHIPPEN_PROGRAMS=20000 WHIPPEN_TICKS=10000 WHIPPEN_RESUME=search-c.txt cargo test --test c programs -- --nocapture
//! ```

mod case;
mod program;
mod recordings;
mod toolchain;

#[path = "../it/common.rs"]
#[expect(dead_code, reason = "other tests want more of it")]
mod common;

#[path = "../it/random_programs/progress.rs"]
mod progress;
#[path = "../it/random_programs/text.rs"]
mod text;
#[path = "../it/minute/words.rs"]
mod words;

use whippen_compiler::c99::{Layout, Options, source};
use whippen_compiler::kernel::random::{self, Rng};
use whippen_compiler::kernel::{Kernel, parse, verify, without_probes};

use case::Case;
use program::{agree, agree_on};
use progress::Progress;
use toolchain::{Find, Toolchain, clang, cortex_m33, gcc};

const LAYOUTS: [Layout; 2] = [Layout::Records, Layout::Columns];

/// How random kernels are compiled: quickly, some with care, and some looking for what C leaves
/// undefined. Some compute with constants alone, or use nothing of what they compute, so warnings
/// are of no interest.
const QUICK: &[&str] = &["-O0", "-w"];
const OPTIMIZED: &[&str] = &["-O2", "-w"];
const CHECKED: &[&str] = &[
    "-O1",
    "-w",
    "-fsanitize=undefined",
    "-fno-sanitize-recover=all",
];

/// How everything else is compiled: no warning, but that several kernels in one file say the same
/// twice.
const STRICT: [&str; 7] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wno-unused-variable",
    "-Wno-unused-but-set-variable",
    "-Wno-typedef-redefinition",
    "-Werror",
];

/// How many of them one program holds: all of their code fits 4 MB.
const BATCH: usize = 250;

/// How many random kernels, where the environment does not say.
const KERNELS: usize = 5_000;

fn kernels() -> usize {
    whippen_need::count("WHIPPEN_KERNELS", KERNELS)
}

fn random_case(seed: usize) -> Case {
    let kernel = random::kernel(seed as u64);
    Case::random(kernel, LAYOUTS[seed % 2], &mut Rng::new(seed as u64))
}

/// So many of them, from the `first` on.
fn agree_on_random(compiler: &Toolchain, first: usize, count: usize) {
    agree_on(compiler, count, BATCH, |number| random_case(first + number));
}

/// Half of the random kernels: GCC and Clang have one each.
fn half(find: Find, which: usize) {
    if let Some(compiler) = find(QUICK) {
        let share = kernels().div_ceil(2);
        agree_on_random(&compiler, which * share, share);
    }
}

#[test]
fn random_kernels_by_gcc() {
    half(gcc, 0);
}

#[test]
fn random_kernels_by_clang() {
    half(clang, 1);
}

#[test]
fn random_kernels_on_a_cortex_m33() {
    if let Some(compiler) = cortex_m33(QUICK) {
        agree_on_random(&compiler, 0, kernels());
    }
}

/// Some more, made with care.
fn fewer(find: Find, flags: &[&str]) {
    if let Some(compiler) = find(flags) {
        agree_on_random(&compiler, kernels(), kernels() / 50);
    }
}

#[test]
fn random_kernels_optimized_by_gcc() {
    fewer(gcc, OPTIMIZED);
}

#[test]
fn random_kernels_checked_by_gcc() {
    fewer(gcc, CHECKED);
}

#[test]
fn random_kernels_optimized_by_clang() {
    fewer(clang, OPTIMIZED);
}

#[test]
fn random_kernels_optimized_on_a_cortex_m33() {
    fewer(cortex_m33, OPTIMIZED);
}

/// For the processor at hand. Clang 19 takes features of some together that exclude each other, and
/// says so itself.
const NATIVE: &[&str] = &[
    "-O3",
    "-march=native",
    "-Wno-unknown-warning-option",
    "-Wno-invalid-feature-combination",
];

/// Everything that is exported, in both layouts, by a strict compiler.
fn instruments(find: Find, mode: &[&str]) {
    let Some(compiler) = find(&[&STRICT, mode].concat()) else {
        return;
    };
    let mut cases = Vec::new();
    for compiled in common::all_and_programs() {
        let all = common::gesture_words(&compiled);
        let rows = all.chunks(compiled.model.senses.len());
        // What is played once takes longer: two of it, and fewer rows.
        let (step, keys) = if compiled.model.is_of_key() {
            (7, 5)
        } else {
            (41, 2)
        };
        let words = rows.step_by(step).collect::<Vec<_>>().concat();
        let bare = without_probes(&compiled.lowered.kernel);
        cases.push(Case::played(
            compiled.lowered.kernel,
            LAYOUTS[0],
            &words,
            keys,
        ));
        cases.push(Case::played(bare, LAYOUTS[1], &words, keys));
    }
    agree(&compiler, &cases);
    println!("{compiler}: {} cases agree", cases.len());
}

#[test]
fn instruments_by_gcc() {
    instruments(gcc, &["-O2"]);
    instruments(gcc, NATIVE);
}

#[test]
fn instruments_checked_by_gcc() {
    instruments(gcc, &CHECKED[2..]);
}

#[test]
fn instruments_by_clang() {
    instruments(clang, &["-O2"]);
    instruments(clang, NATIVE);
}

#[test]
fn instruments_on_a_cortex_m33() {
    instruments(cortex_m33, &["-O2"]);
}

/// What has strings, frictions and delay lines under words and live values at random.
fn minute(mode: &[&str]) {
    if let Some(compiler) = gcc(mode) {
        for file in ["bowed-violin.whip", "rubbed-bank.whip", "keytar.whip"] {
            let kernel = common::instruments(file, &[]).remove(0).lowered.kernel;
            let case = Case::noise(without_probes(&kernel), LAYOUTS[0], words::ticks());
            agree(&compiler, &[case]);
            println!("{compiler}: {file}, {} ticks", words::ticks());
        }
    }
}

#[test]
fn minute_by_gcc() {
    minute(OPTIMIZED);
}

#[test]
fn minute_checked_by_gcc() {
    minute(CHECKED);
}

/// Each instrument of a key on each motion of one.
fn instruments_on_recordings(find: Find) {
    let (Some(motions), Some(compiler)) = (recordings::all(), find(OPTIMIZED)) else {
        return;
    };
    let kernels: Vec<Kernel> = common::of_keys()
        .into_iter()
        .filter(|compiled| !compiled.model.turns())
        .map(|compiled| without_probes(&compiled.lowered.kernel))
        .collect();
    let cases = motions.len() * kernels.len();
    assert!(cases > 0, "no motions or no instruments");
    agree_on(&compiler, cases, 1, |number| {
        let (_, words) = &motions[number / kernels.len()];
        Case::played(
            kernels[number % kernels.len()].clone(),
            Layout::Records,
            words,
            1,
        )
    });
    println!(
        "{} motions: {:?}",
        motions.len(),
        motions.iter().map(|(name, _)| name).collect::<Vec<_>>()
    );
}

#[test]
fn instruments_on_recordings_by_gcc() {
    instruments_on_recordings(gcc);
}

#[test]
fn instruments_on_recordings_on_a_cortex_m33() {
    instruments_on_recordings(cortex_m33);
}

const SMALL: &str = "\
kernel spring @44100 {
  in x: u16 [100..65535]
  out f: i16 [-32768..32767]
  live k: i32 [-8..8] = 3
  keyed gain: i32 [1..9] = { 1, 2, 9 }
  cell phi': i32 [-70000..70000] = 0
  line past: 2 [0..65535]
  event crossed(1)
  tick {
    v0: i32 [100..65535] = in x
    v1: i32 [0..65535] = delay past 2
    v2: i32 [-65435..65535] = sub v0 v1
    v3: i32 [-8..8] = live k
    v4: i32 [1..9] = keyed gain
    v5: i32 [-72..72] = mul v3 v4
    v6: i64 [-4718520..4718520] = mul_wide v2 v5
    v7: i64 [-73727..73727] = sar_round v6 6
    v8: i32 [-73727..73727] = narrow v7
    v9: i32 [70000..70000] = const 70000
    v10: i32 [-70000..-70000] = const -70000
    v11: i32 [-73727..70000] = min v8 v9
    v12: i32 [-70000..70000] = max v11 v10
    v13: i1 [0..1] = lt v0 v1
    v14: i32 [-35000..35000] = if v13 {
      emit crossed v12
      v15: i32 [-35000..35000] = sar v12 1
      yield v15
    } else {
      v16: i32 [0..0] = const 0
      yield v16
    }
    set phi' v12
    v17: i32 [-17500..17500] = sar v12 2
    out f v17
    push past v0
  }
}
";

fn small() -> Kernel {
    parse(SMALL).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_small_kernel_reads_well() {
    for (layout, name) in LAYOUTS.into_iter().zip(["records", "columns"]) {
        let kernel = small();
        let verified = verify(&kernel).unwrap_or_else(|e| panic!("{e:?}"));
        let source = source(
            verified,
            Options {
                keys: 3,
                layout,
                events: 8,
            },
        );
        insta::assert_snapshot!(
            format!("small_kernel_{name}"),
            format!("{}\n{}", source.header, source.body)
        );
    }
}

/// How many random programs, where the environment does not say, and how many C holds together.
const PROGRAMS: u64 = 8;
const TOGETHER: u64 = 4;

/// Random programs under words and live values at random, by GCC and Clang in turns.
#[test]
fn random_programs() {
    let (Some(gcc), Some(clang)) = (gcc(QUICK), clang(QUICK)) else {
        return;
    };
    let all = whippen_need::count("WHIPPEN_PROGRAMS", PROGRAMS);
    let mut progress = Progress::resume();
    while progress.programs < all {
        let batch = (progress.programs..all).take(TOGETHER as usize);
        let case = |seed: u64| {
            let name = format!("random {seed}");
            let compiled = common::compiled(&name, &text::program(seed), &[]).remove(0);
            let kernel = without_probes(&compiled.lowered.kernel);
            Case::noise(kernel, LAYOUTS[seed as usize % 2], words::ticks())
        };
        let cases: Vec<Case> = batch.map(case).collect();
        let compiler = [&gcc, &clang][(progress.programs / TOGETHER % 2) as usize];
        agree(compiler, &cases);
        progress.add(cases.len() as u64, (cases.len() * words::ticks()) as u64);
        println!("{} programs, {} ticks", progress.programs, progress.ticks);
    }
    assert!(progress.ticks > 0);
}
