//! The stack of a core: where it ends, which memory it is in, and whether it has room.

use std::collections::BTreeMap;

use super::NotBounded;
use super::memory::Reach;
use super::program::Program;
use super::tick_handler::OnCore;
use super::unknown::Unknown;
use whippen_board::Board;
use whippen_firmware::RUNNING;
use whippen_isa::reg;

impl OnCore<'_> {
    /// Where the stack ends, and where accesses to it go.
    pub(super) fn stack(&self) -> Result<(u32, Reach), NotBounded> {
        let name = self.running.vectors;
        stack_memory(self.program, self.interference.board, self.number)
            .ok_or_else(|| NotBounded::NoSymbol { name: name.into() })
    }

    /// The stack pointer as the one register of which it is known where it points.
    pub(super) fn stack_base(&self) -> Result<BTreeMap<u8, Reach>, NotBounded> {
        Ok([(reg::SP, self.stack()?.1)].into())
    }

    /// That nothing lies where so many bytes of stack reach.
    pub(super) fn has_stack_room(&self, end: u32, needed: u32) -> Result<(), NotBounded> {
        let memory = self.interference.board.memory_at(end.wrapping_sub(4));
        let base = memory.map_or(end, |memory| memory.base);
        let sections = self.program.sections.iter();
        let below = sections
            .filter(|section| section.base < end)
            .map(|section| section.base.saturating_add(section.size))
            .max();
        let stacks = self.interference.board.stacks.iter().copied();
        let stack = stacks.filter(|other| *other < end).max();
        let below = below.max(stack).unwrap_or(0);
        let room = end.saturating_sub(below.max(base));
        if needed <= room {
            return Ok(());
        }
        Err(NotBounded::StackRoom { needed, room, end })
    }
}

/// Where a core's stack ends and where accesses to it go: the first word of its vectors says it.
pub(super) fn stack_memory(program: &Program, board: &Board, core: usize) -> Option<(u32, Reach)> {
    let vectors = *program.symbols.get(RUNNING.get(core)?.vectors)?;
    let end = program.code.word(vectors)?;
    let memory = board.memory_at(end.checked_sub(4)?);
    let known = memory.filter(|memory| memory.access.extra_cycles().is_some());
    let unknown = match (known, memory) {
        (Some(_), _) => None,
        (None, Some(memory)) => Some(Unknown::Memory {
            memory: memory.name.clone(),
            section: None,
        }),
        (None, None) => Some(Unknown::Nothing { target: end - 4 }),
    };
    let banks = known.map_or(0, |memory| memory.bank_set());
    Some((end, Reach { banks, unknown }))
}
