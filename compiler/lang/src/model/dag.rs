//! Values of a Model: a hash-consed graph of real and boolean expressions.
//!
//! Equal expressions share one node, so a value is computed once per tick wherever it is used. A
//! node's operands always have smaller numbers than the node: one pass from 0 upwards evaluates
//! everything.

use std::collections::HashMap;

use super::curve::Curve;

use super::{
    CellId, DelayId, Function, GridNumber, MachineId, NoiseId, Reading, StrandId, TunedId,
};
use whippen_ids::{IdMap, impl_id};

/// Index of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

impl_id!(NodeId);

/// A real constant, compared and hashed by its bits.
#[derive(Debug, Clone, Copy)]
pub struct Real(pub f64);

impl PartialEq for Real {
    fn eq(&self, other: &Real) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}
impl Eq for Real {}
impl std::hash::Hash for Real {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.to_bits().hash(state);
    }
}

/// Comparisons of reals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cmp {
    /// `<`
    Lt,
    /// `<=`
    Le,
    /// `>`
    Gt,
    /// `>=`
    Ge,
}

/// What a friction is solved from: the slip `v` with `v + gain * law(v) = free`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Balance {
    /// The slip where there were no friction.
    pub free: NodeId,
    /// What a force changes the slip by in a tick: tick length over mass or inertia.
    pub gain: NodeId,
    /// The slip that is tried, of which the law is made: a [`Node::Trial`].
    pub trial: NodeId,
    /// The force against the slip that is tried.
    pub law: NodeId,
    /// Its derivative by that.
    pub slope: NodeId,
    /// The slip of the tick before, from which the search begins.
    pub last: NodeId,
}

/// One value: real unless said otherwise.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Node {
    /// A constant.
    Const(Real),
    /// A constant bool.
    Bool(bool),
    /// The sensed value (index into `senses`), clamped to its range.
    Sense(u32),
    /// Slope of the least-squares line over its window.
    Slope(u32),
    /// Second derivative of the least-squares parabola over its window.
    Curvature(u32),
    /// A live parameter that is a number (index into `lives`).
    Live(u32),
    /// A live parameter that is a bool (bool).
    LiveBool(u32),
    /// A per-key parameter (index into `keyed`).
    Keyed(u32),
    /// A cell at the tick's start.
    Cell(CellId),
    /// This tick's number of a noise.
    Noise(NoiseId),
    /// What was fed to a delay line so many ticks ago (not whole), linear between ticks.
    Tap(DelayId, NodeId),
    /// What was fed to a delay line so many ticks ago (not whole), by an allpass with
    /// memory of its own.
    Tuned(DelayId, NodeId, TunedId),
    /// What is read of a string, as this tick finds it, so many metres from where it begins.
    Read(StrandId, Reading, NodeId),
    /// What the rate of a string at a place would be without its friction, as the mean of before
    /// and after this tick: the place (m from where the string begins), its four coefficients, and
    /// what pushes it, each with its place.
    Mean(StrandId, Vec<NodeId>),
    /// The sum of the squares of the weights by which a string is read at a place.
    Spread(StrandId, NodeId),
    /// A constant that follows from how many parts a string has.
    Grid(StrandId, GridNumber),
    /// The slip that a friction (its memory) tries while it is solved, between 0 and the slip
    /// without it, which is the operand.
    Trial(CellId, NodeId),
    /// The slip at which a friction is in balance, between 0 and the slip without it.
    Slip(Balance),
    /// `a / b` with 16 significant bits, at most so much either way. Only `simplify` builds it.
    Ratio(NodeId, NodeId, Real),
    /// A curve at a value: a table, or what `simplify` builds.
    Curve(Curve, NodeId),
    /// The derivative of a curve by what it is a function of.
    Incline(Curve, NodeId),
    /// Whether a machine is in a state at the tick's start (bool).
    Is(MachineId, u32),
    /// `c0 + sum c_i * x_i`, with `x_i` in increasing order, no `x_i` a constant or another
    /// `Linear`, no `c_i` zero. Only `simplify` builds it.
    Linear(Real, Vec<(Real, NodeId)>),
    /// `a + b`
    Add(NodeId, NodeId),
    /// `a - b`
    Sub(NodeId, NodeId),
    /// `a * b`
    Mul(NodeId, NodeId),
    /// `a / b`
    Div(NodeId, NodeId),
    /// `-a`
    Neg(NodeId),
    /// The smaller.
    Min(NodeId, NodeId),
    /// The larger.
    Max(NodeId, NodeId),
    /// `|a|`
    Abs(NodeId),
    /// `a ^ (halves / 2)` for halves 2 to 6; `a` must not be negative where halves is odd.
    Power(NodeId, u8),
    /// A function that is no algebra; the operand of a logarithm must be above zero.
    Function(Function, NodeId),
    /// A comparison (bool).
    Compare(Cmp, NodeId, NodeId),
    /// Both (bool).
    And(NodeId, NodeId),
    /// Either (bool).
    Or(NodeId, NodeId),
    /// Not (bool).
    Not(NodeId),
    /// `if c then a else b` over reals.
    Select(NodeId, NodeId, NodeId),
    /// `if c then a else b` over bools (bool).
    SelectBool(NodeId, NodeId, NodeId),
}

/// The graph.
#[derive(Debug, Clone, Default)]
pub struct Dag {
    nodes: IdMap<NodeId, Node>,
    index: HashMap<Node, NodeId>,
}

impl Dag {
    /// The node's number, new or old.
    pub fn add(&mut self, node: Node) -> NodeId {
        if let Some(&id) = self.index.get(&node) {
            return id;
        }
        let id = self.nodes.push(node.clone());
        self.index.insert(node, id);
        id
    }

    /// A real constant.
    pub fn constant(&mut self, value: f64) -> NodeId {
        self.add(Node::Const(Real(if value == 0.0 { 0.0 } else { value })))
    }

    /// The node.
    pub fn get(&self, id: NodeId) -> &Node {
        &self.nodes[id]
    }

    /// All nodes, operands before users.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.nodes.enumerated()
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

impl Balance {
    /// What it is made of.
    fn operands(self) -> [NodeId; 6] {
        let Balance {
            free,
            gain,
            trial,
            law,
            slope,
            last,
        } = self;
        [free, gain, trial, law, slope, last]
    }

    pub(super) fn operands_mut(&mut self) -> [&mut NodeId; 6] {
        let Balance {
            free,
            gain,
            trial,
            law,
            slope,
            last,
        } = self;
        [free, gain, trial, law, slope, last]
    }
}

impl Node {
    /// The operands, in order.
    pub fn operands(&self) -> Vec<NodeId> {
        match self {
            Node::Const(_)
            | Node::Bool(_)
            | Node::Sense(_)
            | Node::Slope(_)
            | Node::Curvature(_)
            | Node::Live(_) => {
                vec![]
            }
            Node::Grid(..) => vec![],
            Node::LiveBool(_) | Node::Keyed(_) | Node::Cell(_) | Node::Noise(_) | Node::Is(..) => {
                vec![]
            }
            Node::Linear(_, terms) => terms.iter().map(|&(_, x)| x).collect(),
            &Node::Neg(a) | &Node::Abs(a) | &Node::Power(a, _) | &Node::Not(a) => vec![a],
            &Node::Function(_, a) | &Node::Tap(_, a) | &Node::Tuned(_, a, _) => vec![a],
            &Node::Read(_, _, place) | &Node::Spread(_, place) => vec![place],
            Node::Mean(_, all) => all.clone(),
            &Node::Add(a, b) | &Node::Sub(a, b) | &Node::Mul(a, b) | &Node::Div(a, b) => vec![a, b],
            &Node::Min(a, b)
            | &Node::Max(a, b)
            | &Node::Compare(_, a, b)
            | &Node::And(a, b)
            | &Node::Or(a, b) => {
                vec![a, b]
            }
            &Node::Select(c, a, b) | &Node::SelectBool(c, a, b) => vec![c, a, b],
            &Node::Trial(_, free) => vec![free],
            &Node::Slip(balance) => balance.operands().to_vec(),
            &Node::Ratio(a, b, _) => vec![a, b],
            Node::Curve(_, x) | Node::Incline(_, x) => vec![*x],
        }
    }

    /// Whether it is made of no other values.
    pub fn is_leaf(&self) -> bool {
        use Node::*;
        match self {
            Const(_) | Bool(_) | Sense(_) | Slope(_) | Curvature(_) | Live(_) => true,
            LiveBool(_) | Keyed(_) | Cell(_) | Noise(_) | Is(..) | Grid(..) => true,
            Linear(_, terms) => terms.is_empty(),
            _ => false,
        }
    }

    /// Whether it is a bool.
    pub fn is_bool(&self) -> bool {
        use Node::*;
        matches!(
            self,
            Bool(_)
                | LiveBool(_)
                | Is(..)
                | Compare(..)
                | And(..)
                | Or(..)
                | Not(_)
                | SelectBool(..)
        )
    }
}
