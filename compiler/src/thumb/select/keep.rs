//! Cells that may keep their word: `set c (select b v (get c))` is a store where `b` holds, and no copy of the old word.

use super::Select;
use crate::kernel::{Inst, Op, Type, Value};
use crate::modes::{Block, Mode};
use crate::thumb::frame::K;
use crate::thumb::vcode::{Access, Code, Place, Role};
use whippen_isa::Op as Isa;

/// The choices, by their results, that wait until a cell is overwritten by them.
pub(super) fn waiting(mode: &Mode, used: &[u32]) -> Vec<bool> {
    let mut found = vec![false; mode.values.len()];
    mode.blocks.iter().for_each(|block| in_block(block, used, &mut found));
    found
}

fn in_block(block: &Block, used: &[u32], found: &mut [bool]) {
    for (at, set) in block.insts.iter().enumerate() {
        let Op::Set(cell) = set.op else { continue };
        let chosen = set.args[0];
        let before = &block.insts[..at];
        let made = before.iter().rfind(|inst| inst.results.first() == Some(&chosen));
        let Some(choice) = made.filter(|inst| inst.op == Op::Select && used[chosen.0 as usize] == 1) else { continue };
        let is_old = |inst: &Inst| inst.op == Op::Get(cell) && choice.args[1..].contains(&inst.results[0]);
        let old = before.iter().rposition(is_old);
        found[chosen.0 as usize] = old.is_some_and(|old| !stores(&before[old..], cell));
    }
}

/// Whether one of the instructions may write the cell.
fn stores(insts: &[Inst], cell: u32) -> bool {
    insts.iter().any(|inst| {
        let inside = inst.regions.iter().any(|region| stores(&region.insts, cell));
        inside || matches!(inst.op, Op::Set(other) | Op::SetAt(other) if other == cell)
    })
}

impl Select<'_> {
    /// A store of a choice that waited for it.
    pub(super) fn store_chosen(&mut self, cell: u32, [condition, yes, no]: [Value; 3]) {
        let keeps_no = self.old[no.0 as usize] == Some(cell);
        let new = self.reg(if keeps_no { yes } else { no });
        let cond = self.condition(condition);
        let cond = if keeps_no { Some(cond) } else { cond.invert() };
        let offset = self.frame.cells[cell as usize];
        let store = Code::new(Isa::STR_immediate).with(Role::N, Self::fixed(K)).reg(Role::T, new).imm(offset);
        let mut store = store.access(Access::Write(Place::Cell(cell)));
        store.inst.cond = cond;
        self.emit(store);
    }

    /// Whether a choice waits for its store; its operands are kept until then.
    pub(super) fn waits_for_store(&mut self, inst: &Inst) -> bool {
        let result = inst.results[0];
        let (waits, small) = (self.waiting[result.0 as usize], self.info(result).ty != Type::I64);
        let decided = self.constant(inst.args[0]).is_some();
        if waits && small && !decided {
            self.chosen.insert(result, [inst.args[0], inst.args[1], inst.args[2]]);
        }
        waits && small && !decided
    }
}
