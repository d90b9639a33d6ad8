//! Blocks that were put in order before: modes share many, and so do the ways in which a mode is
//! made.

use std::sync::Mutex;

use rustc_hash::FxHashMap;

use crate::thumb::allocate::{Fixed, Placed};
use crate::thumb::vcode::{Access, Code, End, Role};
use whippen_isa::{Cond, Inst};

/// An order: the instructions by where they stood, in the registers that they have now.
pub(super) type Ordered = Vec<(usize, Inst)>;

/// Orders by what they were found for.
#[derive(Default)]
pub struct Known(Mutex<FxHashMap<Block, Ordered>>);

/// All of a block that its order depends on.
#[derive(PartialEq, Eq, Hash)]
struct Block {
    code: Vec<(Inst, Option<Source>)>,
    end: Ending,
    /// The registers that are wanted behind it.
    behind: u32,
}

/// What an instruction is beside its registers.
#[derive(PartialEq, Eq, Hash)]
struct Source {
    access: Access,
    /// The roles that have an operand, and those of them that have an old one too.
    operands: [bool; 6],
    old: [bool; 6],
    tied: Option<Role>,
}

#[derive(PartialEq, Eq, Hash)]
enum Ending {
    Branch(Cond),
    Next,
    On,
}

impl Known {
    /// The order of a block: as it is known, or is found now.
    pub fn order(&self, block: &Placed, behind: u32, find: impl FnOnce() -> Ordered) -> Ordered {
        let of = Block {
            code: block
                .code
                .iter()
                .map(|fixed| (fixed.inst, fixed.code.as_ref().map(Source::of)))
                .collect(),
            end: match block.end {
                End::Branch { cond, .. } => Ending::Branch(cond),
                End::Next(_) => Ending::Next,
                End::Jump(_) | End::InitDone => Ending::On,
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

impl Source {
    fn of(code: &Code) -> Source {
        Source {
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
pub(super) fn in_order(code: &[Fixed], order: Ordered) -> Vec<Fixed> {
    order
        .into_iter()
        .map(|(at, inst)| Fixed { inst, ..code[at] })
        .collect()
}
