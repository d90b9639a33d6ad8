//! The end of a tick: rings go on, with pointers and the tick's number; it takes the stack back and
//! returns to where the tick was called from.

use whippen_isa::reg::SP;

use crate::around::{StateWords, ring_base, state_word};
use crate::check::{again_with_facts, all_cases, compare_memory, differ, in_order};
use crate::machine::Machine;
use crate::memory::Memory;
use crate::places::Question;
use crate::stop::{Doubt, Reason, Told};
use crate::term::{Base, Kind, Terms};
use crate::truth::Truth;

/// Cases of the end, at most.
const CASES_MAX: usize = 200;

/// Runs the end of a tick whose entry has taken so many bytes of the stack, the last word of them
/// for the address to return to; gives the halfwords of code that it looked at.
///
/// # Errors
/// What could not be shown.
pub(crate) fn check_end(
    question: &Question,
    terms: &mut Terms,
    taken: i128,
) -> Result<Vec<u32>, Doubt> {
    let all = all_cases(terms, vec![Vec::new()], CASES_MAX, |terms| {
        again_with_facts(terms, |terms| run_end(question, terms, taken))
    });
    let all = all.map_err(|doubt| Doubt {
        why: format!("the end of the tick: {}", doubt.why),
        reason: Reason::Entry,
        ..doubt
    })?;
    Ok(in_order(
        all.into_iter().flat_map(|(_, path)| path).collect(),
    ))
}

fn run_end(question: &Question, terms: &mut Terms, taken: i128) -> Told<Vec<u32>> {
    let before = events_of_tick(question, terms)?;
    let own = StateWords::at_end(question, terms, &before)?;
    let [state, stack] = [Base::State, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    let mut machine = Machine::new(question, terms, question.symbols.end);
    machine.draw_registers(terms);
    machine.registers[6] = state;
    machine.registers[usize::from(SP)] = stack;
    machine.memory = before;
    let to = machine.run(terms)?;
    let back = terms.plus(stack, taken - 4)?;
    let back = terms.unread(back, 4);
    if to != back {
        let why = "it does not return to where the tick was called from";
        return differ(terms, back, to, why);
    }
    let (found, wanted) = (
        machine.registers[usize::from(SP)],
        terms.plus(stack, taken)?,
    );
    if found != wanted {
        let why = "it does not leave the stack as it was";
        return differ(terms, wanted, found, why);
    }
    let found = machine.memory.changes(terms)?;
    compare_memory(question, terms, &own, &found)?;
    Ok(machine.looked_at)
}

/// What a tick has left where it has events: in a run with numbers so many, in the ring or in the
/// spare. Without numbers the next event may be anywhere.
fn events_of_tick(question: &Question, terms: &mut Terms) -> Told<Memory> {
    let mut memory = Memory::default();
    let Some(ring) = question.places.events else {
        return Ok(memory);
    };
    let event = i128::from(question.places.event_bytes);
    let whole = [ring.bytes, ring.tick_bytes].map(|bytes| i128::from(bytes) / event);
    let (Some(place), Some(inside), Some(beside)) = (
        terms.drawn((0, 1)),
        terms.drawn((0, whole[0])),
        terms.drawn((0, whole[1])),
    ) else {
        return Ok(memory);
    };
    let written = match place {
        0 => event * inside,
        _ => i128::from(ring.spare) + event * beside,
    };
    let base = ring_base(question, terms, &ring)?;
    let next = terms.plus(base, written)?;
    let address = state_word(terms, question.places.next_event)?;
    memory.store(terms, address, 4, next, Truth::YES)?;
    Ok(memory)
}
