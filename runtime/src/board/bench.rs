//! The key bench of a board's file: `[bench]`, its GPIO numbers and its times.
//!
//! Not here: what no bench can be (`whippen_compiler::board`).

use whippen_compiler::board::Bench;

use super::{CYCLES, MILLIVOLTS, scaled, whole, wholes};
use crate::entries::Entries;
use crate::files::FileError;

/// The bench, if there is one.
pub(super) fn bench(entries: &Entries) -> Result<Option<Bench>, FileError> {
    if entries.all().all(|(key, _)| !key.starts_with("bench.")) {
        return Ok(None);
    }
    let number = |key: &str| whole(entries, key, entries.text(key)?);
    let psram = entries.find("bench.psram").map(|_| number("bench.psram"));
    Ok(Some(Bench {
        sensors: wholes(entries, "bench.sensors")?,
        bridges: wholes(entries, "bench.bridges")?,
        sleep: number("bench.sleep")?,
        fault: number("bench.fault")?,
        psram: psram.transpose()?,
        period_cycles: scaled(entries, "bench.period", CYCLES)?,
        ahead_cycles: scaled(entries, "bench.ahead", CYCLES)?,
        supply_mv: scaled(entries, "bench.supply", MILLIVOLTS)?,
    }))
}
