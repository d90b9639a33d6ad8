//! Loops every round of which is decided by another bit of the input: the bound is the slowest of
//! all ways through all rounds.

use std::collections::BTreeMap;

use whippen_budget::{Annotations, Code};
use whippen_deterministic::Rng;
use whippen_isa::{Arch, Cond, Form, Inst, ItState, Op};
use whippen_words::assembled;

use super::program::{PLAIN, Piece, any, assemble, branch, bx_lr, inst};
use super::{CODE, DATA, bound_of, machine, observed, returning};

/// The head of the outer loop, where its two ways meet, the head of the inner one, and what is
/// behind both.
const HEAD: usize = 0;
const MEET: usize = 1;
const INNER: usize = 2;
const BEHIND: usize = 3;

/// A constant in a register that nothing else writes.
fn set(d: u8, imm: u32) -> Piece {
    Piece::Inst(Inst {
        d,
        imm,
        ..inst(Op::MOV_immediate, Form::T2)
    })
}

/// One less in it, and back as long as something is left.
fn again(d: u8, label: usize) -> [Piece; 2] {
    let less = Inst {
        s: true,
        d,
        n: d,
        imm: 1,
        ..inst(Op::SUB_immediate, Form::T3)
    };
    let back = branch(Some(Cond::NE), true);
    [Piece::Inst(less), Piece::Branch(back, label)]
}

fn run(rng: &mut Rng, pieces: &mut Vec<Piece>, flags: bool) {
    (0..rng.below(4))
        .for_each(|_| pieces.push(Piece::Inst(any(rng, PLAIN, ItState::OUTSIDE, flags))));
}

/// R9 moved up so far, to a register: its sign decides.
fn bit_of_r9(d: u8, amount: u8) -> Piece {
    // LSLS Rd, R9, #k
    Piece::Inst(Inst {
        s: true,
        d,
        m: 9,
        amount,
        ..inst(Op::LSL_immediate, Form::T2)
    })
}

/// So many rounds, each of which goes one way or another by a bit of R9, with a loop inside; the
/// last bit of R9 leads past all of them.
fn program(rng: &mut Rng, [rounds, inner]: [u32; 2]) -> Vec<Piece> {
    let mut pieces = vec![set(11, rounds)];
    run(rng, &mut pieces, true);
    pieces.push(bit_of_r9(10, 31));
    pieces.push(Piece::Branch(branch(Some(Cond::MI), true), BEHIND));
    run(rng, &mut pieces, true);
    pieces.push(Piece::Label(HEAD));
    run(rng, &mut pieces, true);
    pieces.push(bit_of_r9(9, 1));
    run(rng, &mut pieces, false);
    pieces.push(Piece::Branch(branch(Some(Cond::MI), false), MEET));
    run(rng, &mut pieces, true);
    pieces.push(Piece::Label(MEET));
    run(rng, &mut pieces, true);
    if inner > 0 {
        pieces.push(set(10, inner));
        pieces.push(Piece::Label(INNER));
        run(rng, &mut pieces, true);
        pieces.extend(again(10, INNER));
    }
    pieces.extend(again(11, HEAD));
    pieces.push(Piece::Label(BEHIND));
    run(rng, &mut pieces, true);
    pieces.push(bx_lr());
    pieces
}

/// Where a label is.
fn address(pieces: &[Piece], label: usize) -> u32 {
    let before = pieces
        .iter()
        .take_while(|piece| !matches!(piece, Piece::Label(own) if *own == label));
    let size = |piece: &Piece| match piece {
        Piece::Inst(inst) | Piece::Branch(inst, _) => inst.size(),
        Piece::Label(_) => 0,
    };
    CODE + before.map(size).sum::<u32>()
}

#[test]
fn the_bound_is_the_slowest_of_all_ways_through_all_rounds() {
    let mut rng = Rng::new(7);
    for number in 0..60 {
        let [rounds, inner] = [1 + number % 5, number % 4];
        let pieces = program(&mut rng, [rounds, inner]);
        let bytes = assemble(&pieces, CODE).expect("every branch reaches");
        let mut annotations: Annotations = returning();
        annotations.loops.insert(address(&pieces, HEAD), rounds);
        if inner > 0 {
            annotations.loops.insert(address(&pieces, INNER), inner);
        }
        let mut machine = machine(&bytes);
        let slowest = (0..2_u32 << rounds)
            .map(|bits| {
                // The first bit that is looked at becomes the top one.
                let [rounds_go, past] = [bits >> 1 << (31 - rounds), bits & 1];
                let registers = BTreeMap::from([(8, DATA), (9, rounds_go | past)]);
                observed(&mut machine, CODE, &registers)
            })
            .max();
        let bound = bound_of(&Code::new(CODE, bytes.clone()), CODE, &annotations);
        let bound = bound.expect("a bound");
        assert_eq!(Some(bound.cycles_max), slowest, "{bytes:02x?}");
        assert!(!bound.merged);
        let sum: u64 = bound.path.iter().map(|step| step.cycles).sum();
        assert_eq!(sum, bound.cycles_max);
    }
}

/// What a loop changes, once or twice, is known in no round: `movs r0, #0`; `1: cmp r0, #4`;
/// `ble 2f`; `udiv r1, r2, r3`; `2: adds r0, #1`, and `adds r0, #0`; `cmp r0, #6`; `bne 1b`;
/// `bx lr`. In the last round R0 is 5, and there is a division.
#[test]
fn what_a_loop_changes_is_known_in_no_round() {
    let begin = [0x2000, 0x2804, 0xdd01, 0xfbb2, 0xf1f3, 0x3001];
    let [once, twice] = [
        &[0x2806, 0xd1f8, 0x4770][..],
        &[0x3000, 0x2806, 0xd1f7, 0x4770],
    ];
    for end in [once, twice] {
        let halves = begin.iter().chain(end);
        let bytes: Vec<u8> = halves.flat_map(|half: &u16| half.to_le_bytes()).collect();
        let mut annotations = returning();
        annotations.loops.insert(CODE + 2, 6);
        let code = Code::new(CODE, bytes.clone());
        let bound = bound_of(&code, CODE, &annotations).expect("a bound");
        let divides = bound.path.iter().filter(|step| step.address == CODE + 6);
        assert_eq!(divides.count(), 6, "in any round");
        let mut machine = machine(&bytes);
        let registers = BTreeMap::from([(2, u32::MAX), (3, 1)]);
        let observed = observed(&mut machine, CODE, &registers);
        assert!(observed <= bound.cycles_max && observed > bound.cycles_max / 4);
    }
}

/// A loop that is entered by a branch, as it is come back to, and one in whose first round alone a
/// load is waited for.
#[test]
fn rounds_begin_with_what_the_pipeline_holds() {
    let branched = ["b .+4", "nop", "subs r0, #1", "bne .-2", "bx lr"];
    let loaded = [
        "ldr.w r1, [r8]",
        "adds r2, r1, #1",
        "subs r0, #1",
        "bne .-4",
        "bx lr",
    ];
    let cycles = |texts: &[&str], rounds| {
        let bytes = assembled(texts, Arch::V8M);
        let mut annotations = returning();
        annotations.loops.insert(CODE + 4, rounds);
        let code = Code::new(CODE, bytes.clone());
        let bound = bound_of(&code, CODE, &annotations).expect("a bound");
        let registers = BTreeMap::from([(0, rounds), (8, DATA)]);
        let observed = observed(&mut machine(&bytes), CODE, &registers);
        assert_eq!(bound.cycles_max, observed, "{texts:?}, {rounds} rounds");
        observed
    };
    for rounds in 1..6 {
        cycles(&branched, rounds);
        cycles(&loaded, rounds);
    }
    assert_eq!(cycles(&branched, 9) - cycles(&branched, 8), 3);
    let late = [2, 9].map(|rounds| cycles(&loaded, rounds));
    assert_eq!(late[1] - late[0], 7 * 4);
}
