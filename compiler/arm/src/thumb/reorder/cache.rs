//! Memoised orders of blocks: modes share many blocks, and so do the strategies by which one mode
//! is compiled.

use std::sync::Mutex;

use rustc_hash::FxHashMap;

use crate::thumb::func::{Block, Terminator};
use crate::thumb::minst::{Access, MInst, Operand, PReg, Role};
use whippen_isa::{Cond, Inst};

/// The registers of an instruction's operands, by role.
type Operands = [Option<Operand<PReg>>; 6];

/// An instruction in an order.
#[derive(Debug, Clone, Copy)]
pub struct Moved {
    /// Where it stood.
    from: usize,
    /// In the registers that it has now.
    inst: Inst,
    operands: Operands,
}

/// An order of a block's instructions.
pub type Ordered = Vec<Moved>;

/// Orders by what they were found for.
#[derive(Default)]
pub struct OrderCache(Mutex<FxHashMap<BlockKey, Ordered>>);

/// All of a block that its order depends on.
#[derive(PartialEq, Eq, Hash)]
struct BlockKey {
    code: Vec<InstKey>,
    end: EndKey,
    /// The registers that are wanted behind it.
    behind: u32,
}

/// All of an instruction but where it comes from.
#[derive(PartialEq, Eq, Hash)]
struct InstKey {
    inst: Inst,
    operands: Operands,
    access: Access,
    tied: Option<Role>,
    inserted: bool,
}

#[derive(PartialEq, Eq, Hash)]
enum EndKey {
    Branch(Cond),
    Next,
    On,
}

impl OrderCache {
    /// The order of a block: as it is known, or is found now.
    pub fn get_or_find(
        &self,
        block: &Block<PReg>,
        behind: u32,
        find: impl FnOnce() -> Ordered,
    ) -> Ordered {
        let of = BlockKey {
            code: block.code.iter().map(InstKey::of).collect(),
            end: match block.end {
                Terminator::Branch { cond, .. } => EndKey::Branch(cond),
                Terminator::NextKey(_) => EndKey::Next,
                Terminator::Jump(_) | Terminator::FallThrough => EndKey::On,
            },
            behind,
        };
        // Nobody panics while holding the lock; without it, everything is found anew.
        if let Some(known) = self.0.lock().ok().and_then(|known| known.get(&of).cloned()) {
            return known;
        }
        let found = find();
        if let Ok(mut known) = self.0.lock() {
            known.insert(of, found.clone());
        }
        found
    }
}

impl InstKey {
    fn of(inst: &MInst<PReg>) -> InstKey {
        InstKey {
            inst: inst.inst,
            operands: inst.operands,
            access: inst.access,
            tied: inst.tied,
            inserted: inst.inserted,
        }
    }
}

impl Moved {
    /// An instruction, as it is now, that stood at a place.
    pub fn new(from: usize, now: &MInst<PReg>) -> Moved {
        Moved {
            from,
            inst: now.inst,
            operands: now.operands,
        }
    }
}

/// The code in this order.
pub(super) fn apply_order(code: &[MInst<PReg>], order: &[Moved]) -> Vec<MInst<PReg>> {
    let moved = |moved: &Moved| MInst {
        inst: moved.inst,
        operands: moved.operands,
        ..code[moved.from]
    };
    order.iter().map(moved).collect()
}

/// An order of what was in an order before, as one of what stood there at first.
pub(super) fn behind(first: &[Moved], then: Ordered) -> Ordered {
    let from = |moved: Moved| Moved {
        from: first[moved.from].from,
        ..moved
    };
    then.into_iter().map(from).collect()
}
