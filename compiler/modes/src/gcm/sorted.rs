//! Sets of nodes as sorted lists.

use crate::graph::NodeId;

/// What is in one of two lists in order, or in both, in order.
pub(super) fn union(a: &[NodeId], b: &[NodeId]) -> Vec<NodeId> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let mut left = a.iter().copied().peekable();
    for id in b {
        while let Some(smaller) = left.next_if(|other| other < id) {
            all.push(smaller);
        }
        left.next_if_eq(id);
        all.push(*id);
    }
    all.extend(left);
    all
}

/// What is in both of two lists in order, in order.
pub(super) fn common(a: &[NodeId], b: &[NodeId]) -> Vec<NodeId> {
    let mut left = b.iter().peekable();
    let mut is_there = |id: &&NodeId| {
        while left.next_if(|other| other < id).is_some() {}
        left.peek() == Some(id)
    };
    a.iter().filter(|id| is_there(id)).copied().collect()
}
