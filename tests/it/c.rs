//! Kernels in C against the interpreter, bit for bit: outputs, probes, events, cells, through whatever C compilers there are.
//!
//! ```text
//! cargo test --test it c::                                                          every instrument, 320 random kernels
//! WHIPPEN_KERNELS=10000 cargo test --release --test it c:: -- --include-ignored     as many as one likes
//! ```

mod harness;

use whippen_compiler::c::{Layout, Options, source};
use whippen_compiler::kernel::random::{self, Rng};
use whippen_compiler::kernel::{Kernel, parse, verify, without_probes};

use crate::common;
use harness::{Case, Compiler, compilers};

const LAYOUTS: [Layout; 2] = [Layout::Records, Layout::Columns];

/// How random kernels are compiled: quickly, and looking for what C leaves undefined. Some compute with constants alone,
/// or use nothing of what they compute, so warnings are of no interest.
const QUICK: &[&str] = &["-O2", "-w"];
const CHECKED: &[&str] = &["-O1", "-w", "-fsanitize=undefined", "-fno-sanitize-recover=all"];

fn random_case(seed: u64) -> Case {
    let kernel = random::kernel(seed);
    let layout = LAYOUTS[(seed % 2) as usize];
    Case::random(kernel, layout, &mut Rng::new(seed))
}

fn agree_on(compiler: &Compiler, seeds: std::ops::Range<u64>) {
    let cases: Vec<Case> = seeds.map(random_case).collect();
    harness::agree(compiler, &cases);
}

#[test]
fn random_kernels() {
    for compiler in compilers(QUICK) {
        agree_on(&compiler, 0..120);
        agree_on(&compiler, 120..240);
    }
}

#[test]
fn random_kernels_do_nothing_undefined() {
    for compiler in compilers(CHECKED).into_iter().take(1) {
        agree_on(&compiler, 240..320);
    }
}

#[test]
#[ignore = "as long as WHIPPEN_KERNELS says"]
fn random_kernels_at_length() {
    let count = std::env::var("WHIPPEN_KERNELS").ok().and_then(|count| count.parse().ok()).unwrap_or(10_000);
    for compiler in compilers(QUICK) {
        (320..320 + count).step_by(200).for_each(|first| agree_on(&compiler, first..first + 200));
    }
}

/// Instruments without a warning, at full optimisation and with undefined behaviour looked for.
#[test]
fn instruments() {
    let strict = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-variable", "-Wno-unused-but-set-variable", "-Werror"];
    let positions = common::gesture();
    let words: Vec<u16> = common::words(&positions).into_iter().step_by(7).collect();
    for mode in [&["-O2"][..], &["-O3", "-march=native"], &CHECKED[2..]] {
        for compiler in compilers(&[&strict, mode].concat()) {
            let mut cases = Vec::new();
            for compiled in common::all() {
                for (layout, kernel) in
                    LAYOUTS.into_iter().zip([&compiled.lowered.kernel, &without_probes(&compiled.lowered.kernel)])
                {
                    cases.push(Case::played(kernel.clone(), layout, &words));
                }
            }
            harness::agree(&compiler, &cases);
        }
    }
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
        let source = source(verified, Options { keys: 3, layout, events: 8 });
        insta::assert_snapshot!(format!("small_kernel_{name}"), format!("{}\n{}", source.header, source.body));
    }
}
