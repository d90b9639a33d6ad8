//! States at the ends of paths, and which of them make others superfluous.

use whippen_isa::timing::Pipe;

use super::arena::Chain;
use super::facts::Facts;

/// States at one place, at most.
const STATES_MAX: usize = 64;

/// The state at the end of a path.
#[derive(Debug, Clone)]
pub struct State {
    pub pipe: Pipe,
    pub facts: Facts,
    pub cycles: u64,
    pub chain: Chain,
}

/// Adds a state, unless another makes it superfluous; takes out those that it makes so.
pub fn insert(states: &mut Vec<State>, state: State, merged: &mut bool) {
    let beats =
        |a: &State, b: &State| a.pipe == b.pipe && a.cycles >= b.cycles && a.facts.covers(&b.facts);
    if states.iter().any(|known| beats(known, &state)) {
        return;
    }
    states.retain(|known| !beats(&state, known));
    let full = states.len() >= STATES_MAX;
    let like = if full {
        states.iter_mut().find(|known| known.pipe == state.pipe)
    } else {
        None
    };
    match like {
        None => states.push(state),
        Some(known) => {
            *merged = true;
            known.facts = known.facts.join(&state.facts);
            if known.cycles < state.cycles {
                (known.cycles, known.chain) = (state.cycles, state.chain);
            }
        }
    }
}
