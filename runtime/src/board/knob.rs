//! The knob of a board's file: `[knob]`, its GPIO numbers and its times.
//!
//! Not here: what no knob can be (`whippen_compiler::board`).

use whippen_compiler::board::Knob;

use super::{CYCLES, MILLIVOLTS, scaled, whole, wholes};
use crate::entries::Entries;
use crate::files::FileError;

/// The knob, if there is one.
pub(super) fn knob(entries: &Entries) -> Result<Option<Knob>, FileError> {
    if entries.all().all(|(key, _)| !key.starts_with("knob.")) {
        return Ok(None);
    }
    let number = |key: &str| whole(entries, key, entries.text(key)?);
    let key = "knob.phases";
    let phases = <[u32; 3]>::try_from(wholes(entries, key)?)
        .map_err(|_| entries.error(key, "must be three pins, as in `6 7 8`"))?;
    Ok(Some(Knob {
        clock: number("knob.clock")?,
        select: number("knob.select")?,
        data: number("knob.data")?,
        phases,
        enable: number("knob.enable")?,
        fault: number("knob.fault")?,
        period_cycles: scaled(entries, "knob.period", CYCLES)?,
        ahead_cycles: scaled(entries, "knob.ahead", CYCLES)?,
        supply_mv: scaled(entries, "knob.supply", MILLIVOLTS)?,
        align_mv: scaled(entries, "knob.align", MILLIVOLTS)?,
        pole_pairs: number("knob.pole_pairs")?,
    }))
}
