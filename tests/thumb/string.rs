//! Strings on the emulated cores: cycles of a tick, and what it leaves, against the interpreter.

use crate::target::{CORES, Target};
use whippen_compiler::kernel::{Interp, parse};
use whippen_compiler::modes::Modes;

/// A string of so many parts, and its tick.
fn kernel(parts: u32, [left, right]: [u32; 2]) -> String {
    let points = parts - 1;
    format!(
        "kernel string @44100 {{
  in x: u16 [0..65535]
  cell e: i32 x {parts} [-2147483648..2147483647] = 0
  cell v: i32 x {points} [-2147483648..2147483647] = 0
  init {{
    v0: i32 [0..65535] = in x
    v1: i32 [2..2] = const 2
    v2: i32 [0..2147450880] = shl v0 15
    set_at e v1 v2
  }}
  tick {{
    v3: i32 [1500000000..1500000000] = const 1500000000
    v4: i32 [-200000000..-200000000] = const -200000000
    v5: i32 [30000000..30000000] = const 30000000
    v6: i32 [-70000000..-70000000] = const -70000000
    v7: i32 [{left}..{left}] = const {left}
    v8: i32 [{right}..{right}] = const {right}
    wave e v v3 v4 v5 v6 v7 v8
  }}
}}
"
    )
}

/// Runs a string on all cores; gives the cycles of its longest tick on each, and the bound.
fn compare(parts: u32, ends: [u32; 2]) -> [[u64; 2]; 3] {
    let kernel = parse(&kernel(parts, ends)).expect("parses");
    CORES.map(|core| {
        let mut interp = Interp::new(&kernel, 1).expect("verifies");
        let mut target = Target::new(&Modes::single(&kernel), 1, core);
        interp.init(&[60_000]);
        target.init(&[60_000]);
        let mut cycles = 0;
        for tick in 0..40 {
            interp.tick(&[0], &mut []);
            target.tick(&[0]);
            cycles = cycles.max(target.cycles);
            let words = [(0, parts), (1, parts - 1)];
            for (cell, word) in words
                .into_iter()
                .flat_map(|(cell, n)| (0..n).map(move |at| (cell, at)))
            {
                let told = || {
                    format!(
                        "{}, {parts} parts, tick {tick}, {cell}[{word}]",
                        core.name()
                    )
                };
                let want = interp.cell(0, cell, word as usize);
                assert_eq!(Some(target.cell(0, cell, word)), want, "{}", told());
            }
        }
        let bound = target.cycles_max();
        assert!(cycles <= bound, "{}: {cycles}, bound {bound}", core.name());
        [cycles, bound]
    })
}

#[test]
fn every_end_and_every_number_of_points() {
    for ends in [[0, 0], [2, 0], [0, 2], [2, 2]] {
        for parts in [6, 7, 8, 9, 33, 34] {
            compare(parts, ends);
        }
    }
}

#[test]
fn a_point_takes_thirteen_cycles() {
    let all = [32, 45, 62, 81].map(|parts| (parts, compare(parts, [0, 0])));
    for (parts, cycles) in all {
        println!("{parts}: {cycles:?}");
    }
    let [(first, few), .., (last, many)] = all;
    let of_point = |core: usize| {
        [0, 1].map(|at| (many[core][at] - few[core][at]).div_ceil(u64::from(last - first)))
    };
    assert_eq!([0, 1, 2].map(of_point), [[13, 13], [14, 14], [143, 152]]);
}
