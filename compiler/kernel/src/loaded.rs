//! A kernel ready to run: its keys' memory, and code that works on it.
//!
//! ```text
//!   Loaded<C> = kernel + memory + C      C: Interpreter (the reference), JitFunctions (machine code)
//! ```
//!
//! What a host may do with an engine is written here once, for all of them: start, tick, and look
//! into memory or change it between ticks, within the declared ranges.
//!
//! Not here: how code runs (`interp`, `jit`).

use super::{EngineError, Happened, Kernel, Memory};

/// What runs a kernel. Only [`Loaded`] calls it, always with the kernel and the memory that the
/// code was made for.
pub trait Code {
    /// Runs `init`, or `tick`, for every key. There is one word per key and port, `outputs` is
    /// empty in `init`.
    fn run(
        &mut self,
        tick: bool,
        kernel: &Kernel,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    );
}

/// A kernel, the memory of its keys, and what runs it.
#[derive(Debug, Clone)]
pub struct Loaded<C> {
    kernel: Kernel,
    memory: Memory,
    code: C,
}

impl<C> Loaded<C> {
    /// `memory` and `code` must have been made for this kernel.
    pub fn new_with(kernel: Kernel, memory: Memory, code: C) -> Loaded<C> {
        Loaded {
            kernel,
            memory,
            code,
        }
    }

    /// What runs the kernel.
    pub fn code(&self) -> &C {
        &self.code
    }
}

/// Gives an engine of another crate, which wraps a [`Loaded`] to have functions of its own, all
/// that a [`Loaded`] does.
#[macro_export]
macro_rules! deref_to_loaded {
    ($engine:ty, $code:ty) => {
        impl std::ops::Deref for $engine {
            type Target = $crate::Loaded<$code>;

            fn deref(&self) -> &Self::Target {
                &self.0
            }
        }

        impl std::ops::DerefMut for $engine {
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.0
            }
        }
    };
}

impl<C: Code> Loaded<C> {
    /// Puts the memory back to its start (live values stay) and runs `init` for every key.
    ///
    /// # Panics
    /// If `inputs` has not one word per key and port, key after key.
    pub fn init(&mut self, inputs: &[u16]) {
        self.memory.reset(&self.kernel);
        self.call(false, inputs, &mut []);
    }

    /// Runs one tick for every key.
    ///
    /// # Panics
    /// If `inputs` or `outputs` have not one word per key and port, key after key.
    pub fn tick(&mut self, inputs: &[u16], outputs: &mut [i16]) {
        assert_eq!(
            outputs.len(),
            self.memory.keys() * self.kernel.outputs.len(),
            "one output word per key and port"
        );
        self.call(true, inputs, outputs);
        self.memory.advance();
    }

    /// What was exported in the last tick: key after key, probe after probe.
    pub fn probes(&self) -> &[i64] {
        self.memory.probes()
    }

    /// The events since the last call, in the order of ticks, then keys.
    pub fn drain_events(&mut self) -> Vec<Happened> {
        self.memory.drain_events(&self.kernel)
    }

    /// Changes a live value.
    ///
    /// # Errors
    /// There is none with this index; the value is outside its range.
    pub fn set_live(&mut self, live: usize, value: i32) -> Result<(), EngineError> {
        self.memory.set_live(&self.kernel, live, value)
    }

    /// A word of a cell; none if there is no such key, cell or word.
    pub fn cell(&self, key: usize, cell: usize, word: usize) -> Option<i64> {
        self.memory.cell(&self.kernel, key, cell, word)
    }

    /// Changes a word of a cell.
    ///
    /// # Errors
    /// No such key, cell or word; the value is outside the cell's range.
    pub fn set_cell(
        &mut self,
        key: usize,
        cell: usize,
        word: usize,
        value: i64,
    ) -> Result<(), EngineError> {
        self.memory.set_cell(&self.kernel, key, cell, word, value)
    }

    /// All memory.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    fn call(&mut self, tick: bool, inputs: &[u16], outputs: &mut [i16]) {
        assert_eq!(
            inputs.len(),
            self.memory.keys() * self.kernel.inputs.len(),
            "one input word per key and port"
        );
        self.code
            .run(tick, &self.kernel, &mut self.memory, inputs, outputs);
    }
}
