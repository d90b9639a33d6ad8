//! WebAssembly back end: a Kernel as a module that browsers and node run, bit for bit as the
//! interpreter does.
//!
//! ```text
//!   Kernel + keys -> Module { bytes }        exports: memory, init(), tick()
//!
//!   init()   memory as before the first tick (live values stay), then `init` of every key
//!   tick()   one tick of all keys: words in at `inputs`, words out at `outputs`
//! ```
//!
//! A module imports nothing and never grows its memory, so it runs wherever it is loaded, an audio
//! thread included. Where everything lies is told in a custom section named `whippen`, a text of
//! JSON ([`MemoryMap::json`]). All that the interpreter's memory has is there in the same order, so
//! tests compare bytes. Events collect until the host takes them and sets their count to 0.
//!
//! Words are native: `i1` and `i32` are `i32`, `i64` is `i64`; since `verify` proved that nothing
//! leaves its type, no operation is wider than its meaning. Where a kernel `assume`s, indices are
//! held inside, as in every engine.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `memory_map` | where everything lies, and its text |
//! | `body` | instructions and locals of one function |
//! | `translate` | regions, the loop over the keys |
//! | `arithmetic`, `storage` | operators on values, and on memory |
//! | `helpers` | functions that several operators call |
//! | `start` | memory as before the first tick |
//!
//! Not here: a page that loads it, verifying kernels.

mod arithmetic;
mod body;
mod helpers;
mod memory_map;
mod start;
mod storage;
mod translate;

pub use memory_map::MemoryMap;

use std::borrow::Cow;
use std::fmt;

use serde_json::Value;
use wasm_encoder::{
    CodeSection, ConstExpr, CustomSection, DataCountSection, DataSection, ExportKind,
    ExportSection, FunctionSection, MemorySection, MemoryType, Module as Encoder, TypeSection,
    ValType,
};
use whippen_kernel::{EngineError, Kernel, Memory};

use body::Body;
use translate::Translator;

/// Bytes of a page of memory.
const PAGE: u32 = 1 << 16;

/// The most locals that a function may have in any browser.
const LOCALS_MAX: usize = 50_000;

/// A Kernel in WebAssembly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    /// The module.
    pub bytes: Vec<u8>,
    /// Where its memory has what.
    pub map: MemoryMap,
}

/// Why there is no module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WasmError {
    /// The kernel does not verify, or its memory cannot be laid out.
    Engine(EngineError),
    /// All memory takes so many bytes, more than 2 GiB.
    Bytes(u64),
    /// A function has so many values, more than browsers take.
    Values(usize),
}

impl fmt::Display for WasmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WasmError::Engine(error) => error.fmt(f),
            WasmError::Bytes(bytes) => write!(f, "{bytes} bytes of memory, more than 2 GiB"),
            WasmError::Values(count) => {
                write!(f, "{count} values in a tick, more than {LOCALS_MAX}")
            }
        }
    }
}

impl std::error::Error for WasmError {}

/// What a module is told by, in its custom section.
pub const SECTION: &str = "whippen";

/// Translates a kernel for so many keys; what its integers mean stands in the text beside the map,
/// under `meaning`.
///
/// # Errors
/// The kernel does not verify; too many keys, too much memory, too many values.
pub fn module(kernel: &Kernel, keys: usize, meaning: Value) -> Result<Module, WasmError> {
    let memory = Memory::new(kernel, keys).map_err(WasmError::Engine)?;
    let map = MemoryMap::new(kernel, &memory)?;
    let fresh = start::Fresh::of(kernel, &memory, &map);
    let mut parts = Parts::default();
    for helper in helpers::all() {
        parts.add(helper.params, helper.result, helper.body);
    }
    for (is_tick, region) in [(false, &kernel.init), (true, &kernel.tick)] {
        let body = Translator::new(kernel, &memory.layout, &map).function(region, is_tick, &fresh);
        if body.locals() > LOCALS_MAX {
            return Err(WasmError::Values(body.locals()));
        }
        parts.add(&[], None, body);
    }
    for run in &fresh.runs {
        parts.data.passive(run.bytes.iter().copied());
    }
    for (at, bytes) in map.constants(kernel) {
        parts
            .data
            .active(0, &ConstExpr::i32_const(at as i32), bytes);
    }
    let text = map.json(kernel, meaning).to_string();
    let bytes = parts.finish(map.end.div_ceil(PAGE).max(1), &text);
    Ok(Module { bytes, map })
}

/// The sections that grow.
#[derive(Default)]
struct Parts {
    types: TypeSection,
    functions: FunctionSection,
    code: CodeSection,
    data: DataSection,
}

impl Parts {
    /// Adds a function.
    fn add(&mut self, params: &[ValType], result: Option<ValType>, body: Body) {
        self.types.ty().function(params.iter().copied(), result);
        self.functions.function(self.types.len() - 1);
        self.code.function(&body.finish());
    }

    /// The module, with memory of so many pages and a text.
    fn finish(&self, pages: u32, text: &str) -> Vec<u8> {
        let mut memories = MemorySection::new();
        memories.memory(MemoryType {
            minimum: pages.into(),
            maximum: Some(pages.into()),
            memory64: false,
            shared: false,
            page_size_log2: None,
        });
        let mut exports = ExportSection::new();
        exports.export("memory", ExportKind::Memory, 0);
        exports.export("init", ExportKind::Func, helpers::COUNT);
        exports.export("tick", ExportKind::Func, helpers::COUNT + 1);
        let count = self.data.len();
        let mut encoder = Encoder::new();
        encoder
            .section(&self.types)
            .section(&self.functions)
            .section(&memories)
            .section(&exports)
            .section(&DataCountSection { count })
            .section(&self.code)
            .section(&self.data)
            .section(&CustomSection {
                name: Cow::Borrowed(SECTION),
                data: Cow::Borrowed(text.as_bytes()),
            });
        encoder.finish()
    }
}
