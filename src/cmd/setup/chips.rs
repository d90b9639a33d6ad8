//! Several chips that have one keyboard, `--board 'rp2350*2'` or its `board rp2350 * 2`: a run of
//! neighbouring keys each, and an image each, that passes MIDI on to the next chip.
//!
//! ```text
//!   MIDI --> chip 1: lowest keys --serial port--> chip 2 --serial port--> notes of all keys
//! ```
//!
//! Not here: how MIDI is passed on (the firmware), what a chip's cores have (as of one chip).

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use whippen_compiler::check::{Keyboard, note_name};
use whippen_compiler::firmware::{Monitor, SensorTuning, divide_equally, with_values_from};
use whippen_compiler::keyboard::{CHIPS_MAX, KeyRange, Layout};
use whippen_runtime::image::ImageInstrument;

use super::{ImageSetup, SetupArgs};
use crate::exit::{Failure, Outcome};

/// One of several chips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Chip {
    /// From 1, that of the lowest keys.
    pub number: u32,
    /// How many there are.
    pub of: u32,
    /// Its keys, of all.
    pub keys: KeyRange,
    /// MIDI numbers of its lowest and highest key.
    pub notes: [u8; 2],
}

/// A board and how many of it, from `NAME*COUNT`; one where there is no count.
///
/// # Errors
/// The count is none, or too large, in words.
pub fn counted(name: &OsStr) -> Result<(OsString, u32), String> {
    let Some((board, count)) = name.to_str().and_then(|text| text.rsplit_once('*')) else {
        return Ok((name.to_os_string(), 1));
    };
    let chips = count.trim().parse().ok();
    match chips.filter(|chips| (1..=CHIPS_MAX).contains(chips)) {
        Some(chips) => Ok((board.trim_end().into(), chips)),
        None => Err(format!(
            "`{}`: behind the * is how many chips there are, 1 to {CHIPS_MAX}",
            name.display()
        )),
    }
}

/// The keys of each chip: equal parts, the first chips have what is over.
pub fn keys_of_chips(keys: u32, chips: u32) -> Vec<KeyRange> {
    let mut first = 0;
    let part = |count: u32| {
        let keys = KeyRange::new(first, first + count);
        first = keys.end;
        keys
    };
    divide_equally(keys, chips).into_iter().map(part).collect()
}

/// The file of a chip: `piano.chip2.elf` beside `piano.elf`; that one itself of an only chip.
pub fn file_of_chip(path: &Path, number: u32, of: u32) -> PathBuf {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match of {
        1 => path.to_path_buf(),
        _ => path.with_extension(format!("chip{number}.{ending}")),
    }
}

/// That several chips have their serial ports for each other.
pub fn check_no_monitor(chips: u32, monitor: Option<Monitor>) -> Outcome {
    if chips == 1 || monitor.is_none() {
        return Ok(());
    }
    let why = "several chips pass MIDI on by their serial ports, which the monitor takes: give it \
               one chip";
    Err(Failure::Usage(why.to_string()))
}

impl SetupArgs {
    /// How many chips are asked for on the command line.
    pub fn named_chips(&self) -> Result<u32, Failure> {
        Ok(self.board_and_chips(None)?.1)
    }

    /// The board that was named, and how many chips; else as many as the keyboard has.
    pub(super) fn board_and_chips(
        &self,
        keyboard: Option<&Keyboard>,
    ) -> Result<(Option<OsString>, u32), Failure> {
        let counted = self.board.as_deref().map(counted).transpose();
        let counted = counted.map_err(Failure::Usage)?;
        let of_keyboard = keyboard.map_or(1, |own| own.chips);
        Ok(counted.map_or((None, of_keyboard), |(board, chips)| (Some(board), chips)))
    }
}

impl Chip {
    /// Whether it has the highest keys.
    pub fn is_last(&self) -> bool {
        self.number == self.of
    }

    /// It, in words, with its keys.
    pub fn told(&self) -> String {
        let [first, last] = self.notes.map(note_name);
        format!(
            "chip {} of {}, keys {first} .. {last}",
            self.number, self.of
        )
    }

    /// It, with its keys by their numbers from 0.
    pub fn json(&self) -> Value {
        let KeyRange { first, end } = self.keys;
        json!({ "number": self.number, "of": self.of, "keys": [first, end - 1] })
    }
}

impl ImageSetup {
    /// For so many chips.
    pub fn on_chips(self, chips: u32) -> ImageSetup {
        ImageSetup { chips, ..self }
    }

    /// The set-up of each chip, this one where there is only one.
    ///
    /// # Errors
    /// Keys that several chips cannot have.
    pub fn of_chips(&self) -> Result<Vec<ImageSetup>, Failure> {
        if self.chips == 1 {
            return Ok(vec![self.clone()]);
        }
        if !self.first().model.is_of_key() {
            let why = format!("`{}` is played once, by one chip", self.first().model.name);
            return Err(Failure::Usage(why));
        }
        let [least, _] = self.keys_possible();
        if self.keys < least * self.chips {
            let why = format!(
                "{} keys on {} chips, whose cores have one each at least: give {} or more with \
                 --keys",
                self.keys,
                self.chips,
                least * self.chips
            );
            return Err(Failure::Usage(why));
        }
        let layout = self.layout.with_keys(self.keys);
        let layout =
            layout.map_err(|error| Failure::Usage(format!("{error}: leave --keys away")))?;
        let parts = keys_of_chips(self.keys, self.chips);
        let numbered = (1..).zip(parts);
        let chips = numbered.map(|(number, keys)| {
            let notes = [keys.first, keys.end - 1].map(|key| layout.note_of(key));
            let of = self.chips;
            let chip = Chip {
                number,
                of,
                keys,
                notes,
            };
            self.of_chip(&layout, chip)
        });
        chips.collect()
    }

    fn of_chip(&self, layout: &Layout, chip: Chip) -> Result<ImageSetup, Failure> {
        let part = layout.part(chip.keys);
        self.check_parameters(layout, &part, chip)?;
        let tuned = |all: &SensorTuning| SensorTuning {
            tuned: match all.tuned.len() == self.keys as usize {
                true => all.tuned[chip.keys.indices()].to_vec(),
                // As many as there are not, which the firmware tells.
                false => all.tuned.clone(),
            },
            ..all.clone()
        };
        Ok(ImageSetup {
            keys: part.keys,
            layout: part,
            tuning: self.tuning.as_ref().map(tuned),
            chips: 1,
            chip: Some(chip),
            ..self.clone()
        })
    }

    /// That live parameters have the same numbers on each chip, as control changes go to all: they
    /// are numbered through by zones.
    fn check_parameters(&self, all: &Layout, part: &Layout, chip: Chip) -> Result<(), Failure> {
        for (all, own) in all.programs.iter().zip(&part.programs) {
            let has_lives = all.instruments().iter().any(|id| {
                let kernel = &self.instruments[id.index()].lowered.kernel;
                !kernel.lives.is_empty()
            });
            if has_lives && all.zones.len() != own.zones.len() {
                return Err(Failure::Usage(format!(
                    "`{}`: chip {} has no keys of some zone, so its live parameters would have \
                     other numbers than those of the other chips",
                    all.name, chip.number
                )));
            }
        }
        Ok(())
    }

    /// The instruments of all keys as those of this chip's: values per key begin with its first.
    pub fn with_own_keys(&self, instruments: &[ImageInstrument]) -> Vec<ImageInstrument> {
        let first = self.chip.map_or(0, |chip| chip.keys.first);
        let own = |of: &ImageInstrument| {
            let mut own = of.clone();
            own.modes.kernel = with_values_from(&own.modes.kernel, first);
            own
        };
        instruments.iter().map(own).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chips_are_counted_behind_the_name() {
        let of = |text: &str| counted(text.as_ref());
        let board = |name: &str, chips| Ok((OsString::from(name), chips));
        assert_eq!(of("rp2350"), board("rp2350", 1));
        assert_eq!(of("rp2350*2"), board("rp2350", 2));
        assert_eq!(of("boards/mine.toml * 16"), board("boards/mine.toml", 16));
        for wrong in ["rp2350*", "rp2350*0", "rp2350*17", "rp2350*x", "rp2350*-1"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn keys_are_divided_as_over_cores() {
        let ranges = |keys, chips| -> Vec<(u32, u32)> {
            let all = keys_of_chips(keys, chips).into_iter();
            all.map(|keys| (keys.first, keys.end)).collect()
        };
        assert_eq!(ranges(88, 2), [(0, 44), (44, 88)]);
        assert_eq!(ranges(61, 3), [(0, 21), (21, 41), (41, 61)]);
    }

    #[test]
    fn files_say_which_chip_they_are_for() {
        let path = Path::new("out/piano.uf2");
        assert_eq!(file_of_chip(path, 2, 2), Path::new("out/piano.chip2.uf2"));
        assert_eq!(file_of_chip(path, 1, 1), path);
    }
}
