//! Joined states: what is known in both, and afterwards no more than what arrives. The checker
//! refuses a larger claim, and of two ways that a state was joined for, one may lead to a cheaper
//! one in the end.

use whippen_audit::{Facts, NONE, PLACES};

use super::explored::Explored;
use super::potential::Remains;
use crate::relevant::FLAGS;

/// Cuts the states that are kept down to what arrives, with `entered` at the first; those that
/// changed are open again. Whether any is.
pub fn tighten(explored: &mut Explored, remains: &Remains, entered: (usize, &Facts)) -> bool {
    let mut arrived: Vec<Vec<Option<Facts>>> = explored
        .spots
        .iter()
        .map(|spot| vec![None; spot.states.len()])
        .collect();
    let mut arrive = |(spot, nth): (usize, usize), state: &Facts| {
        let claim = &explored.spots[spot].states[nth].1;
        let all = arrived[spot][nth].take();
        arrived[spot][nth] = Some(hull(all, claim, state));
    };
    let (start, facts) = entered;
    arrive((start, remains.first), facts);
    for (spot, kept) in explored.spots.iter().zip(&remains.kept) {
        let follows = kept.iter().flat_map(|(nth, _)| &spot.follows[*nth]);
        for follows in follows {
            if let Some(to) = follows.to {
                arrive(to, &follows.state.1);
            }
        }
    }
    for (number, (spot, arrived)) in explored.spots.iter_mut().zip(arrived).enumerate() {
        for (nth, (state, hull)) in spot.states.iter_mut().zip(arrived).enumerate() {
            if let Some(hull) = hull.filter(|hull| *hull != state.1) {
                state.1 = hull;
                explored.open.insert((number, nth));
            }
        }
    }
    !explored.open.is_empty()
}

/// A claim cut down to what arrived before and what arrives now.
fn hull(before: Option<Facts>, claim: &Facts, state: &Facts) -> Facts {
    let first = before.is_none();
    let mut all = before.unwrap_or_else(|| claim.clone());
    // Nothing known of the flags stays so.
    if claim.flags != !0 {
        all.flags = state.flags | if first { 0 } else { all.flags };
    }
    let mut seen = vec![!first; claim.values.len()];
    for (name, other) in claim.names.iter().zip(&state.names) {
        let (Some(words), Some([low, high])) = (
            all.values.get_mut(usize::from(*name)),
            state.values.get(usize::from(*other)).copied(),
        ) else {
            continue;
        };
        let known = std::mem::replace(&mut seen[usize::from(*name)], true);
        *words = match known {
            true => [words[0].min(low), words[1].max(high)],
            false => [low, high],
        };
    }
    all
}

/// What is known in both.
pub fn join(a: &Facts, b: &Facts) -> Facts {
    let mut pairs: Vec<(u16, u16)> = Vec::new();
    let mut joined = Facts {
        flags: a.flags | b.flags,
        ..Facts::default()
    };
    for place in 0..PLACES {
        let pair = (a.names[place], b.names[place]);
        if pair.0 == NONE || pair.1 == NONE {
            continue;
        }
        let known = pairs.iter().position(|own| *own == pair);
        let at = known.unwrap_or_else(|| {
            let (x, y) = (a.values[usize::from(pair.0)], b.values[usize::from(pair.1)]);
            joined.values.push([x[0].min(y[0]), x[1].max(y[1])]);
            pairs.push(pair);
            pairs.len() - 1
        });
        joined.names[place] = at as u16;
    }
    joined.trim(0xffff | FLAGS);
    joined
}
