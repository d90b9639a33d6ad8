//! Programs that are made up: straight runs with forward branches, calls and IT blocks between
//! them.

use whippen_deterministic::Rng;
use whippen_isa::{Arch, Class, Cond, Encoding, Form, Inst, ItState, Op, RegSet, decode};

/// An instruction, or a branch to a label.
#[derive(Clone, Copy)]
pub enum Piece {
    Inst(Inst),
    /// The branch, its offset still 0, and its label.
    Branch(Inst, usize),
    Label(usize),
}

/// The bytes from an address on; none when a branch does not reach.
pub fn assemble(pieces: &[Piece], at: u32) -> Option<Vec<u8>> {
    let mut labels = vec![0; pieces.len() + 1];
    let mut address = at;
    for piece in pieces {
        match piece {
            Piece::Inst(inst) | Piece::Branch(inst, _) => address += inst.size(),
            Piece::Label(label) => labels[*label] = address,
        }
    }
    let mut bytes = Vec::new();
    for piece in pieces {
        let here = at + bytes.len() as u32;
        let inst = match *piece {
            Piece::Inst(inst) => inst,
            Piece::Branch(inst, label) => Inst {
                imm: labels[label].wrapping_sub(here + 4),
                ..inst
            },
            Piece::Label(_) => continue,
        };
        let (first, second) = inst.encode(Arch::V8M).ok()?.halfwords();
        [Some(first), second]
            .into_iter()
            .flatten()
            .for_each(|half| bytes.extend(half.to_le_bytes()));
    }
    Some(bytes)
}

/// An instruction by its encoding; what the encoding has not is at rest.
pub fn inst(op: Op, form: Form) -> Inst {
    Inst::new(Encoding::new(op, form).expect("an encoding"))
}

pub fn branch(cond: Option<Cond>, wide: bool) -> Inst {
    let form = match (cond.is_some(), wide) {
        (true, false) => Form::T1,
        (false, false) => Form::T2,
        (true, true) => Form::T3,
        (false, true) => Form::T4,
    };
    Inst {
        cond,
        ..inst(Op::B, form)
    }
}

pub fn bx_lr() -> Piece {
    Piece::Inst(Inst {
        m: 14,
        ..inst(Op::BX, Form::T1)
    })
}

/// What random instructions may write: not the base of data, not what decides, not SP, LR, PC.
const WRITABLE: u16 = 0b0001_0000_1111_1111;
/// What they may read besides: R8 points to data.
const READABLE: u16 = WRITABLE | 1 << 8;

/// Classes of random instructions.
pub const PLAIN: &[Class] = {
    use Class::*;
    &[
        Alu,
        Move,
        Shift,
        Bitfield,
        Extend,
        ExtendAdd,
        Bits,
        Saturate,
        Dsp,
        Select,
        Multiply,
        MultiplyAdd,
        MultiplyLong,
        MultiplyAddLong,
        Load,
        Load,
        Load,
        LoadDual,
        LoadMultiple,
        Store,
        Store,
        StoreDual,
        StoreMultiple,
        Nop,
    ]
};

/// Others: of the floating-point unit, and divisions.
pub const RARE: &[Class] = {
    use Class::*;
    &[
        Divide,
        FloatAlu,
        FloatMultiplyAdd,
        FloatDivide,
        FloatConvert,
        FloatMove,
        FloatTransfer,
        FloatLoad,
        FloatStore,
    ]
};

/// A random instruction of one of some classes, in a state of IT; flags only if it may.
pub fn any(rng: &mut Rng, classes: &[Class], it: ItState, flags: bool) -> Inst {
    loop {
        let class = rng.pick(classes);
        let of_class: Vec<Encoding> = Encoding::all().filter(|e| e.class() == class).collect();
        let encoding = rng.pick(&of_class);
        let (mask, bits) = encoding.fixed_bits();
        let word = bits | rng.next() as u32 & !mask;
        let (first, second) = if encoding.size() == 4 {
            ((word >> 16) as u16, word as u16)
        } else {
            (word as u16, 0)
        };
        let Ok(inst) = decode(first, second, Arch::V8M, it) else {
            continue;
        };
        let Some(inst) = tamed(inst).filter(|inst| classes.contains(&inst.class())) else {
            continue;
        };
        let sets = inst.flags().writes.intersects(whippen_isa::Flags::NZCV);
        let harmless =
            inst.defs().core_bits() & !WRITABLE == 0 && inst.uses().core_bits() & !READABLE == 0;
        if harmless && (flags || !sets) && inst.encode(Arch::V8M).is_ok() {
            return inst;
        }
    }
}

/// Memory is only accessed a little behind R8.
fn tamed(inst: Inst) -> Option<Inst> {
    use Class::*;
    let at_base = Inst {
        n: 8,
        wback: false,
        index: true,
        add: true,
        ..inst
    };
    let near = Inst {
        imm: inst.imm & 0x3c,
        ..at_base
    };
    let immediate =
        !matches!(inst.op(), Op::LDR_literal) && inst.uses().contains(RegSet::core(inst.n));
    match inst.class() {
        Load | Store | LoadDual | StoreDual | FloatLoad | FloatStore => {
            let by_register = inst.is_by_register();
            (immediate && !by_register && inst.n < 13).then_some(near)
        }
        LoadMultiple | StoreMultiple => {
            let plain = matches!(inst.op(), Op::LDM | Op::STM) && inst.size() == 4;
            plain.then_some(Inst {
                imm: inst.imm & 0xff,
                ..at_base
            })
        }
        _ => Some(inst),
    }
}

/// A random IT block with its instructions; the last may be a branch to a label.
pub fn it_block(rng: &mut Rng, classes: &[Class], flags: bool) -> Vec<Piece> {
    loop {
        let (cond, mask) = (rng.below(14) as u8, 1 + rng.below(15) as u8);
        let Some(mut state) = ItState::after_it(cond, mask) else {
            continue;
        };
        let it = Inst {
            imm: u32::from(cond) << 4 | u32::from(mask),
            ..inst(Op::IT, Form::T1)
        };
        let mut pieces = vec![Piece::Inst(it)];
        while state.inside() {
            pieces.push(Piece::Inst(any(rng, classes, state, flags)));
            state = state.advance();
        }
        return pieces;
    }
}
