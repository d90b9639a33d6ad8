//! What was made before, by what it was made of.
//!
//! `--most-keys` and the language server make nearly the same image again and again: other numbers
//! of keys, another value of a parameter, a comment. A function whose result follows from its
//! arguments and from nothing else need not be run twice for the same ones.
//!
//! The key is a digest (SHA-256) of everything that the result is made of: nobody knows two
//! different things that have the same. So what is found is what would be made again.

use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::{Arc, Mutex};

use sha2::{Digest, Sha256};

/// Results by what they were made of, for as long as the process runs; they are forgotten all at
/// once when they become too many.
#[derive(Debug)]
pub struct Memo<T> {
    known: Mutex<BTreeMap<[u8; 32], Arc<T>>>,
    kept_max: usize,
}

impl<T> Memo<T> {
    /// One that keeps so many results at most.
    pub const fn new(kept_max: usize) -> Memo<T> {
        Memo {
            known: Mutex::new(BTreeMap::new()),
            kept_max,
        }
    }

    /// What is made of something: as it is known, or made now. `of` has to be all that `make`
    /// looks at.
    ///
    /// # Errors
    /// Those of `make`, which are not kept.
    pub fn get_or_make<E>(
        &self,
        of: &impl Hash,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let key = digest(of);
        // Nobody panics while holding the lock; without it, everything is made anew.
        if let Some(known) = self
            .known
            .lock()
            .ok()
            .and_then(|all| all.get(&key).cloned())
        {
            return Ok(known);
        }
        let made = Arc::new(make()?);
        if let Ok(mut all) = self.known.lock() {
            if all.len() >= self.kept_max {
                all.clear();
            }
            all.insert(key, made.clone());
        }
        Ok(made)
    }

    /// How many results are kept.
    pub fn kept(&self) -> usize {
        self.known.lock().map_or(0, |all| all.len())
    }
}

pub(crate) fn digest(what: &impl Hash) -> [u8; 32] {
    let mut bytes = Written {
        sha: Sha256::new(),
        open: Vec::with_capacity(OPEN_MAX),
    };
    what.hash(&mut bytes);
    bytes.sha.chain_update(&bytes.open).finalize().into()
}

/// Bytes that are digested at once: what is hashed comes in a few at a time.
const OPEN_MAX: usize = 4096;

/// Takes what is hashed as it is: lengths and variants are part of it, so different values of a
/// type are different bytes.
struct Written {
    sha: Sha256,
    /// What is not digested yet.
    open: Vec<u8>,
}

impl Hasher for Written {
    fn write(&mut self, bytes: &[u8]) {
        if self.open.len() + bytes.len() > OPEN_MAX {
            self.sha.update(&self.open);
            self.open.clear();
        }
        match bytes.len() < OPEN_MAX {
            true => self.open.extend_from_slice(bytes),
            false => self.sha.update(bytes),
        }
    }

    /// Not asked for.
    fn finish(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_not_made_again() {
        let memo = Memo::new(4);
        let made = |of: &str, value: Result<u32, ()>| Ok(*memo.get_or_make(&of, || value)?);
        assert_eq!(
            [made("a", Ok(7)), made("a", Ok(8)), made("b", Ok(9))],
            [Ok(7), Ok(7), Ok(9)]
        );
        assert_eq!(made("c", Err(())), Err(()));
        assert_eq!(made("c", Ok(1)), Ok(1));
        assert_eq!(memo.kept(), 3);
    }

    /// Whatever lies next to what: strings, lists and options of the same bytes are different.
    #[test]
    fn different_things_have_different_digests() {
        assert_ne!(digest(&("ab", "c")), digest(&("a", "bc")));
        assert_ne!(
            digest(&(vec![1_u8, 2], vec![3_u8])),
            digest(&(vec![1_u8], vec![2_u8, 3]))
        );
        assert_ne!(
            digest(&(None::<u8>, Some(0_u8))),
            digest(&(Some(0_u8), None::<u8>))
        );
        assert_eq!(digest(&("ab", 1_u64)), digest(&("ab".to_string(), 1_u64)));
    }

    /// However much of it comes at once.
    #[test]
    fn digests_are_those_of_all_bytes() {
        fn bytes_of(pieces: &[usize]) -> Vec<u8> {
            let all = 0..pieces.iter().sum::<usize>();
            all.map(|at| (at * 7 % 251) as u8).collect()
        }
        struct Pieces(Vec<usize>);
        impl Hash for Pieces {
            fn hash<H: Hasher>(&self, state: &mut H) {
                let (mut at, bytes) = (0, bytes_of(&self.0));
                for length in &self.0 {
                    state.write(&bytes[at..at + length]);
                    at += length;
                }
            }
        }
        for pieces in [
            vec![],
            vec![1, 4095, 1],
            vec![4096],
            vec![3, 9000, 5, 4096, 4095, 2],
            vec![7; 3000],
        ] {
            let all: [u8; 32] = Sha256::digest(bytes_of(&pieces)).into();
            assert_eq!(digest(&Pieces(pieces.clone())), all, "{pieces:?}");
        }
    }

    #[test]
    fn not_more_is_kept_than_there_is_room_for() {
        let memo = Memo::new(3);
        for number in 0..20_u32 {
            for made in [Ok(number), Err(())] {
                assert_eq!(memo.get_or_make(&number, || made), Ok(number.into()));
            }
            assert!(memo.kept() <= 3);
        }
    }
}
