//! Narrowing intervals until they agree with each other, or cannot.

use super::{Facts, asked_state};
use crate::model::{Cmp, Function, Interval, Model, Node, NodeId};
use crate::range::transfer;
use whippen_ids::IdMap;

/// So often the graph is walked, down and up.
pub(crate) const ROUNDS_MAX: usize = 6;

/// The intervals in which all facts can hold; `None` if there are none. `nodes` are those to look
/// at, operands first.
pub fn narrow(
    model: &Model,
    nodes: &[NodeId],
    facts: &Facts,
    start: IdMap<NodeId, Interval>,
) -> Option<IdMap<NodeId, Interval>> {
    let mut pass = NarrowingPass {
        model,
        at: start,
        changed: false,
    };
    for &id in nodes {
        if let Some(asked) = asked_state(facts, model.dag.get(id)) {
            pass.keep(id, asked)?;
        }
    }
    for &fact in &facts.holds {
        pass.decide(fact, true)?;
    }
    for &fact in &facts.fails {
        pass.decide(fact, false)?;
    }
    for _ in 0..ROUNDS_MAX {
        pass.changed = false;
        for &id in nodes.iter().rev() {
            pass.down(id)?;
        }
        for &id in nodes {
            pass.up(id)?;
        }
        pass.machines(nodes)?;
        if !pass.changed {
            break;
        }
    }
    Some(pass.at)
}

struct NarrowingPass<'m> {
    model: &'m Model,
    at: IdMap<NodeId, Interval>,
    changed: bool,
}

impl NarrowingPass<'_> {
    fn of(&self, id: NodeId) -> Interval {
        self.at[id]
    }

    /// Cuts a node's interval down; `None` if nothing is left.
    fn keep(&mut self, id: NodeId, other: Interval) -> Option<()> {
        let own = self.of(id);
        let cut = Interval {
            low: own.low.max(other.low),
            high: own.high.min(other.high),
        };
        if cut.low > cut.high {
            return None;
        }
        if cut != own {
            self.at[id] = cut;
            self.changed = true;
        }
        Some(())
    }

    fn below(&mut self, id: NodeId, high: f64) -> Option<()> {
        self.keep(
            id,
            Interval {
                low: f64::NEG_INFINITY,
                high,
            },
        )
    }

    fn above(&mut self, id: NodeId, low: f64) -> Option<()> {
        self.keep(
            id,
            Interval {
                low,
                high: f64::INFINITY,
            },
        )
    }

    fn decide(&mut self, id: NodeId, value: bool) -> Option<()> {
        self.keep(id, Interval::point(f64::from(value)))
    }

    fn decided(&self, id: NodeId) -> Option<bool> {
        let own = self.of(id);
        (own.low == own.high).then_some(own.low == 1.0)
    }

    /// From operands to the node.
    fn up(&mut self, id: NodeId) -> Option<()> {
        let node = self.model.dag.get(id);
        if node.is_leaf() {
            return Some(());
        }
        match transfer(self.model, node, |o| self.of(o)) {
            Ok(interval) => self.keep(id, interval),
            Err(_) => Some(()),
        }
    }

    /// From the node to its operands.
    fn down(&mut self, id: NodeId) -> Option<()> {
        let out = self.of(id);
        match self.model.dag.get(id) {
            &Node::Add(a, b) => self
                .keep(a, out - self.of(b))
                .and_then(|()| self.keep(b, out - self.of(a))),
            &Node::Sub(a, b) => self
                .keep(a, out + self.of(b))
                .and_then(|()| self.keep(b, self.of(a) - out)),
            &Node::Neg(a) => self.keep(a, -out),
            &Node::Mul(a, b) => self.factor(a, b, out).and_then(|()| self.factor(b, a, out)),
            &Node::Div(a, b) => self.keep(a, out * self.of(b)),
            &Node::Abs(a) => self.keep(
                a,
                Interval {
                    low: -out.high,
                    high: out.high,
                },
            ),
            &Node::Function(Function::Exp, a) if out.low > 0.0 => {
                let log = Function::Log.interval(out).unwrap_or(self.of(a));
                self.keep(a, log)
            }
            &Node::Min(a, b) => self
                .smaller(a, b, out)
                .and_then(|()| self.smaller(b, a, out)),
            &Node::Max(a, b) => self.larger(a, b, out).and_then(|()| self.larger(b, a, out)),
            &Node::Select(c, a, b) | &Node::SelectBool(c, a, b) => self.choice((c, a, b), out),
            &Node::Compare(cmp, a, b) => match self.decided(id) {
                Some(holds) => self.compared(cmp, holds, a, b),
                None => Some(()),
            },
            &Node::And(a, b) => self.both(id, a, b, true),
            &Node::Or(a, b) => self.both(id, a, b, false),
            &Node::Not(a) => self.decided(id).map_or(Some(()), |v| self.decide(a, !v)),
            _ => Some(()),
        }
    }

    fn factor(&mut self, a: NodeId, b: NodeId, product: Interval) -> Option<()> {
        product
            .quotient(self.of(b))
            .map_or(Some(()), |q| self.keep(a, q))
    }

    /// `out = min(a, b)`, seen from `a`.
    fn smaller(&mut self, a: NodeId, b: NodeId, out: Interval) -> Option<()> {
        self.above(a, out.low)?;
        if self.of(b).low > out.high {
            self.below(a, out.high)
        } else {
            Some(())
        }
    }

    /// `out = max(a, b)`, seen from `a`.
    fn larger(&mut self, a: NodeId, b: NodeId, out: Interval) -> Option<()> {
        self.below(a, out.high)?;
        if self.of(b).high < out.low {
            self.above(a, out.low)
        } else {
            Some(())
        }
    }

    fn choice(&mut self, (c, a, b): (NodeId, NodeId, NodeId), out: Interval) -> Option<()> {
        let apart = |x: Interval| x.low > out.high || x.high < out.low;
        if apart(self.of(a)) {
            self.decide(c, false)?;
        }
        if apart(self.of(b)) {
            self.decide(c, true)?;
        }
        match self.decided(c) {
            Some(true) => self.keep(a, out),
            Some(false) => self.keep(b, out),
            None => Some(()),
        }
    }

    /// Whether `a` and `b` lie on the right sides of each other; strictness is judged on the way
    /// up.
    fn compared(&mut self, cmp: Cmp, holds: bool, a: NodeId, b: NodeId) -> Option<()> {
        let less = matches!(cmp, Cmp::Lt | Cmp::Le) == holds;
        let (small, large) = if less { (a, b) } else { (b, a) };
        self.below(small, self.of(large).high)?;
        self.above(large, self.of(small).low)
    }

    /// `and`, where `all` is true, else `or`.
    fn both(&mut self, id: NodeId, a: NodeId, b: NodeId, all: bool) -> Option<()> {
        match self.decided(id) {
            Some(value) if value == all => self.decide(a, all).and_then(|()| self.decide(b, all)),
            Some(_) if self.decided(a) == Some(all) => self.decide(b, !all),
            Some(_) if self.decided(b) == Some(all) => self.decide(a, !all),
            _ => Some(()),
        }
    }

    /// A machine that is in one state is in no other.
    fn machines(&mut self, nodes: &[NodeId]) -> Option<()> {
        let is = |&id: &NodeId| match self.model.dag.get(id) {
            &Node::Is(machine, state) => Some((id, machine, state)),
            _ => None,
        };
        let asked: Vec<_> = nodes.iter().filter_map(is).collect();
        let held: Vec<_> = asked
            .iter()
            .filter(|(id, ..)| self.decided(*id) == Some(true))
            .copied()
            .collect();
        for (_, machine, state) in held {
            for &(other, ..) in asked
                .iter()
                .filter(|(_, m, s)| *m == machine && *s != state)
            {
                self.decide(other, false)?;
            }
        }
        Some(())
    }
}
