//! The routines that prepare keys, against what the Kernel says that keys begin with: `init`, which
//! prepares all for the first tick, and `begin`, which prepares one.
//!
//! ```text
//!   init:  pointers, then for each key: [the Kernel's init of it], its code that of mode 0
//!   begin: the key's cells as they are at first, and the same
//! ```
//!
//! The key of `begin` is any key: its number is a term. The loop of `init` over keys is shown by
//! induction: up to where it is entered with key 0, and from there, with any key, to the next one
//! or, behind the last, back to where it was called from. Where the loop begins is found by a run;
//! that it is the right place follows from what is shown of it.
//!
//! Not here: what memory holds before `init` (`first`).

use rustc_hash::FxHashMap;
use whippen_isa::reg::{LR, SP};

use crate::Routine;
use crate::around::{StateWords, histories, state_word};
use crate::check::{
    ROLES, again_with_facts, all_cases, compare_memory, differ, in_order, on_one_side,
};
use crate::entry;
use crate::kernel::{KeyAt, run_init};
use crate::machine::{Machine, RunEnd};
use crate::memory::{Changes, Memory};
use crate::places::Question;
use crate::stop::{Doubt, Told, unproven};
use crate::term::{Base, Kind, Term, Terms};
use crate::truth::Truth;

/// Cases of a routine, or of a piece of it, at most.
const CASES_MAX: usize = 200;

/// Of a word.
const WORD_BYTES: i128 = 4;

/// What was shown of a routine.
pub(crate) struct Shown {
    pub cases: usize,
    /// The halfwords of code that it looked at, in order.
    pub looked_at: Vec<u32>,
}

/// Terms that know of the pointers of a state, and of a key's number.
pub(crate) fn terms(question: &Question) -> Terms {
    let mut terms = entry::terms(question);
    let key = terms.of(Kind::Key);
    terms.learn_always(key, (0, last_key(question)));
    terms
}

/// Whether a routine leaves what the Kernel says.
///
/// # Errors
/// What could not be shown.
pub(crate) fn check_routine(
    question: &Question,
    terms: &mut Terms,
    routine: Routine,
) -> Result<Shown, Doubt> {
    match routine {
        Routine::Init => check_init(question, terms),
        Routine::Begin => in_all_cases(terms, |terms| run_begin(question, terms)).map(shown),
    }
}

fn shown(cases: Vec<Vec<u32>>) -> Shown {
    Shown {
        cases: cases.len(),
        looked_at: in_order(cases.into_iter().flatten().collect()),
    }
}

fn in_all_cases<T>(
    terms: &mut Terms,
    run: impl Fn(&mut Terms) -> Told<T>,
) -> Result<Vec<T>, Doubt> {
    let all = all_cases(terms, vec![Vec::new()], CASES_MAX, |terms| {
        again_with_facts(terms, &run)
    })?;
    Ok(all.into_iter().map(|(_, result)| result).collect())
}

fn last_key(question: &Question) -> i128 {
    i128::from(question.places.keys) - 1
}

/// The number of a key, whichever it is.
fn any_key(question: &Question, terms: &mut Terms) -> Term {
    match (last_key(question), terms.drawn((0, last_key(question)))) {
        (_, Some(number)) => terms.constant(number),
        (0, None) => terms.constant(0),
        (_, None) => terms.of(Kind::Key),
    }
}

/// Where the key of a number finds its memory.
fn key_at(question: &Question, terms: &mut Terms, key: Term) -> Told<KeyAt> {
    let places = question.places;
    let first = state_word(terms, places.records)?;
    let samples = terms.of(Kind::Base(Base::Samples));
    let history = match places.first_line {
        Some(line) => {
            let from = histories(question, terms)?;
            terms.plus(from, places.lines[line as usize].at.into())?
        }
        None => terms.of(Kind::Base(Base::History)),
    };
    Ok(KeyAt {
        record: terms.add_scaled(first, key, places.record_bytes.into())?,
        samples: terms.add_scaled(samples, key, places.stride.into())?,
        history: terms.add_scaled(history, key, places.history_bytes.into())?,
    })
}

/// What a key's cells hold before its `init`.
fn first_cells(question: &Question, terms: &mut Terms, at: KeyAt) -> Told<Memory> {
    let mut memory = Memory::default();
    for (from, words) in question.first_cells() {
        for (word, offset) in words.into_iter().zip((0..).step_by(4)) {
            let address = terms.plus(at.record, i128::from(from) + offset)?;
            let word = terms.constant(word.into());
            memory.store(terms, address, 4, word, Truth::YES)?;
        }
    }
    Ok(memory)
}

/// What a key begins with.
fn begun(question: &Question, terms: &mut Terms, at: KeyAt) -> Told<Memory> {
    let run = |terms: &mut Terms| {
        let before = first_cells(question, terms, at)?;
        run_init(question, terms, at, before)
    };
    on_one_side(terms, run)?;
    terms.known.refresh();
    let mut memory = run(terms)?;
    let code = terms.constant((question.symbols.modes[0] | 1).into());
    memory.store(terms, at.record, 4, code, Truth::YES)?;
    Ok(memory)
}

fn run_begin(question: &Question, terms: &mut Terms) -> Told<Vec<u32>> {
    let [state, samples, stack] =
        [Base::State, Base::Samples, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    let key = any_key(question, terms);
    let at = KeyAt {
        samples,
        ..key_at(question, terms, key)?
    };
    let wanted = begun(question, terms, at)?;
    let mut machine = Machine::new(question, terms, question.symbols.begin);
    let back = caller(terms);
    machine.draw_registers(terms);
    machine.registers[..3].copy_from_slice(&[state, samples, key]);
    machine.registers[usize::from(LR)] = back;
    machine.registers[usize::from(SP)] = stack;
    let to = machine.run(terms)?;
    returned(terms, &machine, [to, back])?;
    let found = left_to_others(terms, &machine.memory, 0)?;
    compare_memory(question, terms, &wanted, &found)?;
    Ok(machine.looked_at)
}

/// Where a routine is to return to; in a run with numbers it is one, at which there is no code.
fn caller(terms: &mut Terms) -> Term {
    match terms.is_sampling() {
        true => terms.constant(-1),
        false => terms.of(Kind::Register(LR)),
    }
}

/// Whether a routine has gone back to where it was called from, with the stack as it was.
fn returned(terms: &mut Terms, machine: &Machine, [to, back]: [Term; 2]) -> Told<()> {
    if to != back {
        return differ(terms, back, to, "it does not return to its caller");
    }
    let stack = terms.of(Kind::Base(Base::Stack));
    let found = machine.registers[usize::from(SP)];
    if found != stack {
        return differ(terms, stack, found, "it does not leave the stack as it was");
    }
    Ok(())
}

/// What is in memory otherwise than it was, but for the stack below what is the caller's or, by so
/// many bytes, the routine's own.
fn left_to_others(terms: &mut Terms, memory: &Memory, kept: i128) -> Told<Changes> {
    let stack = terms.of(Kind::Base(Base::Stack));
    let mut found = memory.changes(terms)?;
    found.apart.retain(|held| {
        let end = held.address.at + i128::from(held.bytes);
        held.address.moving != stack || end > -kept
    });
    Ok(found)
}

fn check_init(question: &Question, terms: &mut Terms) -> Result<Shown, Doubt> {
    question.check_first()?;
    let found = in_all_cases(terms, |terms| {
        on_one_side(terms, |terms| find_loop(question, terms))
    })?;
    let head = found.into_iter().flatten().next();
    let entered = in_all_cases(terms, |terms| enter_loop(question, terms, head))?;
    let taken = entered.iter().map(|(taken, _)| *taken).next().unwrap_or(0);
    if entered.iter().any(|(own, _)| *own != taken) {
        return Err(Doubt::new(
            crate::Reason::Code,
            "it takes more of the stack in some cases",
        ));
    }
    let mut all: Vec<Vec<u32>> = entered.into_iter().map(|(_, path)| path).collect();
    if let Some(head) = head {
        all.extend(in_all_cases(terms, |terms| {
            run_key(question, terms, head, taken)
        })?);
    }
    Ok(shown(all))
}

/// What the state holds before `init` and code reads: of each line the first slot is written first.
fn first_slots(question: &Question, terms: &mut Terms) -> Told<Memory> {
    let mut memory = Memory::default();
    for line in &question.places.lines {
        let address = state_word(terms, line.ring)?;
        let zero = terms.constant(0);
        memory.store(terms, address, 4, zero, Truth::YES)?;
    }
    Ok(memory)
}

/// A processor at the beginning of `init`.
fn at_init<'a>(question: &'a Question<'a>, terms: &mut Terms) -> Told<Machine<'a>> {
    let mut machine = Machine::new(question, terms, question.symbols.init);
    let [state, samples, stack] =
        [Base::State, Base::Samples, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    machine.draw_registers(terms);
    machine.registers[..2].copy_from_slice(&[state, samples]);
    machine.registers[usize::from(LR)] = caller(terms);
    machine.registers[usize::from(SP)] = stack;
    machine.memory = first_slots(question, terms)?;
    Ok(machine)
}

/// Where the loop over keys begins: the first place to which a run comes back with the next key's
/// record. There is none where there is one key.
fn find_loop(question: &Question, terms: &mut Terms) -> Told<Option<u32>> {
    let second = terms.constant(1);
    let second = key_at(question, terms, second)?.record;
    let mut machine = at_init(question, terms)?;
    let mut seen: FxHashMap<u32, Term> = FxHashMap::default();
    let left = machine.run_until(terms, |machine| {
        let record = machine.registers[usize::from(ROLES[1].0)];
        let before = *seen.entry(machine.pc).or_insert(record);
        before != record && record == second
    })?;
    Ok(match left {
        RunEnd::At(head) => Some(head),
        RunEnd::For(_) => None,
    })
}

/// `init` up to its loop over keys, or to its end where there is none; gives the bytes that it has
/// taken of the stack.
fn enter_loop(question: &Question, terms: &mut Terms, head: Option<u32>) -> Told<(i128, Vec<u32>)> {
    let before = first_slots(question, terms)?;
    let mut wanted = StateWords::at_init(question, terms, &before)?;
    let zero = terms.constant(0);
    let at = key_at(question, terms, zero)?;
    let mut machine = at_init(question, terms)?;
    let back = machine.registers[usize::from(LR)];
    if head.is_none() {
        let cells = first_cells(question, terms, at)?;
        machine.memory.extend(cells);
        wanted.extend(begun(question, terms, at)?);
    }
    let left = machine.run_until(terms, |machine| head == Some(machine.pc))?;
    let stack = terms.of(Kind::Base(Base::Stack));
    let taken = terms.sub(stack, machine.registers[usize::from(SP)])?;
    let Some(taken) = terms.number(taken) else {
        return unproven("it does not say what of the stack it takes");
    };
    match left {
        RunEnd::At(_) => {
            registers_at(question, terms, &machine, at)?;
            let last = terms.plus(stack, -WORD_BYTES)?;
            let kept = machine.memory.load(terms, last, 4)?;
            if kept != back {
                return differ(terms, back, kept, "it does not keep where it returns to");
            }
        }
        RunEnd::For(_) if question.places.keys != 1 => {
            return unproven("there is no loop over keys");
        }
        RunEnd::For(to) => returned(terms, &machine, [to, back])?,
    }
    let found = left_to_others(terms, &machine.memory, 0)?;
    compare_memory(question, terms, &wanted, &found)?;
    Ok((taken, machine.looked_at))
}

/// One round of the loop of `init`, with any key.
fn run_key(question: &Question, terms: &mut Terms, head: u32, taken: i128) -> Told<Vec<u32>> {
    let key = any_key(question, terms);
    let at = key_at(question, terms, key)?;
    let wanted = begun(question, terms, at)?;
    let mut machine = Machine::new(question, terms, head);
    let [state, stack] = [Base::State, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    machine.draw_registers(terms);
    for (register, holds) in roles(state, at) {
        machine.registers[usize::from(register)] = holds;
    }
    machine.registers[usize::from(SP)] = terms.plus(stack, -taken)?;
    machine.memory = first_cells(question, terms, at)?;
    let left = machine.run_until(terms, |machine| machine.pc == head)?;
    let is_last = terms.at_least(key, last_key(question))?;
    match (left, terms.decide(is_last)?) {
        (RunEnd::At(_), false) => {
            let next = terms.plus(key, 1)?;
            let next = key_at(question, terms, next)?;
            registers_at(question, terms, &machine, next)?;
            let (found, wanted) = (
                machine.registers[usize::from(SP)],
                terms.plus(stack, -taken)?,
            );
            if found != wanted {
                return differ(
                    terms,
                    wanted,
                    found,
                    "a key does not leave the stack as it was",
                );
            }
        }
        (RunEnd::For(to), true) => {
            let last = terms.plus(stack, -WORD_BYTES)?;
            let back = terms.unread(last, 4);
            returned(terms, &machine, [to, back])?;
        }
        (_, is_last) => {
            let [wanted, found] = [is_last, !is_last].map(|ends| terms.constant(ends.into()));
            return differ(terms, wanted, found, "it does not go round for each key");
        }
    }
    let found = left_to_others(terms, &machine.memory, WORD_BYTES)?;
    compare_memory(question, terms, &wanted, &found)?;
    Ok(machine.looked_at)
}

/// What registers that lead to memory hold at a key.
fn roles(state: Term, at: KeyAt) -> [(u8, Term); 4] {
    let all = [state, at.record, at.samples, at.history];
    std::array::from_fn(|role| (ROLES[role].0, all[role]))
}

/// Whether registers lead to a key's memory.
fn registers_at(question: &Question, terms: &mut Terms, machine: &Machine, at: KeyAt) -> Told<()> {
    let [state, history] = [Base::State, Base::History].map(|base| terms.of(Kind::Base(base)));
    for (register, wanted) in roles(state, at) {
        let found = machine.registers[usize::from(register)];
        let is_used = wanted != history || question.places.first_line.is_some();
        if is_used && found != wanted {
            let why = format!("r{register} is not at the next key");
            return differ(terms, wanted, found, why);
        }
    }
    Ok(())
}
