//! The only unsafe code of the emulator: calling what was translated, being called by it, and
//! freeing it.

use super::unit::{Exit, Time};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::Op;
use cranelift_codegen::ir::types::I64;
use cranelift_codegen::ir::{AbiParam, Signature};
use cranelift_codegen::isa::{OwnedTargetIsa, TargetFrontendConfig};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{Module, default_libcall_names};

/// What is compiled: of a core, the bus, the maps of pages that are read and written, the place of
/// page number 1 less a page, and time. How it ended (`Exit::of`).
type Function =
    unsafe extern "C" fn(*mut Cpu, *mut Bus, *const u32, *const u32, *mut u8, *mut Time) -> u64;

/// Translated blocks. They are dropped with their first block, before or with the host that made
/// them.
#[derive(Clone, Copy)]
pub(crate) struct Native(Function);

/// Addresses of the interpreter, for translated code.
#[derive(Clone, Copy)]
pub(crate) struct Helpers {
    /// Runs an instruction.
    pub run: i64,
    /// Runs one whose condition has been met.
    pub body: i64,
}

/// Machine code for this computer; nothing when Cranelift does not know it.
#[derive(Default)]
pub(crate) struct Host {
    isa: Option<OwnedTargetIsa>,
    module: Option<JITModule>,
    room: FunctionBuilderContext,
    failed: bool,
}

impl Host {
    /// Compiles a function that is filled; nothing where that cannot be done.
    pub fn define(
        &mut self,
        fill: impl FnOnce(FunctionBuilder, Helpers, TargetFrontendConfig),
    ) -> Option<Native> {
        if self.failed {
            return None;
        }
        let code = self.try_define(fill);
        self.failed = code.is_none();
        code
    }

    #[allow(unsafe_code)]
    fn try_define(
        &mut self,
        fill: impl FnOnce(FunctionBuilder, Helpers, TargetFrontendConfig),
    ) -> Option<Native> {
        let module = match &mut self.module {
            Some(module) => module,
            none => {
                let isa = match &self.isa {
                    Some(isa) => isa.clone(),
                    None => self.isa.insert(isa()?).clone(),
                };
                let builder = JITBuilder::with_isa(isa, default_libcall_names());
                none.insert(JITModule::new(builder))
            }
        };
        let mut context = module.make_context();
        context.func.signature = signature(module.make_signature(), 6);
        let id = module
            .declare_anonymous_function(&context.func.signature)
            .ok()?;
        let helpers = Helpers {
            run: run as *const () as i64,
            body: body as *const () as i64,
        };
        let builder = FunctionBuilder::new(&mut context.func, &mut self.room);
        fill(builder, helpers, module.target_config());
        module.define_function(id, &mut context).ok()?;
        module.finalize_definitions().ok()?;
        let address = module.get_finalized_function(id);
        // SAFETY: the function was just compiled with the signature `Function`.
        Some(Native(unsafe {
            std::mem::transmute::<*const u8, Function>(address)
        }))
    }
}

impl Host {
    /// Frees all code; nobody may have any of it.
    #[allow(unsafe_code)]
    pub fn clear(&mut self) {
        if let Some(module) = self.module.take() {
            // SAFETY: the code runs only inside `Native::run`, which has returned, and blocks with
            // pointers to it are dropped before (`crate::code::Code::clear`) or with their core.
            unsafe { module.free_memory() }
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.clear();
    }
}

impl Native {
    /// Runs blocks.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn run(self, cpu: &mut Cpu, bus: &mut Bus, time: &mut Time) -> Exit {
        let (cpu, bus): (*mut Cpu, *mut Bus) = (cpu, bus);
        // SAFETY: `bus` was a reference just now, and nobody else has one.
        let (reads, writes, pages) = unsafe { (*bus).memory.places() };
        // SAFETY: the code was made by `emitter` for exactly these types. It reads and writes
        // fields of the core and of time by their offsets, and bytes of a page at a page number
        // that a map has, which is one of the pages there are (`Memory` never removes one); the
        // offset in the page is masked. The pointers stay valid during the call: the maps and the
        // pages are made once. Nobody else has a reference to the core or the bus meanwhile but
        // `run` and `body` below.
        Exit::of(unsafe { (self.0)(cpu, bus, reads, writes, pages.wrapping_sub(PAGE), time) })
    }
}

impl Native {
    /// Runs blocks of a core that runs apart.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn run_apart(self, cpu: &mut Cpu, bus: &mut Bus, time: &mut Time) -> Exit {
        let trail = &mut bus.trail;
        time.accesses = trail.accesses.reserve(2 * ACCESSES_MAX);
        time.replaced = trail.replaced.reserve(2 * ACCESSES_MAX);
        time.stretches = trail.stretches.reserve(STRETCHES_MAX + 1);
        time.accesses_max = trail.accesses.len() + ACCESSES_MAX;
        time.stretches_max = trail.stretches.len() + STRETCHES_MAX;
        let (cpu, bus): (*mut Cpu, *mut Bus) = (cpu, bus);
        // SAFETY: `bus` was a reference just now, and nobody else has one.
        let (reads, writes, pages, stripes) = unsafe { (*bus).memory.places_apart() };
        time.stripes = stripes;
        // SAFETY: as above. Besides, it reads the ports of pages there are, and notes accesses,
        // stores and stretches. A block begins only where there is room for all that it can note,
        // so neither the code nor the interpreter runs out of it or moves it meanwhile; each store
        // is also an access.
        Exit::of(unsafe { (self.0)(cpu, bus, reads, writes, pages.wrapping_sub(PAGE), time) })
    }
}

/// What a block of 64 instructions accesses at most, each a list of at most 32 words; twice, since
/// what cannot be done in place may have noted some before.
const ACCESSES_MAX: usize = 2 * 64 * 32;
/// Blocks that run one after the other before somebody makes room again.
const STRETCHES_MAX: usize = 1 << 12;

const PAGE: usize = crate::memory::PAGE;

/// Runs an instruction by the interpreter.
#[allow(unsafe_code)]
unsafe extern "C" fn run(cpu: *mut Cpu, bus: *mut Bus, op: *const Op) -> u64 {
    // SAFETY: translated code hands on what it was called with by `Native::run`, and an instruction
    // of its block, which stands where it was when the block was translated.
    let (cpu, bus, op) = unsafe { (&mut *cpu, &mut *bus, &*op) };
    (op.run)(cpu, bus, op) as u64
}

/// Runs an instruction by the interpreter whose condition has been met.
#[allow(unsafe_code)]
unsafe extern "C" fn body(cpu: *mut Cpu, bus: *mut Bus, op: *const Op) -> u64 {
    // SAFETY: as for `run`.
    let (cpu, bus, op) = unsafe { (&mut *cpu, &mut *bus, &*op) };
    cpu.r[15] = op.pc();
    (op.body)(cpu, bus, op) as u64
}

/// Of so many words of 64 bits, and one as its result.
pub(super) fn signature(mut signature: Signature, parameters: usize) -> Signature {
    signature.params = vec![AbiParam::new(I64); parameters];
    signature.returns = vec![AbiParam::new(I64)];
    signature
}

/// This machine, with everything it can do. Optimizing costs a third of the time of compiling, and
/// gains nothing: what is emitted has little in common that could be shared.
fn isa() -> Option<OwnedTargetIsa> {
    let mut flags = settings::builder();
    let checks = if cfg!(debug_assertions) {
        "true"
    } else {
        "false"
    };
    for (name, value) in [
        ("opt_level", "none"),
        ("is_pic", "false"),
        ("enable_verifier", checks),
    ] {
        flags.set(name, value).ok()?;
    }
    let builder = cranelift_native::builder().ok()?;
    builder.finish(settings::Flags::new(flags)).ok()
}
