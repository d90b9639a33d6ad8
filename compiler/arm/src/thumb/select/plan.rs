//! Selection plan: what is settled about every value before the first instruction is selected.
//!
//! An analysis over the Kernel's instructions that leaves one record for each value; selection only
//! reads it. Its steps, in the order in which each finds what it asks for:
//!
//! | step | file | settles |
//! | --- | --- | --- |
//! | count uses, terms of sums | `uses` | `uses`, `sum_uses`, `as_word` |
//! | prove intervals without promises | `beyond_doubt` | `proven` |
//! | find sums that are indices | `indices` | `index` |
//! | follow stores to the starts of blocks | `stored_cells` | |
//! | find conditional stores | `choices` | `old_word_of`, `becomes_store`; asks for `uses` |
//! | find loads that may be made again | `reloads` | `may_reload`; asks for `becomes_store` |
//! | count what comparisons compare once more | `uses` | `uses`; last, since the steps above ask for uses in the Kernel, and this is about those in the code |

mod choices;
pub(in crate::thumb) mod indices;
mod reloads;
mod stored_cells;
mod uses;

use crate::features::Features;
use crate::thumb::beyond_doubt;
use crate::thumb::tick_invariant::TickInvariants;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Kernel, Range, Value, ValueInfo};
use whippen_modes::Mode;

/// What is settled about a value.
#[derive(Debug, Clone)]
pub(in crate::thumb) struct ValuePlan {
    /// Where it lies even if promises are wrong.
    pub proven: Range,
    /// The value and the constant that it is the sum of, if it is nothing but an index.
    pub index: Option<(Value, i64)>,
    /// How often it is used, more than once if in a loop.
    pub uses: u32,
    /// How often it is a term of a sum.
    pub sum_uses: u32,
    /// Whether a bool is needed as a word.
    pub as_word: bool,
    /// The cell whose word it is, as it was at the tick's start.
    pub old_word_of: Option<u32>,
    /// Whether it is a choice that waits for its store, because that may keep the old word.
    pub becomes_store: bool,
    /// Whether each block that uses it may load it again.
    pub may_reload: bool,
}

/// The record of each value.
pub(in crate::thumb) type Plan = IdMap<Value, ValuePlan>;

impl ValuePlan {
    fn new(proven: Range) -> ValuePlan {
        ValuePlan {
            proven,
            index: None,
            uses: 0,
            sum_uses: 0,
            as_word: false,
            old_word_of: None,
            becomes_store: false,
            may_reload: false,
        }
    }
}

/// Nothing but where values lie.
fn start(
    kernel: &Kernel,
    values: &IdMap<Value, ValueInfo>,
    insts: &[&[Inst]],
    shared: &[Range],
) -> Plan {
    let proven = beyond_doubt::intervals(kernel, values, insts, shared);
    proven.iter().copied().map(ValuePlan::new).collect()
}

/// Plans a mode; the live values that a tick adds lie where `shared` says.
pub(in crate::thumb) fn plan_mode(
    kernel: &Kernel,
    mode: &Mode,
    shared: &[Range],
    features: &Features,
) -> Plan {
    let insts: Vec<&[Inst]> = mode.blocks.iter().map(|block| &block.insts[..]).collect();
    let mut plan = start(kernel, &mode.values, &insts, shared);
    for block in &mode.blocks {
        uses::count_uses(&mut plan, &block.insts);
        uses::count_uses_of_end(&mut plan, &block.end);
        uses::count_sum_terms(&mut plan, &block.insts);
    }
    indices::find_sums(&mut plan, kernel, &insts, features.wide_moves);
    let stored = stored_cells::at_starts_of_blocks(mode, kernel.cells.len());
    choices::find_conditional_stores(&mut plan, mode, &stored);
    reloads::find_reloads(&mut plan, kernel, mode, &stored);
    for block in &mode.blocks {
        uses::count_compared(&mut plan, &block.insts);
    }
    plan
}

/// Plans what prepares one key, of which only the size counts.
pub(in crate::thumb) fn plan_init(kernel: &Kernel) -> Plan {
    let mut plan = start(kernel, &kernel.values, &[&kernel.init.insts], &[]);
    uses::count_uses(&mut plan, &kernel.init.insts);
    uses::count_compared(&mut plan, &kernel.init.insts);
    plan
}

/// Plans what a tick computes at its entry.
pub(in crate::thumb) fn plan_invariants(kernel: &Kernel, invariants: &TickInvariants) -> Plan {
    let mut plan = start(kernel, &invariants.values, &[&invariants.insts], &[]);
    uses::count_uses(&mut plan, &invariants.insts);
    uses::count_word_uses(&mut plan, &invariants.results);
    uses::count_compared(&mut plan, &invariants.insts);
    plan
}
