//! Weighted union-find over the units of values: clusters that share a unit, and ties between
//! clusters whose units have a fixed ratio up to a power of two.

use super::middle;
use super::reach::needed;
use crate::clamp;
use crate::format::{TOP, exp2, exponent, fraction_bits};
use crate::scales::Scales;
use crate::sense::{curvature_lsb, slope_lsb};
use crate::simplify::Step;
use crate::strand;
use whippen_ids::{Id, IdMap, impl_id};
use whippen_lang::model::{CellId, Interval, Node, NodeId};
use whippen_lang::range::Ranges;

/// So many bits of the smaller range may be given up for one unit in a cluster.
const GIVEN_UP: i32 = 10;
/// Units of a constant from which on it may decide about their size.
const FEW: f64 = 8192.0;

/// The unit of a node, of a cell or of a drive word, which is to be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnitVar(u32);

impl_id!(UnitVar);

/// The smallest and the largest unit that members of a cluster need for their ranges to fit.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitBounds {
    pub(super) smallest: f64,
    pub(super) largest: f64,
}

/// The cluster that a cluster's unit follows.
#[derive(Debug, Clone, Copy)]
struct Tie {
    /// A representative; itself at a root.
    parent: UnitVar,
    /// The unit over that of the parent, up to a power of two.
    ratio: f64,
}

pub(super) struct Chooser<'a> {
    pub(super) step: &'a Step,
    /// By sense.
    scales: &'a [Scales],
    /// Nodes that a tick computes even if nobody watches: those alone have preferences.
    needed: IdMap<NodeId, bool>,
    /// Clusters: the union-find parent; itself at a representative.
    parent: IdMap<UnitVar, UnitVar>,
    /// By representative.
    pub(super) bounds: IdMap<UnitVar, UnitBounds>,
    /// By representative.
    ties: IdMap<UnitVar, Tie>,
    /// By root of the ties: a unit that is not free to choose.
    fixed: IdMap<UnitVar, Option<f64>>,
}

impl<'a> Chooser<'a> {
    pub(super) fn new(step: &'a Step, ranges: &Ranges, scales: &'a [Scales]) -> Chooser<'a> {
        let model = &step.model;
        // Coordinates count from the middle of their range.
        let coordinate = |node: &Node| match *node {
            Node::Cell(cell) => Some(middle(&model.cells[cell])),
            _ => None,
        };
        let reach = |id: NodeId| match coordinate(model.dag.get(id)) {
            Some((middle, _)) => ranges.get(id).high - middle,
            None => ranges.get(id).magnitude(),
        };
        let sum = |node: &Node, id: NodeId| match node {
            Node::Linear(c0, terms) => {
                let of = |x: NodeId| coordinate(model.dag.get(x)).map_or(0.0, |(middle, _)| middle);
                let constant: f64 = terms.iter().map(|(c, x)| c.0 * of(*x)).sum::<f64>() + c0.0;
                let own = if step.coordinates.contains(&id) {
                    0.0
                } else {
                    constant.abs()
                };
                terms
                    .iter()
                    .fold(own, |sum, (c, x)| sum + c.0.abs() * reach(*x))
            }
            _ => reach(id),
        };
        let nodes = model.dag.nodes().map(|(id, node)| sum(node, id));
        let cells = model.cells.iter().map(|cell| middle(cell).1);
        let drives = model.drives();
        let drives = drives.iter().map(|port| TOP * scales[*port].drive_lsb);
        let needs = nodes
            .chain(cells)
            .chain(drives)
            .map(|reach| reach.max(exp2(-40)) / TOP);
        let mut bounds: IdMap<UnitVar, UnitBounds> = needs
            .map(|need| UnitBounds {
                smallest: need,
                largest: need,
            })
            .collect();
        apply_grains(step, scales, &mut bounds);
        let count = bounds.len();
        let vars = || (0..count).map(UnitVar::from_index);
        Chooser {
            step,
            scales,
            needed: needed(step),
            parent: vars().collect(),
            bounds,
            ties: vars().map(|parent| Tie { parent, ratio: 1.0 }).collect(),
            fixed: IdMap::filled(None, count),
        }
    }

    /// Nodes that may prefer a unit, operands first.
    pub(super) fn nodes_with_preferences(&self) -> Vec<(NodeId, &'a Node)> {
        self.step
            .model
            .dag
            .nodes()
            .filter(|(id, _)| self.needed[id])
            .collect()
    }

    pub(super) fn var_of_node(&self, node: NodeId) -> UnitVar {
        UnitVar::from_index(node.index())
    }

    pub(super) fn var_of_cell(&self, cell: CellId) -> UnitVar {
        UnitVar::from_index(self.step.model.dag.len() + cell.index())
    }

    /// The drive words, with their ports.
    fn drives(&self) -> Vec<(UnitVar, usize)> {
        let ports = self.step.model.drives();
        let first = self.bounds.len() - ports.len();
        let vars = (first..).map(UnitVar::from_index);
        vars.zip(ports).collect()
    }

    pub(super) fn representative(&self, mut var: UnitVar) -> UnitVar {
        while self.parent[var] != var {
            var = self.parent[var];
        }
        var
    }

    /// Unites the clusters of two variables, unless their ranges are too different.
    fn unite(&mut self, a: UnitVar, b: UnitVar) {
        let a = self.representative(a);
        let b = self.representative(b);
        let united = UnitBounds {
            smallest: self.bounds[a].smallest.min(self.bounds[b].smallest),
            largest: self.bounds[a].largest.max(self.bounds[b].largest),
        };
        if a != b && united.largest <= united.smallest * exp2(GIVEN_UP) {
            self.parent[b] = a;
            self.bounds[a] = united;
        }
    }

    pub(super) fn clusters(&mut self) {
        let step = self.step;
        let model = &step.model;
        for (id, node) in model.dag.nodes() {
            if let Node::Cell(cell) = *node {
                self.unite(self.var_of_cell(cell), self.var_of_node(id));
            }
        }
        for ((body, &rate), &coordinate) in
            model.bodies.iter().zip(&step.rates).zip(&step.coordinates)
        {
            self.unite(self.var_of_cell(body.rate), self.var_of_node(rate));
            self.unite(
                self.var_of_cell(body.coordinate),
                self.var_of_node(coordinate),
            );
        }
        for &(cell, node) in &model.nexts {
            self.unite(self.var_of_cell(cell), self.var_of_node(node));
        }
        for (id, node) in self.nodes_with_preferences() {
            if let Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) = *node
                && clamp::symmetric(&model.dag, id).is_none()
            {
                let is_flexible = |n: &NodeId| is_flexible(model.dag.get(*n));
                [a, b]
                    .iter()
                    .filter(|n| is_flexible(n))
                    .for_each(|n| self.unite(self.var_of_node(id), self.var_of_node(*n)));
            }
            // What a friction's step divides by is limited before its constant comes.
            if let Node::Ratio(_, steep, _) = *node
                && let Node::Linear(_, terms) = model.dag.get(steep)
                && let [(whole, above)] = terms[..]
                && whole.0 == 1.0
            {
                self.unite(self.var_of_node(steep), self.var_of_node(above));
            }
        }
    }

    /// Units that are not ours to choose.
    pub(super) fn anchors(&mut self) {
        let model = &self.step.model;
        for (id, node) in model.dag.nodes() {
            let lsb = match *node {
                Node::Live(l) => Some(exp2(-fraction_bits(model.lives[l as usize].range))),
                Node::Keyed(k) => Some(exp2(-fraction_bits(model.keyed[k as usize].range))),
                _ => own_unit(self.step, self.scales, node),
            };
            if let Some(lsb) = lsb {
                let cluster = self.representative(self.var_of_node(id));
                self.fixed[cluster].get_or_insert(lsb);
            }
        }
        // What pushes a string counts what its points go in a tick.
        for strand in &model.strands {
            let rub = strand.friction.as_ref().map(|rub| rub.push);
            for push in strand.pushes.iter().copied().chain(rub) {
                let cluster = self.representative(self.var_of_node(push.change));
                let unit = strand::rate_unit(strand, model.rate_hz);
                self.fixed[cluster].get_or_insert(unit);
            }
        }
        // What counts in steps counts in whole ones.
        for (_, node) in model.dag.nodes() {
            if let Node::Linear(c0, terms) = node
                && let [(c, x)] = terms[..]
                && let Some(cell) = self.state(x)
                && c.0.abs() == 1.0
                && c0.0 != 0.0
            {
                let cluster = self.representative(self.var_of_cell(cell));
                self.fixed[cluster].get_or_insert(c0.0.abs());
            }
        }
        for (body, &new) in model.bodies.iter().zip(&self.step.rates) {
            let cluster = self.representative(self.var_of_cell(body.rate));
            let unit = self.rate_unit(
                model.cells[body.rate].range,
                new,
                self.bounds[cluster].largest,
            );
            self.fixed[cluster].get_or_insert(unit);
        }
        for (drive, port) in self.drives() {
            self.fixed[drive] = Some(self.scales[port].drive_lsb);
        }
    }

    /// A rate that reaches as far both ways is clamped to a power of two of its unit, which is one
    /// instruction. And what gravity does in a tick is a whole number of units, so that nothing of
    /// it is lost.
    fn rate_unit(&self, range: Interval, new: NodeId, need: f64) -> f64 {
        let dag = &self.step.model.dag;
        let arms = match *dag.get(new) {
            Node::Select(_, a, b) => [a, b],
            _ => [new; 2],
        };
        let constant = arms.iter().find_map(|arm| match dag.get(*arm) {
            Node::Linear(c0, _) => Some(c0.0.abs()),
            _ => None,
        });
        let symmetric = range.low == -range.high;
        let power = exp2(exponent(range.high / need));
        // The integers of a rate are shifted by a few.
        let unit = if symmetric {
            range.high / power * (1.0 - exp2(-15))
        } else {
            need
        };
        match constant.map(|c| (c, (c / unit).ceil())) {
            Some((c, units)) if units >= FEW => c / if symmetric { units } else { units - 1.0 },
            _ => unit,
        }
    }

    /// The root that the unit of a variable follows, and that unit over the root's.
    fn root(&self, var: UnitVar) -> (UnitVar, f64) {
        let mut at = self.representative(var);
        let mut ratio = 1.0;
        while self.ties[at].parent != at {
            ratio *= self.ties[at].ratio;
            at = self.ties[at].parent;
        }
        (at, ratio)
    }

    /// Lets the unit of `user` be `c` times the unit of `x`, up to a power of two, unless both are
    /// settled already.
    fn tie(&mut self, user: UnitVar, c: f64, x: UnitVar) {
        let (user, over_user) = self.root(user);
        let (x, over_x) = self.root(x);
        // A fixed unit must be a root.
        let ratio = c.abs() * over_x / over_user;
        match (user == x, self.fixed[user], self.fixed[x]) {
            (true, ..) | (_, Some(_), Some(_)) => {}
            (_, Some(_), None) => {
                self.ties[x] = Tie {
                    parent: user,
                    ratio: 1.0 / ratio,
                }
            }
            (_, None, _) => self.ties[user] = Tie { parent: x, ratio },
        }
    }

    pub(super) fn tie_all(&mut self) {
        let step = self.step;
        let model = &step.model;
        for body in &model.bodies {
            self.tie(
                self.var_of_cell(body.coordinate),
                1.0 / f64::from(model.rate_hz),
                self.var_of_cell(body.rate),
            );
        }
        for (id, node) in self
            .nodes_with_preferences()
            .into_iter()
            .filter(|(id, _)| !step.drives.contains(id))
        {
            self.tie_sum(self.var_of_node(id), node);
        }
        for ((drive, _), sum) in self.drives().into_iter().zip(&step.drives) {
            self.tie_sum(drive, model.dag.get(*sum));
        }
    }

    fn tie_sum(&mut self, user: UnitVar, node: &Node) {
        let Node::Linear(_, terms) = node else { return };
        for (c, x) in terms
            .iter()
            .filter(|(_, x)| is_flexible(self.step.model.dag.get(*x)))
        {
            self.tie(user, c.0, self.var_of_node(*x));
        }
    }

    /// The finest unit of a cluster that its members fit into.
    pub(super) fn unit(&self, var: UnitVar) -> f64 {
        let (root, ratio) = self.root(var);
        let mantissa = self.fixed[root].unwrap_or(1.0) * ratio;
        let need = self.bounds[self.representative(var)].largest;
        let n = exponent(need) - exponent(mantissa);
        let fits = |n: &i32| mantissa * exp2(*n) >= need;
        mantissa * exp2((n - 1..=n + 1).find(fits).unwrap_or(n + 1))
    }
}

/// The unit that a node has by itself, if it is the integer of a port.
fn own_unit(step: &Step, scales: &[Scales], node: &Node) -> Option<f64> {
    let rate = f64::from(step.model.rate_hz);
    let ticks = |sense: u32| step.model.senses[sense as usize].window;
    let of = |sense: u32| scales[sense as usize];
    match *node {
        Node::Sense(s) => Some(of(s).sensor_lsb),
        Node::Slope(s) => Some(slope_lsb(of(s), rate, ticks(s))),
        Node::Curvature(s) => Some(curvature_lsb(of(s), rate, ticks(s))),
        _ => None,
    }
}

/// Makes the finest unit of each node the finest that makes sense: integers of ports are no finer
/// than they are, and what is limited by constants is no finer than what it is made of.
fn apply_grains(step: &Step, scales: &[Scales], bounds: &mut IdMap<UnitVar, UnitBounds>) {
    let dag = &step.model.dag;
    for (id, node) in dag.nodes() {
        let grain = match *node {
            Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) => {
                match (dag.real(a), dag.real(b)) {
                    (None, Some(_)) => bounds[UnitVar(a.0)].smallest,
                    (Some(_), None) => bounds[UnitVar(b.0)].smallest,
                    _ => 0.0,
                }
            }
            _ => own_unit(step, scales, node).unwrap_or(0.0) * exp2(-GIVEN_UP),
        };
        let finest = &mut bounds[UnitVar(id.0)].smallest;
        *finest = finest.max(grain);
    }
}

/// Whether the unit of a value can follow a preference. Constants suit any; products and quotients
/// follow from their operands.
fn is_flexible(node: &Node) -> bool {
    use Node::*;
    matches!(
        node,
        Sense(_)
            | Slope(_)
            | Curvature(_)
            | Live(_)
            | Keyed(_)
            | Cell(_)
            | Linear(..)
            | Add(..)
            | Sub(..)
            | Neg(_)
            | Min(..)
            | Max(..)
            | Select(..)
            | Abs(_)
            | Function(..)
    )
}
