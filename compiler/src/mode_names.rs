//! Modes in the words of the program: `contact is flying, repetition is engaged`.

use whippen_kernel::{Cell, Range};
use whippen_lang::model::Model;
use whippen_modes::{Mode, Modes};

/// What each mode knows of machines, pulses and events, in their order.
pub fn mode_names(model: &Model, modes: &Modes) -> Vec<String> {
    modes
        .modes
        .iter()
        .map(|mode| name(model, &modes.kernel.cells, mode))
        .collect()
}

fn name(model: &Model, cells: &[Cell], mode: &Mode) -> String {
    let known = cells
        .iter()
        .zip(&mode.cells)
        .filter(|(cell, range)| cell.range != **range);
    let parts: Vec<String> = known
        .filter_map(|(cell, range)| part(model, cell, *range))
        .collect();
    if parts.is_empty() {
        "any state".to_string()
    } else {
        parts.join(", ")
    }
}

/// What a cell says, if it is one of a machine, a pulse or an event and says more than its
/// declaration.
fn part(model: &Model, cell: &Cell, range: Range) -> Option<String> {
    let (name, kind) = cell.name.rsplit_once('.')?;
    match kind {
        "state" => {
            let machine = model.machines.iter().find(|machine| machine.name == name)?;
            let states = (range.low..=range.high)
                .filter_map(|state| machine.states.get(usize::try_from(state).ok()?));
            Some(format!(
                "{name} is {}",
                states.cloned().collect::<Vec<_>>().join(" or ")
            ))
        }
        "pulse" if range.high == 0 => Some(format!("no {name}")),
        "pulse" if range.low > 0 => Some(format!("{name} runs")),
        "event" if range.low > 0 => Some(format!("{name} held before")),
        "event" if range.high == 0 => Some(format!("{name} did not hold before")),
        _ => None,
    }
}
