//! The end of a tick: rings go on, with pointers and the tick's number; it takes the stack back and
//! returns to where the tick was called from.

use whippen_isa::reg::SP;

use crate::around::StateWords;
use crate::check::{again_with_facts, all_cases, compare_memory, in_order};
use crate::machine::Machine;
use crate::places::Question;
use crate::stop::{Doubt, Reason, Told, unproven};
use crate::term::{Base, Kind, Terms};

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
    let own = StateWords::at_end(question, terms)?;
    let [state, stack] = [Base::State, Base::Stack].map(|base| terms.of(Kind::Base(base)));
    let mut machine = Machine::new(question, terms, question.symbols.end);
    machine.registers[6] = state;
    machine.registers[usize::from(SP)] = stack;
    let to = machine.run(terms)?;
    let back = terms.plus(stack, taken - 4)?;
    if to != terms.of(Kind::Load(back, 4)) {
        return unproven("it does not return to where the tick was called from");
    }
    if machine.registers[usize::from(SP)] != terms.plus(stack, taken)? {
        return unproven("it does not leave the stack as it was");
    }
    let found = machine.memory.changed(terms)?;
    compare_memory(question, terms, &own, &found)?;
    Ok(machine.looked_at)
}
