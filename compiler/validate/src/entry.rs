//! The tick's entry: the registers and words that it leaves to the modes of keys, and tables.

use std::collections::BTreeSet;

use whippen_isa::reg::{LR, SP};

use crate::Verdict;
use crate::around::{StateWords, state_word};
use crate::check::{
    ROLES, Start, again_with_facts, all_cases, compare_memory, differ, in_order, on_one_side,
};
use crate::contract;
use crate::end::check_end;
use crate::kernel::run_shared;
use crate::machine::Machine;
use crate::memory::{Address, Changes, Held, Memory};
use crate::places::Question;
use crate::root;
use crate::stop::{Doubt, Reason, Stop, Told, unproven};
use crate::term::{Base, Kind, Term, Terms};

/// Cases of the entry, at most.
const CASES_MAX: usize = 200;

/// Where memory lies whose addresses are not known: no sum with an offset leaves a word.
const ADDRESSES: (i128, i128) = (1 << 28, 7 << 28);

/// Terms that know of the pointers of a state, and of routines.
pub(crate) fn terms(question: &Question) -> Terms {
    let mut terms = Terms::default();
    terms.contracts = contract::shown(question);
    terms.roots = root::shown(question, &terms.contracts);
    for base in [
        Base::State,
        Base::Record,
        Base::Samples,
        Base::History,
        Base::Stack,
    ] {
        let base = terms.of(Kind::Base(base));
        terms.learn_always(base, ADDRESSES);
    }
    let places = question.places;
    let pointers = places.lines.iter().flat_map(|line| line.pointers.values());
    let pointers = pointers.chain([&places.next_event]).copied();
    let apart = places.apart.map(|at| [at, at + 4]);
    let apart = apart.into_iter().flatten();
    for at in pointers.chain(apart.clone()) {
        let address = state_word(&mut terms, at);
        terms.pointers.extend(address);
    }
    for at in apart {
        if let Ok(address) = state_word(&mut terms, at) {
            let from = terms.of(Kind::Load(address, 4));
            terms.learn_always(from, ADDRESSES);
        }
    }
    addresses_of_slots(question, &mut terms);
    ranges_of_state(question, &mut terms);
    if places.number.is_some() {
        let address = state_word(&mut terms, places.next_event);
        if let Ok(address) = address {
            let next = terms.of(Kind::Load(address, 4));
            terms.learn_always(next, ADDRESSES);
        }
    }
    terms
}

/// A pointer and HISTORY make the address of a slot, modulo 2^32; it is taken as the sum.
fn addresses_of_slots(question: &Question, terms: &mut Terms) {
    let history = terms.of(Kind::Base(Base::History));
    for line in &question.places.lines {
        for at in line.pointers.values() {
            let Ok(address) = state_word(terms, *at) else {
                continue;
            };
            let pointer = terms.of(Kind::Load(address, 4));
            if let Ok(slot) = terms.add_scaled(pointer, history, 1 << line.scale) {
                terms.learn_always(slot, ADDRESSES);
            }
        }
    }
}

/// What the Kernel declares of live values, and slots' numbers: the entry computes with them too.
fn ranges_of_state(question: &Question, terms: &mut Terms) {
    let places = question.places;
    let lives = places.lives.iter().zip(&question.modes.kernel.lives);
    let lives = lives.map(|(at, live)| (*at, (live.range.low.into(), live.range.high.into())));
    let rings = places.lines.iter();
    let rings = rings.map(|line| (line.ring, (0, i128::from(line.len) - 1)));
    for (at, range) in lives.chain(rings) {
        if let Ok(address) = state_word(terms, at) {
            let word = terms.of(Kind::Load(address, 4));
            terms.learn_always(word, range);
        }
    }
}

/// What one case of the entry leaves.
struct Left {
    registers: [Term; 16],
    /// Bytes of the stack from SP on that modes may use.
    stack_bytes: i128,
    /// Each shared word: as the Kernel says, and as it is stored.
    shared: Vec<(Term, Term)>,
    /// The halfwords of code that it looked at.
    looked_at: Vec<u32>,
    unknown: u32,
}

/// Runs the tick's entry; gives where modes start, and a verdict for each shared word.
///
/// # Errors
/// What could not be shown.
pub(crate) fn check_entry(
    question: &Question,
    terms: &mut Terms,
) -> Result<(Start, Vec<Verdict>), Doubt> {
    // Each word in one term for all cases, where it can be written so.
    terms.known.forget();
    let whole = run_shared(question, terms, question.shared).unwrap_or_default();
    let all = vec![Vec::new()];
    let left = all_cases(terms, all, CASES_MAX, |terms| {
        again_with_facts(terms, |terms| run_entry(question, terms))
    })?;
    let left: Vec<Left> = left.into_iter().map(|(_, left)| left).collect();
    let mut verdicts = Vec::new();
    let mut replaced = Vec::new();
    let mut memory = Memory::default();
    for (number, at) in (0..question.shared.results.len()).zip(shared_places(question)) {
        let address = state_word(terms, *at).map_err(in_words)?;
        let mut verdict = Verdict::Validated { cases: left.len() };
        let mut says = left.iter().map(|case| case.shared[number].0);
        let first = says.next();
        let word = match first.filter(|first| says.all(|other| other == *first)) {
            Some(one) => Some(one),
            None => whole.get(number).copied(),
        };
        for case in &left {
            let (wanted, found) = case.shared[number];
            replaced.push((found, word.unwrap_or(wanted)));
            if found != wanted || word.is_none() {
                verdict = otherwise(terms, wanted, found);
            }
        }
        verdicts.push(verdict);
        let Some(value) = word.or(first) else {
            continue;
        };
        let address = terms.address(address);
        memory.held.push(Held {
            address,
            bytes: 4,
            value,
        });
    }
    let registers = registers_of(terms, &left, &replaced);
    let at_end = check_ends(question, terms, &left)?;
    let stack_bytes = left.iter().map(|case| case.stack_bytes).min();
    let unknown = left.iter().map(|case| case.unknown).max();
    let of_cases = left.into_iter().flat_map(|case| case.looked_at);
    let start = Start {
        registers,
        memory,
        stack_bytes: stack_bytes.unwrap_or(0),
        looked_at: in_order(of_cases.chain(at_end).collect()),
        unknown: unknown.unwrap_or(0),
    };
    Ok((start, verdicts))
}

/// The verdict on a word that is not shown to be what it should.
fn otherwise(terms: &mut Terms, wanted: Term, found: Term) -> Verdict {
    let (says, does) = (terms.show(wanted), terms.show(found));
    let why = format!("the Kernel says {says}, the code {does}");
    match differ::<()>(terms, wanted, found, why) {
        Err(Stop::Unproven(doubt)) => Verdict::of(doubt),
        _ => Verdict::of(Doubt::new(Reason::Code, "its numbers are too large")),
    }
}

/// The end of the tick, by what each case of the entry has taken of the stack. A run with numbers
/// leaves it out: `refute_around` runs it by itself.
fn check_ends(question: &Question, terms: &mut Terms, left: &[Left]) -> Result<Vec<u32>, Doubt> {
    if terms.is_sampling() {
        return Ok(Vec::new());
    }
    let taken: BTreeSet<i128> = left.iter().map(|case| case.stack_bytes + 4).collect();
    let mut all = Vec::new();
    for bytes in taken {
        all.extend(check_end(question, terms, bytes)?);
    }
    Ok(all)
}

fn in_words(told: Stop) -> Doubt {
    match told {
        Stop::Unproven(doubt) => doubt,
        other => Doubt::new(Reason::Code, format!("{other:?}")),
    }
}

/// What registers hold in all cases.
fn registers_of(terms: &mut Terms, left: &[Left], replaced: &[(Term, Term)]) -> [Term; 16] {
    std::array::from_fn(|register| {
        let role = ROLES
            .iter()
            .find(|(role, _)| usize::from(*role) == register);
        if let Some((_, base)) = role {
            return terms.of(Kind::Base(*base));
        }
        if register == usize::from(SP) {
            return terms.of(Kind::Base(Base::Stack));
        }
        let mut values = left.iter().map(|case| case.registers[register]);
        let first = values.next();
        match first.filter(|first| values.all(|value| value == *first)) {
            Some(value) => {
                let shared = replaced.iter().find(|(found, _)| *found == value);
                shared.map_or(value, |(_, wanted)| *wanted)
            }
            None => terms.of(Kind::Register(register as u8)),
        }
    })
}

fn run_entry(question: &Question, terms: &mut Terms) -> Told<Left> {
    let places = question.places;
    let own = StateWords::at_entry(question, terms)?;
    on_one_side(terms, |terms| run_shared(question, terms, question.shared))?;
    terms.known.refresh();
    let wanted = run_shared(question, terms, question.shared)?;
    let mut machine = Machine::new(question, terms, question.symbols.tick);
    let state = terms.of(Kind::Base(Base::State));
    let samples = terms.of(Kind::Base(Base::Samples));
    let stack = terms.of(Kind::Base(Base::Stack));
    machine.registers[0] = state;
    machine.registers[1] = samples;
    machine.registers[usize::from(SP)] = stack;
    let to = machine.run(terms)?;
    let first = state_word(terms, places.records)?;
    let code = machine.memory.load(terms, first, 4)?;
    if to != code {
        let why = "the entry does not go on to the first key";
        return differ(terms, code, to, why);
    }
    at_first_key(question, terms, &machine, first)?;
    let found = left_to_others(question, terms, &machine.memory)?;
    compare_memory(question, terms, &own, &found)?;
    let mut shared = Vec::new();
    for (wanted, at) in wanted.into_iter().zip(shared_places(question)) {
        let address = state_word(terms, *at)?;
        let found = machine.memory.load(terms, address, 4)?;
        let difference = terms.sub(wanted, found)?;
        let is_same = terms.bounds(difference) == (0, 0);
        shared.push((wanted, if is_same { wanted } else { found }));
    }
    let taken = terms.sub(stack, machine.registers[usize::from(SP)])?;
    let Some(taken) = terms.number(taken) else {
        return unproven("the entry does not say what of the stack it takes");
    };
    let last = terms.plus(stack, -4)?;
    let back = terms.of(Kind::Register(LR));
    let kept = machine.memory.load(terms, last, 4)?;
    if kept != back {
        let why = "the entry does not keep where the tick returns to";
        return differ(terms, back, kept, why);
    }
    Ok(Left {
        registers: machine.registers,
        // The last word is where the tick returns to.
        stack_bytes: taken - 4,
        shared,
        looked_at: machine.looked_at,
        unknown: machine.unknown,
    })
}

/// Whether registers lead to the first key's memory.
fn at_first_key(
    question: &Question,
    terms: &mut Terms,
    machine: &Machine,
    first: Term,
) -> Told<()> {
    let places = question.places;
    let [state, samples] = [Base::State, Base::Samples].map(|base| terms.of(Kind::Base(base)));
    let row = state_word(terms, places.row)?;
    let row = terms.of(Kind::Load(row, 4));
    let begin = [state, first, samples, row];
    for ((register, base), begin) in ROLES.into_iter().zip(begin) {
        let is_used = base != Base::History || !places.lines.is_empty();
        let found = machine.registers[usize::from(register)];
        if is_used && found != begin {
            let why = format!("r{register} is not at the first key");
            return differ(terms, begin, found, why);
        }
    }
    Ok(())
}

/// What the entry leaves in memory, but for its own part of the stack and words of all keys.
fn left_to_others(question: &Question, terms: &mut Terms, memory: &Memory) -> Told<Changes> {
    let [state, stack] = [Base::State, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    let of_shared: BTreeSet<u32> = shared_places(question).copied().collect();
    let mut found = memory.changes(terms)?;
    found.apart.retain(|held| {
        let Address { moving, at } = held.address;
        let is_shared = u32::try_from(at).is_ok_and(|at| of_shared.contains(&at));
        !(moving == stack && at < 0 || moving == state && is_shared && held.bytes == 4)
    });
    Ok(found)
}

/// In the state: each word that the entry computes for all keys.
fn shared_places<'a>(question: &Question<'a>) -> impl Iterator<Item = &'a u32> {
    let lives = question.modes.kernel.lives.len();
    let all = question.places.lives.iter().skip(lives);
    all.take(question.shared.results.len())
}

/// Whether the image has the Kernel's tables.
pub(crate) fn check_tables(question: &Question) -> Verdict {
    let tables = question
        .modes
        .kernel
        .tables
        .iter()
        .zip(&question.symbols.tables);
    for (table, from) in tables {
        for (index, value) in (0..).zip(&table.values) {
            let address = from.wrapping_add(4 * index);
            let found = question.code.word(address);
            if found == Some(*value as u32) {
                continue;
            }
            let why = format!("word {index} of table `{}` differs", table.name);
            return match found {
                Some(_) => Verdict::Refuted { why },
                None => Verdict::of(Doubt::new(Reason::Entry, why)),
            };
        }
    }
    Verdict::Validated {
        cases: question.modes.kernel.tables.len(),
    }
}
