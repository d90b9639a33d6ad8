//! What an instruction does to the flow of control.

use whippen_isa::{Class, Inst, Op, RegSet, reg};

/// Where an instruction may lead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// To the next.
    Next,
    /// To an address.
    Jump(u32),
    /// To a function that comes back to the next instruction.
    Call(u32),
    /// To a function in a register.
    CallIndirect,
    /// Back to the caller, if the register or stack slot holds what the call put there.
    Return,
    /// To an entry of a table of bytes or halfwords.
    Table,
    /// Anywhere.
    Indirect,
    /// Out of the code's own hands.
    Waits,
}

impl Control {
    /// Of an instruction at an address.
    pub fn of(inst: &Inst, at: u32) -> Self {
        let relative = at.wrapping_add(4).wrapping_add(inst.imm);
        match inst.class() {
            Class::Branch | Class::CompareBranch => Self::Jump(relative),
            Class::BranchLink if inst.op() == Op::BL => Self::Call(relative),
            Class::BranchLink => Self::CallIndirect,
            Class::BranchRegister if inst.m == reg::LR => Self::Return,
            Class::TableBranch => Self::Table,
            Class::Exception | Class::Security => Self::Waits,
            // How many words, only the coprocessor knows.
            Class::Coprocessor if inst.is_of_coprocessor_memory() => Self::Waits,
            Class::Wait if matches!(inst.op(), Op::WFE | Op::WFI) => Self::Waits,
            _ if !inst.defs().contains(RegSet::core(reg::PC)) => Self::Next,
            Class::LoadMultiple | Class::Load if inst.n == reg::SP && inst.wback => Self::Return,
            _ if inst.op() == Op::MOV_register && inst.m == reg::LR => Self::Return,
            _ => Self::Indirect,
        }
    }

    /// Whether something else than the next instruction may follow.
    pub fn branches(self) -> bool {
        self != Self::Next
    }
}

/// Whether the instruction after it may follow a branch.
pub fn falls_through(inst: &Inst) -> bool {
    inst.is_conditional() || inst.class() == Class::CompareBranch
}
