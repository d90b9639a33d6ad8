//! Blocks that were put in order before: modes share many, and so do the ways in which a mode is
//! made.

use std::sync::Mutex;

use rustc_hash::FxHashMap;

use crate::thumb::allocate::{Fixed, Placed};
use crate::thumb::minst::{Access, MInst, Role, Terminator};
use whippen_isa::{Cond, Inst};

/// An order: the instructions by where they stood, in the registers that they have now.
pub(super) type Ordered = Vec<(usize, Inst)>;

/// Orders by what they were found for.
#[derive(Default)]
pub struct OrderCache(Mutex<FxHashMap<BlockKey, Ordered>>);

/// All of a block that its order depends on.
#[derive(PartialEq, Eq, Hash)]
struct BlockKey {
    code: Vec<(Inst, Option<InstKey>)>,
    end: EndKey,
    /// The registers that are wanted behind it.
    behind: u32,
}

/// What an instruction is beside its registers.
#[derive(PartialEq, Eq, Hash)]
struct InstKey {
    access: Access,
    /// The roles that have an operand, and those of them that have an old one too.
    operands: [bool; 6],
    old: [bool; 6],
    tied: Option<Role>,
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
        block: &Placed,
        behind: u32,
        find: impl FnOnce() -> Ordered,
    ) -> Ordered {
        let of = BlockKey {
            code: block
                .code
                .iter()
                .map(|fixed| (fixed.inst, fixed.code.as_ref().map(InstKey::of)))
                .collect(),
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
    fn of(code: &MInst) -> InstKey {
        InstKey {
            access: code.access,
            operands: code.operands.map(|operand| operand.is_some()),
            old: code
                .operands
                .map(|operand| operand.is_some_and(|operand| operand.old.is_some())),
            tied: code.tied,
        }
    }
}

/// The code in this order.
pub(super) fn apply_order(code: &[Fixed], order: Ordered) -> Vec<Fixed> {
    order
        .into_iter()
        .map(|(at, inst)| Fixed { inst, ..code[at] })
        .collect()
}
