//! Reverse postorder: each node before those it leads to, but for edges that close a loop.
//!
//! Not here: what comes of nodes that are not reached (callers drop them or keep them).

use super::{Id, IdMap};

/// The nodes that the entry leads to, in reverse postorder; the entry is the first.
///
/// Of several targets of a node, what the last leads to comes last.
pub fn reverse_postorder<K: Id, T: IntoIterator<Item = K>>(
    nodes: usize,
    entry: K,
    targets: impl Fn(K) -> T,
) -> Vec<K> {
    let mut seen = IdMap::filled(false, nodes);
    // A node is done once all that it leads to are.
    let (mut order, mut open) = (Vec::new(), vec![(entry, false)]);
    while let Some((node, done)) = open.pop() {
        if done {
            order.push(node);
        } else if !std::mem::replace(&mut seen[node], true) {
            open.push((node, true));
            open.extend(targets(node).into_iter().map(|to| (to, false)));
        }
    }
    order.reverse();
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_come_before_those_they_lead_to() {
        // A diamond below a loop of 0 and 1; 5 is not reached.
        let edges: [&[usize]; 6] = [&[1], &[0, 2, 3], &[4], &[4], &[], &[4]];
        let order = reverse_postorder(6, 0, |node: usize| edges[node].iter().copied());
        assert_eq!(order, [0, 1, 2, 3, 4]);
    }
}
