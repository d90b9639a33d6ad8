//! The static bound: how many cycles final machine code takes at most, whatever its input.
//!
//! ```text
//!   Code (bytes), Annotations
//!      | graph     every instruction that can be reached, as blocks; calls in the context of their caller
//!      | stack     where the stack pointer is, and that returns return
//!      | order     loops, inner before outer, each with its bound
//!      v
//!   longest       forward through the blocks: for every state of the pipeline, the worst-case path into it
//!      |            block   cycles by `isa::timing::Core::issue`, the function that the emulator counts with
//!      |            facts   what is known of registers and flags along the path: branches that contradict it are cut
//!      v
//!   Bound         cycles, the worst-case path, stack, how sure
//! ```
//!
//! Nothing is guessed: what cannot be followed is a [`NotBounded`] that names the address and what
//! is missing. `docs/budget.md` says why the bound holds.
//!
//! # What is not here
//!
//! How code came about: the analysis sees bytes, so it judges the compiler's code, the firmware's
//! and a C compiler's alike. Interrupts: they steal cycles whenever they come, and are charged per
//! period by whoever knows how often.

mod arena;
mod block;
mod calls;
mod certificate;
#[cfg(test)]
#[path = "../tests/made/chip.rs"]
mod chip;
mod code;
mod contention;
mod core_stack;
mod cores;
mod error;
mod facts;
mod graph;
mod idle;
mod longest;
mod memory;
mod only;
mod order;
mod parts;
mod program;
mod relevant;
mod report;
mod sending;
mod stack;
mod state;
mod tick;
mod tick_handler;
mod unknown;
mod waiting;

use std::collections::{BTreeMap, BTreeSet};

use whippen_isa::timing::{Core, Evidence, Target};

pub use certificate::{NotCertified, certificate};
pub use code::Code;
pub use contention::ByContention;
pub use cores::{Bounded, cores, cores_of};
pub use error::NotBounded;
pub use memory::{Accessed, Extent, Interference, Lies, Neighbour, Others, Reach, Waits};
pub use parts::{CutBound, Helped, Leg, PartBound};
pub use program::Program;
pub use report::{Budget, CoreBudget};
pub use sending::Sending;
pub use tick::{Tick, calling_tick_without_waiting, tick_without_waiting, ticks};
pub use tick_handler::{OnCore, TickHandlerBound, ZoneBound, tick_handlers};
pub use unknown::{Unknown, UnknownTime};
pub use waiting::{WaitCause, Waited};

/// What the bytes do not say.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Annotations {
    /// How often the head of a loop runs at most each time the loop is entered, by its address.
    pub loops: BTreeMap<u32, u32>,
    /// Where the indirect branch at an address may go.
    pub targets: BTreeMap<u32, Vec<u32>>,
    /// Arriving at one of these ends a path; the instruction there is not counted.
    pub stops: BTreeSet<u32>,
    /// The entry lies inside a function, behind what saved its registers: that its return finds the
    /// caller is not checked.
    pub inside: bool,
    /// Some ways end with more on the stack than others: where the stack pointer is at the end is
    /// not asked.
    pub ends_apart: bool,
    /// What the caller goes on with, as far as the return's cycles depend on it; where it is not
    /// known, the most expensive.
    pub return_to: Option<Target>,
    /// The entry is an exception's handler: what its return costs beyond the instruction's own
    /// cycles is not this code's.
    pub handler: bool,
    /// Functions that are bounded elsewhere, by the addresses of the call (none: wherever it is)
    /// and of the function: what the call costs.
    pub known: BTreeMap<(Option<u32>, u32), Known>,
    /// Registers that point into memory that is known, and where accesses through them go. It is
    /// checked that nothing that is reached moves them but steps by constants, which stay inside;
    /// where something else does, they are no more than others.
    pub bases: BTreeMap<u8, Reach>,
    /// Registers of which something is known at the entry: the lowest and the highest word (signed)
    /// that they may hold.
    pub entered: BTreeMap<u8, [u32; 2]>,
    /// WFE and WFI are instructions like others: how long they sleep is not the question.
    pub sleeps: bool,
}

/// What a function costs that is bounded elsewhere. It returns with a pipeline that remembers
/// nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Known {
    /// Cycles from its first instruction to the one that follows its call.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack_bytes: u32,
}

/// One question: from `entry` until a stop or the return to the caller.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// The core and its side in disputed rules.
    pub core: &'a Core,
    /// The code.
    pub code: &'a Code,
    /// Where it starts, bit 0 clear.
    pub entry: u32,
    /// What the bytes do not say.
    pub annotations: &'a Annotations,
    /// Memory and who else uses it, if waiting for it is to be charged.
    pub interference: Option<&'a Interference<'a>>,
}

/// One instruction of the worst-case path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Its address.
    pub address: u32,
    /// Its cycles; of all rounds but the last two where a loop was not written out.
    pub cycles: u64,
    /// Of those, for memory.
    pub waits: Waits,
    /// The data that it accesses.
    pub accessed: Accessed,
    /// How often; more than once only for the head of a loop that was not written out.
    pub times: u32,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bound {
    /// No execution takes more.
    pub cycles_max: u64,
    /// A path that takes so many, as far as the facts know.
    pub path: Vec<Step>,
    /// How sure: as the least sure number that any path uses.
    pub class: Evidence,
    /// Whether every path ends with a pipeline that remembers nothing.
    pub settled: bool,
    /// Nothing in the pipeline at an end delays what follows.
    pub delays_nobody: bool,
    /// Bytes of stack, at most.
    pub stack_bytes_max: u32,
    /// Bytes by which the stack pointer is above its place at the entry when a path ends.
    pub stack_left: i32,
    /// Branches that no input takes in the state in which they were met.
    pub infeasible: u32,
    /// Whether states were joined because there were too many, or rounds were not written out: the
    /// bound may then be larger than the facts would have it.
    pub merged: bool,
    /// Code bytes of the instructions that can be reached.
    pub code_bytes: u32,
}

/// What every bound of an entry starts from, whatever interferes.
struct Flow {
    graph: graph::Graph,
    stack: stack::Stack,
    order: order::Order,
}

impl Flow {
    fn build(query: &Query, tables: &graph::Tables) -> Result<Flow, NotBounded> {
        let graph = graph::Graph::build(query, tables)?;
        let stack = stack::follow(query, &graph)?;
        let order = order::Order::of(query, &graph)?;
        Ok(Flow {
            graph,
            stack,
            order,
        })
    }

    /// With the entries of tables that facts allow.
    fn with_tables(query: &Query) -> Result<Flow, NotBounded> {
        let mut tables = graph::Tables::default();
        loop {
            let flow = Flow::build(query, &tables)?;
            if !tables.learn(&flow.find_longest(query).indices) {
                return Ok(flow);
            }
        }
    }

    /// Of code that need not end, and whose loops have no bounds.
    fn without_order(query: &Query) -> Result<Flow, NotBounded> {
        let graph = graph::Graph::build(query, &graph::Tables::default())?;
        let stack = stack::follow(query, &graph)?;
        let order = order::Order {
            elements: Vec::new(),
        };
        Ok(Flow {
            graph,
            stack,
            order,
        })
    }

    fn find_longest(&self, query: &Query) -> longest::Longest {
        longest::Longest::find(query, &self.graph, &self.order)
    }

    fn answer(&self, found: longest::Longest) -> Result<Bound, NotBounded> {
        found.answer(self.stack, &self.graph)
    }
}

/// Bounds one entry.
pub fn bound(query: &Query) -> Result<Bound, NotBounded> {
    let mut tables = graph::Tables::default();
    loop {
        let flow = Flow::build(query, &tables)?;
        let found = flow.find_longest(query);
        if !tables.learn(&found.indices) {
            return flow.answer(found);
        }
    }
}

/// Bounds one entry with each of two interferences, which take the place of the query's: the graph
/// is the same for both.
fn bound_by_contention(
    query: &Query,
    interferences: ByContention<&Interference>,
) -> Result<ByContention<Bound>, NotBounded> {
    let mut tables = graph::Tables::default();
    loop {
        let flow = Flow::build(query, &tables)?;
        let find = |interference| {
            flow.find_longest(&Query {
                interference: Some(interference),
                ..*query
            })
        };
        let found = interferences.map(find);
        let learned = [&found.alone, &found.contended].map(|found| tables.learn(&found.indices));
        if learned == [false; 2] {
            return found.map(|found| flow.answer(found)).both();
        }
    }
}
