//! How often values are used, and as what: counted before anything is selected.

use super::Select;
use whippen_kernel::{Inst, Op, Value, all_insts};

impl Select<'_> {
    pub(super) fn count_word_uses(&mut self, values: &[Value]) {
        for value in values {
            self.as_word[value.0 as usize] = true;
            self.use_count[value.0 as usize] += 1;
        }
    }

    /// Counts what is compared as often as the comparison, which is made anew for each use.
    pub(super) fn count_compared(&mut self, insts: &[Inst]) {
        for inst in all_insts(insts) {
            if matches!(inst.op, Op::Lt | Op::Le | Op::Eq)
                && self.use_count[inst.results[0].0 as usize] != 1
            {
                inst.args
                    .iter()
                    .for_each(|arg| self.use_count[arg.0 as usize] += 1);
            }
        }
    }

    /// Counts what is a term of a sum; nothing in loops.
    pub(super) fn count_sum_terms(&mut self, insts: &[Inst]) {
        for inst in insts {
            if matches!(inst.op, Op::Add | Op::Sub) && inst.args[0] != inst.args[1] {
                inst.args
                    .iter()
                    .for_each(|arg| self.sum_uses[arg.0 as usize] += 1);
            }
            if inst.op == Op::If {
                inst.regions
                    .iter()
                    .for_each(|inner| self.count_sum_terms(&inner.insts));
            }
        }
    }

    /// Counts everything in a loop once more, so that nothing is computed again in each round.
    fn count_in_loop(&mut self, insts: &[Inst]) {
        for inst in all_insts(insts) {
            inst.args
                .iter()
                .for_each(|arg| self.use_count[arg.0 as usize] += 1);
        }
    }

    /// Marks the bools that are needed as words: all but those that only steer.
    pub(super) fn count_uses(&mut self, insts: &[Inst]) {
        for inst in insts {
            let words = if matches!(inst.op, Op::If | Op::Select) {
                &inst.args[1..]
            } else {
                &inst.args
            };
            self.count_word_uses(words);
            if words.len() < inst.args.len() {
                self.use_count[inst.args[0].0 as usize] += 1;
            }
            for inner in &inst.regions {
                self.count_word_uses(&inner.yields);
                self.count_uses(&inner.insts);
                if matches!(inst.op, Op::Loop(_)) {
                    self.count_in_loop(&inner.insts);
                    inner
                        .yields
                        .iter()
                        .for_each(|value| self.use_count[value.0 as usize] += 1);
                }
            }
        }
    }
}
