//! Conditional stores: a choice between a new word and the cell's old one waits for its store.

use super::compare::Relation;
use super::{Binding, Select};
use crate::thumb::minst::{Access, AliasClass, MInst, Role, VReg};
use crate::thumb::registers::RECORD;
use whippen_isa::{Cond, Op as Isa};
use whippen_kernel::{Inst, Type, Value};

impl Select<'_> {
    /// A store of a choice that waited for it.
    pub(super) fn store_conditionally(&mut self, cell: u32, [condition, yes, no]: [Value; 3]) {
        let keeps_no = self.plan[no].old_word_of == Some(cell);
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
        match self.binding(condition) {
            Binding::Comparison(Relation::Equal, [a, b])
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

    /// Binds a choice that waits for its store, with what it chooses from.
    pub(super) fn bind_at_store(&self, inst: &Inst, result: Value) -> Option<Binding> {
        let is_word = self.info(result).ty != Type::I64;
        let is_decided = self.constant(inst.args[0]).is_some();
        let waits = self.plan[result].becomes_store && is_word && !is_decided;
        waits.then(|| Binding::Choice([inst.args[0], inst.args[1], inst.args[2]]))
    }
}
