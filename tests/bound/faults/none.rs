//! Faults that are none, by rules that need no validator: the code does the same.
//!
//! | rule | why it is none |
//! | --- | --- |
//! | commuted | the operands of a sum, of a product or of bits, in the other order |
//! | dead | other only in registers, flags and words of the stack that nobody reads any more |
//!
//! What is read only for what nobody reads counts as not read. What is read is told by the decoder.
//! Whatever is not decided by these rules counts as a fault.

use std::collections::BTreeMap;

use whippen_isa::{Class, Flags, Inst, Op, reg};

use super::put::{Placed, is_store, returns};

/// What code still reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Live {
    /// Bit n for Rn.
    pub registers: u16,
    pub flags: Flags,
    /// Words of the stack, bit n for that at SP + 4 n.
    pub slots: u64,
}

impl Live {
    pub fn and(self, other: Live) -> Live {
        Live {
            registers: self.registers | other.registers,
            flags: self.flags | other.flags,
            slots: self.slots | other.slots,
        }
    }

    pub fn meets(self, other: Live) -> bool {
        let meet = self.registers & other.registers != 0 || self.slots & other.slots != 0;
        meet || self.flags.intersects(other.flags)
    }

    fn without(self, other: Live) -> Live {
        Live {
            registers: self.registers & !other.registers,
            flags: self.flags.without(other.flags),
            slots: self.slots & !other.slots,
        }
    }

    /// Before an instruction, from what is live behind it. What only leads to what is not read is
    /// not read itself; but addresses are, since there might be nothing elsewhere.
    pub fn before(self, inst: &Inst) -> Live {
        let slot = slot(inst);
        let uses = Live {
            registers: inst.uses().core_bits(),
            flags: inst.flags().reads,
            slots: slot.filter(|_| !is_store(inst.op())).unwrap_or(0),
        };
        let writes = written(inst);
        if let Some(by) = taken_back(inst) {
            return Live {
                slots: self.slots << by,
                ..self
            };
        }
        let has_only_these = is_plain(inst) || slot.is_some();
        let is_elsewhere = inst.class() == Class::Load && slot.is_none();
        if has_only_these && !is_elsewhere && !self.meets(writes) {
            return self;
        }
        let live = match inst.is_conditional() {
            true => self,
            // Saturation is only ever set.
            false => self.without(Live {
                flags: writes.flags.without(Flags::Q),
                ..writes
            }),
        };
        let moves_stack = !has_only_these && inst.defs().core_bits() & 1 << reg::SP != 0;
        let live = live.and(uses);
        match moves_stack {
            true => Live {
                slots: u64::MAX,
                ..live
            },
            false => live,
        }
    }
}

/// The words of the stack that an instruction loads or stores, and it does nothing else but with
/// registers.
fn slot(inst: &Inst) -> Option<u64> {
    let words = match inst.op() {
        Op::LDR_immediate | Op::STR_immediate => 1,
        Op::LDRD_immediate | Op::STRD_immediate => 3,
        _ => return None,
    };
    let is_plain = inst.n == reg::SP && inst.index && inst.add && !inst.wback;
    (is_plain && inst.imm.is_multiple_of(4) && inst.imm < 4 * 63).then(|| words << (inst.imm / 4))
}

/// By how many words an instruction takes back the stack, where that is all.
fn taken_back(inst: &Inst) -> Option<u32> {
    let is_so = inst.op() == Op::ADD_SP_plus_immediate && inst.d == reg::SP;
    (is_so && !inst.is_conditional() && inst.imm < 4 * 64).then_some(inst.imm / 4)
}

/// Whether code may find its stack otherwise than by SP and an offset.
fn shows_stack(inst: &Inst) -> bool {
    let is_of_stack = matches!(inst.op(), Op::PUSH | Op::POP);
    let moves = (inst.defs().core_bits() & inst.uses().core_bits()) >> reg::SP & 1 != 0;
    let uses = inst.uses().core_bits() >> reg::SP & 1 != 0;
    uses && !moves && !is_of_stack && slot(inst).is_none()
}

/// What it may leave otherwise than it was.
fn written(inst: &Inst) -> Live {
    let is_same = inst.op() == Op::MOV_register && inst.d == inst.m && inst.amount == 0;
    Live {
        registers: if is_same { 0 } else { inst.defs().core_bits() },
        flags: inst.flags().writes,
        slots: slot(inst).filter(|_| is_store(inst.op())).unwrap_or(0),
    }
}

/// Everything.
pub const ALL: Live = Live {
    registers: u16::MAX,
    flags: Flags::NZCV.union(Flags::Q).union(Flags::GE),
    slots: u64::MAX,
};

/// What is live behind each instruction of a piece of code, by address, where all is live that is
/// live at `exit` when it is left.
pub fn live_behind(code: &[Placed], exit: Live) -> BTreeMap<u32, Live> {
    let shows_stack = code.iter().any(|(.., inst)| shows_stack(inst));
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
            let live = match shows_stack {
                true => Live {
                    slots: u64::MAX,
                    ..live
                },
                false => live,
            };
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
    /// To the next key's code, or back from the tick.
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
        Op::POP if returns(inst) => vec![Next::Away],
        _ if returns(inst) => vec![Next::Anywhere],
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

/// In what the outcomes of two instructions may be other, where it is registers, flags and words of
/// the stack alone.
pub fn difference(one: &Inst, other: &Inst) -> Option<Live> {
    let is_followed = |inst: &Inst| is_plain(inst) || slot(inst).is_some();
    // From another place nothing may be loaded: there might be none.
    let is_same_place = Inst { t: one.t, ..*other } == *one;
    let is_load = other.class() == Class::Load && slot(other).is_none();
    if !is_followed(one) || !is_followed(other) || is_load && !is_same_place {
        return None;
    }
    let both = written(one).and(written(other));
    let renamed = Inst {
        d: one.d,
        t: one.t,
        ..*other
    };
    let flagged = Inst {
        s: one.s,
        encoding: one.encoding,
        ..*other
    };
    let (registers, flags) = if renamed == *one {
        (both.registers, Flags::NONE)
    } else if one.op() == other.op() && flagged == *one {
        (0, both.flags)
    } else {
        (both.registers, both.flags)
    };
    Some(Live {
        registers,
        flags,
        ..both
    })
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

#[cfg(test)]
mod tests {
    use whippen_isa::{Arch, Cond, ItState, parse};

    use super::{Flags, Inst, Live, Placed, difference, is_commuted, live_behind, reg};

    fn inst(text: &str) -> Inst {
        let parsed = parse(text, Arch::V8M, None);
        // Or in a block of its own.
        let parsed = parsed.or_else(|_| parse(text, Arch::V8M, Some(Cond::LT)));
        parsed.unwrap_or_else(|why| panic!("{text}: {why:?}"))
    }

    /// Whether the second of two instructions may stand for the first, behind which code comes that
    /// leaves R6, R7 and SP.
    fn is_dead(one: &str, other: &str, behind: &[&str]) -> bool {
        let exit = Live {
            registers: 1 << 6 | 1 << 7 | 1 << reg::SP | 1 << reg::LR,
            flags: Flags::NONE,
            slots: 0,
        };
        let code = |first: &str| {
            let all = [first].into_iter().chain(behind.iter().copied());
            let mut at = 0;
            let placed = all.chain(["bx lr"]).map(|text| {
                let inst = inst(text);
                at += inst.size();
                (at - inst.size(), ItState::OUTSIDE, inst)
            });
            placed.collect::<Vec<Placed>>()
        };
        let Some(differs) = difference(&inst(one), &inst(other)) else {
            return false;
        };
        let both = [one, other].map(code);
        both.iter()
            .all(|code| !live_behind(code, exit)[&0].meets(differs))
    }

    #[test]
    fn what_nobody_reads_is_no_fault() {
        let cases: [(&str, &str, &[&str], bool); 17] = [
            // Written before it is read, and the other way round.
            (
                "movs r0, #1",
                "movs r0, #2",
                &["movs r0, #3", "str r0, [r7]"],
                true,
            ),
            (
                "movs r0, #1",
                "movs r0, #2",
                &["str r0, [r7]", "movs r0, #3"],
                false,
            ),
            ("movs r0, #1", "movs r1, #1", &["str r0, [r7]"], false),
            ("movs r0, r0", "movs r1, r0", &["str r0, [r7]"], true),
            ("movs r0, r0", "movs r1, r0", &["str r1, [r7]"], false),
            // Only read for what is not read; but of an address that is not so.
            ("movs r0, #1", "movs r0, #2", &["adds r1, r0, #1"], true),
            ("movs r0, #1", "movs r0, #2", &["ldr r1, [r0]"], false),
            ("ldr r0, [r6]", "ldr r0, [r6, #4]", &[], false),
            ("ldr r0, [r6]", "ldr r1, [r6]", &[], true),
            // What may be left as it was.
            (
                "mov.w r0, #1",
                "mov.w r0, #2",
                &["movlt r0, r7", "str r0, [r7]"],
                false,
            ),
            (
                "mov.w r0, #1",
                "movs.w r0, #1",
                &["beq .+4", "str r6, [r7]"],
                false,
            ),
            // Flags alone.
            ("mov.w r0, #1", "movs.w r0, #1", &["str r0, [r7]"], true),
            (
                "movs r0, #1",
                "movs r0, #0",
                &["beq .+4", "str r6, [r7]"],
                false,
            ),
            // Words of the stack.
            (
                "str r0, [sp, #4]",
                "str r1, [sp, #4]",
                &["ldr r2, [sp, #8]", "str r2, [r7]"],
                true,
            ),
            (
                "str r0, [sp, #4]",
                "str r1, [sp, #4]",
                &["ldr r2, [sp, #4]", "str r2, [r7]"],
                false,
            ),
            (
                "str r0, [sp, #4]",
                "str r1, [sp, #4]",
                &["add r2, sp, #4"],
                false,
            ),
            // What stores elsewhere.
            ("str r0, [r7]", "str r1, [r7]", &[], false),
        ];
        for (one, other, behind, is_none) in cases {
            assert_eq!(
                is_dead(one, other, behind),
                is_none,
                "{one} -> {other}, {behind:?}"
            );
        }
    }

    #[test]
    fn operands_that_commute_are_no_fault() {
        for (one, other, is_none) in [
            ("adds r0, r1, r2", "adds r0, r2, r1", true),
            ("subs r0, r1, r2", "subs r0, r2, r1", false),
            ("ldr r0, [r6, r1]", "ldr r0, [r1, r6]", true),
            (
                "add.w r0, r1, r2, lsl #2",
                "add.w r0, r2, r1, lsl #2",
                false,
            ),
            ("umull r0, r1, r2, r3", "umull r0, r1, r3, r2", true),
            ("mla r0, r1, r2, r3", "mla r0, r1, r3, r2", false),
        ] {
            assert_eq!(
                is_commuted(&inst(one), &inst(other)),
                is_none,
                "{one} -> {other}"
            );
        }
    }
}
