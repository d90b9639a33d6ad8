//! Presets: TOML files with values for an instrument's parameters, under `[set]`, and `for`, the
//! instruments that they are for.
//!
//! Not here: whether an instrument has these parameters, which the checker says as of any setting.

use std::path::Path;

use whippen_instruments::PRESETS as BUNDLED;

use crate::entries::{Entries, Known};
use crate::files::{FileError, InputKind, read_text};

const KNOWN: &[Known] = &[("for", "keytar"), ("set.*", "0.2 N")];

/// What a preset holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Preset {
    /// The instruments that it is for; any if there is none.
    pub instruments: Vec<String>,
    /// Names and values, as in the file.
    pub sets: Vec<(String, String)>,
}

/// The bundled preset of that name, if there is one.
pub fn bundled(name: &str) -> Option<Preset> {
    let (name, text) = BUNDLED.iter().find(|(bundled, _)| *bundled == name)?;
    let path = Path::new("instruments/presets").join(format!("{name}.toml"));
    Some(read(&path, text).expect("bundled presets are correct"))
}

/// Reads a preset.
///
/// # Errors
/// The file cannot be read, or is no preset.
pub fn load(path: &Path) -> Result<Preset, FileError> {
    read(path, &read_text(path, InputKind::PRESET)?)
}

fn read(path: &Path, text: &str) -> Result<Preset, FileError> {
    let entries = Entries::parse(path, text, KNOWN)?;
    let (mut sets, mut instruments) = (Vec::new(), Vec::new());
    for (key, value) in entries.all() {
        match key.strip_prefix("set.") {
            Some(name) => sets.push((name.to_string(), value.to_string())),
            None => instruments.extend(value.split(',').map(|name| name.trim().to_string())),
        }
    }
    if sets.is_empty() {
        let why = "sets nothing: wanted is `[set]` and below it lines such as `weight = \"0.2 N\"`";
        return Err(FileError::new(path, why));
    }
    Ok(Preset { instruments, sets })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_brackets_and_dots() {
        let preset = bundled("open-g").expect("it is bundled");
        assert_eq!(preset.instruments, ["keytar"]);
        assert!(
            preset
                .sets
                .contains(&("strings[5].pitch".to_string(), "293.665 Hz".to_string()))
        );
    }

    #[test]
    fn commands_may_name_what_is_bundled() {
        let names = whippen_compiler::bundled::presets();
        assert!(names.into_iter().all(|name| bundled(name).is_some()));
    }

    #[test]
    fn what_is_no_preset_says_so() {
        let wrong = |text: &str| {
            let path = Path::new("mine.toml");
            read(path, text).expect_err("it is wrong").to_string()
        };
        assert!(wrong("").contains("sets nothing"));
        assert!(wrong("[sets]\nk = \"1 N\"\n").contains("unknown key `sets.k`"));
        assert!(wrong("[set]\nk = 1\n").contains("must be a string"));
    }
}
