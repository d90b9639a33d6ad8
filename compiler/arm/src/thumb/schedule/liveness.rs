//! Which registers are needed behind each block.

use crate::thumb::minst::{Func, MInst, Terminator, VReg};

/// A set of registers, a bit for each.
type Set = Vec<u64>;

pub(super) fn live_out(func: &Func) -> Vec<Vec<VReg>> {
    let empty: Set = vec![0; func.vregs as usize / 64 + 1];
    let mut before = vec![empty; func.blocks.len()];
    let mut out = before.clone();
    loop {
        let mut changed = false;
        // From the end: blocks follow those that lead to them, so one round does, but for loops.
        for index in (0..func.blocks.len()).rev() {
            let block = &func.blocks[index];
            let mut needed: Set = vec![0; before[index].len()];
            for target in block.end.targets() {
                needed
                    .iter_mut()
                    .zip(&before[target])
                    .for_each(|(all, more)| *all |= more);
            }
            if let Terminator::Jump(edge) = &block.end {
                edge.args
                    .iter()
                    .for_each(|reg| put(&mut needed, *reg, true));
            }
            out[index].clone_from(&needed);
            if let Terminator::NextKey(code) = block.end {
                put(&mut needed, code, true);
            }
            for code in block.code.iter().rev() {
                code.writes().for_each(|reg| put(&mut needed, reg, false));
                MInst::reads(code).for_each(|reg| put(&mut needed, reg, true));
            }
            block
                .params
                .iter()
                .for_each(|reg| put(&mut needed, *reg, false));
            changed |= before[index] != needed;
            before[index] = needed;
        }
        if !changed {
            return out.into_iter().map(|set| members(&set)).collect();
        }
    }
}

fn put(set: &mut Set, reg: VReg, is_in: bool) {
    let (word, bit) = (&mut set[reg as usize / 64], 1 << (reg % 64));
    *word = if is_in { *word | bit } else { *word & !bit };
}

fn members(set: &Set) -> Vec<VReg> {
    let mut all = Vec::new();
    for (word, bits) in (0..).zip(set) {
        let mut left = *bits;
        while left != 0 {
            all.push(64 * word + left.trailing_zeros());
            left &= left - 1;
        }
    }
    all
}
