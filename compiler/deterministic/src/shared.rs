//! Values that are shared, and know their digest.

use std::hash::{Hash, Hasher};
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, OnceLock};

use crate::memo::digest;

/// A value that clones share until one of them changes it. It is hashed by its digest, which is
/// found once: what is large is asked for in a [`Memo`](crate::Memo) again and again.
#[derive(Debug, Clone, Default)]
pub struct Shared<T>(Arc<Digested<T>>);

#[derive(Debug, Clone, Default)]
struct Digested<T> {
    value: T,
    digest: OnceLock<[u8; 32]>,
}

impl<T> From<T> for Shared<T> {
    fn from(value: T) -> Shared<T> {
        let digest = OnceLock::new();
        Shared(Arc::new(Digested { value, digest }))
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.value
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut T {
        let own = Arc::make_mut(&mut self.0);
        own.digest = OnceLock::new();
        &mut own.value
    }
}

impl<T: PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Shared<T>) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.value == other.0.value
    }
}

impl<T: Hash> Hash for Shared<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Digested {
            value,
            digest: known,
        } = &*self.0;
        known.get_or_init(|| digest(value)).hash(state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each change is that of one clone, and has another digest.
    #[test]
    fn clones_share_a_value_until_one_changes_it() {
        let first = Shared::from(vec![1, 2]);
        let mut second = first.clone();
        let shared = digest(&first);
        assert!(Arc::ptr_eq(&first.0, &second.0));
        assert_eq!((digest(&second), &second), (shared, &first));
        second.push(3);
        assert_eq!((&*first, &*second), (&vec![1, 2], &vec![1, 2, 3]));
        assert_ne!((digest(&second), &second), (shared, &first));
        second.pop();
        assert_eq!((digest(&second), &second), (shared, &first));
    }
}
