//! Longest paths in a directed acyclic graph, by one sweep against its edges.
//!
//! ```text
//!   longest(n) = weight(n) + the longest of what follows n, or weight(n) where nothing follows
//! ```
//!
//! Not here: which edges there are, and what each weighs (callers say it, and leave out the edges
//! that close a loop), the nodes of the longest path, paths through calls (`budget`).

use super::{Id, IdMap};
use std::ops::Add;

/// The weight of the longest path from each node on, its own weight included.
///
/// `order` names nodes behind those they lead to. `onward` is the weight of the longest path
/// beyond a node, given the paths from the nodes named before it; none where paths end.
pub fn longest_paths<K, W>(
    nodes: usize,
    order: impl IntoIterator<Item = K>,
    weight: impl Fn(K) -> W,
    onward: impl Fn(K, &IdMap<K, W>) -> Option<W>,
) -> IdMap<K, W>
where
    K: Id,
    W: Copy + Default + Add<Output = W>,
{
    let mut longest = IdMap::filled(W::default(), nodes);
    for node in order {
        let beyond = onward(node, &longest);
        longest[node] = match beyond {
            Some(beyond) => weight(node) + beyond,
            None => weight(node),
        };
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diamond with a longer side: 0 leads to 1 and 2, both lead to 3; 4 stands alone.
    const EDGES: [&[(usize, u32)]; 5] = [&[(1, 0), (2, 5)], &[(3, 0)], &[(3, 1)], &[], &[]];
    const WEIGHTS: [u32; 5] = [1, 20, 10, 100, 7];

    #[test]
    fn the_longest_path_is_that_of_nodes_and_edges() {
        let onward = |node: usize, known: &IdMap<usize, u32>| {
            EDGES[node].iter().map(|(to, edge)| edge + known[*to]).max()
        };
        let longest = longest_paths(5, (0..5).rev(), |node| WEIGHTS[node], onward);
        assert_eq!(*longest, [121, 120, 111, 100, 7]);
    }

    #[test]
    fn the_longest_path_is_that_of_all_paths() {
        fn try_all(node: usize) -> u32 {
            let beyond = EDGES[node].iter().map(|(to, edge)| edge + try_all(*to));
            WEIGHTS[node] + beyond.max().unwrap_or(0)
        }
        let onward = |node: usize, known: &IdMap<usize, u32>| {
            EDGES[node].iter().map(|(to, edge)| edge + known[*to]).max()
        };
        let longest = longest_paths(5, [3, 4, 2, 1, 0], |node| WEIGHTS[node], onward);
        assert_eq!(*longest, [0, 1, 2, 3, 4].map(try_all));
    }
}
