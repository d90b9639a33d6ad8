//! The forms of a mode's code from selection to the final order of its instructions.

use super::super::allocate::{Allocated, allocate};
use super::super::minst::Func;
use super::super::reorder::OrderCache;
use super::super::search::{reorder_and_hoist, schedule_within, select_mode};
use super::super::{Parts, ThumbError};

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
pub(super) fn forms_of(parts: &mut Parts, mode: usize) -> Result<ModeForms, ThumbError> {
    let (chosen, core) = (parts.made.chosen[mode], &parts.core);
    let (layout, literals) = (&parts.layout, &mut parts.literals);
    let selected = select_mode(&parts.modes, mode, chosen.strategy, layout, literals, core);
    let promoted = layout.promoted.promote_in(selected.clone());
    let scheduled = schedule_within(promoted.clone(), chosen.strategy.pressure_limit, core);
    let allocated = allocate(&scheduled, core.arch).map_err(ThumbError::Bug)?;
    let mut reordered = allocated.clone();
    if chosen.reordered {
        reorder_and_hoist(&mut reordered, core, &OrderCache::default())?;
    }
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
