//! Whether an order of instructions with registers computes the same.

use crate::thumb::allocate::Fixed;
use crate::thumb::same::{self, Step};
use crate::thumb::vcode::{Access, Place};
use whippen_isa::Flags;
use whippen_isa::reg::SP;

pub(super) fn same(one: &[Fixed], other: &[Fixed]) -> bool {
    let steps = |code: &[Fixed]| code.iter().map(step).collect::<Vec<Step>>();
    same::same(&steps(one), &steps(other))
}

fn step(fixed: &Fixed) -> Step {
    let inst = &fixed.inst;
    let registers = |bits: u16| (0..16).filter(move |reg| bits >> reg & 1 == 1).map(|reg| format!("r{reg}"));
    let mut reads: Vec<String> = registers(inst.uses().core_bits()).collect();
    let mut writes: Vec<String> = registers(inst.defs().core_bits()).collect();
    if inst.is_conditional() {
        // What is skipped leaves what was there.
        reads.extend(writes.clone());
    }
    let flags = inst.flags();
    for (touched, to) in [(flags.reads, &mut reads), (flags.writes, &mut writes)] {
        if touched.intersects(Flags::NZCV) {
            to.push("flags".to_string());
        }
    }
    match fixed.code.map(|code| code.access) {
        None if inst.n == SP => {
            let to = if inst.uses().core_bits() >> inst.t & 1 == 1 { &mut writes } else { &mut reads };
            to.push(format!("stack {}", inst.imm));
        }
        None | Some(Access::None | Access::Read(Place::Constant) | Access::Write(Place::Constant)) => {}
        Some(Access::Read(place)) => reads.push(format!("{place:?}")),
        Some(Access::Write(place)) => writes.push(format!("{place:?}")),
    }
    Step { name: format!("{:?}", (inst, fixed.code.and_then(|code| code.address))), reads, writes }
}
