//! Random programs with random inputs: nobody takes longer than the bound.

use std::collections::BTreeMap;

use whippen_budget::Code;
use whippen_deterministic::Rng;
use whippen_isa::{Class, Cond, Form, Inst, ItState, Op};

use super::program::{PLAIN, Piece, RARE, any, assemble, branch, bx_lr, inst, it_block};
use super::{CODE, DATA, bound_of, machine, observed, returning};

/// Blocks with forward branches on whatever the flags are.
fn program(rng: &mut Rng) -> Vec<Piece> {
    let classes: Vec<Class> = [PLAIN, PLAIN, RARE].concat();
    let blocks = 2 + rng.below(8) as usize;
    let mut pieces = Vec::new();
    for block in 0..blocks {
        pieces.push(Piece::Label(block));
        for _ in 0..rng.below(6) {
            match rng.chance(1, 5) {
                true => pieces.extend(it_block(rng, &classes, true)),
                false => pieces.push(Piece::Inst(any(rng, &classes, ItState::OUTSIDE, true))),
            }
        }
        let to = block + 1 + rng.below((blocks - block) as u64) as usize;
        let cond = Cond::ALL[rng.below(14) as usize];
        let compare = inst(if rng.chance(1, 2) { Op::CBZ } else { Op::CBNZ }, Form::T1);
        match rng.below(6) {
            0 => {}
            1 => pieces.push(Piece::Branch(branch(None, rng.chance(1, 2)), to)),
            2 => pieces.push(Piece::Branch(
                Inst {
                    n: rng.below(8) as u8,
                    ..compare
                },
                to,
            )),
            _ => pieces.push(Piece::Branch(branch(Some(cond), rng.chance(1, 3)), to)),
        }
    }
    pieces.push(Piece::Label(blocks));
    pieces.push(bx_lr());
    pieces
}

#[test]
fn no_input_takes_longer_than_the_bound() {
    let mut rng = Rng::new(1);
    let (mut programs, mut runs, mut cut, mut tight) = (0, 0, 0, 0);
    while programs < 400 {
        let pieces = program(&mut rng);
        // CBZ reaches no further than it reaches.
        let Some(bytes) = assemble(&pieces, CODE) else {
            continue;
        };
        let bound = bound_of(&Code::new(CODE, bytes.clone()), CODE, &returning()).expect("a bound");
        let mut machine = machine(&bytes);
        let mut slowest = 0;
        for _ in 0..25 {
            let noise: Vec<u8> = (0..256).map(|_| rng.next() as u8).collect();
            machine.bus.memory.write(DATA, &noise).expect("RAM");
            let edge = |rng: &mut Rng| rng.pick(&[0, 1, 2, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff]);
            let word = |rng: &mut Rng| {
                if rng.chance(1, 2) {
                    edge(rng)
                } else {
                    rng.next() as u32
                }
            };
            let mut registers: BTreeMap<u8, u32> =
                (0..13).map(|register| (register, word(&mut rng))).collect();
            registers.insert(8, DATA);
            let cycles = observed(&mut machine, CODE, &registers);
            assert!(
                cycles <= bound.cycles_max,
                "{cycles} > {}: {bytes:02x?}",
                bound.cycles_max
            );
            slowest = slowest.max(cycles);
            runs += 1;
        }
        programs += 1;
        cut += u32::from(bound.infeasible > 0);
        tight += u32::from(slowest == bound.cycles_max);
    }
    println!("{programs} programs, {runs} runs; {tight} bounds reached; ways were cut in {cut}");
    assert!(
        tight > programs / 4 && cut > programs / 20,
        "{tight} bounds reached, ways cut in {cut}"
    );
}
