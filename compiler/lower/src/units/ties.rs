//! Clusters of values that share a unit, and ties between them.

use super::middle;
use super::reach::needed;
use crate::clamp;
use crate::format::{TOP, exp2, exponent, fraction_bits};
use crate::scales::Scales;
use crate::sense::{curvature_lsb, slope_lsb};
use crate::simplify::Step;
use whippen_lang::model::{CellId, Interval, Node, NodeId};
use whippen_lang::range::Ranges;

/// So many bits of the smaller range may be given up for one unit in a cluster.
const GIVEN_UP: i32 = 10;
/// Units of a constant from which on it may decide about their size.
const FEW: f64 = 8192.0;

/// What a place (a node, a cell, the drive word) hangs on.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// The place it hangs on; itself at a root.
    to: usize,
    /// Its unit over the unit there, up to a power of two.
    ratio: f64,
}

pub(super) struct Chooser<'a> {
    pub(super) step: &'a Step,
    scales: Scales,
    /// Nodes that no observer asks for: those alone have wishes.
    needed: Vec<bool>,
    /// Clusters: who speaks for a place.
    pub(super) speaker: Vec<usize>,
    /// By speaker: smallest and largest unit that some member needs to fit.
    pub(super) needs: Vec<(f64, f64)>,
    /// By speaker.
    links: Vec<Link>,
    /// By root of the ties: a unit that is given.
    given: Vec<Option<f64>>,
}

impl<'a> Chooser<'a> {
    pub(super) fn new(step: &'a Step, ranges: &Ranges, scales: Scales) -> Chooser<'a> {
        let model = &step.model;
        // Coordinates count from the middle of their range.
        let coordinate = |node: &Node| match *node {
            Node::Cell(cell) => Some(middle(&model.cells[cell.0 as usize])),
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
        let drive = TOP * scales.drive_lsb;
        let needs = nodes
            .chain(cells)
            .chain([drive])
            .map(|reach| reach.max(exp2(-40)) / TOP);
        let mut needs: Vec<(f64, f64)> = needs.map(|need| (need, need)).collect();
        grains(step, scales, &mut needs);
        let count = needs.len();
        Chooser {
            step,
            scales,
            needed: needed(step),
            speaker: (0..count).collect(),
            needs,
            links: (0..count).map(|to| Link { to, ratio: 1.0 }).collect(),
            given: vec![None; count],
        }
    }

    /// Nodes that a tick needs, operands first.
    pub(super) fn wishing(&self) -> Vec<(NodeId, &'a Node)> {
        self.step
            .model
            .dag
            .nodes()
            .filter(|(id, _)| self.needed[id.0 as usize])
            .collect()
    }

    pub(super) fn cell(&self, cell: CellId) -> usize {
        self.step.model.dag.len() + cell.0 as usize
    }

    fn drive(&self) -> usize {
        self.needs.len() - 1
    }

    pub(super) fn speaker(&self, mut place: usize) -> usize {
        while self.speaker[place] != place {
            place = self.speaker[place];
        }
        place
    }

    /// Puts two places into one cluster, unless their ranges are too different.
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.speaker(a), self.speaker(b));
        let (low, high) = (
            self.needs[a].0.min(self.needs[b].0),
            self.needs[a].1.max(self.needs[b].1),
        );
        if a != b && high <= low * exp2(GIVEN_UP) {
            self.speaker[b] = a;
            self.needs[a] = (low, high);
        }
    }

    pub(super) fn clusters(&mut self) {
        let step = self.step;
        let model = &step.model;
        for (id, node) in model.dag.nodes() {
            if let Node::Cell(cell) = *node {
                self.join(self.cell(cell), id.0 as usize);
            }
        }
        for ((body, &rate), &coordinate) in
            model.bodies.iter().zip(&step.rates).zip(&step.coordinates)
        {
            self.join(self.cell(body.rate), rate.0 as usize);
            self.join(self.cell(body.coordinate), coordinate.0 as usize);
        }
        for &(cell, node) in &model.nexts {
            self.join(self.cell(cell), node.0 as usize);
        }
        for (id, node) in self.wishing() {
            if let Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) = *node
                && clamp::symmetric(&model.dag, id).is_none()
            {
                let bends = |n: &NodeId| bends(model.dag.get(*n));
                [a, b]
                    .iter()
                    .filter(|n| bends(n))
                    .for_each(|n| self.join(id.0 as usize, n.0 as usize));
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
                let cluster = self.speaker(id.0 as usize);
                self.given[cluster].get_or_insert(lsb);
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
                let cluster = self.speaker(self.cell(cell));
                self.given[cluster].get_or_insert(c0.0.abs());
            }
        }
        for (body, &new) in model.bodies.iter().zip(&self.step.rates) {
            let cluster = self.speaker(self.cell(body.rate));
            let unit = self.rate_unit(
                model.cells[body.rate.0 as usize].range,
                new,
                self.needs[cluster].1,
            );
            self.given[cluster].get_or_insert(unit);
        }
        let drive = self.drive();
        self.given[drive] = Some(self.scales.drive_lsb);
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

    /// The root of a place's ties, and its unit over the unit there.
    fn root(&self, place: usize) -> (usize, f64) {
        let (mut at, mut ratio) = (self.speaker(place), 1.0);
        while self.links[at].to != at {
            ratio *= self.links[at].ratio;
            at = self.links[at].to;
        }
        (at, ratio)
    }

    /// Lets the unit of `user` be `c` times the unit of `x`, up to a power of two, unless both are
    /// settled already.
    fn tie(&mut self, user: usize, c: f64, x: usize) {
        let ((user, over_user), (x, over_x)) = (self.root(user), self.root(x));
        // What is given must be a root.
        let ratio = c.abs() * over_x / over_user;
        match (user == x, self.given[user], self.given[x]) {
            (true, ..) | (_, Some(_), Some(_)) => {}
            (_, Some(_), None) => {
                self.links[x] = Link {
                    to: user,
                    ratio: 1.0 / ratio,
                }
            }
            (_, None, _) => self.links[user] = Link { to: x, ratio },
        }
    }

    pub(super) fn ties(&mut self) {
        let step = self.step;
        let model = &step.model;
        for body in &model.bodies {
            self.tie(
                self.cell(body.coordinate),
                1.0 / f64::from(model.rate_hz),
                self.cell(body.rate),
            );
        }
        for (id, node) in self
            .wishing()
            .into_iter()
            .filter(|(id, _)| *id != step.drive)
        {
            self.tie_sum(id.0 as usize, node);
        }
        self.tie_sum(self.drive(), model.dag.get(step.drive));
    }

    fn tie_sum(&mut self, user: usize, node: &Node) {
        let Node::Linear(_, terms) = node else { return };
        for (c, x) in terms
            .iter()
            .filter(|(_, x)| bends(self.step.model.dag.get(*x)))
        {
            self.tie(user, c.0, x.0 as usize);
        }
    }

    /// The finest unit of a cluster that its members fit into.
    pub(super) fn unit(&self, place: usize) -> f64 {
        let (root, ratio) = self.root(place);
        let mantissa = self.given[root].unwrap_or(1.0) * ratio;
        let need = self.needs[self.speaker(place)].1;
        let n = exponent(need) - exponent(mantissa);
        let fits = |n: &i32| mantissa * exp2(*n) >= need;
        mantissa * exp2((n - 1..=n + 1).find(fits).unwrap_or(n + 1))
    }
}

/// The unit that a node has by itself, if it is the integer of a port.
fn own_unit(step: &Step, scales: Scales, node: &Node) -> Option<f64> {
    let rate = f64::from(step.model.rate_hz);
    let ticks = |sense: u32| step.model.senses[sense as usize].window;
    match *node {
        Node::Sense(_) => Some(scales.sensor_lsb),
        Node::Slope(s) => Some(slope_lsb(scales, rate, ticks(s))),
        Node::Curvature(s) => Some(curvature_lsb(scales, rate, ticks(s))),
        _ => None,
    }
}

/// Makes the finest unit of each node the finest that makes sense: integers of ports are no finer
/// than they are, and what is limited by constants is no finer than what it is made of.
fn grains(step: &Step, scales: Scales, needs: &mut [(f64, f64)]) {
    let dag = &step.model.dag;
    for (id, node) in dag.nodes() {
        let grain = match *node {
            Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) => {
                match (dag.real(a), dag.real(b)) {
                    (None, Some(_)) => needs[a.0 as usize].0,
                    (Some(_), None) => needs[b.0 as usize].0,
                    _ => 0.0,
                }
            }
            _ => own_unit(step, scales, node).unwrap_or(0.0) * exp2(-GIVEN_UP),
        };
        let finest = &mut needs[id.0 as usize].0;
        *finest = finest.max(grain);
    }
}

/// Whether a value takes a wish of its unit, or has one to spread. Constants suit any; products and
/// quotients follow from their operands.
fn bends(node: &Node) -> bool {
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
    )
}
