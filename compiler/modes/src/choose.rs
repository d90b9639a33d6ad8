//! Which cells are worth modes of their own: those that save most where they are known.

use super::facts::meet;
use super::fold::{Fold, Path};
use super::graph::{Graph, Kind};
use super::tick::Tick;
use super::tree::Discrete;
use super::{Mode, Modes};
use whippen_kernel::{Op, Range};

/// The cells in the order of what knowing them saves.
pub(super) fn by_gain(graph: &mut Graph, tick: &Tick, cells: Vec<Discrete>) -> Vec<Discrete> {
    let mut fold = Fold::default();
    let whole = cycles(graph, &mut fold, tick, Path::default());
    let mut found = Vec::new();
    for discrete in cells {
        let known = |class: &Range, graph: &mut Graph, fold: &mut Fold| {
            let get = graph.node(
                Kind::Op(Op::Get(discrete.cell as u32)),
                graph.kernel.cells[discrete.cell].ty,
                &[],
            );
            let path = Path {
                facts: [(get, *class)].into_iter().collect(),
                ..Path::default()
            };
            cycles(graph, fold, tick, path)
        };
        let dearest = discrete
            .classes
            .iter()
            .map(|class| known(class, graph, &mut fold))
            .max()
            .unwrap_or(whole);
        found.push((whole.saturating_sub(dearest), discrete));
    }
    found.sort_by_key(|(gain, _)| std::cmp::Reverse(*gain));
    found.into_iter().map(|(_, discrete)| discrete).collect()
}

/// The cells, by their place in the list, that are worth a try all at once: a mode becomes as many
/// as there are classes that it may be entered with, each as large as the whole; twice as large
/// where the class has several values, because a tick may then leave it or not, whatever else it
/// does.
pub(super) fn that_fit(modes: &Modes, cells: &[Discrete], instructions: usize) -> Vec<usize> {
    let mut sizes: Vec<usize> = modes.modes.iter().map(Mode::instructions).collect();
    let mut found = Vec::new();
    for (at, discrete) in cells.iter().enumerate() {
        let classes = |mode: &Mode| {
            let met = discrete
                .classes
                .iter()
                .map(|class| meet(*class, mode.cells[discrete.cell]));
            met.map(|Range { low, high }| usize::from(low <= high) + usize::from(low < high))
                .sum::<usize>()
        };
        let split: Vec<usize> = modes
            .modes
            .iter()
            .zip(&sizes)
            .map(|(mode, size)| size * classes(mode))
            .collect();
        if split.iter().sum::<usize>() <= instructions {
            sizes = split;
            found.push(at);
        }
    }
    found
}

fn cycles(graph: &mut Graph, fold: &mut Fold, tick: &Tick, path: Path) -> u32 {
    let mark = fold.mark();
    let folded = fold.run(graph, &path, &tick.roots());
    fold.back(mark);
    folded.map_or(0, |roots| fold.cost(graph, &roots))
}
