//! The frame of a core: everything that happens between the converter's request and the return from its handler.
//!
//! ```text
//!   request -> instruction in progress -> entry -> handler -> exit
//!                                                  '- board_begin, keys, board_end, service, guard
//!                                                                  '- entry, one mode per key, end (`tick`)
//! ```
//!
//! The handler is bounded as one function whose call of the keys costs what their own bounds add up to, so its dearest way
//! may also be the one of a missed tick, which leaves the keys out. Nothing interrupts it: every other vector of the core
//! leads to the end of the firmware, which is checked in the bytes of its table.

use std::collections::{BTreeMap, BTreeSet};

use whippen_isa::Class;
use whippen_isa::timing::{Core, Evidence, Outcome, Pipe, Target};

use super::graph::{Control, Graph, Tables};
use super::memory::Surroundings;
use super::program::Program;
use super::tick::Tick;
use super::{Annotations, Bound, Known, NotBounded, Query, Step, bound, stack};
use crate::firmware::{BEGINNING, DEAD, PARTS, PROGRAMS_MAX, Running, keys_name};

/// Words that an exception saves and restores.
const SAVED_WORDS: u16 = 8;
/// Bytes of those, and what aligns them.
const SAVED_BYTES: u32 = 4 * SAVED_WORDS as u32 + 4;

/// The bounds of one core's frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Keys of the core.
    pub keys: u32,
    /// The code of the keys.
    pub tick: Tick,
    /// The handler, all keys included.
    pub handler: Bound,
    /// What the cycles around the keys are for, on the handler's dearest way.
    pub parts: Vec<(String, u64)>,
    /// Cycles of all keys on that way.
    pub keys_cycles_max: u64,
    /// Cycles from the request to the return, at most.
    pub cycles_max: u64,
    /// Bytes of stack: what runs between ticks, the exception, the handler.
    pub stack_bytes_max: u32,
    /// As sure as the least sure number.
    pub class: Evidence,
}

/// A core to be bounded.
#[derive(Debug, Clone, Copy)]
pub struct Played<'a> {
    /// Final bytes.
    pub program: &'a Program,
    /// Its timing.
    pub core: &'a Core,
    /// What runs on it.
    pub running: &'a Running,
    /// Which of the image's programs plays.
    pub number: usize,
    /// Its keys.
    pub keys: u32,
    /// Who else uses memory.
    pub surroundings: &'a Surroundings,
}

impl Frame {
    /// Cycles around the keys, at most.
    pub fn around_cycles_max(&self) -> u64 {
        self.cycles_max.saturating_sub(self.keys_cycles_max)
    }
}

/// Bounds the frame of a core.
///
/// # Errors
/// What cannot be bounded, or is not there.
pub fn frame(of: &Played) -> Result<Frame, NotBounded> {
    let Played { program, core, running, number, keys, surroundings } = *of;
    let name = keys_name(running.core, number);
    let (handler, entry) = (find(program, running.handler)?, find(program, &format!("{name}_tick"))?);
    only_handler(program, running, handler)?;
    let targets = without_others(program, running.core, number);
    let tick = super::tick::tick(program, &name, core, surroundings, returns_to(program, &targets, entry))?;
    let known = |keys: u32| Known { cycles: tick.cycles_max(keys), stack_bytes: tick.stack_bytes_max() };
    let known_calls = at_beginning(program, &targets, entry).into_iter().map(|call| (call, known(keys - 1))).collect();
    let mut annotations = Annotations { handler: true, targets, known_calls, ..program.annotations.clone() };
    annotations.known.insert(entry, known(keys));
    let query =
        |entry, annotations| Query { core, code: &program.code, entry, annotations, surroundings: Some(surroundings) };
    let handled = bound(&query(handler, &annotations))?;
    let sleeping = Annotations { sleeps: true, ..program.annotations.clone() };
    let idle = Idle::of(&query(find(program, running.idle)?, &sleeping))?;
    let stacking = u64::from(surroundings.elsewhere());
    let (enter, leave) = (u64::from(core.exceptions.entry.cycles), u64::from(core.exceptions.exit.cycles));
    let mut parts = vec![
        ("the instruction in progress".to_string(), idle.cycles_max),
        ("entry of the interrupt".to_string(), enter + u64::from(SAVED_WORDS + 1) * stacking),
    ];
    parts.extend(handler_parts(program, &handled.path, entry, &tick));
    parts.push(("return from the interrupt".to_string(), leave + u64::from(SAVED_WORDS) * stacking));
    if surroundings.visits > 0 {
        parts.push(("the other core's visits".to_string(), u64::from(surroundings.visits)));
    }
    let others: u64 = parts.iter().map(|(_, cycles)| cycles).sum();
    let through_keys = handled.path.iter().filter(|step| step.address == entry);
    let keys_cycles_max = through_keys.map(|step| step.cycles - tick.frame_cycles_max()).sum();
    Ok(Frame {
        keys,
        keys_cycles_max,
        cycles_max: others + keys_cycles_max,
        stack_bytes_max: idle.stack_bytes_max + SAVED_BYTES + handled.stack_bytes_max,
        class: handled.class.max(tick.class()).max(core.exceptions.entry.evidence).max(core.exceptions.exit.evidence),
        tick,
        handler: handled,
        parts,
    })
}

fn find(program: &Program, name: &str) -> Result<u32, NotBounded> {
    program.symbols.get(name).copied().ok_or_else(|| NotBounded::NoSymbol { name: name.to_string() })
}

/// Whatever a core's table of vectors holds leads to the handler or to the end.
fn only_handler(program: &Program, running: &Running, handler: u32) -> Result<(), NotBounded> {
    let (table, dead) = (find(program, running.vectors)?, find(program, DEAD)?);
    // The first two words are not used after the start.
    for at in program.words_of(table).skip(2) {
        let vector = program.code.word(at).unwrap_or(0) & !1;
        if vector != 0 && vector != handler && vector != dead {
            return Err(NotBounded::Interrupts { address: vector });
        }
    }
    Ok(())
}

/// Where indirect branches go while one program plays: not to the others.
fn without_others(program: &Program, core: usize, number: usize) -> BTreeMap<u32, Vec<u32>> {
    let entries = |number: usize| ["tick", "begin"].map(|what| format!("{}_{what}", keys_name(core, number)));
    let names = (0..PROGRAMS_MAX).filter(|other| *other != number).flat_map(entries);
    let others: BTreeSet<u32> = names.filter_map(|name| program.symbols.get(&name).copied()).collect();
    let mut targets = program.annotations.targets.clone();
    targets.values_mut().for_each(|to| to.retain(|to| !others.contains(&(to & !1))));
    targets
}

/// The calls through registers that may go to a function.
fn calls<'a>(targets: &'a BTreeMap<u32, Vec<u32>>, callee: u32) -> impl Iterator<Item = (u32, &'a [u32])> {
    let all = targets.iter().map(|(&at, to)| (at, &to[..]));
    all.filter(move |(_, to)| to.iter().any(|to| to & !1 == callee))
}

/// Where a function that is called through a register comes back to, if it is always the same place.
fn returns_to(program: &Program, targets: &BTreeMap<u32, Vec<u32>>, callee: u32) -> Option<Target> {
    let mut calls = calls(targets, callee);
    let (at, _) = calls.next().filter(|_| calls.next().is_none())?;
    let address = at + if program.code.is_wide_at(at) { 4 } else { 2 };
    Some(Target { address, wide: program.code.is_wide_at(address) })
}

/// The calls of the keys while they begin, a key more each tick: one at least does not play yet. The handler's own call may go
/// to what begins as well.
fn at_beginning(program: &Program, targets: &BTreeMap<u32, Vec<u32>>, entry: u32) -> Vec<u32> {
    let within = |at: u32| program.names.range(..=at).rev().flat_map(|(_, names)| names).next();
    calls(targets, entry).map(|(at, _)| at).filter(|&at| within(at).is_some_and(|name| name == BEGINNING)).collect()
}

/// The cycles of the handler's dearest way by part, the keys' own code left out.
fn handler_parts(program: &Program, path: &[Step], keys: u32, tick: &Tick) -> Vec<(String, u64)> {
    let mut parts: Vec<(String, u64)> = Vec::new();
    for step in path {
        let (name, cycles) = match step.address == keys {
            true => ("to the first key and from the last".to_string(), tick.frame_cycles_max()),
            false => (part(program, step.address), step.cycles),
        };
        match parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += cycles,
            None => parts.push((name, cycles)),
        }
    }
    parts
}

fn part(program: &Program, address: u32) -> String {
    let before = program.names.range(..=address).rev().flat_map(|(_, names)| names);
    let known = before.filter_map(|name| PARTS.iter().find(|(symbol, _)| symbol == name)).next();
    known.map_or_else(|| "elsewhere".to_string(), |(_, words)| (*words).to_string())
}

/// What the tick interrupts.
struct Idle {
    /// The longest instruction: it is finished first.
    cycles_max: u64,
    stack_bytes_max: u32,
}

impl Idle {
    fn of(query: &Query) -> Result<Self, NotBounded> {
        let graph = Graph::build(query, &Tables::default())?;
        let items = graph.blocks.iter().flat_map(|block| &block.items);
        let cycles = items.map(|item| {
            let taken = Target { address: 2, wide: true };
            let target = (item.control != Control::Next).then_some(taken);
            let waits = query.surroundings.map_or(0, |around| around.waits_max(&item.inst, item.address));
            let quotient_bits = if item.inst.class() == Class::Divide { 31 } else { 0 };
            let outcome = Outcome { target, waits, quotient_bits, ..Outcome::NEXT };
            let (_, cost) = query.core.issue(Pipe::default(), &item.timed, item.address, &outcome);
            u64::from(cost.cycles()) + u64::from(query.core.late.cycles)
        });
        let cycles_max = cycles.max().unwrap_or(0);
        Ok(Self { cycles_max, stack_bytes_max: stack::follow(query, &graph)?.deepest })
    }
}
