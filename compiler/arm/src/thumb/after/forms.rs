//! The forms of a mode's code from selection to the final order of its instructions.

use super::super::code_cache::CodeCache;
use super::super::compile::{CompileUnit, Compiler};
use super::super::func::{Allocated, Func};
use super::super::reorder::OrderCache;
use super::super::{Parts, ThumbError};
use whippen_modes::ModeId;

/// A mode's code after each pass.
pub(super) struct ModeForms {
    pub selected: Func,
    pub promoted: Func,
    pub scheduled: Func,
    pub allocated: Allocated,
    pub reordered: Allocated,
}

/// The forms of a mode by the strategy that was chosen for it. The last of them must be the code
/// that was chosen.
pub(super) fn forms_of(parts: &mut Parts, mode: ModeId) -> Result<ModeForms, ThumbError> {
    let chosen = parts.made.chosen[mode];
    let cache = CodeCache::new();
    let compiler = Compiler {
        kernel: &parts.modes.kernel,
        modes: &parts.modes.modes,
        layout: &parts.layout,
        shared: &parts.shared_ranges,
        core: &parts.core,
        cache: &cache,
    };
    let selected = compiler.select(
        CompileUnit::Mode(mode),
        chosen.strategy,
        &mut parts.literals,
    );
    let promoted = parts.layout.promoted.promote_in(selected.clone());
    let scheduled = compiler.schedule(promoted.clone(), chosen.strategy)?;
    let allocated = compiler.allocate(&scheduled)?;
    let reordered = match chosen.reordered {
        true => compiler
            .reorder(&allocated, &OrderCache::default())?
            .0
            .clone(),
        false => allocated.clone(),
    };
    let expected = parts.made.modes[mode].to_string();
    if reordered.to_string() != expected {
        return Err(ThumbError::Bug(format!(
            "mode {mode} is compiled otherwise the second time:\n{expected}\n{reordered}"
        )));
    }
    Ok(ModeForms {
        selected: selected.into_reverse_postorder(),
        promoted: promoted.into_reverse_postorder(),
        scheduled,
        allocated,
        reordered,
    })
}
