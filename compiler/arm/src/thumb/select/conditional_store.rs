//! Cells that may keep their word: `set c (select b v (get c))` is a store where `b` holds, and no
//! copy of the old word.

use super::{Binding, Select};
use crate::thumb::minst::{Access, AliasClass, MInst, Role, VReg};
use crate::thumb::registers::RECORD;
use whippen_isa::{Cond, Op as Isa};
use whippen_kernel::{Inst, Op, Type, Value};
use whippen_modes::Mode;

/// The choices, by their results, that wait until a cell is overwritten by them.
pub(super) fn find(mode: &Mode, use_count: &[u32], cells: usize) -> Vec<bool> {
    let mut scan = StoreScan {
        loaded_from: vec![None; mode.values.len()],
        found: vec![false; mode.values.len()],
        use_count,
    };
    let mut before = vec![vec![false; cells]; mode.blocks.len()];
    // What a block names comes after it, so one pass sees every way in.
    for (index, block) in mode.blocks.iter().enumerate() {
        let mut stored = std::mem::take(&mut before[index]);
        scan.block(&block.insts, &mut stored);
        for target in block.end.targets() {
            before[target.block]
                .iter_mut()
                .zip(&stored)
                .for_each(|(known, stored)| *known |= stored);
        }
    }
    scan.found
}

struct StoreScan<'a> {
    /// The cell whose word a value is, as it was at the tick's start.
    loaded_from: Vec<Option<u32>>,
    found: Vec<bool>,
    use_count: &'a [u32],
}

impl StoreScan<'_> {
    fn block(&mut self, insts: &[Inst], stored: &mut [bool]) {
        for (at, inst) in insts.iter().enumerate() {
            match inst.op {
                Op::Get(cell) if !stored[cell as usize] => {
                    self.loaded_from[inst.results[0].0 as usize] = Some(cell)
                }
                Op::Set(cell) if !stored[cell as usize] => {
                    let chosen = inst.args[0];
                    let made = insts[..at]
                        .iter()
                        .rfind(|inst| inst.results.first() == Some(&chosen));
                    let alone = |choice: &&Inst| {
                        choice.op == Op::Select && self.use_count[chosen.0 as usize] == 1
                    };
                    let is_old = |value: &Value| self.loaded_from[value.0 as usize] == Some(cell);
                    let keeps = made
                        .filter(alone)
                        .is_some_and(|choice| choice.args[1..].iter().any(is_old));
                    self.found[chosen.0 as usize] = keeps;
                }
                _ => {}
            }
            stores(inst, stored);
        }
    }
}

/// Notes the cells that an instruction may write.
fn stores(inst: &Inst, stored: &mut [bool]) {
    for inst in inst.all_insts() {
        if let Op::Set(cell) | Op::SetAt(cell) = inst.op {
            stored[cell as usize] = true;
        }
    }
}

impl Select<'_> {
    /// A store of a choice that waited for it.
    pub(super) fn store_conditionally(&mut self, cell: u32, [condition, yes, no]: [Value; 3]) {
        let keeps_no = self.loaded_from[no.0 as usize] == Some(cell);
        let new = if keeps_no { yes } else { no };
        let (new, cond) = match self
            .zero_where_equal(condition)
            .filter(|_| keeps_no && self.constant(new) == Some(0))
        {
            Some([a, b]) => (self.subtract_with_flags(a, b), Some(Cond::EQ)),
            None => {
                let (new, cond) = (self.reg(new), self.condition(condition));
                (new, if keeps_no { Some(cond) } else { cond.invert() })
            }
        };
        let offset = self.layout.cells[cell as usize];
        let store = MInst::new(Isa::STR_immediate)
            .with(Role::N, Self::fixed(RECORD))
            .reg(Role::T, new)
            .imm(offset);
        let mut store = store.access(Access::Write(AliasClass::Cell(cell)));
        store.inst.cond = cond;
        self.emit(store);
    }

    /// Two words whose difference is zero where a bool holds.
    fn zero_where_equal(&self, condition: Value) -> Option<[Value; 2]> {
        match self.bindings[condition.0 as usize] {
            Binding::Comparison(Op::Eq, [a, b])
                if self.info(a).ty != Type::I64 && self.split_constant(&[a, b]).is_none() =>
            {
                Some([a, b])
            }
            _ => None,
        }
    }

    /// Sets the flags, as a comparison would, and keeps the difference.
    fn subtract_with_flags(&mut self, a: Value, b: Value) -> VReg {
        let (n, m) = (self.reg(a), self.reg(b));
        self.result(
            MInst::new(Isa::SUB_register)
                .reg(Role::N, n)
                .reg(Role::M, m)
                .flags(),
        )
    }

    /// Whether a choice waits for its store; its operands are kept until then.
    pub(super) fn defers_to_store(&mut self, inst: &Inst) -> bool {
        let result = inst.results[0];
        let (waits, small) = (
            self.becomes_store[result.0 as usize],
            self.info(result).ty != Type::I64,
        );
        let decided = self.constant(inst.args[0]).is_some();
        if waits && small && !decided {
            self.pending_choices
                .insert(result, [inst.args[0], inst.args[1], inst.args[2]]);
        }
        waits && small && !decided
    }
}
