//! Rewrites a graph bottom up; every rule is a smart constructor of the new graph.

use std::collections::{HashMap, HashSet};

use super::curve::Curved;
use super::keyed::PerKey;
use super::{interval_of, linear::Sum};
use whippen_ids::IdMap;
use whippen_lang::model::dag::Real;
use whippen_lang::model::fold::fold;
use whippen_lang::model::{Cmp, Dag, Interval, Model, Node, NodeId};
use whippen_lang::range::LIMIT;
use whippen_source::Span;

pub(super) struct Rewriter<'a> {
    pub(super) model: &'a Model,
    /// New node of each old one.
    pub(super) map: IdMap<NodeId, Option<NodeId>>,
    /// How often each old node is used by what must be computed.
    uses: IdMap<NodeId, u32>,
    pub(super) dag: Dag,
    pub(super) per_key: PerKey,
    intervals: IdMap<NodeId, Interval>,
    /// Whether a value depends on live parameters and constants alone.
    pub(super) common: IdMap<NodeId, bool>,
    spans: IdMap<NodeId, Option<Span>>,
    within: IdMap<NodeId, Option<u32>>,
    /// Sums of several terms with several users: computed once, not unfolded into their users.
    shared: HashSet<NodeId>,
    /// Of each slip that a friction tries, the old node that solves it.
    solved: HashMap<NodeId, NodeId>,
    /// Laws with curves, and their slopes, by the old node that solves them.
    pub(super) curved: Curved,
    /// The slips of frictions.
    pub(super) slips: Vec<NodeId>,
}

impl<'a> Rewriter<'a> {
    pub fn new(model: &'a Model, roots: Vec<NodeId>, curved: Curved) -> Rewriter<'a> {
        Rewriter {
            model,
            map: IdMap::filled(None, model.dag.len()),
            uses: count_uses(&model.dag, &roots),
            dag: Dag::default(),
            per_key: PerKey::new(&model.keyed),
            intervals: IdMap::new(),
            common: IdMap::new(),
            spans: IdMap::new(),
            within: IdMap::new(),
            shared: HashSet::new(),
            solved: solved(&model.dag),
            curved,
            slips: Vec::new(),
        }
    }

    /// Puts the new graph into a model: its values, those per key among them, where they were
    /// written, and inside which calls.
    pub fn finish_into(self, model: &mut Model) {
        model.dag = self.dag;
        model.keyed = self.per_key.all;
        model.spans = self.spans;
        model.within = self.within;
    }

    /// The new node that computes what old node `id` does. Operands come first, without recursion.
    pub fn node(&mut self, id: NodeId) -> NodeId {
        let mut stack = vec![id];
        while let Some(&top) = stack.last() {
            let operands = match self.model.dag.get(top) {
                // Its law is written for each slip that is tried.
                Node::Slip(balance) => vec![balance.free, balance.gain, balance.last],
                // What nobody tries is the slip that was found.
                Node::Trial(..) => self.solved.get(&top).copied().into_iter().collect(),
                node => node.operands(),
            };
            let open: Vec<NodeId> = operands
                .into_iter()
                .filter(|o| self.map[o].is_none())
                .collect();
            if !open.is_empty() {
                stack.extend(open);
                continue;
            }
            stack.pop();
            if self.map[top].is_none() {
                self.convert(top);
            }
        }
        self.map[id].expect("converted above")
    }

    fn convert(&mut self, old: NodeId) {
        let node = self.model.dag.get(old).clone();
        if self.spans.len() < self.dag.len() {
            self.spans.resize(self.dag.len(), None);
            self.within.resize(self.dag.len(), None);
        }
        let new = match node {
            Node::Slip(balance) => self.balanced(old, balance),
            node => self.rewrite(&node),
        };
        self.mark(old);
        if self.uses[old] > 1 && matches!(self.dag.get(new), Node::Linear(_, t) if t.len() > 1) {
            self.shared.insert(new);
        }
        self.map[old] = Some(new);
    }

    /// Gives the nodes that are new since the last mark the place of an old one.
    pub(super) fn mark(&mut self, old: NodeId) {
        let span = self.model.spans.get(old).copied().flatten();
        let call = self.model.within.get(old).copied().flatten();
        self.spans.resize(self.dag.len(), span);
        self.within.resize(self.dag.len(), call);
    }

    fn rewrite(&mut self, node: &Node) -> NodeId {
        let n = |s: &Self, id: &NodeId| s.map[id].expect("operands come first");
        match node {
            Node::Linear(c0, terms) => {
                let sum = terms.iter().fold(Sum::constant(c0.0), |sum, (c, x)| {
                    let term = self.sum_of(n(self, x)).scaled(c.0);
                    sum.plus(&term)
                });
                self.linear(sum)
            }
            Node::Add(a, b) => self.combine(n(self, a), 1.0, n(self, b)),
            Node::Sub(a, b) => self.combine(n(self, a), -1.0, n(self, b)),
            Node::Neg(a) => {
                let sum = self.sum_of(n(self, a)).scaled(-1.0);
                self.linear(sum)
            }
            Node::Mul(a, b) => self.mul(n(self, a), n(self, b)),
            Node::Div(a, b) => self.div(n(self, a), n(self, b)),
            Node::Min(a, b) => self.min(n(self, a), n(self, b)),
            Node::Max(a, b) => self.max(n(self, a), n(self, b)),
            Node::Abs(a) => self.abs(n(self, a)),
            Node::Power(a, halves) => self.power(n(self, a), *halves),
            Node::Compare(cmp, a, b) => self.compare(*cmp, n(self, a), n(self, b)),
            Node::And(a, b) => self.and(n(self, a), n(self, b)),
            Node::Or(a, b) => {
                let (na, nb) = (self.not(n(self, a)), self.not(n(self, b)));
                let both = self.and(na, nb);
                self.not(both)
            }
            Node::Not(a) => self.not(n(self, a)),
            Node::Select(c, a, b) => self.select(n(self, c), n(self, a), n(self, b)),
            Node::SelectBool(c, a, b) => self.select_bool(n(self, c), n(self, a), n(self, b)),
            Node::Is(m, 0) if self.model.machines[m].states.len() == 2 => {
                let other = self.add(Node::Is(*m, 1));
                self.not(other)
            }
            node => {
                let mut node = node.clone();
                node.map_operands(|operand| n(self, &operand));
                let node = fold(&self.dag, &node).unwrap_or(node);
                self.add(node)
            }
        }
    }

    pub(super) fn add(&mut self, node: Node) -> NodeId {
        let interval = interval_of(self.model, &node, |o| self.intervals[o]);
        let bool = node.is_bool();
        let common = self.is_common(&node);
        if interval.low == interval.high && !matches!(node, Node::Const(_) | Node::Bool(_)) {
            return self.add(if bool {
                Node::Bool(interval.low == 1.0)
            } else {
                Node::Const(Real(interval.low))
            });
        }
        if let Some(keyed) = self.worked_out(&node, interval) {
            return keyed;
        }
        self.add_within(node, interval, common)
    }

    /// A node whose interval is known, and whether it is the same for all keys.
    pub(super) fn add_within(&mut self, node: Node, interval: Interval, common: bool) -> NodeId {
        let id = self.dag.add(node);
        if id == self.intervals.next_id() {
            self.intervals.push(interval);
            self.common.push(common);
        }
        id
    }

    /// Whether it is the same for all keys, and stays so from tick to tick.
    fn is_common(&self, node: &Node) -> bool {
        use Node::{Cell, Curvature, Is, Keyed, Mean, Noise, Read, Sense, Slope, Tap, Tuned};
        let of_key = matches!(
            node,
            Sense(_)
                | Slope(_)
                | Curvature(_)
                | Keyed(_)
                | Cell(_)
                | Is(..)
                | Noise(_)
                | Tap(..)
                | Tuned(..)
                | Read(..)
                | Mean(..)
        );
        !of_key
            && node
                .operands()
                .into_iter()
                .all(|operand| self.common[operand])
    }

    pub(super) fn interval(&self, id: NodeId) -> Interval {
        self.intervals[id]
    }

    pub(super) fn constant_of(&self, id: NodeId) -> Option<f64> {
        match self.dag.get(id) {
            Node::Const(c) => Some(c.0),
            _ => None,
        }
    }

    /// `id` as a sum; a shared sum of several terms stays one value.
    pub(super) fn sum_of(&self, id: NodeId) -> Sum {
        match self.dag.get(id) {
            Node::Const(c) => Sum::constant(c.0),
            Node::Linear(c0, terms) if !self.shared.contains(&id) => {
                terms.iter().fold(Sum::constant(c0.0), |sum, (c, x)| {
                    sum.plus(&self.per_key.sum_of(*x).scaled(c.0))
                })
            }
            _ => self.per_key.sum_of(id),
        }
    }

    pub(super) fn linear(&mut self, sum: Sum) -> NodeId {
        let sum = self.with_keyed_together(sum);
        match sum.single() {
            Some((node, 1.0)) if sum.constant == 0.0 => node,
            None if sum.terms.is_empty() => self.add(Node::Const(Real(sum.constant + 0.0))),
            _ => {
                let terms = sum.terms.into_iter().map(|(x, c)| (Real(c), x)).collect();
                self.add(Node::Linear(Real(sum.constant + 0.0), terms))
            }
        }
    }

    pub(super) fn combine(&mut self, a: NodeId, factor: f64, b: NodeId) -> NodeId {
        let sum = self.sum_of(a).plus(&self.sum_of(b).scaled(factor));
        self.linear(sum)
    }

    /// `c * x` as coefficient and value, where `id` is that.
    pub(super) fn scaled(&self, id: NodeId) -> (f64, NodeId) {
        match self.dag.get(id) {
            Node::Linear(c0, terms) if c0.0 == 0.0 && terms.len() == 1 => {
                (terms[0].0.0, terms[0].1)
            }
            _ => (1.0, id),
        }
    }

    pub(super) fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if let Some((c, x)) = self
            .constant_of(a)
            .map(|c| (c, b))
            .or(self.constant_of(b).map(|c| (c, a)))
        {
            let sum = self.sum_of(x).scaled(c);
            return self.linear(sum);
        }
        let ((ca, a), (cb, b)) = (self.scaled(a), self.scaled(b));
        let mut scale = ca * cb;
        let mut factors = [a, b];
        if let Some(keyed) = factors.iter_mut().find(|id| self.is_keyed(**id)) {
            *keyed = self.linear(self.per_key.sum_of(*keyed).scaled(scale));
            scale = 1.0;
        }
        let [a, b] = factors;
        let product = self.add(Node::Mul(a.min(b), a.max(b)));
        self.linear(Sum::value(product).scaled(scale))
    }

    fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if let Some(c) = self.constant_of(b) {
            let sum = self.sum_of(a).scaled(1.0 / c);
            return self.linear(sum);
        }
        if let Some(reciprocal) = self.keyed_reciprocal(b).or_else(|| self.reciprocal(b)) {
            return self.mul(a, reciprocal);
        }
        if self.common[b] && !self.common[a] {
            // A quotient is dear, and this one is the same for all keys.
            let one = self.add(Node::Const(Real(1.0)));
            let reciprocal = self.div(one, b);
            return self.mul(a, reciprocal);
        }
        let (cb, b) = self.scaled(b);
        let (ca, a) = match self.constant_of(a) {
            // Constants divided by the same share one quotient.
            Some(constant) => (constant, self.add(Node::Const(Real(1.0)))),
            None => self.scaled(a),
        };
        let quotient = self.add(Node::Div(a, b));
        self.linear(Sum::value(quotient).scaled(ca / cb))
    }

    pub(super) fn min(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.interval(a), self.interval(b)) {
            _ if a == b => a,
            (x, y) if x.high <= y.low => a,
            (x, y) if y.high <= x.low => b,
            _ => self
                .limited(a, b, true)
                .unwrap_or_else(|| self.add(Node::Min(a.min(b), a.max(b)))),
        }
    }

    pub(super) fn max(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.interval(a), self.interval(b)) {
            _ if a == b => a,
            (x, y) if x.low >= y.high => a,
            (x, y) if y.low >= x.high => b,
            _ => self
                .limited(a, b, false)
                .unwrap_or_else(|| self.add(Node::Max(a.min(b), a.max(b)))),
        }
    }

    fn abs(&mut self, a: NodeId) -> NodeId {
        match self.interval(a) {
            i if i.low >= 0.0 => a,
            i if i.high <= 0.0 => {
                let sum = self.sum_of(a).scaled(-1.0);
                self.linear(sum)
            }
            _ => self.add(Node::Abs(a)),
        }
    }

    fn power(&mut self, a: NodeId, halves: u8) -> NodeId {
        match halves {
            2 => a,
            4 => self.mul(a, a),
            6 => {
                let square = self.mul(a, a);
                self.mul(square, a)
            }
            _ => self.add(Node::Power(a, halves)),
        }
    }

    /// Moves scale and offset of single values to the constant side.
    fn compare(&mut self, cmp: Cmp, a: NodeId, b: NodeId) -> NodeId {
        let difference = self.sum_of(a).plus(&self.sum_of(b).scaled(-1.0));
        let Some((x, c)) = difference.single() else {
            return self.add(Node::Compare(cmp, a, b));
        };
        if difference.constant == 0.0
            && let Some(factor) = self.sign_of(x)
        {
            let zero = self.add(Node::Const(Real(0.0)));
            let cmp = if c > 0.0 { cmp } else { flipped(cmp) };
            return self.compare(cmp, factor, zero);
        }
        let threshold = -difference.constant / c + 0.0;
        // No value reaches so far: as it stands it is decided by ranges.
        if threshold.abs() > LIMIT {
            return self.add(Node::Compare(cmp, a, b));
        }
        let threshold = self.add(Node::Const(Real(threshold)));
        let cmp = if c > 0.0 { cmp } else { flipped(cmp) };
        self.add(Node::Compare(cmp, x, threshold))
    }

    /// The factor that has the sign of a product, where the other is above zero.
    fn sign_of(&self, product: NodeId) -> Option<NodeId> {
        let Node::Mul(a, b) = *self.dag.get(product) else {
            return None;
        };
        let is_positive = |factor: &NodeId| self.interval(*factor).low > 0.0;
        match (is_positive(&a), is_positive(&b)) {
            (true, _) => Some(b),
            (_, true) => Some(a),
            _ => None,
        }
    }

    fn not(&mut self, a: NodeId) -> NodeId {
        match *self.dag.get(a) {
            Node::Not(inner) => inner,
            _ => self.add(Node::Not(a)),
        }
    }

    fn and(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let is = |s: &Self, id, value| *s.dag.get(id) == Node::Bool(value);
        if a == b || is(self, b, true) || is(self, a, false) {
            return a;
        }
        if is(self, a, true) || is(self, b, false) {
            return b;
        }
        self.add(Node::And(a.min(b), a.max(b)))
    }

    fn select(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        match *self.dag.get(c) {
            _ if a == b => a,
            Node::Bool(value) => [b, a][usize::from(value)],
            Node::Not(inner) => self.select(inner, b, a),
            _ => self.chosen(c, a, b),
        }
    }

    /// `(c and a) or (not c and b)`
    fn select_bool(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        let not_c = self.not(c);
        let (first, second) = (self.and(c, a), self.and(not_c, b));
        let (nf, ns) = (self.not(first), self.not(second));
        let neither = self.and(nf, ns);
        self.not(neither)
    }
}

fn flipped(cmp: Cmp) -> Cmp {
    match cmp {
        Cmp::Lt => Cmp::Gt,
        Cmp::Le => Cmp::Ge,
        Cmp::Gt => Cmp::Lt,
        Cmp::Ge => Cmp::Le,
    }
}

/// The slips of frictions, by the slips that they try.
fn solved(dag: &Dag) -> HashMap<NodeId, NodeId> {
    let slip = |(id, node): (NodeId, &Node)| match node {
        Node::Slip(balance) => Some((balance.trial, id)),
        _ => None,
    };
    dag.nodes().filter_map(slip).collect()
}

/// Uses of every node by what is reachable from `roots`.
fn count_uses(dag: &Dag, roots: &[NodeId]) -> IdMap<NodeId, u32> {
    let mut uses = IdMap::filled(0, dag.len());
    let mut stack = roots.to_vec();
    while let Some(id) = stack.pop() {
        uses[id] += 1;
        if uses[id] == 1 {
            stack.extend(dag.get(id).operands());
        }
    }
    uses
}
