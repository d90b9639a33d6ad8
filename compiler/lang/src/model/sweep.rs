//! Which nodes are needed: everything below a node, and a Model without the nodes that nothing
//! uses.

use super::{Action, Dag, Model, Node, NodeId};
use whippen_ids::{Id, IdMap};

impl Dag {
    /// A node and everything below it, operands before users.
    pub fn below(&self, root: NodeId) -> Vec<NodeId> {
        let mut needed = IdMap::filled(false, root.index() + 1);
        needed[root] = true;
        self.mark_operands(&mut needed);
        needed.ids().filter(|id| needed[id]).collect()
    }

    fn mark_operands(&self, needed: &mut IdMap<NodeId, bool>) {
        for user in needed.ids().rev() {
            if needed[user] {
                self.get(user)
                    .operands()
                    .iter()
                    .for_each(|id| needed[id] = true);
            }
        }
    }
}

impl Node {
    /// Replaces every operand.
    pub fn map_operands(&mut self, mut f: impl FnMut(NodeId) -> NodeId) {
        let mut change = |id: &mut NodeId| *id = f(*id);
        match self {
            Node::Const(_)
            | Node::Bool(_)
            | Node::Sense(_)
            | Node::Slope(_)
            | Node::Curvature(_) => {}
            Node::Live(_)
            | Node::LiveBool(_)
            | Node::Keyed(_)
            | Node::Cell(_)
            | Node::Noise(_)
            | Node::Grid(..)
            | Node::Is(..) => {}
            Node::Linear(_, terms) => terms.iter_mut().for_each(|(_, x)| change(x)),
            Node::Neg(a) | Node::Abs(a) | Node::Power(a, _) | Node::Not(a) => change(a),
            Node::Function(_, a) | Node::Tap(_, a) | Node::Tuned(_, a, _) => change(a),
            Node::Read(_, _, place) | Node::Spread(_, place) => change(place),
            Node::Mean(_, all) => all.iter_mut().for_each(change),
            Node::Add(a, b)
            | Node::Sub(a, b)
            | Node::Mul(a, b)
            | Node::Div(a, b)
            | Node::Min(a, b) => {
                change(a);
                change(b);
            }
            Node::Max(a, b) | Node::Compare(_, a, b) | Node::And(a, b) | Node::Or(a, b) => {
                change(a);
                change(b);
            }
            Node::Select(c, a, b) | Node::SelectBool(c, a, b) => {
                change(c);
                change(a);
                change(b);
            }
            Node::Trial(_, free) => change(free),
            Node::Ratio(a, b, _) => {
                change(a);
                change(b);
            }
            Node::Curve(_, x) | Node::Incline(_, x) => change(x),
            Node::Slip(balance) => balance.operands_mut().into_iter().for_each(change),
        }
    }
}

impl Model {
    /// Every place where the Model names a node, in a fixed order.
    pub fn roots_mut(&mut self) -> Vec<&mut NodeId> {
        let mut roots: Vec<&mut NodeId> = Vec::new();
        for body in &mut self.bodies {
            roots.push(&mut body.acceleration);
            roots.extend(body.hold.as_mut());
            roots.extend(body.friction.as_mut().map(|friction| &mut friction.taken));
        }
        for strand in &mut self.strands {
            roots.push(&mut strand.density);
            roots.extend(&mut strand.loads);
            roots.extend(&mut strand.coefficients);
            for push in &mut strand.pushes {
                roots.extend([&mut push.change, &mut push.place]);
            }
            if let Some(rub) = &mut strand.friction {
                roots.extend([&mut rub.push.change, &mut rub.push.place]);
            }
            roots.extend(strand.pitch.as_mut());
            roots.extend(strand.hold.as_mut());
        }
        roots.extend(self.delays.iter_mut().map(|delay| &mut delay.feed));
        roots.extend(self.sounds.iter_mut().map(|sound| &mut sound.value));
        roots.extend(&mut self.channels);
        roots.extend(self.nexts.iter_mut().map(|(_, value)| value));
        for rule in &mut self.rules {
            roots.push(&mut rule.guard);
            for action in &mut rule.actions {
                match action {
                    Action::Write { value, .. } | Action::Fire { value, .. } => roots.push(value),
                    Action::Emit { args, .. } => roots.extend(args),
                }
            }
        }
        roots.extend(self.forces.iter_mut().map(|force| &mut force.value));
        roots.extend(self.named.iter_mut().map(|named| &mut named.value));
        roots
    }

    /// Takes away the nodes that nothing uses; the others keep their order and their places.
    pub fn sweep(&mut self) {
        let mut needed = IdMap::filled(false, self.dag.len());
        self.roots_mut()
            .iter()
            .for_each(|root| needed[**root] = true);
        self.dag.mark_operands(&mut needed);
        let old = std::mem::take(&mut self.dag);
        let spans = std::mem::take(&mut self.spans);
        let within = std::mem::take(&mut self.within);
        let mut renamed = IdMap::filled(NodeId(0), old.len());
        for (id, node) in old.nodes().filter(|(id, _)| needed[id]) {
            let mut node = node.clone();
            node.map_operands(|operand| renamed[operand]);
            renamed[id] = self.dag.add(node);
            self.spans.push(spans.get(id).copied().flatten());
            self.within.push(within.get(id).copied().flatten());
        }
        self.roots_mut()
            .into_iter()
            .for_each(|root| *root = renamed[*root]);
    }
}
