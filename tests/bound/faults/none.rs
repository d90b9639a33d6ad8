//! Faults that are none, by rules that need no validator: the code does the same.
//!
//! | rule | why it is none |
//! | --- | --- |
//! | commuted | the operands of a sum, of a product or of bits, in the other order |
//! | dead | other in registers and flags alone that are written before they are read |
//!
//! What is read is told by the decoder. Whatever is not decided by these rules counts as a fault.

use std::collections::BTreeMap;

use whippen_isa::{Class, Flags, Inst, Op, reg};

use super::Placed;

/// Registers, bit n for Rn, and flags that code still reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Live {
    pub registers: u16,
    pub flags: Flags,
}

impl Live {
    pub fn and(self, other: Live) -> Live {
        Live {
            registers: self.registers | other.registers,
            flags: self.flags | other.flags,
        }
    }

    pub fn meets(self, other: Live) -> bool {
        self.registers & other.registers != 0 || self.flags.intersects(other.flags)
    }

    /// Before an instruction, from what is live behind it.
    pub fn before(self, inst: &Inst) -> Live {
        let (uses, flags) = (inst.uses().core_bits(), inst.flags());
        let mut live = self;
        if !inst.is_conditional() {
            live.registers &= !inst.defs().core_bits();
            // Saturation is only ever set.
            live.flags = live.flags.without(flags.writes.without(Flags::Q));
        }
        live.and(Live {
            registers: uses,
            flags: flags.reads,
        })
    }
}

/// Everything.
pub const ALL: Live = Live {
    registers: u16::MAX,
    flags: Flags::NZCV.union(Flags::Q).union(Flags::GE),
};

/// What is live behind each instruction of a piece of code, by address, where all is live that is
/// live at `exit` when it is left.
pub fn live_behind(code: &[Placed], exit: Live) -> BTreeMap<u32, Live> {
    let nothing = code.iter().map(|(at, ..)| (*at, Live::default()));
    let mut before: BTreeMap<u32, Live> = nothing.collect();
    let mut behind = before.clone();
    loop {
        let known = before.clone();
        for (at, _, inst) in code.iter().rev() {
            let next = successors(*at, inst).into_iter().map(|next| match next {
                Next::At(to) => before.get(&to).copied().unwrap_or(ALL),
                Next::Away => exit,
                Next::Anywhere => ALL,
            });
            let live = next.fold(Live::default(), Live::and);
            behind.insert(*at, live);
            before.insert(*at, live.before(inst));
        }
        if before == known {
            return behind;
        }
    }
}

enum Next {
    At(u32),
    /// To the next key's code.
    Away,
    Anywhere,
}

fn successors(at: u32, inst: &Inst) -> Vec<Next> {
    let to = Next::At(at.wrapping_add(4).wrapping_add(inst.imm));
    let behind = Next::At(at + inst.size());
    match inst.op() {
        Op::B if inst.is_conditional() => vec![to, behind],
        Op::B => vec![to],
        Op::CBZ | Op::CBNZ => vec![to, behind],
        Op::BX if inst.is_conditional() => vec![Next::Away, behind],
        Op::BX => vec![Next::Away],
        // A routine may read whatever there is.
        Op::BL => vec![Next::Anywhere],
        _ if inst.defs().core_bits() & 1 << reg::PC != 0 => vec![Next::Anywhere],
        _ => vec![behind],
    }
}

/// Whether the operands of a sum, of a product or of bits are in the other order.
pub fn is_commuted(one: &Inst, other: &Inst) -> bool {
    let commutes = matches!(
        one.op(),
        Op::ADD_register
            | Op::ADC_register
            | Op::AND_register
            | Op::ORR_register
            | Op::EOR_register
            | Op::MUL
            | Op::MLA
            | Op::MLS
            | Op::SMMUL
            | Op::SMMLA
            | Op::SMULL
            | Op::SMLAL
            | Op::UMULL
            | Op::UMLAL
            | Op::LDR_register
            | Op::LDRH_register
            | Op::LDRB_register
            | Op::LDRSH_register
            | Op::LDRSB_register
            | Op::STR_register
            | Op::STRH_register
            | Op::STRB_register
    );
    let swapped = Inst {
        n: other.m,
        m: other.n,
        ..*other
    };
    commutes && one.amount == 0 && !one.wback && swapped == *one
}

/// In what the outcomes of two instructions may be other, where it is registers and flags alone.
pub fn difference(one: &Inst, other: &Inst) -> Option<Live> {
    if !(is_plain(one) && is_plain(other)) {
        return None;
    }
    let registers = moved(one) | moved(other);
    let flags = one.flags().writes | other.flags().writes;
    let renamed = Inst {
        d: one.d,
        t: one.t,
        ..*other
    };
    if renamed == *one {
        return Some(Live {
            registers,
            flags: Flags::NONE,
        });
    }
    // From another place nothing may be loaded: there might be none.
    if other.class() == Class::Load {
        return None;
    }
    let flagged = Inst {
        s: one.s,
        encoding: one.encoding,
        ..*other
    };
    let registers = match one.op() == other.op() && flagged == *one {
        true => 0,
        false => registers,
    };
    Some(Live { registers, flags })
}

/// Whether an instruction leaves what it does in registers and flags, and goes on behind it.
fn is_plain(inst: &Inst) -> bool {
    let is_moving = matches!(
        inst.class(),
        Class::Alu
            | Class::Move
            | Class::Shift
            | Class::Bitfield
            | Class::Extend
            | Class::ExtendAdd
            | Class::Bits
            | Class::Saturate
            | Class::Multiply
            | Class::MultiplyAdd
            | Class::MultiplyLong
            | Class::MultiplyAddLong
            | Class::Divide
            | Class::Load
            | Class::Nop
    );
    is_moving && !inst.wback && inst.defs().core_bits() & (1 << reg::PC | 1 << reg::SP) == 0
}

/// The registers in which it leaves something else than they held.
fn moved(inst: &Inst) -> u16 {
    let is_same = inst.op() == Op::MOV_register && inst.d == inst.m && inst.amount == 0;
    if is_same { 0 } else { inst.defs().core_bits() }
}
