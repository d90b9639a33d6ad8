//! How far the registers of a mode's code are from where they pointed when it was entered, and
//! whether the key's next mode is still to be stored: a must analysis, forward.

use std::collections::hash_map::Entry;

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::flow::{Flow, state_at};
use whippen_isa::{Class, Inst, ItState, Op};

/// What holds before an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Held {
    /// How far each register is from where it was at the entry, if that is known.
    moved: [Option<i32>; 16],
    /// Nobody has stored to the first word behind `record` yet.
    pub unchanged: bool,
}

impl Held {
    /// How far a register is from where it was at the entry, if that is known.
    pub(super) fn moved(&self, register: u8) -> Option<i32> {
        self.moved[usize::from(register)]
    }

    fn behind(mut self, inst: &Inst, record: u8) -> Held {
        self.unchanged &= !stores_first(inst, record, self.moved(record));
        let defs = inst.defs().core_bits();
        for register in 0..16 {
            if defs >> register & 1 != 0 {
                let by = step(inst, register).filter(|_| !inst.is_conditional());
                let moved = &mut self.moved[usize::from(register)];
                *moved = moved.zip(by).and_then(|(moved, by)| moved.checked_add(by));
            }
        }
        self
    }

    fn meet(mut self, other: &Held) -> Held {
        for (own, other) in self.moved.iter_mut().zip(other.moved) {
            *own = (*own).filter(|_| *own == other);
        }
        self.unchanged &= other.unchanged;
        self
    }
}

/// By how much an instruction moves a register that it writes, if it only moves it.
fn step(inst: &Inst, register: u8) -> Option<i32> {
    // What is larger moves no pointer.
    let way = i32::try_from(inst.imm).ok()?;
    let sum = |sign: i32| (inst.n == register).then_some(sign * way);
    match inst.op() {
        Op::ADD_immediate => sum(1),
        Op::SUB_immediate => sum(-1),
        _ if inst.wback && inst.n == register && inst.t != register => {
            let single = matches!(inst.class(), Class::Load | Class::Store);
            single.then_some(if inst.add { way } else { -way })
        }
        _ => None,
    }
}

/// What holds at each instruction that is reached from `from` without leaving the code before `to`,
/// by address. The register `record` points at the record.
pub(super) fn held(flow: &Flow, from: u32, to: u32, record: u8) -> Vec<(u32, Held)> {
    let entry = Held {
        moved: [Some(0); 16],
        unchanged: true,
    };
    let instructions_max = (to.saturating_sub(from) / 2) as usize;
    let mut all = FxHashMap::with_capacity_and_hasher(instructions_max, FxBuildHasher);
    all.insert(from, (entry, ItState::OUTSIDE));
    let mut open = vec![from];
    while let Some(at) = open.pop() {
        let Some((before, it)) = all.get(&at).copied() else {
            continue;
        };
        let Some(inst) = flow.inst(at, it) else {
            continue;
        };
        let behind = before.behind(&inst, record);
        let inside = |next: &u32| (from + 1..to).contains(next);
        for next in flow.leads(&inst, at).to.into_iter().filter(inside) {
            let it = state_at(next, at, &inst, it);
            let (known, is_new) = match all.entry(next) {
                Entry::Vacant(place) => (place.insert((behind, it)), true),
                Entry::Occupied(place) => (place.into_mut(), false),
            };
            let met = known.0.meet(&behind);
            if is_new || met != known.0 {
                *known = (met, it);
                open.push(next);
            }
        }
    }
    let mut all: Vec<(u32, Held)> = all.into_iter().map(|(at, (held, _))| (at, held)).collect();
    all.sort_unstable_by_key(|(at, _)| *at);
    all
}

/// Whether an instruction may store to the first word of the record, from which its register is so
/// far.
fn stores_first(inst: &Inst, record: u8, moved: Option<i32>) -> bool {
    let offset = match (inst.index, inst.add) {
        (false, _) => 0,
        (true, true) => inst.imm as i32,
        (true, false) => -(inst.imm as i32),
    };
    match inst.class() {
        Class::Store | Class::StoreDual => {
            inst.n == record && moved.is_none_or(|moved| moved + offset == 0)
        }
        Class::StoreMultiple => inst.n == record,
        _ => false,
    }
}
