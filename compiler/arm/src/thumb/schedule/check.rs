//! Whether a schedule computes the same.

use crate::thumb::minst::{Access, AliasClass, MInst, Reg};
use crate::thumb::reorder_check::{self, Step};
use whippen_isa::Flags;

pub(super) fn computes_same(one: &[MInst], other: &[MInst]) -> bool {
    let steps = |code: &[MInst]| code.iter().map(step_of).collect::<Vec<Step>>();
    reorder_check::computes_same(&steps(one), &steps(other))
}

fn step_of(code: &MInst) -> Step {
    let flags = code.inst.flags();
    let mut reads: Vec<String> = code.reads().map(|reg| format!("v{reg}")).collect();
    let mut writes: Vec<String> = code.writes().map(|reg| format!("v{reg}")).collect();
    for (touched, to) in [(flags.reads, &mut reads), (flags.writes, &mut writes)] {
        if touched.intersects(Flags::NZCV) {
            to.push("flags".to_string());
        }
    }
    for u in code.uses() {
        if let Reg::Fixed(reg) = u.operand.reg {
            if u.reads || !u.writes {
                reads.push(format!("r{reg}"));
            }
            if u.writes {
                writes.push(format!("r{reg}"));
            }
        }
    }
    match code.access {
        Access::None | Access::Read(AliasClass::Constant) | Access::Write(AliasClass::Constant) => {
        }
        Access::Read(place) => reads.push(format!("{place:?}")),
        Access::Write(place) => writes.push(format!("{place:?}")),
    }
    Step {
        name: format!("{:?}", (code.inst, code.operands)),
        reads,
        writes,
    }
}
