//! How often values are used, and as what.

use super::Plan;
use whippen_kernel::{Inst, Op, Value, all_insts};
use whippen_modes::End;

/// Counts uses, and marks the bools that are needed as words: all but those that only steer.
pub(super) fn count_uses(plan: &mut Plan, insts: &[Inst]) {
    for inst in insts {
        let words = if matches!(inst.op, Op::If | Op::Select) {
            plan[inst.args[0]].uses += 1;
            &inst.args[1..]
        } else {
            &inst.args
        };
        count_word_uses(plan, words);
        for inner in &inst.regions {
            count_word_uses(plan, &inner.yields);
            count_uses(plan, &inner.insts);
            if matches!(inst.op, Op::Loop(_)) {
                count_in_loop(plan, &inner.insts);
                count_again(plan, &inner.yields);
            }
        }
    }
}

/// Counts what a block hands over, and what it decides by.
pub(super) fn count_uses_of_end(plan: &mut Plan, end: &End) {
    if let End::Branch { condition, .. } = end {
        plan[condition].uses += 1;
    }
    for target in end.targets() {
        count_word_uses(plan, &target.args);
    }
}

/// Counts values that are needed in registers.
pub(super) fn count_word_uses(plan: &mut Plan, values: &[Value]) {
    for value in values {
        plan[value].as_word = true;
        plan[value].uses += 1;
    }
}

/// Counts everything in a loop once more, so that nothing is computed again in each round.
fn count_in_loop(plan: &mut Plan, insts: &[Inst]) {
    for inst in all_insts(insts) {
        count_again(plan, &inst.args);
    }
}

fn count_again(plan: &mut Plan, values: &[Value]) {
    for value in values {
        plan[value].uses += 1;
    }
}

/// Counts what is a term of a sum; nothing in loops.
pub(super) fn count_sum_terms(plan: &mut Plan, insts: &[Inst]) {
    for inst in insts {
        if matches!(inst.op, Op::Add | Op::Sub) && inst.args[0] != inst.args[1] {
            for arg in &inst.args {
                plan[arg].sum_uses += 1;
            }
        }
        if inst.op == Op::If {
            for inner in &inst.regions {
                count_sum_terms(plan, &inner.insts);
            }
        }
    }
}

/// Counts what is compared as often as the comparison, which is made anew for each use.
pub(super) fn count_compared(plan: &mut Plan, insts: &[Inst]) {
    for inst in all_insts(insts) {
        if matches!(inst.op, Op::Lt | Op::Le | Op::Eq) && plan[inst.results[0]].uses != 1 {
            count_again(plan, &inst.args);
        }
    }
}
