//! Foreign code: C, C++ and assembly compiled by the GNU toolchain, run here and by QEMU, with the
//! same output and exit code.
//!
//! QEMU is the judge in the same run; nothing is recorded.

mod tools;

use std::path::Path;

use tools::{Build, TARGETS, have_all};
use whippen_emulator::elf::{Elf, regions_for, vector_table};
use whippen_emulator::{Board, Machine, Region, Stop};

/// Cycles after which a program is lost.
const CYCLES_MAX: u64 = 200_000_000;

/// Runs an image until it exits: its output and its exit code.
fn emulated(image: &Path, build: &Build) -> (String, u32) {
    let bytes = std::fs::read(image).expect("the image was just built");
    let elf = Elf::parse(&bytes, false).unwrap_or_else(|e| panic!("{build}: {e}"));
    assert_eq!(
        elf.arch,
        Some(build.target.core.arch()),
        "{build}: build attributes"
    );
    let runs = regions_for(&elf, &[]).expect("a small image");
    let region = |(base, size, writable)| match writable {
        true => Region::ram("ram", base, size),
        false => Region::rom("rom", base, size),
    };
    let regions = runs.into_iter().map(region).collect();
    let vector_table = vector_table(&elf).expect("a vector table");
    let board = Board {
        regions,
        vector_table,
        ..Board::generic(build.target.core)
    };
    let mut machine = Machine::new(board).expect("a board");
    machine.semihosting.enabled = true;
    elf.load(&mut machine.bus.memory, false)
        .expect("memory is there");
    machine.reset();
    let stop = machine.run(CYCLES_MAX);
    let output = String::from_utf8_lossy(&machine.semihosting.output).into_owned();
    match stop {
        Stop::Exit { code } => (output, code),
        other => panic!("{build}: {other}\n{output}"),
    }
}

/// One program on every core, at every level of optimization.
fn agrees_with_qemu(program: &str) {
    if !have_all() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut outputs = 0;
    for build in TARGETS.iter().flat_map(|t| Build::all(program, t)) {
        let image = build.compile(folder.path());
        let judged = build.qemu(&image);
        assert_eq!(judged.1, 0, "{build} fails in QEMU:\n{}", judged.0);
        assert!(!judged.0.is_empty(), "{build} says nothing");
        assert_eq!(emulated(&image, &build), judged, "{build}");
        outputs += 1;
    }
    println!("{program}: {outputs} images agree with QEMU");
}

macro_rules! programs {
    ($($name:ident $what:literal,)+) => { $(
        #[doc = $what]
        #[test]
        fn $name() {
            agrees_with_qemu(stringify!($name));
        }
    )+ };
}

programs! {
    mixed "lists, matrices, a state machine, CRC",
    aes "AES-128 with known vectors",
    dsp "FFT, FIR and biquad in fixed point",
    simd "the DSP extension, instruction by instruction",
    numbers "64-bit division, soft and hard floats",
    library "newlib: strings, qsort, printf, longjmp",
    shapes "C++: virtual calls, constructors, templates",
    tasks "a preemptive kernel with PendSV, SysTick, SVC and lazy FP state",
    exceptions "priorities, masks, nesting, faults and escalation",
}
