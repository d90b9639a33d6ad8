//! Just-in-time compilation of a Kernel for the computer this runs on, by Cranelift and by its own
//! code: a second engine beside `interp`.
//!
//! `init` and `tick` become functions over a stretch of keys, with the loop over the keys inside:
//!
//! ```text
//! entry:  bases of all buffers, rows of this tick for every (line, ticks) that is read or pushed
//! keys:   where the words of this key stand                            <---+
//!         `if` -> branches and a merge, `loop` -> a loop, `select` -> cmov  |
//!         next key --------------------------------------------------------+
//! ```
//!
//! Keyboards run several keys at once: sixteen where the machine has AVX-512 and a tick is made of
//! words (`avx512`), else four (`lanes`), and what is left one by one (`stretches`).
//!
//! All work on the same [`Memory`] as the interpreter and agree with it in every byte. The proofs
//! of `verify` carry over: since no value can leave its range, 32-bit values of a single key live
//! sign-extended in 64-bit registers, where their operators give the same results, and neither
//! `widen` nor `narrow` costs anything.
//!
//! The only unsafe code of the compiler is in this file: calling what was compiled, being called
//! by it, and freeing it.

mod avx512;
mod compile;
mod lanes;
mod loop_context;
mod memo;
#[cfg(test)]
mod random_insts;
mod saturate;
mod stretches;
mod string;
mod translate;
mod wave;
mod zero;

use compile::{Compiled, Function, Several};
use loop_context::{BUFFERS, Buffer};
use std::fmt;
use stretches::{Stretch, stretches};
use whippen_kernel::layout::EVENT_HEAD;
use whippen_kernel::memory::Clock;
use whippen_kernel::{
    Code, EngineError, Kernel, Loaded, Memory, without_probes, without_probes_in_same_memory,
};

/// How to compile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Whether probes are kept. Without them, and without what only they need, a kernel runs
    /// faster; `probes()` is empty.
    pub probes: bool,
}

/// A compiled kernel.
pub struct JitCode(Loaded<JitFunctions>);

impl fmt::Debug for JitCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JitCode").finish_non_exhaustive()
    }
}

whippen_kernel::deref_to_loaded!(JitCode, JitFunctions);

/// The machine code of a kernel.
pub struct JitFunctions {
    /// All tables, one after the other.
    tables: Vec<i32>,
    /// What a tick calls, in the order of the keys.
    stretches: Vec<Stretch>,
    /// Events of a tick of keys in lanes, before they are sorted.
    raised: Vec<u32>,
    /// What a tick needs beside its memory.
    room: Vec<i32>,
    /// What is kept from one tick to the next.
    kept: Vec<i64>,
    code: Option<Compiled>,
}

/// What is compiled: the first argument points to the bases of all buffers.
type Machine = unsafe extern "C" fn(*const [*mut u8; BUFFERS], i64, i64);

impl JitCode {
    /// Compiles a kernel for so many keys; `init` comes first.
    ///
    /// # Errors
    /// The kernel does not verify; too many keys or too much memory; Cranelift does not know this
    /// machine.
    pub fn build(kernel: &Kernel, keys: usize, options: Options) -> Result<JitCode, EngineError> {
        // What does not verify is not taken apart.
        let mut memory = Memory::new(kernel, keys)?;
        let bare = if options.probes {
            None
        } else {
            Some(without_probes(kernel))
        };
        if let Some(bare) = &bare {
            memory = Memory::new(bare, keys)?;
        }
        let kernel = bare.unwrap_or_else(|| kernel.clone());
        let lanes = lanes::suits(&kernel, keys).then_some(&kernel);
        JitFunctions::new(&kernel, lanes, &memory, None)
            .map(|code| JitCode(Loaded::new_with(kernel.clone(), memory, code)))
    }

    /// Compiles a kernel for so many keys of which one is observed: only its probes are kept (those
    /// of its neighbours may be, too), and the other keys run as fast as without.
    ///
    /// # Errors
    /// Those of [`JitCode::build`]; no such key.
    pub fn build_observing(
        kernel: &Kernel,
        keys: usize,
        observed: usize,
    ) -> Result<JitCode, EngineError> {
        let memory = Memory::new(kernel, keys)?;
        if observed >= keys {
            return Err(EngineError::Unknown);
        }
        let bare = without_probes_in_same_memory(kernel);
        let lanes = lanes::suits(&bare, keys).then_some(&bare);
        JitFunctions::new(kernel, lanes, &memory, Some(observed))
            .map(|code| JitCode(Loaded::new_with(kernel.clone(), memory, code)))
    }
}

/// How the keys of a kernel run at once that may run in lanes.
fn several<'a>(lanes: Option<&'a Kernel>, memory: &Memory) -> Several<'a> {
    let sixteen = |kernel| {
        let has_it = avx512::machine_has_it();
        has_it.then(|| avx512::sixteen(kernel, &memory.layout))?
    };
    match (lanes, lanes.and_then(sixteen)) {
        (None, _) => Several::Never,
        (_, Some(sixteen)) => Several::Sixteen(sixteen),
        (Some(kernel), None) => Several::Four(kernel),
    }
}

impl JitFunctions {
    fn new(
        kernel: &Kernel,
        lanes: Option<&Kernel>,
        memory: &Memory,
        observed: Option<usize>,
    ) -> Result<JitFunctions, EngineError> {
        let several = several(lanes, memory);
        let stretches = stretches(memory.keys(), &several, observed);
        let single = stretches
            .iter()
            .any(|stretch| stretch.function == Function::Single);
        let code =
            Compiled::new(kernel, single, several, &memory.layout).map_err(EngineError::Host)?;
        let events = lanes.map_or(0, |kernel| {
            kernel.tick.events_max() as usize * memory.keys()
        });
        Ok(JitFunctions {
            tables: kernel
                .tables
                .iter()
                .flat_map(|table| &table.values)
                .copied()
                .collect(),
            stretches,
            raised: vec![0; events * memory.layout.event_words],
            room: vec![0; code.room_words],
            kept: vec![memo::NO_WORD; code.kept_words],
            code: Some(code),
        })
    }

    /// Runs a stretch of several keys at once; what they tell is sorted by keys.
    fn lanes(
        &mut self,
        stretch: Stretch,
        kernel: &Kernel,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    ) {
        let mut clock = Clock {
            tick: memory.clock.tick,
            ..Clock::default()
        };
        let mut buffers = self.buffers(memory, inputs, outputs);
        buffers[Buffer::Events as usize] = self.raised.as_mut_ptr().cast();
        buffers[Buffer::Clock as usize] = (&raw mut clock).cast();
        self.call(stretch, &buffers);
        if clock.events > 0 {
            self.keep(clock.events as usize, kernel, memory);
        }
    }

    /// Hands on the events that were raised, key by key; those of one key stay in their order.
    fn keep(&self, count: usize, kernel: &Kernel, memory: &mut Memory) {
        let mut records: Vec<&[u32]> = self
            .raised
            .chunks_exact(memory.layout.event_words)
            .take(count)
            .collect();
        records.sort_by_key(|record| record[2]);
        for record in records {
            let args = kernel
                .events
                .get(record[3] as usize)
                .map_or(0, |event| event.args as usize);
            if let Some(room) = memory.event_room() {
                room[2..EVENT_HEAD + args].copy_from_slice(&record[2..EVENT_HEAD + args]);
            }
        }
    }

    /// The bases of all buffers, in the order of `loop_context::Buffer`. What is declared as
    /// `*const` there is only read.
    fn buffers(
        &mut self,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    ) -> [*mut u8; BUFFERS] {
        let constants = self
            .code
            .as_mut()
            .map_or(std::ptr::null_mut(), |code| code.constants.as_mut_ptr());
        [
            inputs.as_ptr().cast_mut().cast(),
            outputs.as_mut_ptr().cast(),
            memory.columns.as_mut_ptr().cast(),
            memory.narrow.as_mut_ptr().cast(),
            memory.wide.as_mut_ptr().cast(),
            memory.rings.as_mut_ptr().cast(),
            memory.lives.as_mut_ptr().cast(),
            self.tables.as_mut_ptr().cast(),
            memory.events.as_mut_ptr().cast(),
            memory.probes.as_mut_ptr().cast(),
            (&raw mut memory.clock).cast(),
            constants.cast(),
            self.room.as_mut_ptr().cast(),
            self.kept.as_mut_ptr().cast(),
        ]
    }

    #[allow(unsafe_code)]
    fn call(&self, stretch: Stretch, buffers: &[*mut u8; BUFFERS]) {
        let Some(address) = self
            .code
            .as_ref()
            .and_then(|code| code.address(stretch.function))
        else {
            return;
        };
        // SAFETY: `address` was made by `compile` with the signature `Machine` and lives as long as
        // `self.code`.
        let machine: Machine = unsafe { std::mem::transmute::<*const u8, Machine>(address) };
        // SAFETY: only `run` calls this, with the buffers of the kernel and the memory that the
        // code was translated for, and the code touches nothing else. Their lengths follow from the
        // memory's layout alone (`Memory` never resizes them), those of the words were checked by
        // `Loaded`, `raised` has room for all events of a tick, and `room` and `constants` are as
        // long as the code says. A stretch lies within the keys; one of whole groups has a multiple
        // of their number, and of part of a group the mask has bits of keys there are. Indices into
        // cells, tables and lines were proven inside by `verify`; the proof holds since inputs are
        // clamped to their ranges, and live values and cells can only be set within theirs. In a
        // kernel that assumes anything, where the proof may not hold, the code itself holds indices
        // inside and divisions from trapping.
        unsafe {
            machine(
                &raw const *buffers,
                stretch.first as i64,
                stretch.end as i64,
            )
        }
    }
}

/// A routine that machine code calls for a tick of a string: one more slope than rates, so many
/// rates, room of `string::ROOM_WORDS`, `k0` to `k3` and how the ends are held.
type StringRoutine =
    unsafe extern "C" fn(*mut i32, *mut i32, *mut i32, usize, i32, i32, i32, i32, i32, i32);

/// Declares a routine for machines with some instructions.
macro_rules! string_routine {
    ($name:ident, $(#[$with:meta])*) => {
        $(#[$with])*
        #[allow(unsafe_code)]
        unsafe extern "C" fn $name(
            e: *mut i32,
            v: *mut i32,
            room: *mut i32,
            count: usize,
            k0: i32,
            k1: i32,
            k2: i32,
            k3: i32,
            first: i32,
            last: i32,
        ) {
            let by = string::Coefficients { k: [k0, k1, k2, k3], ends: [first, last] };
            // SAFETY: machine code calls this with the cells of a string that `verify` has checked
            // (one more slope than rates, in two cells), which lie in the columns that the caller
            // of the machine code lent to it, and with the room of the same `JitFunctions`.
            let (e, v, room) = unsafe {
                (
                    std::slice::from_raw_parts_mut(e, count + 1),
                    std::slice::from_raw_parts_mut(v, count),
                    std::slice::from_raw_parts_mut(room, string::ROOM_WORDS),
                )
            };
            string::tick(e, v, room, &by);
        }
    };
}

string_routine!(string_anywhere,);
#[cfg(target_arch = "x86_64")]
string_routine!(string_avx2, #[target_feature(enable = "avx2")]);
#[cfg(target_arch = "x86_64")]
string_routine!(
    string_avx512,
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
);

/// The address of the routine for this machine, all of whose instructions it has.
fn string_routine() -> i64 {
    #[cfg(target_arch = "x86_64")]
    let routine: StringRoutine = if is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
    {
        string_avx512
    } else if is_x86_feature_detected!("avx2") {
        string_avx2
    } else {
        string_anywhere
    };
    #[cfg(not(target_arch = "x86_64"))]
    let routine: StringRoutine = string_anywhere;
    routine as usize as i64
}

impl Code for JitFunctions {
    fn run(
        &mut self,
        tick: bool,
        kernel: &Kernel,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    ) {
        if !tick {
            let all = Stretch {
                function: Function::Init,
                first: 0,
                end: memory.keys(),
            };
            let buffers = self.buffers(memory, inputs, outputs);
            return self.call(all, &buffers);
        }
        for at in 0..self.stretches.len() {
            let stretch = self.stretches[at];
            if stretch.function != Function::Single {
                self.lanes(stretch, kernel, memory, inputs, outputs);
            } else {
                let buffers = self.buffers(memory, inputs, outputs);
                self.call(stretch, &buffers);
            }
        }
    }
}

#[allow(unsafe_code)]
impl Drop for JitFunctions {
    fn drop(&mut self) {
        if let Some(code) = self.code.take() {
            // SAFETY: the code runs only inside `run`, which has returned, and no pointer into it
            // is handed out.
            unsafe { code.module.free_memory() }
        }
    }
}
