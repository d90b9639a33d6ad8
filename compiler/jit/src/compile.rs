//! Compilation by Cranelift: from a Kernel to finished machine code.

use super::avx512::Sixteen;
use super::lanes::Lanes;
use super::memo;
use super::string;
use super::translate::Translator;
use cranelift_codegen::Context;
use cranelift_codegen::ir::AbiParam;
use cranelift_codegen::ir::types::I64;
use cranelift_codegen::isa::{OwnedTargetIsa, TargetFrontendConfig};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, default_libcall_names};
use whippen_kernel::Kernel;
use whippen_kernel::layout::Layout;

/// Where finished code begins, in bytes: with a line of the cache.
const CODE_ALIGNMENT: u64 = 64;

/// Machine code of one kernel.
pub(super) struct Compiled {
    /// Owns the code.
    pub module: JITModule,
    /// Constants that the code for lanes reads.
    pub constants: Vec<u128>,
    /// How many words a tick needs beside its memory.
    pub room_words: usize,
    /// How many words are kept from one tick to the next.
    pub kept_words: usize,
    init: FuncId,
    single: Option<FuncId>,
    lanes: Option<FuncId>,
    whole: Option<FuncId>,
    part: Option<FuncId>,
}

/// How several keys are to run at once.
pub(super) enum Several<'a> {
    /// They do not.
    Never,
    /// Four.
    Four(&'a Kernel),
    /// Sixteen.
    Sixteen(Sixteen),
}

/// What can be called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    /// `init`, one key after the other.
    Init,
    /// `tick`, one key after the other.
    Single,
    /// `tick`, four keys at once.
    Lanes,
    /// `tick`, sixteen keys at once.
    Whole,
    /// `tick`, some of sixteen keys at once: the last argument has a bit for each.
    Part,
}

impl Compiled {
    /// Compiles `init` of a kernel, its `tick` where it is wanted, and for several keys `tick` of
    /// another with the same memory.
    pub fn new(
        kernel: &Kernel,
        single: bool,
        several: Several,
        layout: &Layout,
    ) -> Result<Compiled, String> {
        let mut module = JITModule::new(JITBuilder::with_isa(isa()?, default_libcall_names()));
        let plan = if single && layout.keys == 1 {
            memo::plan(kernel)
        } else {
            None
        };
        let kept_words = plan.as_ref().map_or(0, |plan| plan.words);
        let alone = |region, plan| {
            move |f: FunctionBuilder, config| {
                Translator::new(kernel, layout, f)
                    .function(region, plan)
                    .finalize(config)
            }
        };
        let (init, ()) = define(&mut module, "init", alone(&kernel.init, None))?;
        let single = single
            .then(|| define(&mut module, "tick", alone(&kernel.tick, plan.as_ref())))
            .transpose()?
            .map(|(id, ())| id);
        let mut compiled = Compiled {
            module,
            constants: Vec::new(),
            room_words: string::ROOM_WORDS,
            kept_words,
            init,
            single,
            lanes: None,
            whole: None,
            part: None,
        };
        compiled.several(several, layout)?;
        compiled
            .module
            .finalize_definitions()
            .map_err(|error| error.to_string())?;
        Ok(compiled)
    }

    /// Adds what runs several keys at once.
    fn several(&mut self, several: Several, layout: &Layout) -> Result<(), String> {
        match several {
            Several::Never => {}
            Several::Four(kernel) => {
                let fill = |f: FunctionBuilder, config| {
                    Lanes::new(kernel, layout, f).function(&kernel.tick, config)
                };
                let (lanes, constants) = define(&mut self.module, "lanes", fill)?;
                (self.lanes, self.constants) = (Some(lanes), constants);
            }
            Several::Sixteen(Sixteen {
                whole,
                part,
                constants,
                room_words,
            }) => {
                self.whole = Some(define_bytes(&mut self.module, "whole", &whole)?);
                self.part = Some(define_bytes(&mut self.module, "part", &part)?);
                self.constants = constants;
                self.room_words = self.room_words.max(room_words);
            }
        }
        Ok(())
    }

    /// The address of a function.
    pub fn address(&self, function: Function) -> Option<*const u8> {
        let id = match function {
            Function::Init => Some(self.init),
            Function::Single => self.single,
            Function::Lanes => self.lanes,
            Function::Whole => self.whole,
            Function::Part => self.part,
        };
        id.map(|id| self.module.get_finalized_function(id))
    }
}

/// This machine, with everything it can do.
fn isa() -> Result<OwnedTargetIsa, String> {
    let mut flags = settings::builder();
    let checks = if cfg!(debug_assertions) {
        "true"
    } else {
        "false"
    };
    for (name, value) in [
        ("opt_level", "speed"),
        ("is_pic", "false"),
        ("enable_verifier", checks),
    ] {
        flags.set(name, value).map_err(|error| error.to_string())?;
    }
    let mut builder = cranelift_native::builder()?;
    if cfg!(target_arch = "x86_64") {
        // With these instructions Cranelift makes `vpmullq` of every product in lanes, where
        // `vpmuldq` is enough and faster.
        builder
            .set("has_avx512dq", "false")
            .map_err(|error| error.to_string())?;
    }
    builder
        .finish(settings::Flags::new(flags))
        .map_err(|error| error.to_string())
}

/// Defines a function of the buffers, the first key and the key after the last.
fn define<T>(
    module: &mut JITModule,
    name: &str,
    fill: impl FnOnce(FunctionBuilder, TargetFrontendConfig) -> T,
) -> Result<(FuncId, T), String> {
    let mut context = module.make_context();
    let pointer = AbiParam::new(module.target_config().pointer_type());
    context.func.signature.params = vec![pointer, AbiParam::new(I64), AbiParam::new(I64)];
    let id = module.declare_function(name, Linkage::Local, &context.func.signature);
    let id = id.map_err(|error| error.to_string())?;
    let mut room = FunctionBuilderContext::new();
    let filled = fill(
        FunctionBuilder::new(&mut context.func, &mut room),
        module.target_config(),
    );
    module
        .define_function(id, &mut context)
        .map_err(|error| explain(&context, &error))?;
    Ok((id, filled))
}

/// Takes over finished code of such a function.
fn define_bytes(module: &mut JITModule, name: &str, bytes: &[u8]) -> Result<FuncId, String> {
    let mut signature = module.make_signature();
    let pointer = AbiParam::new(module.target_config().pointer_type());
    signature.params = vec![pointer, AbiParam::new(I64), AbiParam::new(I64)];
    let id = module
        .declare_function(name, Linkage::Local, &signature)
        .map_err(|error| error.to_string())?;
    module
        .define_function_bytes(id, CODE_ALIGNMENT, bytes, &[])
        .map_err(|error| error.to_string())?;
    Ok(id)
}

fn explain(context: &Context, error: &cranelift_module::ModuleError) -> String {
    format!("{error:?}\n{}", context.func.display())
}
