//! Machine code for the computer this runs on: a Kernel compiled by Cranelift, as a second engine beside `interp`.
//!
//! `init` and `tick` become one function each, with the loop over the keys inside:
//!
//! ```text
//! entry:  bases of all buffers, rows of this tick for every (line, ticks) that is read or pushed
//! keys:   index of the key and its record step along                   <---+
//!         `if` -> branches and a merge, `loop` -> a loop, `select` -> cmov  |
//!         next key --------------------------------------------------------+
//! ```
//!
//! It works on the same [`Memory`] as the interpreter and agrees with it in every byte. The proofs of `verify` carry
//! over: since no value can leave its range, 32-bit values live sign-extended in 64-bit registers, where their
//! operators give the same results, and neither `widen` nor `narrow` costs anything.
//!
//! The only unsafe code of the compiler is in this file: calling what Cranelift made, and freeing it.

mod compile;
mod frame;
mod translate;

use crate::kernel::{Code, EngineError, Kernel, Loaded, Memory, without_probes};
use compile::Compiled;
use frame::BUFFERS;

/// How to compile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Whether probes are kept. Without them, and without what only they need, a kernel runs faster; `probes()` is
    /// empty.
    pub probes: bool,
}

/// A compiled kernel.
pub type HostCode = Loaded<HostFunctions>;

/// The machine code of a kernel.
pub struct HostFunctions {
    /// All tables, one after the other.
    tables: Vec<i32>,
    code: Option<Compiled>,
}

/// What is compiled: the argument points to the bases of all buffers.
type Function = unsafe extern "C" fn(*const [*mut u8; BUFFERS]);

impl Loaded<HostFunctions> {
    /// Compiles a kernel for so many keys; `init` comes first.
    ///
    /// # Errors
    /// The kernel does not verify; too many keys or too much memory; Cranelift does not know this machine.
    pub fn build(kernel: &Kernel, keys: usize, options: Options) -> Result<HostCode, EngineError> {
        let memory = Memory::new(kernel, keys)?;
        let (kernel, memory) = if options.probes {
            (kernel.clone(), memory)
        } else {
            let kernel = without_probes(kernel);
            let memory = Memory::new(&kernel, keys)?;
            (kernel, memory)
        };
        let tables = kernel.tables.iter().flat_map(|table| &table.values).copied().collect();
        let code = compile::compile(&kernel, &memory.layout).map_err(EngineError::Host)?;
        Ok(Loaded::new_with(kernel, memory, HostFunctions { tables, code: Some(code) }))
    }
}

impl Code for HostFunctions {
    #[allow(unsafe_code)]
    fn run(&mut self, tick: bool, _: &Kernel, memory: &mut Memory, inputs: &[u16], outputs: &mut [i16]) {
        let Some(address) = self.code.as_ref().and_then(|code| if tick { code.tick } else { code.init }) else {
            return;
        };
        // In the order of `frame::Buffer`. What is declared as `*const` there is only read by the code.
        let buffers: [*mut u8; BUFFERS] = [
            inputs.as_ptr().cast_mut().cast(),
            outputs.as_mut_ptr().cast(),
            memory.records.as_mut_ptr().cast(),
            memory.narrow.as_mut_ptr().cast(),
            memory.wide.as_mut_ptr().cast(),
            memory.rings.as_mut_ptr().cast(),
            memory.lives.as_mut_ptr().cast(),
            self.tables.as_mut_ptr().cast(),
            memory.events.as_mut_ptr().cast(),
            memory.probes.as_mut_ptr().cast(),
            (&raw mut memory.clock).cast(),
        ];
        // SAFETY: `address` was made by `compile` with the signature `Function` and lives as long as `self.code`.
        let function: Function = unsafe { std::mem::transmute::<*const u8, Function>(address) };
        // SAFETY: only `Loaded` calls this, with the kernel and the memory that the code was translated for, and the
        // code touches nothing but the buffers. Their lengths follow from the memory's layout alone (`Memory` never
        // resizes them), those of the words were checked by `Loaded`. Indices into cells, tables and lines were
        // proven inside by `verify`; the proof holds since inputs are clamped to their ranges, and live values and cells can only be set within
        // theirs. In a kernel that assumes anything, where the proof may not hold, the code itself holds indices
        // inside and divisions from trapping.
        unsafe { function(&raw const buffers) }
    }
}

#[allow(unsafe_code)]
impl Drop for HostFunctions {
    fn drop(&mut self) {
        if let Some(code) = self.code.take() {
            // SAFETY: the code runs only inside `run`, which has returned, and no pointer into it is handed out.
            unsafe { code.module.free_memory() }
        }
    }
}
