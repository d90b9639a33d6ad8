//! Which registers are needed behind each block.

use crate::thumb::vcode::{Code, End, Func, VReg};
use std::collections::BTreeSet;

pub(super) fn out(func: &Func) -> Vec<Vec<VReg>> {
    let mut before: Vec<BTreeSet<VReg>> = vec![BTreeSet::new(); func.blocks.len()];
    let mut out = before.clone();
    loop {
        let mut changed = false;
        for index in (0..func.blocks.len()).rev() {
            let block = &func.blocks[index];
            let mut needed: BTreeSet<VReg> = BTreeSet::new();
            block.end.targets().iter().for_each(|target| needed.extend(&before[*target]));
            if let End::Jump(edge) = &block.end {
                needed.extend(&edge.args);
            }
            out[index].clone_from(&needed);
            if let End::Next(code) = block.end {
                needed.insert(code);
            }
            for code in block.code.iter().rev() {
                needed.retain(|reg| code.writes().all(|written| written != *reg));
                needed.extend(Code::reads(code));
            }
            needed.retain(|reg| !block.params.contains(reg));
            changed |= before[index] != needed;
            before[index] = needed;
        }
        if !changed {
            return out.into_iter().map(|set| set.into_iter().collect()).collect();
        }
    }
}
