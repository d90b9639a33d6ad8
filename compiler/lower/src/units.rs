//! Choice of units: a unit for every value, chosen for all together by union-find with
//! preferences.
//!
//! A unit costs nothing by itself; what costs is its change. So units are settled in three steps:
//!
//! 1. **Clusters.** What must be written in one unit to be chosen between, compared or stored
//!    shares one: the operands of `min`, `max` and `if`, a cell and its new value.
//! 2. **Ties.** Where a sum takes `c * x`, it needs no product if `c` times the unit of `x` is a
//!    power of two of its own. Each such preference ties two clusters up to a power of two,
//!    unless they are connected already: first `coordinate += T * rate`, so that a rate counts
//!    what its coordinate moves in a tick, then the sums, operands before users. Sensor words,
//!    live values and the drive word have units of their own, which spread along the ties.
//! 3. **Size.** Each cluster takes the finest unit with which everything in it fits into 32 bits.
//!
//! Not here: how a sum is computed when a preference was not followed (`linear`).

mod reach;
mod size;
mod ties;

pub(super) use reach::left;

use super::format::TOP;
use super::real::{Scale, power_of_two};
use crate::scales::Scales;
use crate::simplify::Step;
use ties::Chooser;
use whippen_ids::IdMap;
use whippen_lang::model::{Body, Cell, CellId, CellKind, Interval, Node, NodeId};
use whippen_lang::range::Ranges;

/// The unit (SI) of every value and cell.
#[derive(Debug)]
pub(super) struct Units {
    nodes: IdMap<NodeId, Scale>,
    cells: IdMap<CellId, Scale>,
}

impl Units {
    /// The unit a node is computed in, if that is free (meaningless for bools).
    pub fn of(&self, node: NodeId) -> f64 {
        self.nodes[node].lsb
    }

    /// Unit and offset that a node is computed with, if that is free. Only new rates and
    /// coordinates have an offset.
    pub fn scale_of(&self, node: NodeId) -> Scale {
        self.nodes[node]
    }

    /// Unit and offset of a cell. The integers of a rate are half a unit of the coordinate's way in
    /// a tick too large, so that the way is rounded to the nearest by the shift that rounds it
    /// down.
    pub fn scale_of_cell(&self, cell: CellId) -> Scale {
        self.cells[cell]
    }
}

/// Where the integers of a cell count from, and how far it reaches from there. Those of a
/// coordinate count from the middle of its range: sums have a constant to hide that in, and it is
/// worth up to a bit.
fn middle(cell: &Cell) -> (f64, f64) {
    let Interval { low, high } = cell.range;
    match cell.kind {
        CellKind::Coordinate => (0.5 * (low + high), 0.5 * (high - low)),
        _ => (0.0, cell.range.magnitude()),
    }
}

impl Units {
    /// Gives coordinates their offsets, and with them what is to be stored there.
    fn shift_coordinates(&mut self, step: &Step) {
        let model = &step.model;
        for (id, cell) in model.cells.enumerated() {
            self.cells[id].offset = middle(cell).0;
        }
        for (body, new) in model.bodies.iter().zip(&step.coordinates) {
            let scale = self.cells[body.coordinate];
            if matches!(model.dag.get(*new), Node::Linear(..)) && self.nodes[new].lsb == scale.lsb {
                self.nodes[new] = scale;
            }
        }
    }

    /// Gives rates their offsets, and with them what is to be stored there.
    fn shift_rates(&mut self, step: &Step) {
        for (body, &new) in step.model.bodies.iter().zip(&step.rates) {
            let travel = self.coordinate_unit(body) * f64::from(step.model.rate_hz);
            let unit = self.cells[body.rate].lsb;
            let reach = step.model.cells[body.rate].range.magnitude() + 0.5 * travel;
            if power_of_two(travel / unit).is_none_or(|n| n <= 0) || reach > TOP * unit {
                continue;
            }
            let scale = Scale {
                offset: -0.5 * travel,
                ..self.cells[body.rate]
            };
            self.cells[body.rate] = scale;
            let arms = match *step.model.dag.get(new) {
                Node::Select(_, a, b) => vec![a, b],
                _ => vec![new],
            };
            for arm in arms
                .into_iter()
                .filter(|arm| matches!(step.model.dag.get(*arm), Node::Linear(..)))
            {
                if self.nodes[arm].lsb == scale.lsb {
                    self.nodes[arm] = scale;
                }
            }
        }
    }

    fn coordinate_unit(&self, body: &Body) -> f64 {
        self.cells[body.coordinate].lsb
    }
}

/// Chooses the units of all values.
pub(super) fn choose(step: &Step, ranges: &Ranges, scales: &[Scales]) -> Units {
    let mut chooser = Chooser::new(step, ranges, scales);
    chooser.clusters();
    chooser.anchors();
    chooser.tie_all();
    chooser.coarsen_states();
    chooser.widen();
    chooser.coarsen_pulses(ranges);
    let of_node = |(node, _)| Scale::plain(chooser.unit(chooser.var_of_node(node)));
    let of_cell = |cell| Scale::plain(chooser.unit(chooser.var_of_cell(cell)));
    let mut units = Units {
        nodes: step.model.dag.nodes().map(of_node).collect(),
        cells: step.model.cells.ids().map(of_cell).collect(),
    };
    units.shift_coordinates(step);
    units.shift_rates(step);
    units
}
