//! Loads that overlap: whether an access is in the same memory as the one right before it. On cores
//! where loads of one memory pipeline, what is not known to be in one is taken to be in two.

#[cfg(test)]
mod tests;

use whippen_isa::{Inst, reg};

use crate::access::addresses;
use crate::facts::Facts;
use crate::memory::Around;
use crate::place::Tag;

/// What an access leaves for the next one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Last {
    /// The memory that it was in, by first address, where that is known.
    memory: Option<u32>,
    /// The register that it went by, and that still points where it did.
    pointer: Option<u8>,
}

/// Whether the address is in the register `n`, but for a constant or a shifted index.
fn is_by_pointer(inst: &Inst) -> bool {
    inst.words() > 0 && inst.base() != reg::PC && (!inst.is_by_register() || inst.amount > 0)
}

impl Last {
    /// What an instruction leaves.
    pub(crate) fn of(
        inst: &Inst,
        at: u32,
        facts: &Facts,
        tag: Option<Tag>,
        around: &Around,
    ) -> Self {
        if inst.words() == 0 {
            return Self::default();
        }
        let kept = inst.defs().core_bits() >> inst.n & 1 == 0 || inst.steps(inst.n);
        Self {
            memory: memory_of(inst, at, facts, tag, around),
            pointer: Some(inst.n).filter(|_| kept && is_by_pointer(inst)),
        }
    }

    /// Whether an instruction may access another memory than the last one.
    pub(crate) fn is_apart(self, own: Self, inst: &Inst) -> bool {
        let one = self.pointer == Some(inst.n) && is_by_pointer(inst);
        !(one || self.memory.is_some() && self.memory == own.memory)
    }
}

/// The memory that an instruction accesses, where it is known to be one.
fn memory_of(
    inst: &Inst,
    at: u32,
    facts: &Facts,
    tag: Option<Tag>,
    around: &Around,
) -> Option<u32> {
    let by_register = inst.is_by_register();
    match tag {
        Some(Tag::Section(section)) if !by_register && inst.base() != reg::PC => {
            around.memory_base(section)
        }
        _ if inst.n == reg::SP && !by_register => around.stack_memory(),
        _ => {
            let [low, high] = addresses(inst, at, facts)?;
            let last = (high as u32).wrapping_add(4 * u32::from(inst.words() - 1));
            let memory = around.memory_base(low as u32)?;
            (around.memory_base(last) == Some(memory)).then_some(memory)
        }
    }
}
