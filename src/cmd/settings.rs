//! Parameters that the command line sets: presets, and one by one.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap::ValueHint;
use whippen_runtime::preset::{self, Preset};

use super::load;
use super::opened::Opened;
use crate::beside;
use crate::exit::Failure;
use crate::hardware::PRESET;

#[derive(Debug, clap::Args)]
pub struct SettingArgs {
    /// Give a parameter another value, such as weight=0.4N
    #[arg(
        long = "set",
        value_name = "NAME=VALUE",
        help_heading = "The instrument"
    )]
    sets: Vec<String>,
    /// Give several parameters the values of a preset, by name (onofrei, open-g, pentatonic) or as
    /// a TOML file; `--set` goes before it, and of several presets the last
    #[arg(long = "preset", value_name = "NAME|FILE.toml", value_hint = ValueHint::FilePath, help_heading = "The instrument")]
    presets: Vec<OsString>,
}

impl SettingArgs {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.presets.iter().filter_map(|named| PRESET.file(named))
    }

    /// Names and values, each name once, for a program.
    ///
    /// # Errors
    /// A preset cannot be read, or is for none of its instruments.
    pub fn all(&self, program: &Opened) -> Result<Vec<(String, String)>, Failure> {
        let own = load::sets(&self.sets)?;
        let mut all: Vec<(String, String)> = Vec::new();
        for named in &self.presets {
            let preset = match PRESET.file(named) {
                Some(path) if path.exists() => {
                    preset::load(&path).map_err(|error| Failure::Usage(error.to_string()))?
                }
                Some(_) => return Err(Failure::Usage(PRESET.absent(named))),
                None => (named.to_str().and_then(preset::bundled))
                    .ok_or_else(|| Failure::Usage(PRESET.absent(named)))?,
            };
            check_for(&preset, named, program)?;
            let sets = preset.sets;
            all.retain(|(name, _)| sets.iter().all(|(new, _)| new != name));
            all.extend(sets);
        }
        all.retain(|(name, _)| own.iter().all(|(new, _)| new != name));
        all.extend(own);
        Ok(all)
    }
}

/// Whether a preset is for an instrument of a program. One that cannot be read is told of later.
fn check_for(preset: &Preset, named: &OsStr, program: &Opened) -> Result<(), Failure> {
    let texts = program.sources.iter();
    let there: Vec<String> = texts
        .flat_map(|(_, text)| beside::instruments(text))
        .collect();
    let wanted = &preset.instruments;
    if wanted.is_empty() || there.is_empty() || there.iter().any(|name| wanted.contains(name)) {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "the preset `{}` is for `{}`, and the program has `{}`",
        named.display(),
        wanted.join("`, `"),
        there.join("`, `")
    )))
}
