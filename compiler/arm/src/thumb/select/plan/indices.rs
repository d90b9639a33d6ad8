//! Indices of cells, and rows of tables, that are a value and a constant: one address serves
//! several indices, and a table's address takes the constant up.

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
        Op::Add => match constant(b) {
            Some(b) => Some((a, b)),
            None => Some((b, constant(a)?)),
        },
        Op::Sub => Some((a, -constant(b)?)),
        _ => None,
    }
}

/// The operand that is the index of a word of a cell, or of a row of a table.
pub(in crate::thumb) fn index_of(inst: &Inst) -> Option<Value> {
    match inst.op {
        Op::GetAt(_) | Op::SetAt(_) | Op::Lookup(..) => Some(inst.args[0]),
        _ => None,
    }
}

/// What an instruction with half of an address can add to it: its immediate is signed (ELF for the
/// Arm architecture, 4.6.1.1).
const ADDEND_MAX: i64 = i16::MAX as i64;

/// Marks the sums that nothing but such accesses use, and that need not be held inside a cell.
///
/// Those of tables are marked where addresses may take constants up (`in_addresses`), if the
/// constant alone is a row; whether they must be held inside is asked where a row is read.
///
/// What such a sum is made of has the sum's accesses for users: where these stand in several
/// blocks, it cannot wait for the first of them.
pub(super) fn find_sums(plan: &mut Plan, kernel: &Kernel, blocks: &[&[Inst]], in_addresses: bool) {
    let mut uses = IdMap::filled(0_u32, plan.len());
    let mut constants_max = IdMap::filled(i64::MAX, plan.len());
    let mut first_block = IdMap::filled(None, plan.len());
    let mut in_several = IdMap::filled(false, plan.len());
    let numbered = blocks.iter().enumerate();
    for (block, inst) in numbered.flat_map(|(at, insts)| all_insts(insts).map(move |i| (at, i))) {
        let Some(index) = index_of(inst) else {
            continue;
        };
        let is_marked = match (inst.op, inst.op.declared(kernel)) {
            (Op::Lookup(table, _), Some(rows)) => {
                let bytes = 4 * i64::from(kernel.tables[table as usize].columns);
                let most = (rows.len as i64 - 1).min(ADDEND_MAX / bytes);
                constants_max[index] = constants_max[index].min(most);
                in_addresses
            }
            (_, Some(cell)) => Range::new(0, cell.len as i64 - 1).contains(plan[index].proven),
            (_, None) => false,
        };
        uses[index] += u32::from(is_marked);
        in_several[index] |= *first_block[index].get_or_insert(block) != block;
    }
    // In a loop addresses change from round to round, and uses count more than once.
    for inst in blocks.iter().flat_map(|insts| insts.iter()) {
        let Some(result) = inst.results.first().copied() else {
            continue;
        };
        let range = |value: Value| plan[value].proven;
        let constant = |value| (range(value).low == range(value).high).then(|| range(value).low);
        if uses[result] > 0 && uses[result] == plan[result].uses {
            let most = constants_max[result];
            let parts = parts_of_index(inst, constant)
                .filter(|(_, k)| most == i64::MAX || (0..=most).contains(k));
            if let Some((part, _)) = parts.filter(|_| in_several[result]) {
                plan[part].uses += 1;
            }
            plan[result].index = parts;
        }
    }
}
