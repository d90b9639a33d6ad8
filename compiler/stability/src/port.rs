//! One port of an instrument with several, as an instrument by itself.
//!
//! The other ports stand still, anywhere that they may be: what they sense becomes a parameter that
//! is turned while playing, and their speeds are 0. So the loop of each port is judged for all
//! places of the others; what goes from a port to another and back is not.

use std::collections::HashSet;

use whippen_ids::IdMap;
use whippen_lang::model::{Action, CellId, Live, MachineId, Model, Node, NodeId, RuleKind};

/// The loop of one port (its number among the senses): its sense, and the forces that act on it.
pub fn of_port(model: &Model, port: usize) -> Model {
    let mut own = model.clone();
    if model.senses.len() < 2 {
        return own;
    }
    own.forces.retain(|force| force.port == port);
    own.forces.iter_mut().for_each(|force| force.port = 0);
    own.senses = vec![model.senses[port].clone()];
    // Nothing that is only heard or shown.
    own.sounds.clear();
    own.channels.clear();
    own.named.clear();
    let first = own.lives.len() as u32;
    own.lives.extend(model.senses.iter().map(|sense| Live {
        name: sense.name.clone(),
        dim: Some(sense.dim),
        unit: sense.unit.to_string(),
        value: 0.5 * (sense.range.low + sense.range.high),
        range: sense.range,
        span: sense.span,
    }));
    let old = std::mem::take(&mut own.dag);
    // Nodes become fewer, and nobody asks where they stand.
    (own.spans, own.within) = (IdMap::default(), IdMap::default());
    let mut renamed = IdMap::filled(NodeId(0), old.len());
    for (id, node) in old.nodes() {
        let is_own = |sense: &u32| *sense as usize == port;
        let mut node = match node {
            Node::Sense(sense) if is_own(sense) => Node::Sense(0),
            Node::Slope(sense) if is_own(sense) => Node::Slope(0),
            Node::Curvature(sense) if is_own(sense) => Node::Curvature(0),
            Node::Sense(sense) => Node::Live(first + sense),
            Node::Slope(_) | Node::Curvature(_) => {
                renamed[id] = own.dag.constant(0.0);
                continue;
            }
            other => other.clone(),
        };
        node.map_operands(|operand| renamed[operand]);
        renamed[id] = own.dag.add(node);
    }
    let roots = own.roots_mut().into_iter();
    roots.for_each(|root| *root = renamed[*root]);
    own.sweep();
    drop_unfelt(&mut own);
    own
}

/// Takes away what no force feels, so that who runs the program there runs little.
fn drop_unfelt(model: &mut Model) {
    let mut roots: Vec<NodeId> = model.forces.iter().map(|force| force.value).collect();
    let mut needed = IdMap::filled(false, model.dag.len());
    let mut felt = Felt::default();
    loop {
        for node in roots.drain(..).flat_map(|root| model.dag.below(root)) {
            needed[node] = true;
        }
        for (_, node) in model.dag.nodes().filter(|(id, _)| needed[id]) {
            felt.add(node);
        }
        let mut next = model.clone();
        felt.keep(&mut next);
        roots = next.roots_mut().into_iter().map(|root| *root).collect();
        roots.retain(|root| !needed[root]);
        if roots.is_empty() {
            *model = next;
            return model.sweep();
        }
    }
}

/// What forces feel.
#[derive(Default)]
struct Felt {
    cells: HashSet<CellId>,
    machines: HashSet<MachineId>,
    strands: bool,
    delays: bool,
}

impl Felt {
    fn add(&mut self, node: &Node) {
        match node {
            Node::Cell(cell) | Node::Trial(cell, _) => drop(self.cells.insert(*cell)),
            Node::Is(machine, _) => drop(self.machines.insert(*machine)),
            Node::Read(..) | Node::Mean(..) | Node::Spread(..) | Node::Grid(..) => {
                self.strands = true;
            }
            Node::Tap(..) | Node::Tuned(..) => self.delays = true,
            _ => {}
        }
    }

    /// Keeps of a Model what moves what is felt.
    fn keep(&self, model: &mut Model) {
        let felt = |cell: &CellId| self.cells.contains(cell);
        model
            .bodies
            .retain(|body| felt(&body.coordinate) || felt(&body.rate));
        model.nexts.retain(|(cell, _)| felt(cell));
        let pulses = &model.pulses;
        for rule in &mut model.rules {
            rule.actions.retain(|action| match action {
                Action::Write { cell, .. } => felt(cell),
                Action::Fire { pulse, .. } => felt(&pulses[*pulse].level),
                Action::Emit { .. } => false,
            });
        }
        model.rules.retain(|rule| match rule.kind {
            RuleKind::Transition { machine, .. } => self.machines.contains(&machine),
            RuleKind::Event { .. } => !rule.actions.is_empty(),
        });
        if !self.strands {
            model.strands = IdMap::default();
        }
        if !self.delays {
            (model.delays, model.tuned) = (IdMap::default(), IdMap::default());
        }
    }
}
