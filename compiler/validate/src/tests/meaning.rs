//! What instructions mean here and to the emulator: random code without memory.

use whippen_deterministic::Rng;
use whippen_emulator::{Board, CoreKind, Machine as Emulator, Stop as Stopped};
use whippen_ids::IdMap;
use whippen_isa::reg::LR;
use whippen_isa::{Arch, Class, Code as Halfwords, Cond, Encoding, Inst, ItState, Op};
use whippen_isa::{decode, is_wide};
use whippen_kernel::Kernel;
use whippen_modes::Modes;

use super::{number, word};
use crate::machine::Machine;
use crate::places::{Code, Places, Question, Shared, Symbols};
use crate::stop::{Stop, Told};
use crate::term::{Kind, Term, Terms};

/// Where the code lies.
const CODE: u32 = 0x2000_0000;

/// How many instructions it has, but for the last.
const LENGTH: usize = 3;

/// Registers that it uses, from R0 on.
const REGISTERS: u8 = 4;

fn is_followed(class: Class) -> bool {
    matches!(
        class,
        Class::Alu
            | Class::Move
            | Class::Shift
            | Class::Bitfield
            | Class::Bits
            | Class::Extend
            | Class::ExtendAdd
            | Class::Saturate
            | Class::Dsp
            | Class::Multiply
            | Class::MultiplyAdd
            | Class::MultiplyLong
            | Class::MultiplyAddLong
            | Class::Divide
    )
}

fn halfwords(inst: &Inst) -> Option<Vec<u16>> {
    match inst.encode(Arch::V8M).ok()? {
        Halfwords::Narrow(first) => Some(vec![first]),
        Halfwords::Wide(first, second) => Some(vec![first, second]),
    }
}

/// A random instruction on the registers, in an IT block of its own where there is a condition.
fn instruction(rng: &mut Rng, encodings: &[Encoding], cond: Option<Cond>) -> Option<Vec<u16>> {
    let encoding = rng.pick(encodings);
    let (mask, bits) = encoding.fixed_bits();
    let word = rng.next() as u32 & !mask | bits;
    let words = match encoding.size() {
        2 => [word as u16, 0],
        _ => [(word >> 16) as u16, word as u16],
    };
    let it = cond.map_or(Some(ItState::OUTSIDE), |cond| {
        ItState::after_it(cond.bits(), 8)
    })?;
    let mut inst = decode(words[0], words[1], Arch::V8M, it).ok()?;
    for register in [&mut inst.d, &mut inst.n, &mut inst.m, &mut inst.a] {
        *register %= REGISTERS;
    }
    let words = halfwords(&inst)?;
    let read = decode(words[0], words.get(1).copied().unwrap_or(0), Arch::V8M, it).ok()?;
    let allowed = (1 << REGISTERS) - 1;
    let used = read.uses().core_bits() | read.defs().core_bits();
    (used & !allowed == 0).then_some(words)
}

/// Code that ends with sums of its registers and the carry in R0 and R1.
fn code(rng: &mut Rng, encodings: &[Encoding]) -> Vec<u16> {
    let inst = |op, d: u8, m: u8| Inst {
        d,
        n: d,
        m,
        s: true,
        ..Inst::new(Encoding::of(op).last().expect("it has an encoding"))
    };
    // The flags are set before anybody asks.
    let mut all = halfwords(&inst(Op::ADD_register, 0, 1)).expect("it is encoded");
    for _ in 0..LENGTH {
        let cond = rng.chance(1, 3).then(|| rng.pick(&Cond::ALL[..14]));
        let Some(words) = instruction(rng, encodings, cond) else {
            continue;
        };
        if let Some(cond) = cond {
            all.push(0xbf00 | u16::from(cond.bits()) << 4 | 8);
        }
        all.extend(words);
    }
    for (op, d, m) in [(Op::ADC_register, 0, 2), (Op::SBC_register, 1, 3)] {
        all.extend(halfwords(&inst(op, d, m)).expect("it is encoded"));
    }
    all.push(0x4770);
    all
}

/// R0 and R1 at the end, in the case that holds for these words.
fn run(question: &Question, terms: &mut Terms, words: &[i128]) -> Told<[Term; 2]> {
    loop {
        let mut machine = Machine::new(question, terms, CODE);
        match machine.run(terms) {
            Ok(_) => return Ok([machine.registers[0], machine.registers[1]]),
            Err(Stop::Split(asks)) => {
                let Some(number) = number(terms, asks.primitive, words) else {
                    return Err(crate::term::too_large());
                };
                let holds = number >= asks.least;
                terms.assume(asks, holds)?;
            }
            Err(other) => return Err(other),
        }
    }
}

#[test]
fn instructions_mean_what_the_emulator_does() {
    let mut rng = Rng::new(11);
    let all = Encoding::all().filter(|encoding| encoding.exists_in(Arch::V8M));
    let encodings: Vec<Encoding> = all
        .filter(|encoding| is_followed(encoding.class()))
        .collect();
    let modes = Modes {
        kernel: Kernel::default(),
        modes: IdMap::new().into(),
        work_limited: false,
    };
    let new = || Emulator::new(Board::generic(CoreKind::CortexM33)).expect("a board");
    let mut emulator = new();
    let count = whippen_need::count("WHIPPEN_CASES", 3000_u32);
    let mut followed = 0;
    for case in 0..count {
        let halves = code(&mut rng, &encodings);
        let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let words: Vec<i128> = (0..4).map(|_| word(&mut rng)).collect();
        // Code is decoded once, so each case has a place of its own.
        let at = CODE + 128 * (case % 64);
        if at == CODE {
            emulator = new();
        }
        emulator
            .bus
            .memory
            .write(at, &bytes)
            .expect("there is memory");
        let arguments = std::array::from_fn(|at| words[at] as i32 as u32);
        let Stopped::Returned { result, .. } = emulator.call(at | 1, arguments, 10_000) else {
            continue;
        };
        let code = Code {
            pieces: vec![(CODE, bytes)],
            data: Vec::new(),
        };
        let question = Question {
            modes: &modes,
            shared: &Shared::default(),
            code: &code,
            symbols: &Symbols::default(),
            places: &Places::default(),
            arch: Arch::V8M,
        };
        let mut terms = Terms::default();
        let lr = terms.of(Kind::Register(LR));
        assert_eq!(terms.number(lr), None);
        let Ok(ends) = run(&question, &mut terms, &words) else {
            continue;
        };
        followed += 1;
        for (end, wanted) in ends.into_iter().zip(result) {
            let Some(found) = number(&terms, end, &words) else {
                continue;
            };
            assert_eq!(
                found,
                i128::from(wanted as i32),
                "case {case}: {}",
                text(&halves)
            );
        }
    }
    assert!(3 * followed > count, "{followed} of {count} are followed");
}

/// Code in a message.
fn text(halves: &[u16]) -> String {
    let (mut at, mut it, mut text) = (0, ItState::OUTSIDE, String::new());
    while at < halves.len() {
        let second = halves.get(at + 1).copied().unwrap_or(0);
        let Ok(inst) = decode(halves[at], second, Arch::V8M, it) else {
            break;
        };
        text += &format!("{inst}; ");
        it = match inst.op() {
            Op::IT => ItState::after_it((inst.imm >> 4) as u8, 8).unwrap_or_default(),
            _ => it.advance(),
        };
        at += if is_wide(halves[at]) { 2 } else { 1 };
    }
    text
}
