//! Whether a schedule computes the same.

use crate::thumb::same::{self, Step};
use crate::thumb::vcode::{Access, Code, Place, Reg};
use whippen_isa::Flags;

pub(super) fn same(one: &[Code], other: &[Code]) -> bool {
    let steps = |code: &[Code]| code.iter().map(step).collect::<Vec<Step>>();
    same::same(&steps(one), &steps(other))
}

fn step(code: &Code) -> Step {
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
        Access::None | Access::Read(Place::Constant) | Access::Write(Place::Constant) => {}
        Access::Read(place) => reads.push(format!("{place:?}")),
        Access::Write(place) => writes.push(format!("{place:?}")),
    }
    Step {
        name: format!("{:?}", (code.inst, code.operands)),
        reads,
        writes,
    }
}
