//! Parameters that the command line sets: presets, and one by one.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::ValueHint;
use whippen_runtime::preset;

use super::load;
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

    /// Names and values, each name once.
    pub fn all(&self) -> Result<Vec<(String, String)>, Failure> {
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
            all.retain(|(name, _)| preset.iter().all(|(new, _)| new != name));
            all.extend(preset);
        }
        all.retain(|(name, _)| own.iter().all(|(new, _)| new != name));
        all.extend(own);
        Ok(all)
    }
}
