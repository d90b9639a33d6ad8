//! Indices of cells that are a value and a constant: one address serves several of them.

use super::Plan;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Kernel, Op, Range, Value, all_insts};

/// The value and the constant that an index is the sum of, where it is.
pub(in crate::thumb) fn parts_of_index(
    inst: &Inst,
    constant: impl Fn(Value) -> Option<i64>,
) -> Option<(Value, i64)> {
    let [a, b] = inst.args[..] else {
        return None;
    };
    match inst.op {
        Op::Add => Some((a, constant(b)?)).or_else(|| Some((b, constant(a)?))),
        _ => None,
    }
}

/// The operand that is the index of a word of a cell.
pub(in crate::thumb) fn index_of(inst: &Inst) -> Option<Value> {
    match inst.op {
        Op::GetAt(_) | Op::SetAt(_) => Some(inst.args[0]),
        _ => None,
    }
}

/// Marks the sums that nothing but such accesses use, and that need not be held inside.
pub(super) fn find_sums(plan: &mut Plan, kernel: &Kernel, blocks: &[&[Inst]]) {
    let mut uses = IdMap::filled(0_u32, plan.len());
    for inst in blocks.iter().flat_map(|insts| all_insts(insts)) {
        if let (Some(index), Some(cell)) = (index_of(inst), inst.op.declared(kernel)) {
            let inside = Range::new(0, cell.len as i64 - 1).contains(plan[index].proven);
            uses[index] += u32::from(inside);
        }
    }
    // In a loop addresses change from round to round, and uses count more than once.
    for inst in blocks.iter().flat_map(|insts| insts.iter()) {
        let Some(result) = inst.results.first().copied() else {
            continue;
        };
        let range = |value: Value| plan[value].proven;
        let constant = |value| (range(value).low == range(value).high).then(|| range(value).low);
        if uses[result] > 0 && uses[result] == plan[result].uses {
            plan[result].index = parts_of_index(inst, constant);
        }
    }
}
