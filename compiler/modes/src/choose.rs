//! Selection of the cells that modes are specialized on: those that save most cycles where they are
//! known.

use super::decision_tree::Discrete;
use super::facts::meet;
use super::graph::{Graph, Kind};
use super::partial_eval::{PartialEval, Path};
use super::tick::Tick;
use super::{Mode, Modes};
use whippen_kernel::{Op, Range};

/// The cells in the order of what knowing them saves.
pub(super) fn by_gain(graph: &mut Graph, tick: &Tick, cells: Vec<Discrete>) -> Vec<Discrete> {
    let mut eval = PartialEval::default();
    let whole = cycles(graph, &mut eval, tick, Path::default());
    let mut found = Vec::new();
    for discrete in cells {
        let known = |class: &Range, graph: &mut Graph, eval: &mut PartialEval| {
            let get = graph.node(
                Kind::Op(Op::Get(discrete.cell as u32)),
                graph.kernel.cells[discrete.cell].ty,
                &[],
            );
            let path = Path {
                facts: [(get, *class)].into_iter().collect(),
                ..Path::default()
            };
            cycles(graph, eval, tick, path)
        };
        let worst_class = discrete
            .classes
            .iter()
            .map(|class| known(class, graph, &mut eval))
            .max()
            .unwrap_or(whole);
        found.push((whole.saturating_sub(worst_class), discrete));
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

fn cycles(graph: &mut Graph, eval: &mut PartialEval, tick: &Tick, path: Path) -> u32 {
    let mark = eval.mark();
    let folded = eval.evaluate(graph, &path, &tick.roots());
    eval.undo_to(mark);
    folded.map_or(0, |roots| eval.cost(graph, &roots))
}
