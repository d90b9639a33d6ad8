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
    search(
        kernel,
        instructions,
        work.max(tuning::WORK),
        parallel::has_threads(),
    )
}

/// Looks for modes with so many instructions and for so much work at most.
fn search(kernel: &Kernel, instructions: usize, work: u64, looks_ahead: bool) -> Modes {
    let (specializer, mut left) = Specializer::new(kernel, instructions);
    let mut search = Search {
        specializer: &specializer,
        work_left: work,
        looks_ahead,
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
    /// Whether tries are made before anybody asks for them.
    looks_ahead: bool,
    /// A try that was made before anybody asked for it: by which cells, and what became of it.
    ahead: Option<(Vec<usize>, Try)>,
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
        // Decisions change only behind a try that came to nothing.
        let before = (self.ahead.take())
            .filter(|(of, ahead)| *of == numbers(cells) && ahead.work <= work_max);
        let found = match before {
            Some((_, ahead)) => ahead,
            None if then.len() > cells.len() && self.looks_ahead => {
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
                // All cells at once that come to nothing do so again later, most likely.
                self.looks_ahead &= ahead.modes.is_some() || !is_asked;
                self.ahead = is_asked.then(|| (numbers(then), ahead));
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
        modes: gcm::modes(graph, &plan)?.into(),
        kernel: graph.kernel.clone(),
        work_limited: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fmt::Write;
    use whippen_kernel::parse;

    /// A Kernel with so many machines of two states, each of which follows the key with some play
    /// and adds something to the word that goes out.
    fn machines(count: u32) -> Kernel {
        let mut cells = String::new();
        let mut tick =
            String::from("    v0: i32 [0..65535] = in x\n    v1: i32 [0..0] = const 0\n");
        let (mut sum, mut next) = (1, 2);
        for machine in 0..count {
            let (low, high, most) = (5000 + 4000 * machine, 7000 + 5000 * machine, 9 * machine);
            writeln!(cells, "  cell m{machine}: i1 [0..1] = 0").expect("a string has room");
            let v = |nth: u32| next + nth;
            let lines = [
                format!("v{}: i32 [{high}..{high}] = const {high}", v(0)),
                format!("v{}: i1 [0..1] = lt v{} v0", v(1), v(0)),
                format!("v{}: i32 [{low}..{low}] = const {low}", v(2)),
                format!("v{}: i1 [0..1] = lt v0 v{}", v(3), v(2)),
                format!("v{}: i1 [0..1] = get m{machine}", v(4)),
                format!("v{}: i1 [0..1] = or v{} v{}", v(5), v(4), v(1)),
                format!("v{}: i1 [0..1] = not v{}", v(6), v(3)),
                format!("v{}: i1 [0..1] = and v{} v{}", v(7), v(5), v(6)),
                format!("set m{machine} v{}", v(7)),
                format!("v{}: i32 [{most}..{most}] = const {most}", v(8)),
                format!("v{}: i32 [0..{most}] = select v{} v{} v1", v(9), v(4), v(8)),
                format!("v{}: i32 [0..900] = add v{} v{sum}", v(10), v(9)),
            ];
            lines
                .iter()
                .for_each(|line| tick += &format!("    {line}\n"));
            (sum, next) = (v(10), v(11));
        }
        let ports = "  in x: u16 [0..65535]\n  out f: i16 [-1000..1000]\n";
        let tick = format!("  tick {{\n{tick}    out f v{sum}\n  }}\n");
        let text = format!("kernel machines @44100 {{\n{ports}{cells}{tick}}}\n");
        parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    /// With little work and much, whatever fits of the machines at first.
    #[test]
    fn tries_ahead_change_nothing() {
        let mut differ = BTreeSet::new();
        for count in 1..=6 {
            let kernel = machines(count);
            for (instructions, work) in
                [(40, 9_000), (120, 20_000), (400, 60_000), (9_000, 1 << 24)]
            {
                let [ahead, alone] =
                    [true, false].map(|ahead| search(&kernel, instructions, work, ahead));
                assert_eq!(
                    ahead, alone,
                    "{count}, {instructions} instructions, {work} nodes"
                );
                differ.insert(ahead.modes.len());
            }
        }
        assert!(differ.len() > 3, "{differ:?}");
    }
}
