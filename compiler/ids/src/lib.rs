//! Typed indices: a number that says what it counts, and vectors that only such numbers index.
//!
//! ```text
//!   struct NodeId(pub u32);  impl_id!(NodeId);      IdMap<NodeId, Range>: a range for each node
//! ```
//!
//! Orders of and longest paths over what has ids are here too, once for blocks and instructions.
//! Not here: sets, sparse maps, removal. An id is never reused.

mod longest_path;
mod reverse_postorder;

pub use longest_path::longest_paths;
pub use reverse_postorder::reverse_postorder;

use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Index, IndexMut};

/// A number that counts things of one kind.
pub trait Id: Copy {
    /// The id of this number. Numbers above `u32::MAX` do not occur.
    fn from_index(index: usize) -> Self;

    /// Its number.
    fn index(self) -> usize;
}

/// The place in a list whose entries have no ids of their own.
impl Id for usize {
    fn from_index(index: usize) -> Self {
        index
    }

    fn index(self) -> usize {
        self
    }
}

/// Makes a tuple struct with one `u32` an [`Id`].
#[macro_export]
macro_rules! impl_id {
    ($($name:ty),+ $(,)?) => {$(
        impl $crate::Id for $name {
            fn from_index(index: usize) -> Self {
                Self(index as u32)
            }

            fn index(self) -> usize {
                self.0 as usize
            }
        }
    )+};
}

/// One `V` for each id from 0 up. As a slice it is the `V`s in order; only a `K` indexes it.
pub struct IdMap<K, V> {
    entries: Vec<V>,
    ids: PhantomData<fn(K) -> K>,
}

impl<K: Id, V> IdMap<K, V> {
    /// An empty map.
    pub const fn new() -> IdMap<K, V> {
        IdMap {
            entries: Vec::new(),
            ids: PhantomData,
        }
    }

    /// The same value for each of the first `len` ids.
    pub fn filled(value: V, len: usize) -> IdMap<K, V>
    where
        V: Clone,
    {
        IdMap::from(vec![value; len])
    }

    /// Adds an entry; gives its id.
    pub fn push(&mut self, value: V) -> K {
        self.entries.push(value);
        K::from_index(self.entries.len() - 1)
    }

    /// The id that is given next.
    pub fn next_id(&self) -> K {
        K::from_index(self.entries.len())
    }

    /// The entry of an id; none if it has none.
    pub fn get(&self, id: K) -> Option<&V> {
        self.entries.get(id.index())
    }

    /// The entry of an id, to be changed; none if it has none.
    pub fn get_mut(&mut self, id: K) -> Option<&mut V> {
        self.entries.get_mut(id.index())
    }

    /// Makes it as long as this, with copies of `value` where it was shorter.
    pub fn resize(&mut self, len: usize, value: V)
    where
        V: Clone,
    {
        self.entries.resize(len, value);
    }

    /// All ids, in order.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = K> + use<K, V> {
        (0..self.entries.len()).map(K::from_index)
    }

    /// All ids with their entries, in order.
    pub fn enumerated(&self) -> impl DoubleEndedIterator<Item = (K, &V)> {
        self.entries
            .iter()
            .enumerate()
            .map(|(index, value)| (K::from_index(index), value))
    }
}

impl<K: Id, V> Index<K> for IdMap<K, V> {
    type Output = V;

    fn index(&self, id: K) -> &V {
        &self.entries[id.index()]
    }
}

impl<K: Id, V> IndexMut<K> for IdMap<K, V> {
    fn index_mut(&mut self, id: K) -> &mut V {
        &mut self.entries[id.index()]
    }
}

impl<K: Id, V> Index<&K> for IdMap<K, V> {
    type Output = V;

    fn index(&self, id: &K) -> &V {
        &self.entries[id.index()]
    }
}

impl<K: Id, V> IndexMut<&K> for IdMap<K, V> {
    fn index_mut(&mut self, id: &K) -> &mut V {
        &mut self.entries[id.index()]
    }
}

impl<K, V> Deref for IdMap<K, V> {
    type Target = [V];

    fn deref(&self) -> &[V] {
        &self.entries
    }
}

impl<K, V> DerefMut for IdMap<K, V> {
    fn deref_mut(&mut self) -> &mut [V] {
        &mut self.entries
    }
}

impl<K, V> From<Vec<V>> for IdMap<K, V> {
    fn from(entries: Vec<V>) -> IdMap<K, V> {
        IdMap {
            entries,
            ids: PhantomData,
        }
    }
}

impl<K, V> FromIterator<V> for IdMap<K, V> {
    fn from_iter<I: IntoIterator<Item = V>>(values: I) -> IdMap<K, V> {
        IdMap::from(Vec::from_iter(values))
    }
}

impl<K, V> Extend<V> for IdMap<K, V> {
    fn extend<I: IntoIterator<Item = V>>(&mut self, values: I) {
        self.entries.extend(values);
    }
}

impl<K, V> IntoIterator for IdMap<K, V> {
    type Item = V;
    type IntoIter = std::vec::IntoIter<V>;

    fn into_iter(self) -> Self::IntoIter {
        self.entries.into_iter()
    }
}

impl<'a, K, V> IntoIterator for &'a IdMap<K, V> {
    type Item = &'a V;
    type IntoIter = std::slice::Iter<'a, V>;

    fn into_iter(self) -> Self::IntoIter {
        self.entries.iter()
    }
}

impl<'a, K, V> IntoIterator for &'a mut IdMap<K, V> {
    type Item = &'a mut V;
    type IntoIter = std::slice::IterMut<'a, V>;

    fn into_iter(self) -> Self::IntoIter {
        self.entries.iter_mut()
    }
}

impl<K, V> Default for IdMap<K, V> {
    fn default() -> IdMap<K, V> {
        IdMap::from(Vec::new())
    }
}

impl<K, V: Clone> Clone for IdMap<K, V> {
    fn clone(&self) -> IdMap<K, V> {
        IdMap::from(self.entries.clone())
    }
}

impl<K, V: PartialEq> PartialEq for IdMap<K, V> {
    fn eq(&self, other: &IdMap<K, V>) -> bool {
        self.entries == other.entries
    }
}

impl<K, V: Eq> Eq for IdMap<K, V> {}

impl<K, V: Hash> Hash for IdMap<K, V> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.entries.hash(state);
    }
}

impl<K, V: fmt::Debug> fmt::Debug for IdMap<K, V> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.entries.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Node(u32);
    impl_id!(Node);

    #[test]
    fn ids_are_given_in_order_and_find_their_entries() {
        let mut names: IdMap<Node, &str> = IdMap::new();
        assert_eq!(names.next_id(), Node(0));
        assert_eq!([names.push("a"), names.push("b")], [Node(0), Node(1)]);
        names[Node(0)] = "c";
        assert_eq!(names[Node(0)], "c");
        assert_eq!(names.get(Node(2)), None);
        let all: Vec<(Node, &&str)> = names.enumerated().collect();
        assert_eq!(all, [(Node(0), &"c"), (Node(1), &"b")]);
        assert_eq!(names.ids().next_back(), Some(Node(1)));
    }

    #[test]
    fn a_map_grows_by_copies() {
        let mut seen: IdMap<Node, bool> = IdMap::filled(true, 1);
        seen.resize(2, false);
        assert_eq!(*seen, [true, false]);
    }
}
