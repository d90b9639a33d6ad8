//! What was compiled before, by what it was compiled of.
//!
//! `--most-keys` and the language server make nearly the same image again and again: other numbers
//! of keys, another value of a parameter. Registers and orders of instructions follow from the
//! instructions that were selected and from what else stands in the key, and from nothing else. So
//! what was found for a key is what would be found again. The key is a digest (SHA-256): nobody
//! knows two different things that have the same.
//!
//! Kept for as long as the process runs, and forgotten all at once when it becomes much.

use std::hash::{Hash, Hasher};
use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;
use sha2::{Digest, Sha256};
use whippen_isa::Arch;

use super::ThumbError;
use super::compile::Strategy;
use super::func::{Allocated, Func};
use super::promote::Promotions;

/// Functions that are kept at most: of a dozen instruments with as many modes as the grand piano.
const KEPT_MAX: usize = 1024;

/// What names the code of a function.
#[derive(Hash)]
pub(super) enum Origin<'a> {
    /// Selected instructions, to be ordered and given registers in this way.
    Selected(&'a Func, &'a Promotions, Strategy),
    /// Code with registers, to be reordered.
    Allocated(&'a Allocated),
}

/// Code, and about the cycles of its longest path.
pub(super) type Compiled = Arc<(Allocated, u64)>;

/// Code by what it was made of.
#[derive(Default)]
pub(super) struct CodeCache(Mutex<FxHashMap<[u8; 32], Compiled>>);

/// What this process has compiled.
static OF_PROCESS: std::sync::LazyLock<CodeCache> = std::sync::LazyLock::new(CodeCache::default);

impl CodeCache {
    /// Of this process.
    pub fn of_process() -> &'static CodeCache {
        &OF_PROCESS
    }

    /// The code of an origin for cores of an architecture: as it is known, or is made now.
    ///
    /// # Errors
    /// Those of `make`, which are not kept.
    pub fn get_or_make(
        &self,
        origin: &Origin,
        arch: Arch,
        make: impl FnOnce() -> Result<(Allocated, u64), ThumbError>,
    ) -> Result<Compiled, ThumbError> {
        let key = digest(&(origin, arch));
        // Nobody panics while holding the lock; without it, everything is made anew.
        if let Some(known) = self.0.lock().ok().and_then(|all| all.get(&key).cloned()) {
            return Ok(known);
        }
        let made = Arc::new(make()?);
        if let Ok(mut all) = self.0.lock() {
            if all.len() >= KEPT_MAX {
                all.clear();
            }
            all.insert(key, made.clone());
        }
        Ok(made)
    }
}

fn digest(what: &impl Hash) -> [u8; 32] {
    let mut bytes = Written(Vec::new());
    what.hash(&mut bytes);
    Sha256::digest(&bytes.0).into()
}

/// Takes what is hashed as it is: lengths and variants are part of it, so different values of a
/// type are different bytes.
struct Written(Vec<u8>);

impl Hasher for Written {
    fn write(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Not asked for.
    fn finish(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Options, TickAbi, build_object, compile_parts};
    use super::*;
    use whippen_ids::IdMap;
    use whippen_kernel::random::kernel;
    use whippen_modes::{Modes, specialize};

    /// Keys of a core: the words that go out are from 4 to 1020 bytes behind those that come in.
    const KEYS: [u32; 6] = [1, 2, 7, 26, 27, 255];
    /// Kernels for each architecture.
    const KERNELS: u64 = 12;

    /// The object of so many keys, or why there is none.
    fn object(modes: &Modes, keys: u32, arch: Arch, cache: &CodeCache) -> String {
        let options = Options {
            name: "key".to_string(),
            keys,
            gain: true,
            probes: false,
            arch,
        };
        let abi = TickAbi {
            drive_offset: 4 * keys,
            record_bytes_min: 0,
            shares: true,
        };
        let parts = compile_parts(modes, &options, Some(&abi), cache);
        let built = parts.and_then(|parts| build_object(parts, &options));
        format!("{built:?}")
    }

    fn kept(cache: &CodeCache) -> usize {
        cache.0.lock().expect("nobody panicked").len()
    }

    #[test]
    fn code_is_the_same_whatever_was_compiled_before() {
        for arch in [Arch::V8M, Arch::V7EM, Arch::V6M] {
            let everything = CodeCache::default();
            let (mut of_one, mut of_all) = (0, 0);
            for seed in 0..KERNELS {
                let modes = specialize(&kernel(seed), 2_000);
                let before = kept(&everything);
                for keys in KEYS {
                    let first = CodeCache::default();
                    let anew = object(&modes, keys, arch, &first);
                    of_one += kept(&first);
                    let again = [&first, &everything].map(|own| object(&modes, keys, arch, own));
                    assert!(
                        again.iter().all(|own| *own == anew),
                        "{seed}, {keys} keys, {arch:?}"
                    );
                }
                of_all += kept(&everything) - before;
            }
            let shares = arch != Arch::V6M;
            let found_again = 2 * of_all < of_one;
            assert!(
                of_all > 0 && shares <= found_again,
                "{of_all} of {of_one}, {arch:?}"
            );
        }
    }

    #[test]
    fn not_more_is_kept_than_there_is_room_for() {
        let cache = CodeCache::default();
        for vregs in 0..2 * KEPT_MAX as u32 + 1 {
            let func = Func {
                vregs,
                ..Func::new()
            };
            let none = Promotions::default();
            let strategy = Strategy {
                remat_distance: 0,
                remat_within: 0,
                addresses_within: 0,
                pressure_limit: None,
            };
            let code = |slots| Allocated {
                blocks: IdMap::new(),
                vregs: 0,
                free: 0,
                slots,
            };
            let origin = Origin::Selected(&func, &none, strategy);
            let make = |slots| cache.get_or_make(&origin, Arch::V8M, || Ok((code(slots), 1)));
            assert_eq!(make(7).map(|made| made.0.slots), Ok(7));
            assert_eq!(make(8).map(|made| made.0.slots), Ok(7), "it is known");
            assert!(kept(&cache) <= KEPT_MAX);
        }
    }
}
