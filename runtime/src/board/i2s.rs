//! The sound output of a board's file: `[i2s]`, its GPIO numbers.
//!
//! Not here: what no sound output can be (`whippen_compiler::board`).

use whippen_compiler::board::SoundPort;

use super::whole;
use crate::entries::Entries;
use crate::files::FileError;

/// The sound output, if there is one.
pub(super) fn i2s(entries: &Entries) -> Result<Option<SoundPort>, FileError> {
    if entries.all().all(|(key, _)| !key.starts_with("i2s.")) {
        return Ok(None);
    }
    let number = |key: &str| whole(entries, key, entries.text(key)?);
    Ok(Some(SoundPort {
        clock: number("i2s.clock")?,
        side: number("i2s.side")?,
        data: number("i2s.data")?,
    }))
}
