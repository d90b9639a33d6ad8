//! Selection: the code of a Kernel leaves what the Kernel means, whatever it finds.
//!
//! A rule is a Kernel of `tests/filetests/kernel`: each shows one rule of the code generator. It
//! is compiled and linked by the real compiler, for each architecture; the bytes are lifted by
//! Ghidra's description of the processor, which knows nothing of ours, and run with terms.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use whippen_isa::Arch;
use whippen_kernel::{Kernel, Type, parse, verify};
use whippen_modes::Modes;
use whippen_smt::solver::Solver;
use whippen_smt::{Bounded, Query, Term, Verdict, ask, check};

use crate::lifter::{Code, Lifter};
use crate::machine::{RETURN, State};
use crate::meaning::{Memory, tick};
use crate::target::{STACK, Target};

/// Folders of Kernels, each of which shows a rule.
const FOLDERS: [&str; 10] = [
    "allocate",
    "code",
    "control",
    "memory",
    "operators",
    "promote",
    "reorder",
    "schedule",
    "select",
    "v6m",
];

const ARCHS: [(Arch, &str); 3] = [(Arch::V8M, "v8m"), (Arch::V7EM, "v7em"), (Arch::V6M, "v6m")];

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/proof")
}

/// Kernels that verify, by name, in order.
pub fn kernels(folders: &[&str]) -> BTreeMap<String, Kernel> {
    let mut all = BTreeMap::new();
    for folder in folders {
        let entries = std::fs::read_dir(root().join("../../../filetests/kernel").join(folder));
        for entry in entries.expect("a folder") {
            let path = entry.expect("a file").path();
            let text = std::fs::read_to_string(&path).expect("is readable");
            let body = text.split("\n====").next().unwrap_or_default();
            let Ok(kernel) = parse(body) else { continue };
            if verify(&kernel).is_ok() {
                let name = path.file_stem().unwrap_or_default().to_string_lossy();
                all.insert(format!("{folder}/{name}"), kernel);
            }
        }
    }
    all
}

/// Words of memory, at first as the image has them.
struct Words(BTreeMap<u32, Term>);

impl Words {
    fn of(target: &Target) -> Words {
        let mut all = BTreeMap::new();
        for (from, bytes) in target.code.iter().chain(&target.data) {
            for (at, four) in (0..).step_by(4).zip(bytes.chunks(4)) {
                let mut word = [0; 4];
                word[..four.len()].copy_from_slice(four);
                let word = u32::from_le_bytes(word);
                all.insert(from + at, Term::word(word.into(), 32));
            }
        }
        Words(all)
    }

    fn put_half(&mut self, at: u32, half: Term) {
        let old = self.0[&(at & !3)];
        let new = match at & 2 {
            0 => old.extract(31, 16).concat(half),
            _ => half.concat(old.extract(15, 0)),
        };
        self.0.insert(at & !3, new);
    }

    fn put(&mut self, at: u32, value: Bounded, ty: Type) {
        self.0.insert(at, value.word(32));
        if ty == Type::I64 {
            self.0.insert(at + 4, value.word(64).extract(63, 32));
        }
    }
}

/// Every place of memory that a tick may change, with its type and what it holds then.
fn places(kernel: &Kernel, target: &Target, memory: &Memory) -> Vec<(u32, Type, Bounded)> {
    let mut all = Vec::new();
    let at = |place: Option<u32>| place.map(|at| target.state + at);
    for (index, (cell, words)) in kernel.cells.iter().zip(&memory.cells).enumerate() {
        let Some(from) = at(target.layout.cell(0, index)) else {
            continue;
        };
        let bytes = if cell.ty == Type::I64 { 8 } else { 4 };
        let own = (0..).map(|word| from + bytes * word).zip(words);
        all.extend(own.map(|(at, word)| (at, cell.ty, *word)));
    }
    for (index, (probe, word)) in kernel.probes.iter().zip(&memory.probes).enumerate() {
        let from = at(target.layout.probe(0, index));
        all.extend(from.map(|at| (at, probe.ty, *word)));
    }
    all
}

/// What the code finds: the same that the Kernel finds.
fn found(kernel: &Kernel, target: &Target, memory: &Memory) -> Words {
    let mut words = Words::of(target);
    for (at, ty, value) in places(kernel, target, memory) {
        words.put(at, value, ty);
    }
    for (live, value) in memory.lives.iter().enumerate() {
        if let Some(at) = target.layout.live_param(live) {
            words.put(target.state + at, *value, Type::I32);
        }
    }
    for (port, word) in (0..).zip(&memory.inputs) {
        words.put_half(target.state + target.layout.input(0, port), *word);
    }
    words
        .0
        .insert(target.state + target.layout.tick(), memory.tick);
    let code = target.address("k.mode.0").unwrap_or_default() | 1;
    let record = target.state + target.layout.record(0);
    words.0.insert(record, Term::word(code.into(), 32));
    words
}

/// That the code leaves what the Kernel does, as a query.
///
/// # Errors
/// What is not followed.
pub fn claim(
    name: &str,
    kernel: &Kernel,
    target: &Target,
    lifter: &mut Lifter,
) -> Result<Query, String> {
    let before = Memory::free(kernel, &Memory::declared(kernel));
    let wanted = tick(kernel, before.clone())?;
    let start = target.address("k_tick").ok_or("no code")?;
    let words = found(kernel, target, &before);
    let mut state = State::new(start, words.0.clone());
    let cells = places(kernel, target, &before).into_iter();
    state.cells = cells
        .flat_map(|(at, ty, _)| {
            [at, at + 4]
                .into_iter()
                .take(if ty == Type::I64 { 2 } else { 1 })
        })
        .collect();
    let kept: Vec<(u8, Term)> = (4..12)
        .map(|register| {
            let name = format!("r{register}");
            (register, Term::free(&name, whippen_smt::Sort::Word(32)))
        })
        .collect();
    for (register, held) in &kept {
        state.set_register(*register, *held);
    }
    state.set_register(0, Term::word(target.state.into(), 32));
    state.set_register(13, Term::word(STACK.into(), 32));
    state.set_register(14, Term::word((RETURN | 1).into(), 32));
    let ended = state.run(&mut Code::new(lifter, &target.code))?;
    let mut claims = Vec::new();
    for mut end in ended {
        let mut own = end.claims.clone();
        for (register, held) in &kept {
            own.push(end.register(*register).equals(*held));
        }
        own.push(end.register(13).equals(Term::word(STACK.into(), 32)));
        own.extend(memory_claims(kernel, target, &wanted, &words, &end)?);
        claims.push(end.condition.negated().or(Term::all(own)));
    }
    Ok(Query::new(name, &wanted.assumed, Term::all(claims)))
}

/// That memory holds what the Kernel leaves, and else what it held.
fn memory_claims(
    kernel: &Kernel,
    target: &Target,
    wanted: &Memory,
    before: &Words,
    end: &State,
) -> Result<Vec<Term>, String> {
    let mut expected = Words(before.0.clone());
    for (at, ty, value) in places(kernel, target, wanted) {
        expected.put(at, value, ty);
    }
    for (port, value) in (0..).zip(&wanted.outputs) {
        if let Some(value) = value {
            let at = target.state + target.layout.output(0, port);
            expected.put_half(at, value.word(16));
        }
    }
    let tick = target.state + target.layout.tick();
    let next = Term::apply("bvadd", &[wanted.tick, Term::word(1, 32)]);
    expected.0.insert(tick, next);
    let of_lives = kernel.lives.len()..;
    let shared = of_lives.map_while(|live| target.layout.live_param(live));
    let shared: Vec<u32> = shared.map(|at| target.state + at).collect();
    let mut claims = Vec::new();
    for (at, held) in &end.memory {
        // What the tick's entry has computed for all keys nobody reads in the next tick.
        if shared.contains(at) {
            continue;
        }
        match expected.0.get(at) {
            Some(wanted) => claims.push(held.equals(*wanted)),
            None if (STACK - 0x1000..STACK).contains(at) => {}
            None => return Err(format!("a store to {at:#x}")),
        }
    }
    Ok(claims)
}

fn rule(arch: Arch, name: &str, kernel: &Kernel, lifter: &mut Lifter) -> Query {
    Term::forget_all();
    let target = Target::new(&Modes::single(kernel), arch);
    let query = target.and_then(|target| claim(name, kernel, &target, lifter));
    query.unwrap_or_else(|why| Query::unasked(name, &why))
}

/// An instruction that is another one: a shift by 2 instead of 3.
#[test]
fn a_wrong_instruction_is_refuted_with_numbers() {
    let Some(mut lifter) = Lifter::start() else {
        return;
    };
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let kernel = &kernels(&["select"])["select/arith_i32_add_shifted"];
    let mut target = Target::new(&Modes::single(kernel), Arch::V8M).expect("it compiles");
    // add.w rd, rn, rm, lsl #3
    let is_sum = |code: &[u8]| code[1] == 0xeb && code[0] >> 4 == 0 && code[2] & 0xf0 == 0xc0;
    let places = |bytes: &Vec<u8>| {
        let mut all = (0..bytes.len().saturating_sub(3)).step_by(2);
        all.find(|at| is_sum(&bytes[*at..at + 4]))
    };
    let mut code = target.code.iter_mut().map(|(_, bytes)| bytes);
    let (bytes, at) = code
        .find_map(|bytes| places(bytes).map(|at| (bytes, at)))
        .expect("the sum");
    bytes[at + 2] ^= 0x40;
    let query = claim("fault", kernel, &target, &mut lifter).expect("it is followed");
    let answer = ask(&solvers, &query, 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("in_a_0"), "{answer:?}");
}

#[test]
fn code_leaves_what_kernels_mean() {
    let Some(mut lifter) = Lifter::start() else {
        return;
    };
    let mut queries = Vec::new();
    for (arch, of) in ARCHS {
        for (name, kernel) in kernels(&FOLDERS) {
            let name = format!("{of}/{name}");
            queries.push(rule(arch, &name, &kernel, &mut lifter));
        }
    }
    check(&root().join("selection.txt"), &queries);
}
