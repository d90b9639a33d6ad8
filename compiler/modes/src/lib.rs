//! Specialization of a tick by machine state: one piece of code, a *mode*, for every combination of
//! states that can occur.
//!
//! ```text
//!   Kernel -> Modes     mode: what is known of the cells when its tick starts
//!                         |
//!                       blocks: a tree (or, where tails are equal, a graph without cycles) of straight runs;
//!                       a block ends by choosing the next block, or by naming the mode of the next tick
//! ```
//!
//! In a mode, cells that are known are constants, and what the knowledge decides has been decided;
//! the meaning of a tick is the Kernel's, bit for bit. A cell whose value the mode knows
//! ([`Mode::known`]) need not be in memory when its tick starts: nobody reads it there, and whoever
//! leaves for such a mode in [`End::Next`] does not store it. Every other cell is in memory when a
//! tick starts; what it held already is not stored again.
//!
//! A host that changes cells between ticks must find the key's mode anew ([`Modes::mode_of`]);
//! where there is none, no tick can have left the cells so, and the key must start from `init`.
//! Live values may change freely.
//!
//! The passes, in order:
//!
//! | part | technique |
//! | --- | --- |
//! | `graph`, `tick` | hash-consed value graph of a tick: memory read at the start and written at the end |
//! | `partial_eval`, `facts` | partial evaluation of the graph under the facts of a path; facts by backward interval propagation |
//! | `search`, `choose` | the search for the cells that modes are specialized on, and in which order they are tried |
//! | `decision_tree`, `benefit`, `decision_order` | a tree of decisions per mode, greedy by estimated benefit |
//! | `reach` | reachable modes by a fixed point with widening and narrowing |
//! | `gcm` | global code motion: the tree as blocks, each computation early or sunk |
//! | `merge` | tail merging |
//! | `cost`, `tuning` | cycles, roughly; limits and thresholds |
//! | [`mod@verify`], [`run`], `print` | proof, reference engine, text |
//!
//! Not here: registers, instructions of a processor, exact cycles (`arm`, `budget`).

mod benefit;
mod choose;
mod cost;
mod decision_order;
mod decision_tree;
mod facts;
mod gcm;
mod graph;
mod merge;
mod partial_eval;
mod print;
mod reach;
pub mod run;
mod search;
mod tick;
mod tuning;
pub mod verify;

pub use print::Size;

use whippen_deterministic::Shared;
use whippen_ids::{IdMap, impl_id};
use whippen_kernel::{Inst, Kernel, Range, Value, ValueInfo};

/// How many instructions all modes of an instrument may have, if nothing else is asked for: about
/// 40 KB of code.
pub const INSTRUCTIONS: usize = 12_000;

/// All modes of a kernel's tick.
#[derive(Debug, Clone, PartialEq, Hash)]
pub struct Modes {
    /// What the kernel declares, and its `init`; its `tick` is what the modes were made of.
    pub kernel: Kernel,
    /// The modes; a key starts in the first.
    pub modes: Shared<IdMap<ModeId, Mode>>,
    /// Whether the search ended because it became too much work, not because all cells were tried.
    pub work_limited: bool,
}

/// A mode of an instrument; a key starts in the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct ModeId(pub u32);

impl std::fmt::Display for ModeId {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// The tick where the cells are known to be such.
#[derive(Debug, Clone, PartialEq, Hash, Default)]
pub struct Mode {
    /// In words, from the names of cells.
    pub name: String,
    /// Where word 0 of each cell lies when the tick starts.
    pub cells: Vec<Range>,
    /// Whether memory need not hold the cell (its range is a point that the mode stands for), by
    /// cell.
    pub known: Vec<bool>,
    /// All values of the blocks.
    pub values: IdMap<Value, ValueInfo>,
    /// The blocks; the first is the entry, and what a block names comes after it.
    pub blocks: IdMap<BlockId, Block>,
}

/// A block of a mode; the first is the entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BlockId(pub u32);

impl_id!(BlockId, ModeId);

impl std::fmt::Display for BlockId {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "b{}", self.0)
    }
}

/// A straight run of instructions (`if` and `loop` that were left whole are instructions too).
#[derive(Debug, Clone, PartialEq, Hash)]
pub struct Block {
    /// Values handed over by those who come here; none where only one does.
    pub params: Vec<Value>,
    /// Instructions in order.
    pub insts: Vec<Inst>,
    /// What comes then.
    pub end: End,
}

/// How a block ends.
#[derive(Debug, Clone, PartialEq, Hash)]
pub enum End {
    /// One of two blocks, by a bool.
    Branch {
        /// The bool.
        condition: Value,
        /// Where it holds.
        yes: Target,
        /// Where it does not.
        no: Target,
        /// Whether it rarely holds, if that is known.
        likely: Option<bool>,
    },
    /// A block.
    Jump(Target),
    /// The tick is over; the key's next tick starts in this mode.
    Next(ModeId),
}

/// A block, with the values of its parameters.
#[derive(Debug, Clone, PartialEq, Hash)]
pub struct Target {
    /// One of [`Mode::blocks`].
    pub block: BlockId,
    /// One for each parameter.
    pub args: Vec<Value>,
}

/// The modes of a kernel: told apart by those cells that make the longest path shorter, as long as
/// all modes together have no more instructions than this; with 0, the one mode that knows nothing.
///
/// The search is bounded: where decisions that only save cycles become too many, it makes only
/// those that tell the next mode; where it has visited too many nodes it ends with the best modes
/// so far ([`Modes::work_limited`]).
pub fn specialize(kernel: &Kernel, instructions: usize) -> Modes {
    search::specialize(kernel, instructions)
}

/// The modes of a kernel, told apart by all cells that can tell them apart; none if they have more
/// instructions than this.
pub fn specialize_fully(kernel: &Kernel, instructions: usize) -> Option<Modes> {
    search::specialize_fully(kernel, instructions)
}

impl End {
    /// Where it may lead within the mode.
    pub fn targets(&self) -> impl Iterator<Item = &Target> {
        let (first, second) = match self {
            End::Branch { yes, no, .. } => (Some(yes), Some(no)),
            End::Jump(target) => (Some(target), None),
            End::Next(_) => (None, None),
        };
        first.into_iter().chain(second)
    }

    fn targets_mut(&mut self) -> impl Iterator<Item = &mut Target> {
        let (first, second) = match self {
            End::Branch { yes, no, .. } => (Some(yes), Some(no)),
            End::Jump(target) => (Some(target), None),
            End::Next(_) => (None, None),
        };
        first.into_iter().chain(second)
    }
}

impl Mode {
    /// The cells whose value the mode stands for, with that value.
    pub fn stands_for(&self) -> impl Iterator<Item = (usize, i64)> {
        let cells = self.cells.iter().zip(&self.known).enumerate();
        cells
            .filter(|(_, (_, known))| **known)
            .map(|(cell, (range, _))| (cell, range.low))
    }
}

impl Modes {
    /// Instructions of all modes, without constants.
    pub fn instructions(&self) -> usize {
        self.modes.iter().map(Mode::instructions).sum()
    }

    /// The longest path through any mode.
    pub fn longest(&self) -> Size {
        self.modes
            .iter()
            .map(Mode::longest)
            .max()
            .unwrap_or_default()
    }

    /// The mode of a key whose cells hold this (word 0 of each); none if no tick can leave them so.
    pub fn mode_of(&self, cell: impl Fn(usize) -> i64) -> Option<ModeId> {
        self.modes.ids().find(|id| {
            self.modes[id]
                .cells
                .iter()
                .enumerate()
                .all(|(at, range)| range.has(cell(at)))
        })
    }

    /// One mode that knows nothing: the kernel's tick as it is.
    pub fn single(kernel: &Kernel) -> Modes {
        let entry = Block {
            params: Vec::new(),
            insts: kernel.tick.insts.clone(),
            end: End::Next(ModeId(0)),
        };
        let mode = Mode {
            name: "any".to_string(),
            cells: kernel.cells.iter().map(|cell| cell.range).collect(),
            known: vec![false; kernel.cells.len()],
            values: kernel.values.clone(),
            blocks: vec![entry].into(),
        };
        Modes {
            kernel: kernel.clone(),
            modes: IdMap::from(vec![mode]).into(),
            work_limited: false,
        }
    }
}
