//! Modes as wide as they are proven: what the verifier follows, taken for what is declared.

use super::Checker;
use crate::facts::meet;
use crate::tuning;
use crate::{ModeId, Modes};
use whippen_ids::IdMap;
use whippen_kernel::Range;

/// Declares values, and what modes are entered with, as wide as they are proven again.
///
/// Who made a mode followed a path of decisions, and may have known of a value what no branch in
/// the code says any more: because the condition was simplified after the fact was drawn from it,
/// or because the code behind it became that of another path, too. A wider range is as true, so
/// only what does not fit even then is a failure of [`super::verify`].
pub fn widen(modes: &mut Modes) {
    let mut ignored = Vec::new();
    for round in 0..=tuning::WIDENING_ROUNDS {
        let mut entries: IdMap<ModeId, Vec<Range>> =
            modes.modes.iter().map(|mode| mode.cells.clone()).collect();
        let mut all = Vec::new();
        for mode in modes.modes.iter() {
            let mut checker = Checker::of(modes, mode, &mut ignored, true);
            checker.mode();
            for (next, cell, range) in checker.left {
                let (entry, declared) = (&mut entries[next][cell], modes.kernel.cells[cell].range);
                // What memory does not hold is wider than anything that is declared.
                if !entry.contains(range) && declared.contains(range) {
                    *entry = match round {
                        tuning::WIDENING_ROUNDS => declared,
                        _ => entry.union(range),
                    };
                }
            }
            all.push(checker.values);
        }
        for (mode, values) in modes.modes.iter_mut().zip(all) {
            mode.values = values;
        }
        if !enter_wider(modes, entries) {
            return;
        }
    }
}

/// Has modes entered with wider ranges; whether any is wider. Modes that could not be told apart
/// any more stay as they are.
fn enter_wider(modes: &mut Modes, entries: IdMap<ModeId, Vec<Range>>) -> bool {
    let are_apart = |a: &[Range], b: &[Range]| {
        let mut cells = a.iter().zip(b);
        cells.any(|(a, b)| meet(*a, *b).is_empty())
    };
    let ids: Vec<ModeId> = modes.modes.ids().collect();
    let told_apart = |a: &ModeId| {
        let mut others = ids.iter().filter(|b| *b != a);
        others.all(|b| are_apart(&entries[*a], &entries[*b]))
    };
    let mut wider = false;
    if ids.iter().all(told_apart) {
        for (mode, cells) in modes.modes.iter_mut().zip(entries.iter()) {
            wider |= mode.cells != *cells;
            mode.cells.clone_from(cells);
        }
    }
    wider
}
