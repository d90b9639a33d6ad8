//! Derivatives by the chain rule: primes, which are by time, and the slope of a friction's law,
//! which is by the slip that is tried.
//!
//! ```text
//!   sense  -> slope -> curvature -> (no third)       min(a, b) -> if a <= b then a' else b'
//!   coordinate -> rate -> (none)                     if mode then a else b -> if mode then a' else b'
//!   parameters -> 0                                  if x > 3 mm then a else b -> (none)
//! ```
//!
//! The graph below the value is walked once, operands before users, so the depth of an expression
//! does not matter. Every node that has no prime is reported, as a value: the checker knows where
//! it stands in the source.

use std::collections::{HashMap, HashSet};

use super::{Body, Cell, CellId, CellKind, Cmp, Dag, Function, Node, NodeId, Reading};
use whippen_ids::{Id, IdMap};

/// A derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Prime {
    /// Its value.
    pub value: NodeId,
    /// Choices by mode whose branches are not provably equal: the jump between them is not motion
    /// and is left out.
    pub jumps: Vec<NodeId>,
}

/// Why a node has no derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoPrimeKind {
    /// The rate of a body: it changes by blows, which have no derivative.
    Rate,
    /// A `state`, which changes in steps.
    State,
    /// A pulse, which changes in steps.
    Pulse,
    /// The second derivative of a sensed value: the differentiators end there.
    Third,
    /// A choice whose condition compares values.
    Comparison,
    /// A live parameter that glides.
    Glide,
    /// Noise.
    Noise,
    /// What is read from a delay line.
    Delay,
    /// The slope of a table.
    Table,
    /// A rate or a slope of a string.
    String,
    /// A friction, or its slip.
    Friction,
    /// A bool.
    Bool,
}

/// A node without a derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoPrime {
    /// Why.
    pub kind: NoPrimeKind,
    /// The node; for [`NoPrimeKind::Comparison`] the choice.
    pub node: NodeId,
}

/// The time derivative of `root`.
///
/// # Errors
/// All nodes below `root` whose derivative is needed and does not exist.
pub fn prime(
    dag: &mut Dag,
    cells: &IdMap<CellId, Cell>,
    bodies: &[Body],
    root: NodeId,
) -> Result<Prime, Vec<NoPrime>> {
    let moving = reach(dag, root);
    let rates = bodies.iter().map(|b| (b.coordinate, b.rate)).collect();
    let by = By::Time { cells, rates };
    let mut pass = PrimePass::new(dag, by);
    for id in moving {
        pass.enter(id);
    }
    pass.finish(root)
}

/// The derivative of `root` by the slip that is tried, which is `trial`; what does not depend on
/// it is constant.
///
/// # Errors
/// Choices that ask for the slip: they have no derivative.
pub fn slope(dag: &mut Dag, trial: NodeId, root: NodeId) -> Result<NodeId, Vec<NoPrime>> {
    let order = dag.between(trial, root);
    let moving = order.iter().copied().collect();
    let mut pass = PrimePass::new(dag, By::Trial { trial, moving });
    for id in order {
        pass.enter(id);
    }
    pass.finish(root).map(|derivative| derivative.value)
}

impl Dag {
    /// What `from` is needed for below `root`, both included, operands before users.
    pub fn between(&self, from: NodeId, root: NodeId) -> Vec<NodeId> {
        let mut depends = IdMap::filled(false, self.len());
        let mut found = Vec::new();
        for id in self.below(root) {
            let operands = self.get(id).operands();
            depends[id] = id == from || operands.iter().any(|operand| depends[operand]);
            found.extend(depends[id].then_some(id));
        }
        found
    }
}

/// What a derivative is taken by.
enum By<'d> {
    /// Time: memory and what rates it has.
    Time {
        cells: &'d IdMap<CellId, Cell>,
        rates: HashMap<CellId, CellId>,
    },
    /// The slip that a friction tries, and all that depends on it.
    Trial {
        trial: NodeId,
        moving: HashSet<NodeId>,
    },
}

/// The nodes whose derivative is needed, operands before users.
fn reach(dag: &Dag, root: NodeId) -> Vec<NodeId> {
    let mut needed = IdMap::filled(false, root.index() + 1);
    needed[root] = true;
    for user in needed.ids().rev() {
        let node = dag.get(user);
        if needed[user] && !node.is_bool() {
            node.operands()
                .iter()
                .filter(|id| !dag.get(**id).is_bool())
                .for_each(|id| needed[id] = true);
        }
    }
    needed.ids().filter(|id| needed[id]).collect()
}

struct PrimePass<'d> {
    dag: &'d mut Dag,
    by: By<'d>,
    zero: NodeId,
    done: HashMap<NodeId, NodeId>,
    jumps: Vec<NodeId>,
    errors: Vec<NoPrime>,
}

impl<'d> PrimePass<'d> {
    fn new(dag: &'d mut Dag, by: By<'d>) -> PrimePass<'d> {
        let zero = dag.constant(0.0);
        PrimePass {
            dag,
            by,
            zero,
            done: HashMap::new(),
            jumps: Vec::new(),
            errors: Vec::new(),
        }
    }

    fn enter(&mut self, id: NodeId) {
        if let Some(value) = self.node(id) {
            self.done.insert(id, value);
        }
    }

    fn finish(self, root: NodeId) -> Result<Prime, Vec<NoPrime>> {
        match self.of(root) {
            Some(value) if self.errors.is_empty() => Ok(Prime {
                value,
                jumps: self.jumps,
            }),
            _ => Err(self.errors),
        }
    }

    /// The derivative of one node; `None` if it or an operand has none.
    fn node(&mut self, id: NodeId) -> Option<NodeId> {
        let node = self.dag.get(id).clone();
        match (&self.by, node) {
            (By::Trial { trial, .. }, _) if id == *trial => Some(self.dag.constant(1.0)),
            (By::Trial { .. }, node) if node.is_bool() => None,
            (By::Time { .. }, node) if node.is_bool() => self.fail(NoPrimeKind::Bool, id),
            (_, node) => self.derived(id, node),
        }
    }

    fn derived(&mut self, id: NodeId, node: Node) -> Option<NodeId> {
        match node {
            Node::Const(_) | Node::Live(_) | Node::Keyed(_) | Node::Grid(..) => Some(self.zero),
            Node::Read(strand, Reading::Displacement, place) => {
                Some(self.dag.add(Node::Read(strand, Reading::Rate, place)))
            }
            Node::Mean(..) | Node::Spread(..) => self.fail(NoPrimeKind::Friction, id),
            Node::Read(..) => self.fail(NoPrimeKind::String, id),
            Node::Sense(s) => Some(self.dag.add(Node::Slope(s))),
            Node::Slope(s) => Some(self.dag.add(Node::Curvature(s))),
            Node::Curvature(_) => self.fail(NoPrimeKind::Third, id),
            Node::Trial(..) | Node::Slip(_) => self.fail(NoPrimeKind::Friction, id),
            Node::Cell(cell) => self.cell(cell, id),
            Node::Noise(_) => self.fail(NoPrimeKind::Noise, id),
            Node::Tap(..) | Node::Tuned(..) => self.fail(NoPrimeKind::Delay, id),
            Node::Neg(a) => {
                let a = self.of(a)?;
                Some(self.neg(a))
            }
            Node::Add(a, b) => {
                let (a, b) = (self.of(a)?, self.of(b)?);
                Some(self.add(a, b))
            }
            Node::Sub(a, b) => {
                let (a, b) = (self.of(a)?, self.of(b)?);
                Some(self.sub(a, b))
            }
            Node::Mul(a, b) => self.product(a, b),
            Node::Div(a, b) => self.quotient(id, a, b),
            Node::Power(a, 1) => self.root(id, a),
            Node::Power(a, halves) => self.power(a, halves),
            Node::Function(function, a) => self.function(id, function, a),
            Node::Curve(curve, x) => {
                let dx = self.of(x)?;
                let slope = self.dag.add_folded(Node::Incline(curve, x));
                Some(self.mul(slope, dx))
            }
            Node::Incline(..) => self.fail(NoPrimeKind::Table, id),
            Node::Linear(_, terms) => self.linear(&terms),
            Node::Min(a, b) => self.branch_taken(Cmp::Le, a, b),
            Node::Max(a, b) => self.branch_taken(Cmp::Ge, a, b),
            Node::Abs(a) => self.abs(a),
            Node::Select(c, a, b) => self.select(id, c, a, b),
            _ => None,
        }
    }

    /// The derivative of an operand; zero of what a slip that is tried has nothing to do with.
    fn of(&self, id: NodeId) -> Option<NodeId> {
        match &self.by {
            By::Trial { moving, .. } if !moving.contains(&id) => Some(self.zero),
            _ => self.done.get(&id).copied(),
        }
    }

    fn fail(&mut self, kind: NoPrimeKind, node: NodeId) -> Option<NodeId> {
        self.errors.push(NoPrime { kind, node });
        None
    }

    fn cell(&mut self, cell: CellId, id: NodeId) -> Option<NodeId> {
        let By::Time { cells, rates } = &self.by else {
            return Some(self.zero);
        };
        match (rates.get(&cell), cells.get(cell).map(|c| c.kind)) {
            (Some(&rate), _) => Some(self.dag.add(Node::Cell(rate))),
            (None, Some(CellKind::Rate)) => self.fail(NoPrimeKind::Rate, id),
            (None, Some(CellKind::Pulse)) => self.fail(NoPrimeKind::Pulse, id),
            (None, Some(CellKind::Glide)) => self.fail(NoPrimeKind::Glide, id),
            _ => self.fail(NoPrimeKind::State, id),
        }
    }

    /// `a' b + a b'`
    fn product(&mut self, a: NodeId, b: NodeId) -> Option<NodeId> {
        let (da, db) = (self.of(a)?, self.of(b)?);
        let left = self.mul(da, b);
        let right = self.mul(a, db);
        Some(self.add(left, right))
    }

    /// `(a' - (a / b) b') / b`, which uses the quotient that is there already.
    fn quotient(&mut self, id: NodeId, a: NodeId, b: NodeId) -> Option<NodeId> {
        let (da, db) = (self.of(a)?, self.of(b)?);
        let carried = self.mul(id, db);
        let top = self.sub(da, carried);
        Some(if top == self.zero {
            top
        } else {
            self.dag.add_folded(Node::Div(top, b))
        })
    }

    /// `a' / (2 sqrt(a))`, which the ranges refuse where the operand may be zero.
    fn root(&mut self, id: NodeId, a: NodeId) -> Option<NodeId> {
        let da = self.of(a)?;
        let two = self.dag.constant(2.0);
        let twice = self.mul(two, id);
        Some(if da == self.zero {
            da
        } else {
            self.dag.add_folded(Node::Div(da, twice))
        })
    }

    /// The slope of the function times `a'`, made of what is there already where that can be.
    fn function(&mut self, id: NodeId, function: Function, a: NodeId) -> Option<NodeId> {
        let da = self.of(a)?;
        if da == self.zero {
            return Some(da);
        }
        let slope = match function {
            Function::Exp => id,
            Function::Log => return Some(self.dag.add_folded(Node::Div(da, a))),
            Function::Sin => self.dag.add_folded(Node::Function(Function::Cos, a)),
            Function::Cos => {
                let sine = self.dag.add_folded(Node::Function(Function::Sin, a));
                self.neg(sine)
            }
            Function::Tanh => {
                let (one, square) = (self.dag.constant(1.0), self.mul(id, id));
                self.sub(one, square)
            }
        };
        Some(self.mul(slope, da))
    }

    /// `n a^(n-1) a'` with `n` in halves.
    fn power(&mut self, a: NodeId, halves: u8) -> Option<NodeId> {
        let da = self.of(a)?;
        let lower = match halves {
            _ if da == self.zero => return Some(da),
            0..=2 => return Some(da),
            4 => a,
            _ => self.dag.add_folded(Node::Power(a, halves - 2)),
        };
        let n = self.dag.constant(f64::from(halves) / 2.0);
        let slope = self.mul(n, lower);
        Some(self.mul(slope, da))
    }

    fn linear(&mut self, terms: &[(super::dag::Real, NodeId)]) -> Option<NodeId> {
        let mut sum = self.zero;
        for &(factor, x) in terms {
            let (factor, dx) = (self.dag.constant(factor.0), self.of(x)?);
            let term = self.mul(factor, dx);
            sum = self.add(sum, term);
        }
        Some(sum)
    }

    /// `min` and `max`: the derivative of the one that wins; the first of equals.
    fn branch_taken(&mut self, cmp: Cmp, a: NodeId, b: NodeId) -> Option<NodeId> {
        let (da, db) = (self.of(a)?, self.of(b)?);
        let first = self.dag.add_folded(Node::Compare(cmp, a, b));
        Some(self.choose(first, da, db))
    }

    /// `if a < 0 then -a' else a'`
    fn abs(&mut self, a: NodeId) -> Option<NodeId> {
        let da = self.of(a)?;
        let negative = self.dag.add_folded(Node::Compare(Cmp::Lt, a, self.zero));
        let minus = self.neg(da);
        Some(self.choose(negative, minus, da))
    }

    fn select(&mut self, id: NodeId, c: NodeId, a: NodeId, b: NodeId) -> Option<NodeId> {
        let is_decided = match &self.by {
            By::Time { .. } => asks_modes_only(self.dag, c),
            By::Trial { moving, .. } => !moving.contains(&c),
        };
        if !is_decided {
            return self.fail(NoPrimeKind::Comparison, id);
        }
        if a != b && self.dag.bool(c).is_none() {
            self.jumps.push(id);
        }
        let (da, db) = (self.of(a)?, self.of(b)?);
        Some(self.choose(c, da, db))
    }

    fn choose(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            a
        } else {
            self.dag.add_folded(Node::Select(c, a, b))
        }
    }

    fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (a == self.zero, b == self.zero) {
            (true, _) => b,
            (_, true) => a,
            _ => self.dag.add_folded(Node::Add(a, b)),
        }
    }

    fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (a == self.zero, b == self.zero) {
            (_, true) => a,
            (true, _) => self.neg(b),
            _ => self.dag.add_folded(Node::Sub(a, b)),
        }
    }

    fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == self.zero || b == self.zero {
            return self.zero;
        }
        match (self.dag.real(a), self.dag.real(b)) {
            (Some(1.0), _) => b,
            (_, Some(1.0)) => a,
            _ => self.dag.add_folded(Node::Mul(a, b)),
        }
    }

    fn neg(&mut self, a: NodeId) -> NodeId {
        if a == self.zero {
            a
        } else {
            self.dag.add_folded(Node::Neg(a))
        }
    }
}

/// Whether a bool is made of machine states, live bools and constants only.
pub fn asks_modes_only(dag: &Dag, condition: NodeId) -> bool {
    let mut waiting = vec![condition];
    let mut seen = std::collections::HashSet::new();
    while let Some(id) = waiting.pop() {
        if !seen.insert(id) {
            continue;
        }
        match dag.get(id) {
            Node::Compare(..) => return false,
            node => waiting.extend(node.operands()),
        }
    }
    true
}

#[cfg(test)]
mod tests;
