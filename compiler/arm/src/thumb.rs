//! Code for the Cortex-M33, the Cortex-M4 and the Cortex-M0+: the tick of all keys of one core,
//! from modes to an object.
//!
//! ```text
//!   Modes --select--> Func (instructions over virtual registers) --allocate--> --arrange, emit--> Object
//! ```
//!
//! The tick is threaded code: keys have records that lie one after the other, and the first word of
//! a record is the address of the code of the key's present mode. A mode's code does one key's
//! tick, takes the address of the next key's code from the next record and goes there; after the
//! last key a sentinel leads to the end of the frame. There is no loop and no test of modes.
//!
//! | part, in the order of the data's flow | what it settles |
//! | --- | --- |
//! | `registers`, `routine`, `minst`, `func` | register roles, machine instructions, functions of blocks |
//! | `state_layout`, `literal`, `memory` | where everything lies in the state, and what it is at first |
//! | `tick_invariant` | what is computed once a tick for all keys |
//! | `compile` | the list of passes, each with what checks it |
//! | `search` | the strategy of each mode, by worst-case cycles |
//! | `select` | instruction selection |
//! | `v6m` | legalization for ARMv6-M, which has fewer instructions |
//! | `wave` | the tick of a string, as a routine |
//! | `promote` | tick constants in registers from key to key |
//! | `schedule` | list scheduling under register pressure |
//! | `allocate` | register allocation, by `regalloc2` |
//! | `reorder`, `rename` | order of allocated instructions, registers without anti-dependences |
//! | `hoist` | speculation over branches |
//! | `dependence`, `liveness`, `critical_path` | analyses that passes share |
//! | `validate` | translation validation of schedules and of allocated code |
//! | `block_layout` | order of blocks |
//! | `entry` | code around the keys |
//! | `program` | all code of a core in order |
//! | `emit` | encodings, IT blocks, branches |
//! | `object`, `names` | sections and symbols |
//! | `after`, `text` | code after each pass, as text |
//! | `tuning` | tuned constants |
//!
//! Every transformation here keeps every drive word, event and cell of the Kernel, bit for bit. Not
//! here: what a Kernel may assume (`modes`), addresses (`image`).

mod after;
mod allocate;
mod beyond_doubt;
mod block_layout;
mod code_cache;
mod compile;
mod critical_path;
mod dependence;
mod emit;
mod entry;
mod func;
mod hoist;
mod literal;
mod liveness;
mod memory;
mod minst;
mod names;
mod object;
mod program;
mod promote;
mod registers;
mod rename;
mod reorder;
mod routine;
mod schedule;
mod search;
mod select;
mod state_layout;
mod text;
mod tick_invariant;
mod tuning;
mod v6m;
mod validate;
mod wave;

use crate::features::Features;
use crate::image::{Object, Section, SectionKind, timing};
use block_layout::OffPath;
use code_cache::{CodeCache, ModesOrigin, ObjectOrigin};
use compile::Compiler;
use emit::assemble;
use func::Allocated;
use literal::Literals;
use memory::Memory;
use minst::Access;
use object::assemble_object;
use program::write_program;
use search::{Chosen, CompiledModes};
use select::WORDS_OUT;
use state_layout::LITERALS_MAX;
use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;
use tick_invariant::TickInvariants;
use whippen_ids::IdMap;
use whippen_isa::Arch;
use whippen_isa::timing::Core;
use whippen_kernel::{Kernel, Range};
use whippen_modes::{ModeId, Modes};

pub use after::{Function, Pass, code_after};
pub use state_layout::{EVENT_MARK, EventRing, LineSlots, StateLayout};
pub use tick_invariant::{SharedValues, shared_values};

/// What to build.
#[derive(Debug, Clone, Hash)]
pub struct Options {
    /// Prefix of all symbols.
    pub name: String,
    /// Keys of the core.
    pub keys: u32,
    /// Whether each key has a gain for its drive words, 65536 = 1.
    pub gain: bool,
    /// Whether probes are kept, key by key in the records; else they are left out.
    pub probes: bool,
    /// The core's architecture.
    pub arch: Arch,
}

/// Why there is no code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ThumbError {
    /// No keys, or more than the state can have in 16 MiB.
    Keys(u32),
    /// More modes than addresses have room.
    Modes(usize),
    /// A string lies further from the beginning of the record than loads reach.
    Reach {
        /// The cell of its displacements.
        name: String,
        /// Offset of its last word in the record, in bytes.
        end: u32,
        /// The furthest that there may be.
        max: u32,
    },
    /// More is alive at once than loads and stores reach on the stack.
    Stack {
        /// Words that the code keeps there.
        slots: usize,
        /// How many there may be.
        max: usize,
    },
    /// There is so much code that steps between branches and where they lead would be too many.
    Branches {
        /// The code without such steps, in bytes.
        bytes: u32,
    },
    /// A bug: no registers, or no encoding.
    Bug(String),
}

impl fmt::Display for ThumbError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ThumbError::Keys(keys) => write!(
                f,
                "{keys} keys do not fit: a core takes 1 to 65536 keys in 16 MiB"
            ),
            ThumbError::Modes(modes) => write!(f, "{modes} modes, more than {LITERALS_MAX}"),
            ThumbError::Reach { name, end, max } => write!(
                f,
                "the string `{name}` ends {end} bytes behind the beginning of its key's record, \
                 and code reaches {max}; let it have fewer points"
            ),
            ThumbError::Stack { slots, max } => write!(
                f,
                "a tick keeps {slots} words on the stack, and code of this core reaches {max}; let a \
                 bank have fewer members, or take a board with another core"
            ),
            ThumbError::Branches { bytes } => write!(
                f,
                "a tick is {bytes} bytes of code, and branches of this core reach 2048; let a bank \
                 have fewer members, or take a board with another core"
            ),
            ThumbError::Bug(what) => write!(f, "no code: {what}"),
        }
    }
}

impl std::error::Error for ThumbError {}

/// Code and data of a core's keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Built {
    /// The object: `NAME_tick`, `NAME_init`, `NAME_state`.
    pub object: Object,
    /// Where things lie in the state.
    pub layout: StateLayout,
}

impl Built {
    /// How many keys it has.
    pub fn keys(&self) -> u32 {
        self.layout.keys
    }

    /// The section of its state.
    fn state(&mut self) -> Option<&mut Section> {
        self.object
            .sections
            .iter_mut()
            .find(|section| section.kind == SectionKind::Data)
    }

    /// The same code for as many other keys: those of this kernel, which differs in its values per
    /// key alone, and which are numbered from `first` on.
    #[must_use]
    pub fn with_keys_of(mut self, kernel: &Kernel, first: u32) -> Built {
        let layout = self.layout.clone();
        if let Some(data) = self.state() {
            let mut state = Memory {
                bytes: std::mem::take(&mut data.bytes),
                fixups: Vec::new(),
            };
            state.keyed(kernel, &layout);
            state.numbers(&layout, first);
            data.bytes = state.bytes;
        }
        self
    }
}

/// Compiles the tick of a core's keys.
///
/// # Errors
/// Too many keys or modes; a bug.
pub fn compile(modes: &Modes, options: &Options) -> Result<Built, ThumbError> {
    build(modes, options, None, CodeCache::of_process())
}

/// What a firmware's frame asks of the keys' code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TickAbi {
    /// Bytes from a sensor word to the drive word of the same key.
    pub drive_offset: u32,
    /// The least bytes of a key's record; [`record_bytes`] says what a kernel needs.
    pub record_bytes_min: u32,
    /// Whether what is the same for all keys is computed once, at the tick's entry, and stored; for
    /// one key that only costs.
    pub shares: bool,
}

/// Compiles the tick of a core's keys as a part of a firmware's frame: `NAME_tick(state, words)`
/// and `NAME_init(state, words)` find the first key's sensor word at `words`, put drive words
/// `drive_offset` bytes behind sensor words, and keep no register but SP; so does
/// `NAME_begin(state, word, key)`, which prepares one key as `NAME_init` prepares all, once that
/// has run.
///
/// # Errors
/// Too many keys or modes; a bug.
pub fn compile_for_frame(
    modes: &Modes,
    options: &Options,
    abi: &TickAbi,
) -> Result<Built, ThumbError> {
    build(modes, options, Some(abi), CodeCache::of_process())
}

/// Registers that point into known memory while keys are ticked; they go on in steps, by constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Points {
    /// Into `NAME_state`.
    pub state: [u8; 2],
    /// Into `NAME_histories`, where they lie apart.
    pub histories: u8,
    /// Into the rows of words.
    pub words: u8,
}

/// Those of all code for keys.
pub const POINTS: Points = Points {
    state: [registers::STATE, registers::RECORD],
    histories: registers::HISTORY,
    words: registers::SAMPLES,
};

/// Bytes of a key's record.
pub fn record_bytes(kernel: &Kernel, options: &Options) -> u32 {
    StateLayout::new(kernel, options, None, 0).record
}

/// The ring of events of so many keys, its beginning at 0, and the bytes of all events that a tick
/// can have; none where keys have no events.
pub fn event_ring(kernel: &Kernel, keys: u32) -> Option<(EventRing, u32)> {
    state_layout::event_ring(kernel, keys)
}

/// Everything that the bytes are made of.
struct Parts<'m> {
    /// Modes that read what is shared.
    modes: Cow<'m, Modes>,
    layout: StateLayout,
    /// Where the live values lie that a tick adds.
    shared_ranges: Vec<Range>,
    literals: Literals,
    core: Core,
    made: CompiledCode,
}

fn build(
    modes: &Modes,
    options: &Options,
    abi: Option<&TickAbi>,
    cache: &CodeCache,
) -> Result<Built, ThumbError> {
    let origin: ObjectOrigin = (modes, options, abi);
    let built = cache.objects.get_or_make(&origin, || {
        build_object(compile_parts(modes, options, abi, cache)?, options)
    });
    built.map(Arc::unwrap_or_clone)
}

/// All code with registers.
fn compile_parts<'m>(
    own: &'m Modes,
    options: &Options,
    abi: Option<&TickAbi>,
    cache: &CodeCache,
) -> Result<Parts<'m>, ThumbError> {
    if options.keys == 0 || options.keys > 1 << 16 {
        return Err(ThumbError::Keys(options.keys));
    }
    if own.modes.len() + own.kernel.tables.len() > LITERALS_MAX / 2 {
        return Err(ThumbError::Modes(own.modes.len()));
    }
    let shares = abi.is_none_or(|abi| abi.shares);
    let (modes, shared) = match shares {
        false => (Cow::Borrowed(own), TickInvariants::default()),
        true => tick_invariant::hoist_invariants(own),
    };
    let kernel = &modes.kernel;
    let mut layout = StateLayout::new(kernel, options, abi, shared.results.len());
    let core = timing(options.arch);
    let shared_ranges = shared.ranges(kernel);
    let of_any_values = kernel.for_any_values();
    let compiler = Compiler {
        kernel: &of_any_values,
        modes: &modes.modes,
        layout: &layout,
        shared: &shared_ranges,
        core: &core,
        cache,
    };
    let CompiledModes {
        code,
        chosen,
        mut literals,
        promotions,
    } = compile_modes(&compiler, own, shares)?;
    let made = CompiledCode {
        modes: code,
        chosen,
        init: search::compile_init(&compiler, &mut literals)?,
        shared: search::compile_invariants(&compiler, &mut literals, &shared)?,
    };
    layout.promoted = promotions;
    layout.close(literals.all().len());
    if layout.size.max(layout.size_apart) > 1 << 24 {
        return Err(ThumbError::Keys(options.keys));
    }
    Ok(Parts {
        modes,
        layout,
        shared_ranges,
        literals,
        core,
        made,
    })
}

/// The code of all modes, which is the same for any number of keys but for how far words out are
/// from words in. `own` are the modes before what all keys share was taken out of them, if it was.
fn compile_modes(
    compiler: &Compiler,
    own: &Modes,
    shares: bool,
) -> Result<CompiledModes, ThumbError> {
    let features = Features::of(compiler.core.arch);
    let (of_any, short) = compiler.layout.for_any_keys(compiler.kernel, features);
    let origin = ModesOrigin {
        kernel: compiler.kernel,
        modes: &own.modes,
        layout: &of_any,
        shares,
        arch: compiler.core.arch,
    };
    let of_any = Compiler {
        layout: &of_any,
        ..*compiler
    };
    let kept = &compiler.cache.modes;
    let compiled = kept.get_or_make(&origin, || search::compile_modes(&of_any))?;
    let mut compiled = Arc::unwrap_or_clone(compiled);
    let code = compiled.code.iter_mut();
    code.for_each(|mode| put_distance(mode, short));
    Ok(compiled)
}

/// Puts in by how much words out are farther from words in than selection knew.
fn put_distance(code: &mut Allocated, short: u32) {
    let insts = code.blocks.iter_mut().flat_map(|block| &mut block.code);
    for inst in insts.filter(|inst| inst.access == Access::Write(WORDS_OUT)) {
        inst.inst.imm += short;
    }
}

/// The object of all code and its memory.
fn build_object(parts: Parts, options: &Options) -> Result<Built, ThumbError> {
    let modes = &parts.modes;
    let name = &options.name;
    let written = |off_path| {
        let (layout, core) = (&parts.layout, &parts.core);
        let program = write_program(layout, core, &modes.kernel, name, &parts.made, off_path);
        assemble(program.items, program.labels, core.arch, name)
    };
    let code = match written(OffPath::Behind) {
        Err(ThumbError::Branches { .. }) => written(OffPath::Near)?,
        code => code?,
    };
    let mut object = assemble_object(&modes.kernel, &parts.layout, options, &parts.literals, code);
    v6m::add_routines(&mut object, options)?;
    wave::add_routines(&mut object, &modes.kernel, &parts.layout, options)?;
    Ok(Built {
        object,
        layout: parts.layout,
    })
}

/// Code with registers: of all modes, of `init`, and of what a tick computes at its entry, if there
/// is such.
struct CompiledCode {
    modes: IdMap<ModeId, Allocated>,
    chosen: IdMap<ModeId, Chosen>,
    init: Allocated,
    shared: Option<Allocated>,
}
