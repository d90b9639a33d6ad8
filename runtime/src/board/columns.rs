//! The columns of a board's file: `[columns]`, its GPIO numbers, converters and times.
//!
//! Not here: what no columns can be (`whippen_compiler::board`).

use whippen_compiler::board::{CONVERTER_RANGES, ColumnWires, Columns};

use super::{CYCLES, one_of, scaled, whole, wholes};
use crate::entries::Entries;
use crate::files::FileError;

/// The converters that the firmware speaks to.
const ADCS: &[(&str, ())] = &[("ADS8688", ())];
const DACS: &[(&str, ())] = &[("DAC8568", ())];
/// Whether a higher code pulls down.
const DIRECTIONS: &[(&str, bool)] = &[("pushes up", false), ("pulls down", true)];

/// The columns, if there are any.
pub(super) fn columns(entries: &Entries) -> Result<Option<Columns>, FileError> {
    if entries.all().all(|(key, _)| !key.starts_with("columns.")) {
        return Ok(None);
    }
    let number = |key: &str| whole(entries, key, entries.text(key)?);
    let to_dac = wholes(entries, "columns.to_dac")?;
    let from_adc = wholes(entries, "columns.from_adc")?;
    if from_adc.len() != to_dac.len() {
        let what = format!(
            "names {} pins, but must be one for each of the {} of `columns.to_dac`",
            from_adc.len(),
            to_dac.len()
        );
        return Err(entries.error("columns.from_adc", &what));
    }
    one_of(entries, "columns.adc", ADCS)?;
    one_of(entries, "columns.dac", DACS)?;
    let ranges = CONVERTER_RANGES.map(|range| (range.name, range));
    let pins = to_dac.into_iter().zip(from_adc);
    let column = |(to_dac, from_adc)| ColumnWires { to_dac, from_adc };
    Ok(Some(Columns {
        clock: number("columns.clock")?,
        select: number("columns.select")?,
        command: number("columns.command")?,
        enable: number("columns.enable")?,
        fault: entries
            .find("columns.fault")
            .map(|_| number("columns.fault"))
            .transpose()?,
        columns: pins.map(column).collect(),
        range: one_of(entries, "columns.range", &ranges)?,
        pulls_down: one_of(entries, "columns.higher_code", DIRECTIONS)?,
        period_cycles: scaled(entries, "columns.period", CYCLES)?,
    }))
}
