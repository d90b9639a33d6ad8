//! The knob of a board's file: `[knob]`, its GPIO numbers and its times.
//!
//! Not here: what no knob can be (`whippen_compiler::board`).

use whippen_compiler::board::{Knob, Shaft};
use whippen_emulator::KnobPins;

use super::{CYCLES, MILLIVOLTS, address, scaled, whole, wholes};
use crate::entries::Entries;
use crate::files::FileError;

/// The knob, if there is one.
pub(super) fn knob(entries: &Entries) -> Result<Option<Knob>, FileError> {
    if entries.all().all(|(key, _)| !key.starts_with("knob.")) {
        return Ok(None);
    }
    let number = |key: &str| whole(entries, key, entries.text(key)?);
    let data = wholes(entries, "knob.data")?;
    let key = "knob.phases";
    let phases = wholes(entries, key)?;
    if phases.len() != 3 * data.len() {
        let what = "must be three pins for each line of `knob.data`, as in `6 7 8`";
        return Err(entries.error(key, what));
    }
    let shaft = |(data, phases): (&u32, &[u32])| Shaft {
        data: *data,
        phases: [phases[0], phases[1], phases[2]],
    };
    Ok(Some(Knob {
        clock: number("knob.clock")?,
        select: number("knob.select")?,
        shafts: data.iter().zip(phases.chunks(3)).map(shaft).collect(),
        enable: number("knob.enable")?,
        fault: number("knob.fault")?,
        period_cycles: scaled(entries, "knob.period", CYCLES)?,
        ahead_cycles: scaled(entries, "knob.ahead", CYCLES)?,
        supply_mv: scaled(entries, "knob.supply", MILLIVOLTS)?,
        align_mv: scaled(entries, "knob.align", MILLIVOLTS)?,
        pole_pairs: number("knob.pole_pairs")?,
        store: match entries.find("knob.store") {
            Some(_) => Some(address(entries, "knob.store")?),
            None => None,
        },
    }))
}

/// The pins of an emulated chip to which one of the knobs leads.
pub fn knob_pins(all: &Knob, own: &Shaft) -> KnobPins {
    KnobPins {
        select: all.select,
        clock: all.clock,
        data: own.data,
        phases: own.phases,
        enable: all.enable,
        fault: all.fault,
    }
}
