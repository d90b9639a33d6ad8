//! Names of symbols and sections.

use super::routine::StringRoutine;

/// Runs one tick: `void NAME_tick(void *state)`.
pub(super) fn tick(name: &str) -> String {
    format!("{name}_tick")
}

/// Prepares all keys for the first tick: `void NAME_init(void *state)`.
pub(super) fn init(name: &str) -> String {
    format!("{name}_init")
}

/// Prepares one key: `void NAME_begin(void *state, const uint16_t *word, uint32_t key)`.
pub(super) fn begin(name: &str) -> String {
    format!("{name}_begin")
}

/// All memory of a core's keys.
pub(super) fn state(name: &str) -> String {
    format!("{name}_state")
}

/// The ring of events of a core's keys, where it lies apart from their state.
pub(super) fn events(name: &str) -> String {
    format!("{name}_events")
}

/// Histories of a core's keys, where they lie apart from their state.
pub(super) fn histories(name: &str) -> String {
    format!("{name}_histories")
}

/// The code of a mode.
pub(super) fn mode(name: &str, mode: whippen_modes::ModeId) -> String {
    format!("{name}.mode.{mode}")
}

/// What runs after the last key.
pub(super) fn end(name: &str) -> String {
    format!("{name}.end")
}

/// A routine that code calls.
pub(super) fn routine(name: &str, routine: &str) -> String {
    format!("{name}.{routine}")
}

/// The tick of a string.
pub(super) fn string(name: &str, string: StringRoutine) -> String {
    let [u, v] = string.cells;
    let [left, right] = string
        .clamped
        .map(|clamped| if clamped { "c" } else { "p" });
    format!("{name}.wave.{u}.{v}.{left}{right}")
}

/// A table of constants.
pub(super) fn table(name: &str, table: u32) -> String {
    format!("{name}.table.{table}")
}
