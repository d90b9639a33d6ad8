//! A performance laid out on a keyboard: which key moves when.

use std::path::Path;
use whippen_compiler::rate::Rate;

use whippen_compiler::check::note_name;
use whippen_runtime::gesture::{Move, dip_m};
use whippen_runtime::keyboard::PlayingKey;
use whippen_runtime::midi::{Note, Performance};
use whippen_runtime::stroke::{Stroke, strokes};

use super::played_keyboard::PlayedKeyboard;
use crate::exit::{Failure, Outcome};

/// The performance begins after this much rest (s): softest strokes begin before their notes.
pub const LATER_S: f64 = 0.5;

/// After the last note it goes on for this long (s).
const AFTER_S: f64 = 1.0;

/// The longest that is played (s): the clock of a run has 30 bits of ticks.
const LONGEST_S: f64 = 6.0 * 3600.0;

/// A performance laid out on a keyboard.
pub struct Score {
    pub notes: Vec<Note>,
    pub keys: Vec<PlayingKey>,
    pub strokes: Vec<Vec<Stroke>>,
    /// Notes for which the keyboard has no key, by their numbers; each as often as it occurs.
    outside: Vec<u8>,
    pub ticks: usize,
}

impl Score {
    /// Lays out what begins before so many seconds.
    pub fn new(
        performance: &Performance,
        keyboard: &PlayedKeyboard,
        seconds: Option<f64>,
    ) -> Score {
        let until_s = seconds.unwrap_or(f64::INFINITY);
        let begins = |n: &&Note| n.on_s + LATER_S < until_s;
        let notes: Vec<Note> = performance.notes.iter().filter(begins).copied().collect();
        let layout = &keyboard.layout;
        let (mut keys, mut all) = (Vec::new(), Vec::new());
        for key in layout.first_note..=layout.last_note() {
            let numbered = notes.iter().copied().enumerate();
            let own: Vec<(usize, Note)> = numbered.filter(|(_, n)| n.key == key).collect();
            if !own.is_empty() {
                let index = usize::from(key - layout.first_note);
                let (moves, made) = strokes(&own, LATER_S, dip_m(keyboard.model(index)));
                keys.push(PlayingKey { index, moves });
                all.push(made);
            }
        }
        let end = |m: &Move| m.start_s + m.duration_s + AFTER_S;
        let ends = keys.iter().flat_map(|k| &k.moves).map(end);
        let end_s = ends.fold(0.0, f64::max).min(until_s);
        let numbers = notes.iter().map(|n| n.key);
        let outside = numbers.filter(|&key| layout.key_of_note(key).is_none());
        Score {
            outside: outside.collect(),
            ticks: (end_s * f64::from(keyboard.rate_hz())).ceil() as usize,
            notes,
            keys,
            strokes: all,
        }
    }

    /// Whether there is something to play, and not too much.
    pub fn check(&self, path: &Path, keyboard: &PlayedKeyboard) -> Outcome {
        let (first, last) = keyboard.ends();
        let wrong = if self.keys.is_empty() {
            format!("no note is on the keys {first} .. {last}")
        } else if self.ticks as f64 > LONGEST_S * f64::from(keyboard.rate_hz()) {
            "lasts more than six hours; play a part with --seconds".to_string()
        } else {
            return Ok(());
        };
        Err(Failure::Usage(format!("{}: {wrong}", path.display())))
    }

    /// Leaves out what begins after so many ticks, which nobody heard.
    pub fn end_at(&mut self, ticks: usize, rate_hz: Rate) {
        let end_s = ticks as f64 / f64::from(rate_hz);
        for strokes in &mut self.strokes {
            strokes.retain(|stroke| stroke.start_s < end_s);
        }
        self.ticks = ticks;
    }

    /// What cannot be played, in words.
    pub fn outside(&self, keyboard: &PlayedKeyboard) -> Option<String> {
        let (first, last) = keyboard.ends();
        let count = self.outside.len();
        let mut keys = self.outside.clone();
        keys.sort_unstable();
        keys.dedup();
        let names: Vec<String> = keys.into_iter().map(note_name).collect();
        let names = names.join(", ");
        (count > 0).then(|| {
            format!("{count} notes lie outside of {first} .. {last} and are not played: {names}")
        })
    }
}
