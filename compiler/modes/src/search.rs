//! The search for the cells that modes are told apart by: greedy, as many at once as fit.
//!
//! Most often what fits is kept, and then all other cells are tried with it. So where there are
//! threads, that try is made beside the first one; it counts only where the search asks for it. A
//! try begins with the tick as it was read, whatever was tried before: it finds the same at any
//! time, and the search the same with any number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use super::decision_tree::{Decisions, Discrete};
use super::graph::Graph;
use super::reach::{self, Limits};
use super::tick::{self, Tick};
use super::{INSTRUCTIONS, ModeId, Modes, choose, gcm, tuning};
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_kernel::{Kernel, Range};

/// See [`super::specialize`].
pub(super) fn specialize(kernel: &Kernel, instructions: usize) -> Modes {
    if instructions == 0 {
        return Modes::single(kernel);
    }
    let work = (tuning::WORK / INSTRUCTIONS as u64).saturating_mul(instructions as u64);
    let work = work.max(tuning::WORK);
    let (specializer, mut left) = Specializer::new(kernel, instructions);
    let mut search = Search {
        specializer: &specializer,
        work_left: work,
        ahead: None,
    };
    let (mut best, mut chosen) = (Modes::single(kernel), Vec::new());
    let mut decisions = Decisions::All;
    loop {
        let mut more = choose::that_fit(&best, &left, instructions);
        let Some(first) = more.first().copied() else {
            return best;
        };
        while !more.is_empty() {
            let with = |more: &[usize]| -> Vec<Discrete> {
                let added = more.iter().map(|at| left[*at].clone());
                chosen.iter().cloned().chain(added).collect()
            };
            let (cells, then) = (with(&more), with(&in_turn(&more, left.len())));
            match search.tried(&cells, &then, decisions) {
                Some(tried) if tried.longest() <= best.longest() => {
                    (best, chosen) = (tried, cells);
                    break;
                }
                _ if search.work_left <= work / tuning::WORK_REST => {
                    best.work_limited = true;
                    return best;
                }
                // Decisions that are not needed can be exponentially many.
                None if decisions == Decisions::All => decisions = Decisions::Successor,
                _ => more.truncate(more.len() / 2),
            }
        }
        // The first, where even that one does not do alone, is left out for good.
        let settled = if more.is_empty() { vec![first] } else { more };
        let others = left
            .into_iter()
            .enumerate()
            .filter(|(at, _)| !settled.contains(at));
        left = others.map(|(_, discrete)| discrete).collect();
    }
}

/// See [`super::specialize_fully`].
pub(super) fn specialize_fully(kernel: &Kernel, instructions: usize) -> Option<Modes> {
    let (specializer, all) = Specializer::new(kernel, instructions);
    let limits = (u64::MAX, &AtomicBool::new(false));
    specializer.try_cells(&all, Decisions::All, limits).modes
}

/// These places in a list of so many, and then all others.
fn in_turn(first: &[usize], count: usize) -> Vec<usize> {
    let others = (0..count).filter(|at| !first.contains(at));
    first.iter().copied().chain(others).collect()
}

/// A tick to make modes of.
struct Specializer<'k> {
    graph: Graph<'k>,
    tick: Tick,
    start: Vec<Range>,
    instructions: usize,
}

/// What became of a try.
struct Try {
    /// None if they are too large, or too much work.
    modes: Option<Modes>,
    /// Nodes that were visited.
    work: u64,
}

impl<'k> Specializer<'k> {
    /// And the cells that can tell modes apart, the most useful first.
    fn new(kernel: &'k Kernel, instructions: usize) -> (Specializer<'k>, Vec<Discrete>) {
        let start = reach::after_init(kernel);
        let mut graph = Graph::new(kernel);
        let tick = tick::read(
            &mut graph,
            &kernel.tick,
            &tick::in_memory(kernel, &kernel.tick),
        );
        let all = reach::discrete(&graph, &tick, &start);
        let discrete = choose::by_gain(&mut graph, &tick, all);
        let specializer = Specializer {
            graph,
            tick,
            start,
            instructions,
        };
        (specializer, discrete)
    }

    /// Modes told apart by these cells, for so much work at most, unless nobody asks any more.
    fn try_cells(
        &self,
        cells: &[Discrete],
        decisions: Decisions,
        (work_max, is_unasked): (u64, &AtomicBool),
    ) -> Try {
        let mut graph = self.graph.clone();
        let limits = Limits {
            leaves: self.instructions,
            work_max,
            is_unasked,
        };
        let (reached, work) = reach::reach(
            &mut graph,
            &self.tick,
            (cells, decisions),
            &self.start,
            limits,
        );
        let modes = reached
            .ok()
            .and_then(|all| placed(&mut graph, cells, &all.into()));
        let modes = modes.filter(|modes| modes.instructions() <= self.instructions);
        Try { modes, work }
    }
}

/// The tries of one search.
struct Search<'s, 'k> {
    specializer: &'s Specializer<'k>,
    /// How many nodes may still be visited; half of them by the next try.
    work_left: u64,
    /// A try that was made before anybody asked for it: by which cells, and what became of it.
    ahead: Option<(Vec<usize>, Decisions, Try)>,
}

impl Search<'_, '_> {
    /// Modes told apart by `cells`. Beside the first try the one is made that most likely follows,
    /// by the cells `then`.
    fn tried(
        &mut self,
        cells: &[Discrete],
        then: &[Discrete],
        decisions: Decisions,
    ) -> Option<Modes> {
        let work_max = self.work_left / 2;
        let is_unasked = AtomicBool::new(false);
        let limits = (work_max, &is_unasked);
        let one = |cells: &[Discrete]| self.specializer.try_cells(cells, decisions, limits);
        let numbers = |cells: &[Discrete]| cells.iter().map(|own| own.cell).collect::<Vec<_>>();
        let before = self.ahead.take().filter(|(of, by, ahead)| {
            *of == numbers(cells) && *by == decisions && ahead.work <= work_max
        });
        let found = match before {
            Some((_, _, ahead)) => ahead,
            None if then.len() > cells.len() && parallel::has_threads() => {
                let (ahead, found) = parallel::both(
                    || one(then),
                    || {
                        let found = one(cells);
                        is_unasked.store(found.modes.is_none(), Ordering::Relaxed);
                        found
                    },
                );
                // What nobody asked for any more may have been left unfinished.
                let is_asked = found.modes.is_some();
                self.ahead = is_asked.then(|| (numbers(then), decisions, ahead));
                found
            }
            None => one(cells),
        };
        self.work_left = self.work_left.saturating_sub(found.work);
        found.modes
    }
}

fn placed(
    graph: &mut Graph,
    discrete: &[Discrete],
    reached: &IdMap<ModeId, reach::Reached>,
) -> Option<Modes> {
    let in_memory = tick::in_memory(graph.kernel, &graph.kernel.tick);
    let knows = |mode: &reach::Reached| {
        let ranges = mode.cells.iter().zip(&in_memory);
        ranges
            .map(|(range, in_memory)| range.low == range.high && !in_memory)
            .collect::<Vec<bool>>()
    };
    let known: IdMap<ModeId, Vec<bool>> = reached.iter().map(knows).collect();
    let plan = gcm::Plan {
        discrete,
        modes: reached,
        known: &known,
    };
    Some(Modes {
        modes: gcm::modes(graph, &plan)?,
        kernel: graph.kernel.clone(),
        work_limited: false,
    })
}
