//! The cycles that remain in each state: the least numbers that satisfy all steps, by value
//! iteration; in loops the least cycles of a round with which that settles.

use whippen_audit::{Facts, Refusal};
use whippen_isa::timing::Pipe;

use super::explored::{Explored, Spot};

/// Less than anything.
const NOTHING: i64 = i64::MIN / 4;
/// Passes through all states at most.
const PASSES_MAX: usize = 20_000;
/// Cycles of a round at most.
const ROUND_MAX: i64 = 1 << 40;

/// What was found.
pub struct Remains {
    /// Of each spot, the states that are kept and what remains.
    pub kept: Vec<Vec<(usize, i64)>>,
    /// The cycles of a round of each loop.
    pub rounds: Vec<i64>,
    /// The state of the entry that takes up what is entered with.
    pub first: usize,
    /// What remains at the entry.
    pub entry: i64,
    /// The longest instruction.
    pub longest: u64,
}

/// Finds what remains.
pub fn remains(
    explored: &mut Explored,
    entry: (usize, &Facts),
    idle: bool,
) -> Result<Remains, Refusal> {
    let (start, facts) = entry;
    let mut rounds = vec![0; explored.rounds.len()];
    if !idle {
        find_rounds(explored, &mut rounds)?;
    }
    let mut all = solve(explored, &rounds, idle)?;
    // Of several claimed states that cover what arrives, the checker takes the one with least.
    for _ in 0..32 {
        if !choose(explored, &all) {
            break;
        }
        all = solve(explored, &rounds, idle)?;
    }
    let first = cheapest(
        &explored.spots[start],
        &all[start],
        &(explored.begins, facts.clone()),
    );
    let first = first.ok_or_else(|| Refusal::at(explored.spots[start].node.at, "is not met"))?;
    let mut reached: Vec<Vec<bool>> = explored
        .spots
        .iter()
        .map(|spot| vec![false; spot.states.len()])
        .collect();
    let mut open = vec![(start, first)];
    while let Some((spot, state)) = open.pop() {
        if !std::mem::replace(&mut reached[spot][state], true) {
            open.extend(
                explored.spots[spot].follows[state]
                    .iter()
                    .filter_map(|own| own.to),
            );
        }
    }
    let of_spot = |(reached, all): (&Vec<bool>, &Vec<i64>)| {
        let states = reached.iter().zip(all).enumerate();
        states
            .filter(|(_, (reached, _))| **reached)
            .map(|(nth, (_, a))| (nth, *a))
            .collect()
    };
    let kept: Vec<Vec<(usize, i64)>> = reached.iter().zip(&all).map(of_spot).collect();
    Ok(Remains {
        first,
        entry: all[start][first] + enters(explored, &rounds, start),
        kept,
        rounds,
        longest: explored.longest,
    })
}

/// The state of a spot that covers what arrives and has least.
fn cheapest(spot: &Spot, all: &[i64], state: &(Pipe, Facts)) -> Option<usize> {
    let covers = |nth: &usize| {
        let (pipe, facts) = &spot.states[*nth];
        *pipe == state.0 && facts.covers(&state.1)
    };
    (0..spot.states.len())
        .filter(covers)
        .min_by_key(|nth| all[*nth])
}

/// Leads every step to the cheapest state that covers it; whether one changed.
fn choose(explored: &mut Explored, all: &[Vec<i64>]) -> bool {
    let mut changed = false;
    let mut chosen = Vec::new();
    for (number, spot) in explored.spots.iter().enumerate() {
        for (nth, follows) in spot.follows.iter().enumerate() {
            for (way, follows) in follows.iter().enumerate() {
                let Some((to, old)) = follows.to else {
                    continue;
                };
                let best = cheapest(&explored.spots[to], &all[to], &follows.state);
                if let Some(best) = best.filter(|best| *best != old) {
                    chosen.push((number, nth, way, (to, best)));
                }
            }
        }
    }
    for (number, nth, way, to) in chosen {
        explored.spots[number].follows[nth][way].to = Some(to);
        changed = true;
    }
    changed
}

/// What the rounds add of a loop whose head is the entry.
fn enters(explored: &Explored, rounds: &[i64], start: usize) -> i64 {
    go_on(explored, rounds, &[], Some(start))
}

/// What a step adds to the cycles that remain where it leads, for the loops that it enters, goes
/// round and leaves; none where it leaves `within`.
fn step(explored: &Explored, rounds: &[i64], from: &Spot, to: Option<usize>) -> i64 {
    go_on(explored, rounds, &from.loops, to)
}

fn go_on(explored: &Explored, rounds: &[i64], from: &[u32], to: Option<usize>) -> i64 {
    let none = Vec::new();
    let into = to.map_or(&none, |to| &explored.spots[to].loops);
    let same = from.iter().zip(into).take_while(|(a, b)| a == b).count();
    let left: i64 = from[same..].iter().map(|own| rounds[*own as usize]).sum();
    let head = to.and_then(|to| {
        let node = explored.spots[to].node;
        let last = *into.last()? as usize;
        let own = &explored.rounds[last];
        ((own.context, own.head) == (node.context, node.at)).then_some(last)
    });
    match head {
        Some(last) if same == into.len() => -rounds[last] - left,
        Some(last) => rounds[last] * i64::from(explored.rounds[last].rounds_max) - left,
        None => -left,
    }
}

/// The cycles of a round of each loop, inner ones first.
fn find_rounds(explored: &Explored, rounds: &mut [i64]) -> Result<(), Refusal> {
    let depth = |number: usize| {
        let inside = explored
            .spots
            .iter()
            .filter(|spot| spot.loops.contains(&(number as u32)));
        inside
            .map(|spot| spot.loops.iter().position(|own| *own == number as u32))
            .max()
    };
    let mut order: Vec<usize> = (0..rounds.len()).collect();
    order.sort_by_key(|number| std::cmp::Reverse(depth(*number)));
    for number in order {
        let (mut low, mut high) = (0, 1);
        while !settles(explored, rounds, number, high) {
            (low, high) = (high + 1, 2 * high);
            if high > ROUND_MAX {
                return Err(Refusal::at(
                    explored.rounds[number].head,
                    "has endless rounds",
                ));
            }
        }
        while low < high {
            let middle = (low + high) / 2;
            match settles(explored, rounds, number, middle) {
                true => high = middle,
                false => low = middle + 1,
            }
        }
        rounds[number] = high;
    }
    Ok(())
}

/// Whether rounds of so many cycles leave nothing that grows for ever in a loop.
fn settles(explored: &Explored, rounds: &mut [i64], number: usize, cycles: i64) -> bool {
    rounds[number] = cycles;
    let inside = |spot: &Spot| spot.loops.contains(&(number as u32));
    let states = explored.spots.iter().filter(|spot| inside(spot));
    let heads: usize = states.map(|spot| spot.states.len()).max().unwrap_or(1);
    let mut all: Vec<Vec<i64>> = explored
        .spots
        .iter()
        .map(|spot| vec![0; spot.states.len()])
        .collect();
    for _ in 0..4 * heads + 16 {
        let mut changed = false;
        for (at, spot) in explored
            .spots
            .iter()
            .enumerate()
            .rev()
            .filter(|(_, own)| inside(own))
        {
            for (nth, follows) in spot.follows.iter().enumerate() {
                for follows in follows {
                    let Some((to, state)) =
                        follows.to.filter(|(to, _)| inside(&explored.spots[*to]))
                    else {
                        continue;
                    };
                    let more = step(explored, rounds, spot, Some(to));
                    let new = all[to][state] + follows.cycles + more;
                    if new > all[at][nth] {
                        all[at][nth] = new;
                        changed = true;
                    }
                }
            }
        }
        if !changed {
            return true;
        }
    }
    false
}

/// The least that satisfies all steps.
fn solve(explored: &Explored, rounds: &[i64], idle: bool) -> Result<Vec<Vec<i64>>, Refusal> {
    let first = if idle { 0 } else { NOTHING };
    let mut all: Vec<Vec<i64>> = explored
        .spots
        .iter()
        .map(|spot| vec![first; spot.states.len()])
        .collect();
    if idle {
        return Ok(all);
    }
    for _ in 0..PASSES_MAX {
        let mut changed = false;
        for (at, spot) in explored.spots.iter().enumerate().rev() {
            for (nth, follows) in spot.follows.iter().enumerate() {
                for follows in follows {
                    let remains = follows.to.map_or(0, |(to, state)| all[to][state]);
                    if remains == NOTHING {
                        continue;
                    }
                    let more = step(explored, rounds, spot, follows.to.map(|(to, _)| to));
                    let new = remains + follows.cycles + more;
                    if new > all[at][nth] {
                        all[at][nth] = new;
                        changed = true;
                    }
                }
            }
        }
        if !changed {
            return Ok(all);
        }
    }
    Err(Refusal::at(0, "has rounds that do not settle"))
}
