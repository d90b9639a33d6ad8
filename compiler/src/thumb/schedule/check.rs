//! Whether two orders of the same instructions compute the same, found without dependences: everyone who reads flags, a fixed
//! register or memory must find there what the same instruction left, and nothing is used before it is defined.

use crate::thumb::vcode::{Access, Code, Place, Reg, VReg};
use std::collections::{BTreeMap, HashSet};
use whippen_isa::Flags;

/// What one instruction finds: itself, as text, and who left what it reads.
type Found = (String, Vec<(String, Option<String>)>);

pub(super) fn same(one: &[Code], other: &[Code]) -> bool {
    let defined: HashSet<VReg> = one.iter().flat_map(Code::writes).collect();
    let (a, b) = (found(one, &defined), found(other, &defined));
    a.is_some() && a == b
}

/// What each instruction finds, sorted, and what is left at the end; none if something is used before it is defined.
fn found(code: &[Code], defined_here: &HashSet<VReg>) -> Option<(Vec<Found>, BTreeMap<String, String>)> {
    let mut left: BTreeMap<String, String> = BTreeMap::new();
    let mut defined: HashSet<VReg> = HashSet::new();
    let mut all = Vec::new();
    for inst in code {
        if inst.reads().any(|reg| defined_here.contains(&reg) && !defined.contains(&reg)) {
            return None;
        }
        let name = format!("{:?}", (inst.inst, inst.operands));
        let (reads, writes) = places(inst);
        let seen = reads.into_iter().map(|place| (place.clone(), left.get(&place).cloned())).collect();
        // An access also stands behind the one that wrote before it.
        for place in writes {
            left.insert(place, name.clone());
        }
        defined.extend(inst.writes());
        all.push((name, seen));
    }
    all.sort();
    Some((all, left))
}

fn places(code: &Code) -> (Vec<String>, Vec<String>) {
    let flags = code.inst.flags();
    let (mut reads, mut writes) = (Vec::new(), Vec::new());
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
    (reads, writes)
}
