//! `run --live` and `run --notes`: live values that change while a run plays.

use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::model::Model;
use whippen_runtime::automation::{self, Automation};
use whippen_runtime::midi;

use super::option;
use crate::exit::Failure;

/// What changes while it plays.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "The instrument")]
pub struct LiveArgs {
    /// Live values over time: a table with titles such as `t_s,volume,strings[0].pitch_hz`; each
    /// holds until the next, an empty cell changes nothing
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath, conflicts_with_all = ["midi", "errors"])]
    live: Option<PathBuf>,
    /// Notes of a MIDI file set this live pitch; that of a bank, such as strings.pitch=riff.mid, as
    /// the left hand of a guitarist does: a note is stopped on the highest free string that is not
    /// above it, and let go the string is open again
    #[arg(long, value_name = "PARAM=FILE.mid", value_parser = option::named_file, conflicts_with_all = ["midi", "errors"])]
    notes: Vec<(String, PathBuf)>,
}

impl LiveArgs {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.live
            .iter()
            .chain(self.notes.iter().map(|(_, path)| path))
    }

    /// What changes, and what is to be said of it.
    pub fn load(&self, model: &Model) -> Result<(Automation, Vec<String>), Failure> {
        let usage = Failure::Usage;
        let (mut all, mut told) = (Automation::default(), Vec::new());
        if let Some(path) = &self.live {
            all = Automation::load(path, model).map_err(|e| usage(e.to_string()))?;
            told.push(format!(
                "{}: live values change {} times",
                path.display(),
                all.len()
            ));
        }
        for (name, path) in &self.notes {
            let played = midi::load(path).map_err(|e| usage(e.to_string()))?;
            let fingered = automation::finger(&played, model, name);
            let fingered = fingered.map_err(|why| usage(format!("--notes: {why}")))?;
            let notes = played.notes.len();
            told.push(format!("{}: {notes} notes set `{name}`", path.display()));
            if fingered.unplayed > 0 {
                told.push(format!(
                    "{} of them are on no string: none is free that is not above them",
                    fingered.unplayed
                ));
            }
            all = all.and(fingered.automation);
        }
        Ok((all, told))
    }
}
