//! Post-RA scheduling by local search: the order of instructions that have their registers.
//!
//! ```text
//!   block -> dependence graph -> one instruction at a time moved to its best place, until none gets better
//! ```
//!
//! Scheduling before allocation knows neither the loads and moves that the allocator inserts nor
//! the final encodings, which decide where a branch folds. So each block on a long path is searched
//! again, as it is and with its registers renamed (`rename`); the shorter outcome is taken.
//!
//! Cycles are those of [`OrderCost`]: encodings, IT blocks and the end included.

mod cache;
mod cost;
mod pipeline_states;

use super::critical_path;
use super::dependence::{Dependences, build_dependences};
use super::func::{Allocated, Block};
use super::liveness::{RegisterSet, compute_live_in, live_out_of};
use super::minst::PReg;
use super::rename::rename_registers;
use super::tuning::{
    RENAME_HIGH_COST, RENAMED_AGAIN_MAX, REORDER_PATH_MIN, REORDER_TRIES, REORDER_WINDOW,
};
pub(super) use cache::OrderCache;
use cache::{Moved, Ordered, apply_order, behind};
use cost::OrderCost;
use whippen_isa::timing::Core;

/// Reorders every block on a long path, where that makes it shorter; the others are as good as they
/// need be.
pub(super) fn reorder_blocks(func: &mut Allocated, core: &Core, cache: &OrderCache) {
    let through = critical_path::cycles_through_each(func, core);
    let longest = through.iter().copied().max().unwrap_or(0);
    let live_in = compute_live_in(func);
    let free = func.free;
    for (block, through) in func.blocks.iter_mut().zip(through) {
        let is_short = REORDER_PATH_MIN.1 * through < REORDER_PATH_MIN.0 * longest;
        if is_short || block.code.is_empty() {
            continue;
        }
        let live_out = live_out_of(block, &live_in);
        let order = cache.get_or_find(block, live_out.bits(), || {
            best_order(block, &live_out, free, core)
        });
        *block = block.with_code(apply_order(&block.code, &order));
    }
}

/// The best order of a block with its registers, or with others; then, as long as that makes it
/// shorter, the best of what is found with yet others.
fn best_order(block: &Block<PReg>, live_out: &RegisterSet, free: u32, core: &Core) -> Ordered {
    let (mut best, mut cycles) = improve_order(block, core);
    let renamed = |code: &Block<PReg>, high_cost: usize| {
        let code = rename_registers(code, live_out, free, core, high_cost)?;
        let code = block.with_code(code);
        Some(improve_order(&code, core))
    };
    if let Some((other, fewer)) = renamed(block, RENAME_HIGH_COST)
        && fewer < cycles
    {
        (best, cycles) = (other, fewer);
    }
    for _ in 0..RENAMED_AGAIN_MAX {
        let ordered = block.with_code(apply_order(&block.code, &best));
        match renamed(&ordered, 0) {
            Some((other, fewer)) if fewer < cycles => {
                (best, cycles) = (behind(&best, other), fewer);
            }
            _ => break,
        }
    }
    best
}

/// The code in a better order, and twice its cycles.
fn improve_order(block: &Block<PReg>, core: &Core) -> (Ordered, u32) {
    let mut search = LocalSearch::new(block, core);
    search.improve();
    let moved = |at: &usize| Moved::new(*at, &block.code[*at]);
    (search.order.iter().map(moved).collect(), search.cycles)
}

/// The search for a block's order.
struct LocalSearch {
    cost: OrderCost,
    dependences: Dependences,
    order: Vec<usize>,
    /// Where each stands.
    place: Vec<usize>,
    cycles: u32,
    tries: usize,
}

impl LocalSearch {
    fn new(block: &Block<PReg>, core: &Core) -> LocalSearch {
        let order: Vec<usize> = (0..block.code.len()).collect();
        let mut cost = OrderCost::new(block, core);
        let cycles = cost.accept(&order);
        LocalSearch {
            cost,
            dependences: build_dependences(&block.code),
            place: order.clone(),
            order,
            cycles,
            tries: 0,
        }
    }

    fn improve(&mut self) {
        loop {
            let cycles = self.cycles;
            for at in 0..self.order.len() {
                self.move_one(at);
            }
            if self.cycles == cycles || self.tries >= REORDER_TRIES {
                return;
            }
        }
    }

    /// Moves one instruction to where it is best.
    fn move_one(&mut self, at: usize) {
        let from = self.place[at];
        let first = self.dependences.before[at]
            .iter()
            .map(|other| self.place[*other] + 1)
            .max()
            .unwrap_or(0);
        let end = self.dependences.after[at]
            .iter()
            .map(|other| self.place[*other])
            .min()
            .unwrap_or(self.order.len());
        let (first, end) = (
            first.max(from.saturating_sub(REORDER_WINDOW)),
            end.min(from + REORDER_WINDOW),
        );
        let (mut best, mut now) = (from, from);
        for to in (first..end).filter(|to| *to != from) {
            if self.tries >= REORDER_TRIES {
                break;
            }
            self.move_place(now, to);
            now = to;
            self.tries += 1;
            let cycles = self.cost.cost_of(&self.order, from.min(to), from.max(to));
            if cycles < self.cycles {
                (self.cycles, best) = (cycles, to);
            }
        }
        self.move_place(now, best);
        if best != from {
            self.cost.accept(&self.order);
            for place in best.min(from)..=best.max(from) {
                self.place[self.order[place]] = place;
            }
        }
    }

    /// Takes one instruction out and puts it in elsewhere.
    fn move_place(&mut self, from: usize, to: usize) {
        if from < to {
            self.order[from..=to].rotate_left(1);
        } else {
            self.order[to..=from].rotate_right(1);
        }
    }
}
