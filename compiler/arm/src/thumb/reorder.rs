//! The order of instructions that have registers: what the allocator put in between (loads from the
//! stack, moves) is waited for like everything else, and branches fold behind the right
//! instruction.
//!
//! ```text
//!   a block with registers -> what must stay before what -> single instructions moved as long as the block becomes shorter
//! ```
//!
//! Cycles are those of [`OrderCost`]: encodings, IT blocks and the end included.

mod cache;
mod cost;
mod pipeline_states;

use rustc_hash::FxHashMap;
use std::sync::OnceLock;

use super::allocate::{Allocated, Fixed, Placed};
use super::critical_path;
use super::hoist::{compute_live_in, live_out_of};
use super::minst::{Access, AliasClass};
use super::rename::rename_registers;
use super::tuning::{REORDER_PATH_MIN, REORDER_TRIES, REORDER_WINDOW};
pub(super) use cache::OrderCache;
use cache::{Ordered, apply_order};
use cost::OrderCost;
use whippen_isa::reg::SP;
use whippen_isa::timing::Core;
use whippen_isa::{Class, Flags};

/// Puts every block on a long way in a better order, if there is one: the others are as good as
/// they need be.
pub(super) fn reorder_blocks(func: &mut Allocated, core: &Core, cache: &OrderCache) {
    let through = critical_path::cycles_through_each(func, core);
    let longest = through.iter().copied().max().unwrap_or(0);
    let (live, free) = (compute_live_in(func, core), func.free);
    let behind: Vec<u32> = func
        .blocks
        .iter()
        .map(|block| live_out_of(block, &live, core))
        .collect();
    for ((block, through), behind) in func.blocks.iter_mut().zip(through).zip(behind) {
        if REORDER_PATH_MIN.1 * through < REORDER_PATH_MIN.0 * longest || block.code.is_empty() {
            continue;
        }
        let order = cache.get_or_find(block, behind, || best_order(block, behind, free, core));
        (block.code, block.cycles) = (apply_order(&block.code, order), OnceLock::new());
    }
}

/// The best order of a block with its registers, or with others.
fn best_order(block: &Placed, behind: u32, free: u32, core: &Core) -> Ordered {
    let (own, cycles) = improve_order(block, core);
    match rename_registers(block, behind, free, core).map(|code| {
        improve_order(
            &Placed {
                code,
                ..block.clone()
            },
            core,
        )
    }) {
        Some((other, fewer)) if fewer < cycles => other,
        _ => own,
    }
}

/// The code in a better order, and twice its cycles.
fn improve_order(block: &Placed, core: &Core) -> (Ordered, u32) {
    let mut order = LocalSearch::new(block, core);
    order.improve();
    (
        order
            .order
            .iter()
            .map(|at| (*at, block.code[*at].inst))
            .collect(),
        order.cycles,
    )
}

/// What instructions read and write besides values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Resource {
    Flags,
    Register(u8),
    /// A word of the stack.
    Slot(u32),
    Memory(AliasClass),
}

/// What an instruction touches, and whether it writes it.
fn resources_of(fixed: &Fixed) -> Vec<(Resource, bool)> {
    let inst = &fixed.inst;
    let (flags, mut all) = (inst.flags(), Vec::new());
    let (reads, writes) = (
        flags.reads.intersects(Flags::NZCV),
        flags.writes.intersects(Flags::NZCV),
    );
    if reads || writes {
        all.push((Resource::Flags, writes));
    }
    let (uses, defs) = (inst.uses().core_bits(), inst.defs().core_bits());
    for reg in 0..16 {
        match (uses >> reg & 1, defs >> reg & 1) {
            (_, 1) => all.push((Resource::Register(reg), true)),
            (1, _) => all.push((Resource::Register(reg), false)),
            _ => {}
        }
    }
    match fixed.code.map(|code| code.access) {
        Some(
            Access::Read(AliasClass::Constant) | Access::Write(AliasClass::Constant) | Access::None,
        ) => {}
        Some(Access::Read(place)) => all.push((Resource::Memory(place), false)),
        Some(Access::Write(place)) => all.push((Resource::Memory(place), true)),
        None if inst.n == SP => match inst.class() {
            Class::Store => all.push((Resource::Slot(inst.imm), true)),
            Class::Load => all.push((Resource::Slot(inst.imm), false)),
            _ => {}
        },
        None => {}
    }
    all
}

/// A block being put in order.
struct LocalSearch {
    cost: OrderCost,
    /// Who must come before each.
    before: Vec<Vec<usize>>,
    after: Vec<Vec<usize>>,
    order: Vec<usize>,
    /// Where each stands.
    place: Vec<usize>,
    cycles: u32,
    tries: usize,
}

impl LocalSearch {
    fn new(block: &Placed, core: &Core) -> LocalSearch {
        let (before, after) = build_dependences(&block.code);
        let order: Vec<usize> = (0..block.code.len()).collect();
        let mut cost = OrderCost::new(block, core);
        let cycles = cost.accept(&order);
        LocalSearch {
            cost,
            before,
            after,
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
        let first = self.before[at]
            .iter()
            .map(|other| self.place[*other] + 1)
            .max()
            .unwrap_or(0);
        let end = self.after[at]
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

/// Who must come before, and behind, each instruction.
fn build_dependences(code: &[Fixed]) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
    let (mut before, mut after) = (vec![Vec::new(); code.len()], vec![Vec::new(); code.len()]);
    let mut touched: FxHashMap<Resource, (Option<usize>, Vec<usize>)> = FxHashMap::default();
    for (at, fixed) in code.iter().enumerate() {
        let mut edge = |from: usize| {
            if before[at].last() != Some(&from) {
                before[at].push(from);
                after[from].push(at);
            }
        };
        for (resource, writes) in resources_of(fixed) {
            let (writer, readers) = touched.entry(resource).or_default();
            writer.iter().for_each(|writer| edge(*writer));
            if writes {
                readers.drain(..).for_each(&mut edge);
                *writer = Some(at);
            } else {
                readers.push(at);
            }
        }
    }
    (before, after)
}
