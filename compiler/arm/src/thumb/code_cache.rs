//! What was compiled before, by what it was compiled of.
//!
//! Selection knows neither how many keys there are nor how far their words are (`state_layout`), so
//! modes have the same code for any number of keys, but for that distance.
//! Registers and orders of instructions follow from the instructions that were selected and from
//! what else stands in the key, and from nothing else.

use std::sync::Arc;

use whippen_deterministic::{Memo, Shared};
use whippen_ids::IdMap;
use whippen_isa::Arch;
use whippen_kernel::Kernel;
use whippen_modes::{Mode, ModeId, Modes};

use super::compile::Strategy;
use super::func::{Allocated, Func};
use super::promote::Promotions;
use super::search::CompiledModes;
use super::state_layout::StateLayout;
use super::{Built, Options, TickAbi};

/// Functions that are kept at most: of a dozen instruments with as many modes as the grand piano.
const FUNCTIONS_MAX: usize = 1024;
/// Instruments whose modes are kept at most.
const INSTRUMENTS_MAX: usize = 16;
/// Objects that are kept at most: of each instrument some, for other numbers of keys.
const OBJECTS_MAX: usize = 48;

/// What names the code of a function.
#[derive(Hash)]
pub(super) enum Origin<'a> {
    /// Selected instructions, to be ordered and given registers in this way.
    Selected(&'a Func, &'a Promotions, Strategy),
    /// Code with registers, to be reordered.
    Allocated(&'a Allocated),
}

/// What names the code of all modes: what they compute, where their memory lies, and whether what
/// is the same for all keys is computed once.
#[derive(Hash)]
pub(super) struct ModesOrigin<'a> {
    pub kernel: &'a Kernel,
    pub modes: &'a Shared<IdMap<ModeId, Mode>>,
    pub layout: &'a StateLayout,
    pub shares: bool,
    pub arch: Arch,
}

/// Code, and about the cycles of its longest path.
pub(super) type Compiled = Arc<(Allocated, u64)>;

/// What names an object: modes, with all that memory holds at first, and what is asked of it.
pub(super) type ObjectOrigin<'a> = (&'a Modes, &'a Options, Option<&'a TickAbi>);

/// Code by what it was made of.
pub(super) struct CodeCache {
    /// Of functions, by [`Origin`] and architecture.
    pub functions: Memo<(Allocated, u64)>,
    /// Of all modes, before the distance from words in to words out is put in, by [`ModesOrigin`].
    pub modes: Memo<CompiledModes>,
    /// By [`ObjectOrigin`].
    pub objects: Memo<Built>,
}

/// What this process has compiled.
static OF_PROCESS: CodeCache = CodeCache::new();

impl CodeCache {
    /// Nothing is known yet.
    pub const fn new() -> CodeCache {
        CodeCache {
            functions: Memo::new(FUNCTIONS_MAX),
            modes: Memo::new(INSTRUMENTS_MAX),
            objects: Memo::new(OBJECTS_MAX),
        }
    }

    /// Of this process.
    pub fn of_process() -> &'static CodeCache {
        &OF_PROCESS
    }
}

#[cfg(test)]
mod tests {
    use super::super::build;
    use super::*;
    use whippen_kernel::Op;
    use whippen_kernel::random::kernel;
    use whippen_modes::specialize;

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
        let ports = modes.kernel.inputs.len().max(modes.kernel.outputs.len());
        let abi = TickAbi {
            drive_offset: 4 * ports.max(1) as u32 * keys,
            record_bytes_min: 0,
            shares: true,
        };
        format!("{:?}", build(modes, &options, Some(&abi), cache))
    }

    #[test]
    fn code_is_the_same_whatever_was_compiled_before() {
        for arch in [Arch::V8M, Arch::V7EM, Arch::V6M] {
            let everything = CodeCache::new();
            let (mut functions, mut shared) = (0, 0);
            for seed in 0..KERNELS {
                let modes = specialize(&kernel(seed), 2_000);
                let of_kernel = CodeCache::new();
                for keys in KEYS {
                    let first = CodeCache::new();
                    let anew = object(&modes, keys, arch, &first);
                    functions += first.functions.kept();
                    let caches = [&first, &of_kernel, &everything];
                    let again = caches.map(|own| object(&modes, keys, arch, own));
                    assert!(
                        again.iter().all(|own| *own == anew),
                        "{seed}, {keys} keys, {arch:?}"
                    );
                    assert_eq!([first.modes.kept(), first.objects.kept()], [1, 1]);
                }
                // The distance to a slot at an index, and on ARMv6-M to a word, is that of so many
                // keys.
                let mut all = modes.kernel.all_insts();
                let at_index = all.any(|inst| matches!(inst.op, Op::DelayAt(_)));
                if !at_index && arch != Arch::V6M {
                    assert_eq!(of_kernel.modes.kept(), 1, "{seed}, {arch:?}");
                    shared += 1;
                }
            }
            if arch != Arch::V6M {
                assert!(shared > 0, "{arch:?}");
                assert!(2 * everything.functions.kept() < functions, "{arch:?}");
            }
        }
    }
}
