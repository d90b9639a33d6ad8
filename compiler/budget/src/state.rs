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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::arena::START;

    /// A state with R0 up to a word, or anything where that is 0.
    fn state(cycles: u64, up_to: u32) -> State {
        let known = BTreeMap::from([(0, [0, up_to])]);
        State {
            pipe: Pipe::default(),
            facts: match up_to {
                0 => Facts::nothing(),
                _ => Facts::of_registers(&known),
            },
            cycles,
            chain: START,
        }
    }

    /// Cycles of what is left of some.
    fn left(all: Vec<State>) -> Vec<u64> {
        let (mut states, mut merged) = (Vec::new(), false);
        all.into_iter()
            .for_each(|state| insert(&mut states, state, &mut merged));
        assert!(!merged);
        states.iter().map(|state| state.cycles).collect()
    }

    #[test]
    fn the_dearer_one_stays_where_it_knows_no_more() {
        assert_eq!(left(vec![state(3, 9), state(3, 9)]), [3]);
        assert_eq!(left(vec![state(3, 9), state(4, 9)]), [4]);
        assert_eq!(left(vec![state(4, 9), state(3, 9)]), [4]);
        assert_eq!(left(vec![state(4, 9), state(3, 5)]), [4]);
        assert_eq!(left(vec![state(3, 5), state(3, 9), state(1, 7)]), [3]);
        assert_eq!(left(vec![state(4, 5), state(3, 9)]), [4, 3]);
        assert_eq!(left(vec![state(3, 9), state(4, 5)]), [3, 4]);
        assert_eq!(left(vec![state(3, 9), state(3, 0)]), [3]);
    }

    /// Of too many, what both know and the larger of both cycles stays.
    #[test]
    fn too_many_are_joined() {
        let (mut states, mut merged) = (Vec::new(), false);
        // Each is cheaper and knows less.
        for at in 0..STATES_MAX as u32 {
            let cheaper = state(1000 - u64::from(at), 1 + at);
            insert(&mut states, cheaper, &mut merged);
        }
        assert_eq!((states.len(), merged), (STATES_MAX, false));
        insert(&mut states, state(900, 5000), &mut merged);
        assert_eq!((states.len(), merged), (STATES_MAX, true));
        assert_eq!(states[0].cycles, 1000);
        assert_eq!(states[0].facts.interval(0).high, 5000);
        insert(&mut states, state(2000, 1), &mut merged);
        assert!(states.iter().all(|state| state.cycles <= 2000));
        let longest = states.iter().map(|state| state.cycles).max();
        assert_eq!(longest, Some(2000));
        // One with another pipeline is not joined with them.
        let mut other = state(7, 1);
        let core = whippen_isa::timing::Core::cortex_m33();
        let load = whippen_isa::parse("ldr r0, [r1]", whippen_isa::Arch::V8M, None);
        let load = core.prepare(&load.expect("an instruction"));
        other.pipe = core
            .issue(other.pipe, &load, 0, &whippen_isa::timing::Outcome::NEXT)
            .0;
        assert_ne!(other.pipe, Pipe::default());
        let before = states.len();
        insert(&mut states, other, &mut merged);
        assert_eq!(states.len(), before + 1);
    }
}
