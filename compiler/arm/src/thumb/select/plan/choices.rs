//! Conditional stores: `set c (select b v (get c))` is a store where `b` holds, and no copy of the
//! old word.

use super::Plan;
use super::stored_cells::{StartsOfBlocks, StoredCells, note_stores};
use std::slice;
use whippen_kernel::{Inst, Op, Value};
use whippen_modes::Mode;

/// Marks the choices that wait until a cell is overwritten by them, and the words that cells had.
pub(super) fn find_conditional_stores(plan: &mut Plan, mode: &Mode, starts: &StartsOfBlocks) {
    for (block, start) in mode.blocks.iter().zip(starts) {
        scan_block(plan, &block.insts, start.clone());
    }
}

fn scan_block(plan: &mut Plan, insts: &[Inst], mut stored: StoredCells) {
    for (at, inst) in insts.iter().enumerate() {
        match inst.op {
            Op::Get(cell) if !stored[cell as usize] => {
                plan[inst.results[0]].old_word_of = Some(cell);
            }
            Op::Set(cell) if !stored[cell as usize] => {
                let chosen = inst.args[0];
                plan[chosen].becomes_store = may_keep_word(plan, &insts[..at], chosen, cell);
            }
            _ => {}
        }
        note_stores(slice::from_ref(inst), &mut stored);
    }
}

/// Whether a value is a choice, made by one of these for its store alone, whose one side is the
/// word that the cell has.
fn may_keep_word(plan: &Plan, insts: &[Inst], chosen: Value, cell: u32) -> bool {
    let maker = insts
        .iter()
        .rfind(|inst| inst.results.first() == Some(&chosen));
    maker.is_some_and(|choice| {
        let is_old = |value: &Value| plan[value].old_word_of == Some(cell);
        choice.op == Op::Select && plan[chosen].uses == 1 && choice.args[1..].iter().any(is_old)
    })
}
