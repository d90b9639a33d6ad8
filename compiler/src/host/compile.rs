//! From a Kernel to finished machine code.

use super::translate::Translator;
use crate::kernel::layout::Layout;
use crate::kernel::{Kernel, Region};
use cranelift_codegen::Context;
use cranelift_codegen::ir::AbiParam;
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, default_libcall_names};

/// Machine code of one kernel.
pub(super) struct Compiled {
    /// Owns the code.
    pub module: JITModule,
    /// Address of `init`; none if there is nothing to do.
    pub init: Option<*const u8>,
    /// Address of `tick`; none if there is nothing to do.
    pub tick: Option<*const u8>,
}

/// Compiles both regions.
pub(super) fn compile(kernel: &Kernel, layout: &Layout) -> Result<Compiled, String> {
    let mut module = JITModule::new(JITBuilder::with_isa(isa()?, default_libcall_names()));
    let init = define(&mut module, kernel, layout, "init", &kernel.init)?;
    let tick = define(&mut module, kernel, layout, "tick", &kernel.tick)?;
    module.finalize_definitions().map_err(|error| error.to_string())?;
    let [init, tick] = [init, tick].map(|id| id.map(|id| module.get_finalized_function(id)));
    Ok(Compiled { module, init, tick })
}

/// This machine, with everything it can do.
fn isa() -> Result<OwnedTargetIsa, String> {
    let mut flags = settings::builder();
    let checks = if cfg!(debug_assertions) { "true" } else { "false" };
    for (name, value) in [("opt_level", "speed"), ("is_pic", "false"), ("enable_verifier", checks)] {
        flags.set(name, value).map_err(|error| error.to_string())?;
    }
    let builder = cranelift_native::builder()?;
    builder.finish(settings::Flags::new(flags)).map_err(|error| error.to_string())
}

fn define(
    module: &mut JITModule,
    kernel: &Kernel,
    layout: &Layout,
    name: &str,
    region: &Region,
) -> Result<Option<FuncId>, String> {
    if region.insts.is_empty() {
        return Ok(None);
    }
    let mut context = module.make_context();
    context.func.signature.params.push(AbiParam::new(module.target_config().pointer_type()));
    let id = module.declare_function(name, Linkage::Local, &context.func.signature);
    let id = id.map_err(|error| error.to_string())?;
    let mut room = FunctionBuilderContext::new();
    let builder = FunctionBuilder::new(&mut context.func, &mut room);
    Translator::new(kernel, layout, builder).function(region).finalize(module.target_config());
    module.define_function(id, &mut context).map_err(|error| explain(&context, &error))?;
    Ok(Some(id))
}

fn explain(context: &Context, error: &cranelift_module::ModuleError) -> String {
    format!("{error:?}\n{}", context.func.display())
}
