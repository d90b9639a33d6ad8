//! The comparison of a mode with its code: all paths, each with what the Kernel and the bytes
//! leave in memory and registers.

use std::collections::BTreeMap;

use whippen_isa::reg::SP;
use whippen_modes::ModeId;

use crate::kernel::run_mode;
use crate::machine::Machine;
use crate::memory::{Address, Changes, Held, Memory};
use crate::places::Question;
use crate::stop::{Doubt, Reason, Stop, Told, unproven_as};
use crate::term::{Base, Kind, Term, Terms};
use crate::truth::{Truth, Variable};

/// How often a case is run at most.
const RUNS_MAX: usize = 3;

/// The registers that lead to memory.
pub(crate) const ROLES: [(u8, Base); 4] = [
    (6, Base::State),
    (7, Base::Record),
    (10, Base::Samples),
    (11, Base::History),
];

/// What the entry of a tick leaves to all modes.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub registers: [Term; 16],
    /// What it stored that modes read.
    pub memory: Memory,
    /// Bytes of the stack from SP on that modes may use.
    pub stack_bytes: i128,
    /// The halfwords of code that the entry looked at, in order.
    pub looked_at: Vec<u32>,
    /// How many words that routines have left are not known.
    pub unknown: u32,
}

impl Start {
    /// Whether modes find the same.
    pub fn leaves_as(&self, other: &Start) -> bool {
        self.registers == other.registers
            && self.memory.held == other.memory.held
            && self.stack_bytes == other.stack_bytes
    }
}

/// What a path of a mode is to leave, by the Kernel.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    memory: Memory,
    /// The address of the code of the mode.
    code: u32,
}

/// A path of code that leaves what the Kernel says.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub used: Used,
    /// The halfwords of code that it looked at, in order.
    pub looked_at: Vec<u32>,
}

/// How many terms the cases of a mode may make together, which bounds the memory that they take.
/// Modes of the grand piano make 2 500, of the clavichord that sounds 9 600, a bowed string 24 500.
pub(crate) const TERMS_MAX: usize = 200_000;

/// What a case assumes.
pub(crate) type Assumed = Vec<(Variable, bool)>;

/// What a path of a mode does with registers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Used {
    /// Registers of which it reads what they held before.
    pub read: u16,
    /// Registers that it leaves otherwise.
    pub changed: u16,
}

impl Used {
    /// Of both.
    pub fn and(self, other: Used) -> Used {
        Used {
            read: self.read | other.read,
            changed: self.changed | other.changed,
        }
    }
}

/// Runs all cases of some cases (of all inputs, where these assume nothing); each begins with what
/// distinguishes it. Gives what each assumed in the end, and its result.
///
/// # Errors
/// A case that cannot be shown, or too many.
pub(crate) fn all_cases<T>(
    terms: &mut Terms,
    mut left: Vec<Assumed>,
    most: usize,
    mut run: impl FnMut(&mut Terms) -> Told<T>,
) -> Result<Vec<(Assumed, T)>, Doubt> {
    let mut results = Vec::new();
    let mut runs = 0;
    while let Some(case) = left.pop() {
        runs += 1;
        if runs > most {
            return Err(Doubt::new(Reason::Cases, format!("more than {most} cases")));
        }
        if terms.of_paths() > TERMS_MAX {
            let why = format!("more than {TERMS_MAX} terms in {runs} cases");
            return Err(Doubt::new(Reason::Cases, why));
        }
        terms.known.forget();
        let assumed = case
            .iter()
            .try_for_each(|(asks, holds)| terms.assume(*asks, *holds));
        let told = assumed.and_then(|()| run(terms));
        let mut case = case;
        for (asks, side) in std::mem::take(&mut terms.taken) {
            let mut other = case.clone();
            other.push((asks, !side));
            left.push(other);
            case.push((asks, side));
        }
        match told {
            Ok(result) => results.push((case, result)),
            Err(Stop::Impossible) => {}
            Err(Stop::Unproven(doubt)) => return Err(doubt),
            Err(Stop::Split(asks)) => {
                if case.iter().any(|(known, _)| *known == asks) {
                    let why = "a case that does not settle what it assumes";
                    return Err(Doubt::new(Reason::Values, why));
                }
                for holds in [false, true] {
                    let mut more = case.clone();
                    more.push((asks, holds));
                    left.push(more);
                }
            }
        }
    }
    if results.is_empty() {
        return Err(Doubt::new(Reason::Values, "nothing can come here"));
    }
    Ok(results)
}

/// A run that goes on with one side of whatever must be known; `all_cases` sees to the other.
pub(crate) fn on_one_side<T>(
    terms: &mut Terms,
    run: impl FnOnce(&mut Terms) -> Told<T>,
) -> Told<T> {
    terms.takes_sides = true;
    let told = run(terms);
    terms.takes_sides = false;
    told
}

/// One case, some times where it is not shown: what a run learns makes the terms of the next one
/// simpler.
pub(crate) fn again_with_facts<T>(
    terms: &mut Terms,
    mut run: impl FnMut(&mut Terms) -> Told<T>,
) -> Told<T> {
    for _ in 1..RUNS_MAX {
        match run(terms) {
            Err(Stop::Unproven(doubt)) if !doubt.is_certain => terms.known.refresh(),
            other => return other,
        }
    }
    run(terms)
}

pub(crate) fn run_case(
    question: &Question,
    terms: &mut Terms,
    mode: ModeId,
    start: &Start,
) -> Told<Path> {
    let wanted = run_kernel(question, terms, mode)?;
    run_code(question, terms, start, &wanted)
}

/// What the mode leaves in the case that is assumed.
pub(crate) fn run_kernel(question: &Question, terms: &mut Terms, mode: ModeId) -> Told<Wanted> {
    // The first run learns what is known on this path, which makes the terms of the second simpler.
    let kernel = &question.modes.modes[mode];
    on_one_side(terms, |terms| run_mode(question, terms, kernel))?;
    terms.known.refresh();
    let (mut memory, next) = run_mode(question, terms, kernel)?;
    // The first word of a record is the address of the code of the key's mode.
    let record = terms.of(Kind::Base(Base::Record));
    let [code, other] = [mode, next].map(|mode| question.symbols.modes[mode.0 as usize]);
    let code_other = terms.constant((other | 1).into());
    memory.store(terms, record, 4, code_other, Truth::YES)?;
    Ok(Wanted { memory, code })
}

/// Whether the bytes leave what the mode leaves.
pub(crate) fn run_code(
    question: &Question,
    terms: &mut Terms,
    start: &Start,
    wanted: &Wanted,
) -> Told<Path> {
    let record = terms.of(Kind::Base(Base::Record));
    let code_own = terms.constant((wanted.code | 1).into());
    let mut machine = Machine::new(question, terms, wanted.code);
    machine.registers = start.registers;
    machine.memory = start.memory.clone();
    machine.unknown = start.unknown;
    machine
        .memory
        .store(terms, record, 4, code_own, Truth::YES)?;
    let target = machine.run(terms)?;
    compare_end(question, terms, &machine, target)?;
    let found = left_to_others(terms, &machine.memory, start)?;
    compare_memory(question, terms, &wanted.memory, &found)?;
    let changed = (0..16).filter(|r| machine.registers[*r] != start.registers[*r]);
    let roles = ROLES
        .iter()
        .fold(1 << SP, |all, (register, _)| all | 1 << register);
    let used = Used {
        read: machine.read & !roles,
        changed: changed.fold(0, |all, register| all | 1 << register) & !roles,
    };
    Ok(Path {
        used,
        looked_at: in_order(machine.looked_at),
    })
}

/// Addresses, each once.
pub(crate) fn in_order(mut addresses: Vec<u32>) -> Vec<u32> {
    addresses.sort_unstable();
    addresses.dedup();
    addresses
}

/// The key is left for the next one.
fn compare_end(question: &Question, terms: &mut Terms, machine: &Machine, to: Term) -> Told<()> {
    let places = question.places;
    let record = terms.of(Kind::Base(Base::Record));
    let next = terms.plus(record, places.record_bytes.into())?;
    let code = terms.of(Kind::Load(next, 4));
    if to != code {
        let why = "the code does not go on to that of the next key";
        return differ(terms, to, code, why);
    }
    let steps = [0, places.record_bytes, places.stride, places.history_bytes];
    for ((register, base), step) in ROLES.into_iter().zip(steps) {
        if base == Base::History && places.lines.is_empty() {
            continue;
        }
        let base = terms.of(Kind::Base(base));
        let wanted = terms.plus(base, step.into())?;
        let found = machine.registers[usize::from(register)];
        if found != wanted {
            let why = format!("r{register} is not left at the next key");
            return differ(terms, wanted, found, why);
        }
    }
    let stack = terms.of(Kind::Base(Base::Stack));
    let found = machine.registers[usize::from(SP)];
    if found != stack {
        return differ(terms, stack, found, "the stack is not left as it was");
    }
    Ok(())
}

/// What the code of a mode leaves in memory, but for its own part of the stack.
fn left_to_others(terms: &mut Terms, found: &Memory, start: &Start) -> Told<Changes> {
    let stack = terms.of(Kind::Base(Base::Stack));
    let mut left = found.changes(terms)?;
    for held in std::mem::take(&mut left.apart) {
        if held.address.moving == stack {
            let (from, bytes) = (held.address.at, i128::from(held.bytes));
            // What lies below the stack pointer is a routine's that was called, and nobody's now.
            let is_below = from + bytes <= 0;
            if !is_below && !(0..start.stack_bytes - bytes + 1).contains(&from) {
                return unproven_as(Reason::Places, "a store to the stack of others");
            }
        } else if !start.memory.held.contains(&held) {
            left.apart.push(held);
        }
    }
    Ok(left)
}

/// Whether all that code has stored is what is wanted.
pub(crate) fn compare_memory(
    question: &Question,
    terms: &mut Terms,
    wanted: &Memory,
    found: &Changes,
) -> Told<()> {
    let wanted = wanted.changes(terms)?;
    let mut places: BTreeMap<(Address, u8), [Option<Term>; 2]> = BTreeMap::new();
    for (side, changes) in [&wanted, found].into_iter().enumerate() {
        for held in &changes.apart {
            places.entry((held.address, held.bytes)).or_default()[side] = Some(held.value);
        }
    }
    for ((address, bytes), values) in places {
        let at = terms.of_address(address)?;
        let old = terms.unread(at, bytes);
        let values = values.map(|value| value.unwrap_or(old));
        compare_at(question, terms, (address, bytes), values)?;
    }
    let place = |held: &Held| (held.address, held.bytes);
    let [own, others] = [&wanted, found].map(|changes| changes.ordered.iter().map(place));
    if own.ne(others) {
        let why = "stores that may meet each other are others, or in another order";
        return unproven_as(Reason::Places, why);
    }
    for (own, other) in wanted.ordered.iter().zip(&found.ordered) {
        compare_at(question, terms, place(own), [own.value, other.value])?;
    }
    Ok(())
}

/// Whether what code leaves somewhere is what is wanted there.
fn compare_at(
    question: &Question,
    terms: &mut Terms,
    (address, bytes): (Address, u8),
    [wanted, found]: [Term; 2],
) -> Told<()> {
    if wanted == found {
        return Ok(());
    }
    let difference = terms.sub(wanted, found)?;
    if terms.bounds(difference) == (0, 0) {
        return Ok(());
    }
    if terms.is_nothing(difference)? {
        return Ok(());
    }
    if let Some(asks) = terms.question_in(difference)? {
        return Err(Stop::Split(asks));
    }
    let held = Held {
        address,
        bytes,
        value: found,
    };
    let place = describe(question, terms, held);
    let (says, does) = (terms.show(wanted), terms.show(found));
    let why = format!("{place}: the Kernel says {says}, the code {does}");
    differ(terms, wanted, found, why)
}

/// Two values that are not shown to be one; it is certain that they are two where both are numbers
/// of a run with numbers.
pub(crate) fn differ<T>(
    terms: &mut Terms,
    wanted: Term,
    found: Term,
    why: impl Into<String>,
) -> Told<T> {
    let difference = terms.sub(wanted, found)?;
    let is_certain = terms.is_sampling() && terms.number(difference).is_some_and(|by| by != 0);
    let reason = if terms.divides(difference) {
        Reason::Divisions
    } else {
        Reason::Values
    };
    Err(Stop::Unproven(Doubt {
        is_certain,
        ..Doubt::new(reason, why)
    }))
}

/// A place in words.
fn describe(question: &Question, terms: &mut Terms, held: Held) -> String {
    let places = question.places;
    let record = terms.of(Kind::Base(Base::Record));
    let Address { moving, at } = held.address;
    if moving == record {
        if at == 0 {
            return "the next mode".to_string();
        }
        let cells = places.cells.iter().zip(&question.modes.kernel.cells);
        let own = cells
            .filter(|(from, _)| i128::from(**from) <= at)
            .max_by_key(|(from, _)| **from);
        if let Some((from, cell)) = own {
            let word = (at - i128::from(*from)) / 4;
            return match word {
                0 => format!("cell `{}`", cell.name),
                _ => format!("cell `{}`, word {word}", cell.name),
            };
        }
    }
    let samples = terms.of(Kind::Base(Base::Samples));
    if moving == samples {
        return format!("the word out at {at}");
    }
    format!("{} bytes at {} + {at}", held.bytes, terms.show(moving))
}
