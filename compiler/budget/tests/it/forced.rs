//! Programs all of whose paths can be forced: the bound is the largest of all runs, not a cycle
//! more.

use std::collections::BTreeMap;

use whippen_budget::{Bound, Code, Query, bound};
use whippen_deterministic::Rng;
use whippen_isa::timing::{Core, Evidence};
use whippen_isa::{Class, Cond, Form, Inst, ItState, Op};

use super::program::{PLAIN, Piece, any, assemble, branch, bx_lr, inst, it_block};
use super::{CODE, DATA, bound_of, machine, observed, returning};

/// Bits of R9, each of which decides one branch or IT block.
const BITS: usize = 6;

/// Puts a bit of R9 in N.
fn test_bit(bit: usize) -> Piece {
    // LSLS R10, R9, #k
    Piece::Inst(Inst {
        s: true,
        d: 10,
        m: 9,
        amount: 31 - bit as u8,
        ..inst(Op::LSL_immediate, Form::T2)
    })
}

/// Each decision is another bit of R9, so every path has an input.
fn program(rng: &mut Rng) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for bit in 0..BITS {
        pieces.push(Piece::Label(bit));
        run(rng, &mut pieces);
        pieces.push(test_bit(bit));
        (0..rng.below(3))
            .for_each(|_| pieces.push(Piece::Inst(any(rng, PLAIN, ItState::OUTSIDE, false))));
        let cond = if rng.chance(1, 2) { Cond::MI } else { Cond::PL };
        let to = bit + 1 + rng.below((BITS - bit) as u64) as usize;
        if rng.chance(1, 3) {
            pieces.extend(it_on_sign(rng));
        } else {
            pieces.push(Piece::Branch(branch(Some(cond), rng.chance(1, 3)), to));
        }
        run(rng, &mut pieces);
    }
    pieces.push(Piece::Label(BITS));
    run(rng, &mut pieces);
    pieces.push(bx_lr());
    pieces
}

fn run(rng: &mut Rng, pieces: &mut Vec<Piece>) {
    (0..rng.below(5))
        .for_each(|_| pieces.push(Piece::Inst(any(rng, PLAIN, ItState::OUTSIDE, true))));
}

/// An IT block on N.
fn it_on_sign(rng: &mut Rng) -> Vec<Piece> {
    loop {
        let pieces = it_block(rng, PLAIN, false);
        let conds = pieces.iter().filter_map(|piece| {
            if let Piece::Inst(inst) = piece {
                inst.cond
            } else {
                None
            }
        });
        if conds
            .into_iter()
            .all(|cond| matches!(cond, Cond::MI | Cond::PL))
        {
            return pieces;
        }
    }
}

/// The bytes of a random program that can be assembled.
fn assembled(rng: &mut Rng, program: impl Fn(&mut Rng) -> Vec<Piece>) -> Vec<u8> {
    loop {
        if let Some(bytes) = assemble(&program(rng), CODE) {
            return bytes;
        }
    }
}

fn slowest(bytes: &[u8], inputs: impl Iterator<Item = [u32; 2]>) -> u64 {
    let mut machine = machine(bytes);
    let registers = |[a, b]: [u32; 2]| BTreeMap::from([(8, DATA), (9, a), (11, b)]);
    inputs
        .map(|input| observed(&mut machine, CODE, &registers(input)))
        .max()
        .unwrap_or(0)
}

fn bounded(bytes: &[u8]) -> Bound {
    bound_of(&Code::new(CODE, bytes.to_vec()), CODE, &returning()).expect("a bound")
}

#[test]
fn the_bound_is_the_slowest_of_all_paths() {
    let mut rng = Rng::new(2);
    for _ in 0..150 {
        let bytes = assembled(&mut rng, program);
        let slowest = slowest(&bytes, (0..1 << BITS).map(|bits| [bits, 0]));
        let bound = bounded(&bytes);
        assert_eq!(bound.cycles_max, slowest, "{bytes:02x?}");
        assert_eq!(
            bound.path.iter().map(|step| step.cycles).sum::<u64>(),
            bound.cycles_max
        );
    }
}

/// Signed comparisons of two inputs with constants, some of which exclude each other.
fn comparing(rng: &mut Rng) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let blocks = 7;
    for block in 0..blocks {
        pieces.push(Piece::Label(block));
        run(rng, &mut pieces);
        let n = rng.pick(&[9, 11]);
        pieces.push(Piece::Inst(Inst {
            n,
            imm: 10 * rng.below(5) as u32,
            ..inst(Op::CMP_immediate, Form::T2)
        }));
        let cond = rng.pick(&[Cond::GT, Cond::LE, Cond::GE, Cond::LT]);
        let to = block + 1 + rng.below((blocks - block) as u64) as usize;
        pieces.push(Piece::Branch(branch(Some(cond), false), to));
        run(rng, &mut pieces);
    }
    pieces.push(Piece::Label(blocks));
    pieces.push(bx_lr());
    pieces
}

#[test]
fn paths_whose_comparisons_contradict_each_other_do_not_count() {
    let mut rng = Rng::new(3);
    let edges: Vec<u32> = (0..5)
        .flat_map(|c| [10 * c - 1, 10 * c, 10 * c + 1])
        .map(|c: i32| c as u32)
        .collect();
    let mut cut = 0;
    for _ in 0..100 {
        let bytes = assembled(&mut rng, comparing);
        let inputs = edges
            .iter()
            .flat_map(|&a| edges.iter().map(move |&b| [a, b]));
        let bound = bounded(&bytes);
        assert_eq!(bound.cycles_max, slowest(&bytes, inputs), "{bytes:02x?}");
        assert!(!bound.merged);
        cut += u32::from(bound.infeasible > 0);
    }
    assert!(cut > 50, "only {cut} programs had a contradiction");
}

/// The numbers of a core, each made one smaller, one at a time.
fn weakened() -> Vec<(&'static str, Core)> {
    let sound = Core::cortex_m33();
    let mut cores = Vec::new();
    let mut with = |name, change: &dyn Fn(&mut Core)| {
        let mut core = sound;
        change(&mut core);
        cores.push((name, core));
    };
    with("taken", &|core| core.branches.taken.cycles -= 1);
    with("not taken", &|core| core.branches.not_taken.cycles -= 1);
    with("split target", &|core| {
        core.branches.split_target.cycles -= 1
    });
    with("skipped", &|core| core.skipped.cycles -= 1);
    with("late", &|core| core.late.cycles -= 1);
    with("folded", &|core| core.branches.folded.cycles += 1);
    cores
}

#[test]
fn a_bound_by_a_broken_rule_is_caught() {
    let mut rng = Rng::new(4);
    let programs: Vec<(Vec<u8>, u64)> = (0..40)
        .map(|_| {
            let bytes = assembled(&mut rng, program);
            let slowest = slowest(&bytes, (0..1 << BITS).map(|bits| [bits, 0]));
            (bytes, slowest)
        })
        .collect();
    for (rule, core) in weakened() {
        let exceeds = |(bytes, slowest): &(Vec<u8>, u64)| {
            let (code, annotations) = (Code::new(CODE, bytes.clone()), returning());
            let query = Query {
                core: &core,
                code: &code,
                entry: CODE,
                annotations: &annotations,
                interference: None,
            };
            *slowest > bound(&query).expect("a bound").cycles_max
        };
        assert!(
            programs.iter().any(exceeds),
            "nothing exceeds the bound when `{rule}` is one cycle too cheap"
        );
    }
}

#[test]
fn a_bound_is_as_sure_as_its_least_sure_number() {
    let of = |piece: Inst| {
        let bytes = assemble(&[Piece::Inst(piece), bx_lr()], CODE).expect("reachable");
        bounded(&bytes).class
    };
    let add = Inst {
        d: 0,
        n: 1,
        m: 2,
        s: true,
        ..inst(Op::ADD_register, Form::T1)
    };
    let product = Inst {
        d: 0,
        n: 1,
        m: 2,
        ..inst(Op::SMMUL, Form::T1)
    };
    assert_eq!([of(add), of(product)], [Evidence::Exact, Evidence::Rule]);
    assert_eq!(product.class(), Class::Multiply);
}
