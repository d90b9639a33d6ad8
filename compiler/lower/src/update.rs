//! What a tick writes to memory, how much that rounds, and what becomes of it over time.

use super::Lowerer;
use super::convert::Kept;
use super::paths::{self, Path};
use super::recurrence::OverTime;
use crate::simplify::Step;
use whippen_ids::IdMap;
use whippen_lang::model::{Action, CellId, CellKind, Dag, Model, Node, NodeId};
use whippen_source::Span;

/// What writes a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Writer {
    /// `next`, in every tick.
    Next,
    /// The motion of a body, in every tick.
    Motion,
    /// `:=`, which stands here.
    Write(Span),
    /// `fire`, which stands here.
    Fire(Span),
}

/// A write to a cell.
#[derive(Debug, Clone)]
pub struct Update {
    /// The cell.
    pub cell: CellId,
    /// What writes it.
    pub writer: Writer,
    /// What is written: one of these.
    pub paths: Vec<Path>,
    /// Bound on what roundings make of it (SI), from the state that the integers hold and the same
    /// words, where no end of a range limits it; infinite behind a friction.
    pub error: f64,
    /// How far from the ends of the declared range it is limited (SI); 0 where it is not.
    pub ends: f64,
    /// What the errors of all writes to the cell come to.
    pub over_time: OverTime,
}

impl Update {
    /// How it is called in tables: `next y`, `y moves`, `y := ..`, `fire y`.
    pub fn name(&self, model: &Model) -> String {
        let cell = &model.cells[self.cell].name;
        match self.writer {
            Writer::Next => format!("next {cell}"),
            Writer::Motion => format!("{cell} moves"),
            Writer::Write(_) => format!("{cell} := .."),
            Writer::Fire(_) => format!("fire {cell}"),
        }
    }
}

impl Lowerer<'_> {
    /// Notes what a write to a cell rounds.
    pub(super) fn note_update(&mut self, cell: CellId, writer: Writer, value: NodeId, kept: Kept) {
        let declared = self.step.model.cells[cell].range;
        let (scale, range) = (self.units.scale_of_cell(cell), self.cell_range(cell));
        let end = |integer: i64| scale.lsb * integer as f64 + scale.offset;
        let reach = self.ranges.get(value);
        let inside = end(range.low) <= reach.low && reach.high <= end(range.high);
        let missed = (end(range.low) - declared.low).abs();
        let missed = missed.max((end(range.high) - declared.high).abs());
        let units = |cell| self.units.scale_of_cell(cell);
        let mut paths = paths::paths(&self.step.model.dag, units, cell, value, kept.error);
        for path in &mut paths {
            path.followed = self.followed(path, cell);
        }
        self.updates.push(Update {
            cell,
            writer,
            error: match self.step.behind_friction[value] {
                true => f64::INFINITY,
                false => paths.iter().map(|p| p.error).fold(0.0, f64::max),
            },
            paths,
            ends: kept.beside + if inside { 0.0 } else { missed },
            over_time: OverTime::Exact,
        });
    }

    /// What the errors of the values come to that are added to a cell and know nothing of it.
    fn followed(&self, path: &Path, cell: CellId) -> f64 {
        let error = |(x, c): (&NodeId, &f64)| match knows(&self.step.model.dag, *x, cell) {
            true => 0.0,
            false => c.abs() * self.reals.get(x).map_or(0.0, |real| real.error),
        };
        path.terms.iter().map(error).sum()
    }
}

/// Whether a value is made of a cell.
fn knows(dag: &Dag, value: NodeId, cell: CellId) -> bool {
    let (mut open, mut seen) = (vec![value], IdMap::filled(false, dag.len()));
    while let Some(node) = open.pop() {
        if *dag.get(node) == Node::Cell(cell) {
            return true;
        }
        if !std::mem::replace(&mut seen[node], true) {
            open.extend(dag.get(node).operands());
        }
    }
    false
}

/// Sums that `next` and actions add up in a `state`: of its own value and what is added to it,
/// behind any choices.
pub(super) fn adds_up(step: &Step) -> IdMap<NodeId, bool> {
    let (model, dag) = (&step.model, &step.model.dag);
    let mut all = IdMap::filled(false, dag.len());
    let actions = model.rules.iter().flat_map(|rule| &rule.actions);
    let writes = actions.filter_map(|action| match *action {
        Action::Write { cell, value, .. } => Some((cell, value)),
        _ => None,
    });
    let states = model.nexts.iter().copied().chain(writes);
    for (cell, value) in states.filter(|(cell, _)| model.cells[cell].kind == CellKind::State) {
        let mut open = vec![value];
        let mut seen = IdMap::filled(false, dag.len());
        while let Some(node) = open.pop() {
            match dag.get(node) {
                _ if std::mem::replace(&mut seen[node], true) => {}
                Node::Linear(_, terms) => {
                    all[node] |= terms.iter().any(|(_, x)| *dag.get(*x) == Node::Cell(cell));
                }
                &Node::Min(a, b) | &Node::Max(a, b) | &Node::Select(_, a, b) => {
                    open.extend([a, b]);
                }
                _ => {}
            }
        }
    }
    all
}
