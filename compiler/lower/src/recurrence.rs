//! Error propagation over time: M-matrices.
//!
//! The errors `E` of all cells obey `E <- e + M E` where `e` bounds what one tick rounds and `M`
//! the partial derivatives of what is written by what was kept, over the proven ranges. Where the
//! spectral radius of `M` is below one they stay below `(I - M)^-1 e` for ever; that it is shows in
//! the pivots of `I - M`, which then are all above zero. Cells for which no such bound exists are
//! taken out, with what depends on them.
//!
//! ```text
//!   updates + partial derivatives -> exact | bounded | grows steadily | feeds back
//! ```
//!
//! As for one tick, both are taken to go the same branches. Not here: what one tick rounds.

use super::gradient::{Gradient, gradients};
use super::paths::Path;
use super::update::Update;
use crate::simplify::Step;
use whippen_ids::IdMap;
use whippen_lang::model::{CellId, Node, NodeId};
use whippen_lang::range::Ranges;

/// Least pivot that counts as above zero, and what counts as nothing beside one: far above what
/// f64 rounds, and too little to grow by in years.
const LEAST_PIVOT: f64 = 1e-12;
/// Stands for a part of itself that is more than all of it.
const AMPLIFIED: f64 = 2.0;
/// What f64 may lose while it eliminates.
const SLACK: f64 = 1.0 + 1e-9;

/// What the errors of a cell come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OverTime {
    /// Nothing rounds.
    Exact,
    /// They stay below this for ever (SI).
    Bounded(f64),
    /// They add up, by at most so much a second (SI).
    Grows(f64),
    /// What is written depends on the slip of a friction: no bound is known, not even of one tick.
    BehindFriction,
    /// They are fed back or amplified, so no bound is proven; roundings add at most so much a
    /// second to them (SI).
    FedBack(f64),
}

/// Says of each update what the errors of its cell come to.
pub(super) fn judge(step: &Step, ranges: &Ranges, updates: &mut [Update]) {
    let gradients = gradients(step, ranges);
    let all = over_time(step, updates, &gradients);
    for update in updates {
        update.over_time = all[update.cell];
    }
}

/// The error of a cell, at most: `error + sum by_i E_i`.
#[derive(Debug, Clone)]
struct Row {
    error: f64,
    /// By cell: the largest partial derivative.
    by: IdMap<CellId, f64>,
    /// What one tick adds at most.
    at_a_time: f64,
}

impl Row {
    /// Takes in one more value that may be written.
    ///
    /// Of a part `s < 1` of itself and an error `e` a cell comes to `e / (1 - s)`; a value that is
    /// the cell's own adds nothing.
    fn add(&mut self, cell: CellId, path: &Path, slopes: &Gradient) {
        let own = slopes.get(&cell).map_or(0.0, |slope| slope.magnitude());
        let others = || slopes.iter().filter(|(by, _)| **by != cell);
        self.at_a_time = self.at_a_time.max(path.error);
        if own <= 1.0 + LEAST_PIVOT && path.error == 0.0 && others().next().is_none() {
            return;
        }
        let settles = 1.0 - own >= LEAST_PIVOT;
        let left = if settles { 1.0 - own } else { 1.0 };
        self.error = self.error.max(path.error / left);
        for (&by, slope) in others() {
            self.by[by] = self.by[by].max(slope.magnitude() / left);
        }
        if !settles {
            self.by[cell] = self.by[cell].max(own);
        }
    }
}

fn over_time(
    step: &Step,
    updates: &[Update],
    gradients: &IdMap<NodeId, Gradient>,
) -> IdMap<CellId, OverTime> {
    let cells = &step.model.cells;
    let nothing = Row {
        error: 0.0,
        by: IdMap::filled(0.0, cells.len()),
        at_a_time: 0.0,
    };
    let mut rows: IdMap<CellId, Row> = IdMap::filled(nothing, cells.len());
    let from_lines = from_lines(step);
    for update in updates.iter().filter(|update| update.error.is_infinite()) {
        // Of what is amplified there is no bound, nor of what is made of it.
        let own = &mut rows[update.cell].by[update.cell];
        *own = own.max(AMPLIFIED);
    }
    for update in updates {
        // What comes from a delay line has the errors of what was fed, which may come from here.
        if update
            .paths
            .iter()
            .any(|path| path.terms.keys().any(|x| from_lines[x]))
        {
            rows[update.cell].by[update.cell] = f64::INFINITY;
        }
        // A limit forgets what was before.
        rows[update.cell].error = rows[update.cell].error.max(update.ends);
        for path in &update.paths {
            rows[update.cell].add(update.cell, path, &path.gradient(gradients));
        }
    }
    let bounds = bounds(&rows);
    let per_second = f64::from(step.model.rate_hz);
    let is_behind = |cell: CellId| {
        let mut own = updates.iter().filter(|update| update.cell == cell);
        own.any(|update| update.error.is_infinite())
    };
    let judged = |cell: CellId| {
        let row = &rows[cell];
        if is_behind(cell) {
            return OverTime::BehindFriction;
        }
        let others = || row.by.enumerated().filter(move |(by, _)| *by != cell);
        let inherited: Option<f64> = others()
            .filter(|(_, slope)| **slope > 0.0)
            .map(|(by, slope)| Some(slope * bounds[by]?))
            .sum();
        match (bounds[cell], inherited) {
            (Some(0.0), _) => OverTime::Exact,
            (Some(bound), _) => OverTime::Bounded(bound),
            (None, Some(inherited)) if row.by[cell] <= 1.0 + LEAST_PIVOT => {
                OverTime::Grows((row.at_a_time + inherited) * per_second)
            }
            _ => OverTime::FedBack(row.at_a_time * per_second),
        }
    };
    cells.ids().map(judged).collect()
}

/// By node: whether it is made of what delay lines and strings give.
fn from_lines(step: &Step) -> IdMap<NodeId, bool> {
    let mut all: IdMap<NodeId, bool> = IdMap::new();
    for (_, node) in step.model.dag.nodes() {
        let is_line = matches!(
            node,
            Node::Tap(..) | Node::Tuned(..) | Node::Read(..) | Node::Mean(..)
        );
        all.push(is_line || node.operands().iter().any(|x| all[x]));
    }
    all
}

/// The bound on each cell's error, where there is one.
fn bounds(rows: &IdMap<CellId, Row>) -> IdMap<CellId, Option<f64>> {
    let exact = exact(rows);
    let mut open: Vec<CellId> = rows.ids().filter(|cell| !exact[cell]).collect();
    loop {
        match eliminated(rows, &open) {
            Ok(solved) => {
                let mut bounds: IdMap<CellId, Option<f64>> = IdMap::filled(None, rows.len());
                exact.enumerated().for_each(|(cell, exact)| {
                    bounds[cell] = exact.then_some(0.0);
                });
                for (cell, bound) in open.iter().zip(solved) {
                    bounds[cell] = Some(bound * SLACK);
                }
                return bounds;
            }
            Err(failed) => {
                let mut without = vec![failed];
                while let Some(cell) = without.pop() {
                    open.retain(|c| *c != cell);
                    without.extend(open.iter().filter(|c| rows[*c].by[cell] > 0.0));
                }
            }
        }
    }
}

/// Cells that never hold an error: nothing rounds, here and in what they are made of.
fn exact(rows: &IdMap<CellId, Row>) -> IdMap<CellId, bool> {
    let mut exact: IdMap<CellId, bool> = rows.iter().map(|row| row.error == 0.0).collect();
    loop {
        let inherits = |cell: &CellId| {
            let by = rows[cell].by.enumerated();
            exact[cell] && by.into_iter().any(|(by, slope)| *slope > 0.0 && !exact[by])
        };
        let Some(cell) = rows.ids().find(inherits) else {
            return exact;
        };
        exact[cell] = false;
    }
}

/// Solves `(I - M) E = e` for the open cells by elimination; where a pivot is not above zero, its
/// cell.
fn eliminated(rows: &IdMap<CellId, Row>, open: &[CellId]) -> Result<Vec<f64>, CellId> {
    let count = open.len();
    let mut matrix: Vec<Vec<f64>> = open
        .iter()
        .map(|row| {
            let entry = |by: &CellId| f64::from(row == by) - rows[row].by[by];
            let right = rows[row].error;
            open.iter().map(entry).chain([right]).collect()
        })
        .collect();
    for pivot in 0..count {
        if matrix[pivot][pivot].is_nan() || matrix[pivot][pivot] < LEAST_PIVOT {
            return Err(open[pivot]);
        }
        let top = matrix[pivot].clone();
        for row in matrix.iter_mut().skip(pivot + 1) {
            let factor = row[pivot] / top[pivot];
            for (entry, above) in row.iter_mut().zip(&top).skip(pivot) {
                *entry -= factor * above;
            }
        }
    }
    let mut solved = vec![0.0; count];
    for row in (0..count).rev() {
        let later: f64 = (row + 1..count)
            .map(|by| matrix[row][by] * solved[by])
            .sum();
        solved[row] = (matrix[row][count] - later) / matrix[row][row];
    }
    Ok(solved)
}
