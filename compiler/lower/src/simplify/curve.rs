//! The part of a friction's law that one value decides becomes a curve, which is one table: the
//! search asks for it and its slope three times in a tick.
//!
//! ```text
//!   press * (w * exp(0.5 * (1 - w * w))), w = clamp(v / top, -8, 8)   ->   press * curve(v / top)
//! ```

use std::collections::HashMap;
use whippen_lang::model::curve::Curve;
use whippen_lang::model::{Balance, Dag, Interval, Model, Node, NodeId, prime};
use whippen_lang::range::Ranges;

/// Cells of a table at least, and how far off it may be, as a part of what the curve reaches.
const CELLS: u32 = 256;
const OFF: f64 = 1.0 / 4096.0;
/// What counts as no change beyond the cells.
const FLAT: f64 = 1e-7;

/// The laws that have such a part, each with its slope, by the slip that is solved.
pub(super) type Curved = HashMap<NodeId, [NodeId; 2]>;

/// Rewrites the laws of all frictions.
pub(super) fn curved(model: &mut Model, ranges: &Ranges) -> Curved {
    let slip = |(id, node): (NodeId, &Node)| match node {
        Node::Slip(balance) => Some((id, *balance)),
        _ => None,
    };
    let slips: Vec<(NodeId, Balance)> = model.dag.nodes().filter_map(slip).collect();
    let rewritten = slips
        .into_iter()
        .filter_map(|(id, balance)| Some((id, law(model, ranges, balance)?)));
    rewritten.collect()
}

fn law(model: &mut Model, ranges: &Ranges, balance: Balance) -> Option<[NodeId; 2]> {
    let (x, root) = part(&model.dag, balance)?;
    let mut dag = model.dag.clone();
    let slope = prime::slope(&mut dag, x, root).ok()?;
    let over = ranges.get(x);
    let (nodes, slopes) = (alone(&dag, x, root), alone(&dag, x, slope));
    let curve = Curve::new(model, nodes, &slopes, over)?;
    if !is_tabled(model, &curve, over) {
        return None;
    }
    let mut new = HashMap::from([(root, model.dag.add(Node::Curve(curve, x)))]);
    for id in model.dag.between(root, balance.law).into_iter().skip(1) {
        let mut node = model.dag.get(id).clone();
        node.map_operands(|operand| *new.get(&operand).unwrap_or(&operand));
        let changed = model.dag.add(node);
        new.insert(id, changed);
    }
    let law = new[&balance.law];
    let slope = prime::slope(&mut model.dag, balance.trial, law).ok()?;
    Some([law, slope])
}

/// The value, and what is made of it alone: the last such part that has a function in it.
fn part(dag: &Dag, Balance { trial, law, .. }: Balance) -> Option<(NodeId, NodeId)> {
    let mut made_of: HashMap<NodeId, NodeId> = HashMap::new();
    let mut dear: HashMap<NodeId, bool> = HashMap::new();
    let mut found = None;
    for id in dag.between(trial, law) {
        let node = dag.get(id);
        let operands = node.operands();
        let mut of = operands.iter().filter_map(|o| made_of.get(o).copied());
        let first = of.next();
        let alone = first.is_some()
            && of.all(|other| Some(other) == first)
            && operands
                .iter()
                .all(|o| made_of.contains_key(o) || dag.real(*o).is_some());
        // Of what is scaled by a constant it is a function as well, which spares a table's width.
        let scales = matches!(node, Node::Mul(..) | Node::Div(..)) && operands.contains(&trial);
        let x = first
            .filter(|_| alone && !scales && id != trial)
            .unwrap_or(id);
        let inside = operands
            .iter()
            .any(|o| x != id && dear.get(o) == Some(&true));
        let is_dear = inside || x != id && matches!(node, Node::Function(..));
        made_of.insert(id, x);
        dear.insert(id, is_dear);
        if is_dear {
            found = Some((x, id));
        }
    }
    found
}

/// What `root` is made of, as nodes of their own; `x` is number 0.
fn alone(dag: &Dag, x: NodeId, root: NodeId) -> Vec<Node> {
    let mut numbers = HashMap::from([(x, NodeId(0))]);
    let mut nodes: Vec<Node> = Vec::new();
    let mut needed = vec![root];
    let mut open = vec![root];
    while let Some(id) = open.pop().filter(|id| *id != x) {
        for operand in dag.get(id).operands() {
            if operand != x && !needed.contains(&operand) {
                needed.push(operand);
                open.push(operand);
            }
        }
    }
    needed.sort();
    for id in needed {
        let mut node = dag.get(id).clone();
        node.map_operands(|operand| numbers[&operand]);
        nodes.push(node);
        numbers.insert(id, NodeId(nodes.len() as u32));
    }
    nodes
}

/// Whether a table of parabolas is near enough to it.
fn is_tabled(model: &Model, curve: &Curve, over: Interval) -> bool {
    let size = curve.reach().magnitude();
    let Some(half) = half_width(model, curve, over) else {
        return false;
    };
    let width = 2.0 * half / f64::from(CELLS / 2);
    let cells = (0..CELLS / 2).map(|at| -half + width * (f64::from(at) + 0.5));
    let off = cells.map(|middle| {
        let at = |part: f64| {
            let x = (middle + part * width).clamp(over.low, over.high);
            curve.value(model, x).unwrap_or(f64::INFINITY)
        };
        let (low, mid, high) = (at(-0.5), at(0.0), at(0.5));
        let parabola = |t: f64| mid + t * (high - low) + 2.0 * t * t * (low + high - 2.0 * mid);
        let parts = [-0.4, -0.25, -0.1, 0.1, 0.25, 0.4].map(|t| (at(t) - parabola(t)).abs());
        parts.into_iter().fold(0.0, f64::max)
    });
    off.fold(0.0, f64::max) <= OFF * size
}

/// The least power of two beyond which it does not change.
fn half_width(model: &Model, curve: &Curve, over: Interval) -> Option<f64> {
    let mut half = 2.0_f64.powi(over.magnitude().log2().ceil() as i32);
    while curve.is_flat_beyond(model, 0.5 * half, over, FLAT) {
        half *= 0.5;
        if half < f64::MIN_POSITIVE * 1e16 {
            return None;
        }
    }
    Some(half)
}
