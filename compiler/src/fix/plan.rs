//! Which format each node is computed in.
//!
//! A node starts with the finest format that holds its range. Then, users before operands, an operand of `min`, `max` or
//! `if` and the new value of a cell take the format of where they go, so no shift is needed on the way.

use super::format::{fits, fraction_bits};
use crate::model::{Node, NodeId};
use crate::range::Ranges;
use crate::simplify::Step;

/// So many fraction bits may be given up to save a shift.
const GIVEN_UP: i32 = 6;

/// Fraction bits for every node (meaningless for bools).
pub(super) fn fractions(step: &Step, ranges: &Ranges) -> Vec<i32> {
    let dag = &step.model.dag;
    let mut plan: Vec<i32> = dag.nodes().map(|(id, _)| fraction_bits(ranges.get(id))).collect();
    let prefer = |plan: &mut Vec<i32>, node: NodeId, bits: i32| {
        let own = &mut plan[node.0 as usize];
        if computed(dag.get(node)) && fits(ranges.get(node), bits) && *own - bits <= GIVEN_UP {
            *own = bits;
        }
    };
    for (cell, node) in written_every_tick(step) {
        prefer(&mut plan, node, fraction_bits(step.model.cells[cell].range));
    }
    for index in (0..dag.len()).rev() {
        if let Node::Min(a, b) | Node::Max(a, b) | Node::Select(_, a, b) = *dag.get(NodeId(index as u32)) {
            let bits = plan[index];
            prefer(&mut plan, a, bits);
            prefer(&mut plan, b, bits);
        }
    }
    plan
}

/// Cells that get a new value in every tick, with that value.
fn written_every_tick(step: &Step) -> Vec<(usize, NodeId)> {
    let bodies = step.model.bodies.iter().zip(&step.rates).zip(&step.coordinates);
    let moved = bodies.flat_map(|((b, &r), &c)| [(b.rate.0 as usize, r), (b.coordinate.0 as usize, c)]);
    moved.chain(step.model.nexts.iter().map(|(c, n)| (c.0 as usize, *n))).collect()
}

/// Whether the node is computed, in any format one likes.
fn computed(node: &Node) -> bool {
    use Node::*;
    matches!(node, Linear(..) | Add(..) | Sub(..) | Mul(..) | Min(..) | Max(..) | Select(..) | Power(..) | Abs(_))
}

/// The coarser format of two.
pub(super) fn coarser(plan: &[i32], a: NodeId, b: NodeId) -> i32 {
    plan[a.0 as usize].min(plan[b.0 as usize])
}
