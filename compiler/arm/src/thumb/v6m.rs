//! Legalization for ARMv6-M: what selection asks for in terms of the larger cores, as instructions
//! that the Cortex-M0+ has.
//!
//! ```text
//!   Func of selection --legal--> Func: low registers, two operands, flags right before who reads them, no IT
//! ```
//!
//! ARMv6-M has 16-bit instructions, which nearly all set the flags, registers 0 to 7 for most of
//! them, products of 32 bits, no quotient, no saturation and no conditions but those of branches.
//! So here
//!
//! * an operand that is shifted, and a constant that does not fit, becomes an instruction of its
//!   own;
//! * a result that must be its first operand is tied to it, and the allocator copies where that
//!   lives on;
//! * flags are made again in front of whoever reads them: what makes them is kept, not their
//!   values;
//! * a conditional instruction becomes a branch around it;
//! * top words of products and quotients are calls of routines (`routines.s`).
//!
//! It is right and slow: a product's top word takes 23 cycles where a Cortex-M33 takes one.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `constant` | constants, from shifts and sums or from the state |
//! | `flags` | flags, conditions |
//! | `memory` | loads and stores |
//! | `lower` | everything else, instruction by instruction |
//! | `unused` | results that nobody reads |
//! | `routines` | what is called, as a part of the object |
//! | `string` | the tick of a string |

mod constant;
mod flags;
mod lower;
mod memory;
mod routines;
mod string;
mod unused;

use super::func::{BlockId, Edge, Func, Terminator};
use super::literal::Literals;
use super::minst::{MInst, Operand, Reg, Relocation, Role, VReg};
use super::routine::Routine;
use super::state_layout::StateLayout;
use flags::Flags;
use whippen_ids::IdMap;
use whippen_isa::{Op, ShiftType};

pub(super) use constant::{Step, steps};
pub(super) use routines::add_routines;
pub(super) use string::string_loop;

/// The same for ARMv6-M.
pub(super) fn legal(mut func: Func, layout: &StateLayout, literals: &mut Literals) -> Func {
    let blocks = std::mem::take(&mut func.blocks);
    let out = func;
    let mut legal = Legal {
        literals,
        literals_at: layout.literals,
        out,
        at: BlockId(0),
        flags: Flags::default(),
        origin: None,
        known: VReg(0),
    };
    let heads: IdMap<BlockId, BlockId> = blocks.iter().map(|_| legal.out.block()).collect();
    for (head, block) in heads.iter().zip(blocks) {
        (legal.at, legal.flags) = (*head, Flags::default());
        (legal.out.blocks[head].params, legal.out.blocks[head].rounds) =
            (block.params, block.rounds);
        for code in &block.code {
            (legal.origin, legal.known) = (code.origin, VReg(legal.out.vregs));
            legal.one(code);
        }
        legal.end(block.end, &heads);
    }
    unused::without(legal.out)
}

struct Legal<'a> {
    literals: &'a mut Literals,
    /// Offset of the first in the state.
    literals_at: u32,
    out: Func,
    /// The block that code goes to.
    at: BlockId,
    flags: Flags,
    origin: Option<u32>,
    /// Registers from this one on were made for the present instruction.
    known: VReg,
}

impl Legal<'_> {
    fn emit(&mut self, code: MInst) {
        self.out.blocks[self.at].code.push(MInst {
            origin: self.origin,
            ..code
        });
    }

    /// A new register for the result in D.
    fn result(&mut self, code: MInst) -> VReg {
        let d = self.out.fresh();
        self.emit(code.reg(Role::D, d));
        d
    }

    /// An instruction of ARMv6-M whose result is its first operand, changed.
    fn tied(&mut self, op: Op, old: VReg, other: Option<VReg>) -> VReg {
        self.tied_to(Role::N, op, old, other, 0)
    }

    /// The same; the operand is in another role, or an immediate.
    fn tied_to(&mut self, role: Role, op: Op, old: VReg, other: Option<VReg>, imm: u32) -> VReg {
        let d = self.out.fresh();
        let mut code = MInst::new(op).flags().both(Role::D, d, old).imm(imm);
        code.tied = Some(role);
        let rest = if role == Role::N { Role::M } else { Role::N };
        let code = other.map_or(code, |other| code.reg(rest, other));
        self.emit(code);
        d
    }

    /// `op d, n, m` with three low registers.
    fn three(&mut self, op: Op, n: Reg, m: Reg) -> VReg {
        self.result(MInst::new(op).flags().with(Role::N, n).with(Role::M, m))
    }

    /// A copy, which leaves the flags.
    fn copy(&mut self, from: Reg) -> VReg {
        self.result(MInst::new(Op::MOV_register).with(Role::M, from))
    }

    /// The result under the name that selection gave it.
    fn name(&mut self, code: &MInst, role: Role, from: VReg) {
        let Some(Operand {
            reg: Reg::Virtual(to),
            ..
        }) = code.operands[role as usize]
        else {
            return;
        };
        let last = self.out.blocks[self.at]
            .code
            .last_mut()
            .filter(|last| last.writes().eq([from]));
        match last {
            // Nobody else knows it yet.
            Some(last) if from >= self.known => last.rename(from, to),
            _ => self.emit(
                MInst::new(Op::MOV_register)
                    .reg(Role::D, to)
                    .reg(Role::M, from),
            ),
        }
    }

    /// What stands in a role, in a low register.
    fn low(&mut self, code: &MInst, role: Role) -> Reg {
        match code.operands[role as usize].map(|operand| operand.reg) {
            Some(Reg::Fixed(reg)) if reg >= 8 => Reg::Virtual(self.copy(Reg::Fixed(reg))),
            Some(reg) => reg,
            // Every instruction has the operands that its lowering asks for.
            None => Reg::Virtual(self.constant(0)),
        }
    }

    /// The same in a register that is not fixed.
    fn value(&mut self, code: &MInst, role: Role) -> VReg {
        match self.low(code, role) {
            Reg::Virtual(reg) => reg,
            fixed => self.copy(fixed),
        }
    }

    /// The operand M, shifted as it is in the instruction.
    fn shifted(&mut self, code: &MInst, role: Role) -> Reg {
        let reg = self.low(code, role);
        let op = match code.inst.shift {
            ShiftType::LSR => Op::LSR_immediate,
            ShiftType::ASR => Op::ASR_immediate,
            _ => Op::LSL_immediate,
        };
        if code.inst.amount == 0 {
            reg
        } else {
            Reg::Virtual(self.shift(op, reg, code.inst.amount))
        }
    }

    fn shift(&mut self, op: Op, reg: Reg, amount: u8) -> VReg {
        let mut code = MInst::new(op).flags().with(Role::M, reg);
        code.inst.amount = amount;
        self.result(code)
    }

    /// The result of a routine.
    fn call(&mut self, routine: Routine, a: VReg, b: VReg) -> VReg {
        let code = MInst {
            address: Some(Relocation::Routine(routine)),
            ..MInst::new(Op::BL)
        };
        self.result(code.reg(Role::N, a).reg(Role::M, b))
    }

    fn jump(&mut self, block: BlockId, args: Vec<VReg>) {
        self.out.blocks[self.at].end = Terminator::Jump(Edge { block, args });
    }

    fn end(&mut self, end: Terminator, heads: &IdMap<BlockId, BlockId>) {
        match end {
            Terminator::Jump(edge) => self.jump(heads[edge.block], edge.args),
            Terminator::Branch {
                cond,
                yes,
                no,
                likely,
            } => self.branch(cond, heads[yes], heads[no], likely),
            Terminator::NextKey(code) => self.out.blocks[self.at].end = Terminator::NextKey(code),
            Terminator::FallThrough => self.out.blocks[self.at].end = Terminator::FallThrough,
        }
    }
}
