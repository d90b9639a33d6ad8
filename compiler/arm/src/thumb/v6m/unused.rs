//! Instructions whose results nobody reads: flags are made again where they are wanted, so what
//! made them first may be left over.

use crate::thumb::func::{Func, Terminator};
use crate::thumb::minst::{Access, MInst, Reg, VReg};
use rustc_hash::FxHashSet;
use whippen_isa::Flags;

pub(super) fn without(mut func: Func) -> Func {
    loop {
        let read = read(&func);
        let mut gone = false;
        for block in &mut func.blocks {
            let mut flags = matches!(block.end, Terminator::Branch { .. });
            let mut kept: Vec<MInst> = Vec::with_capacity(block.code.len());
            for code in block.code.iter().rev() {
                let (uses, effects) = (
                    code.inst.flags(),
                    matches!(code.access, Access::Write(_) | Access::Update(_)) || fixed(code),
                );
                let wanted = effects
                    || flags && uses.writes.intersects(Flags::NZCV)
                    || code.writes().any(|reg| read.contains(&reg));
                if wanted {
                    flags = flags && !uses.writes.intersects(Flags::NZCV)
                        || uses.reads.intersects(Flags::NZCV);
                    kept.push(*code);
                } else {
                    gone = true;
                }
            }
            kept.reverse();
            block.code = kept;
        }
        if !gone {
            return func;
        }
    }
}

/// Whether a register with a meaning is written.
fn fixed(code: &MInst) -> bool {
    code.uses()
        .any(|u| u.writes && matches!(u.operand.reg, Reg::Fixed(_)))
}

fn read(func: &Func) -> FxHashSet<VReg> {
    let mut read = FxHashSet::default();
    for block in &func.blocks {
        block.code.iter().for_each(|code| read.extend(code.reads()));
        match &block.end {
            Terminator::Jump(edge) => read.extend(edge.args.iter().copied()),
            Terminator::NextKey(code) => drop(read.insert(*code)),
            Terminator::Branch { .. } | Terminator::FallThrough => {}
        }
    }
    read
}
