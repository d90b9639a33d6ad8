//! Notes that set pitches: which string of a bank a note is stopped on, as a guitarist's left hand
//! does it.
//!
//! A note is stopped on the highest string that is free and whose own pitch is not above it; of
//! notes that begin together the highest is placed first. Let go, the string is open again. Where
//! there is one pitch alone, the last note that is held has it.

use whippen_compiler::model::{Live, Model};

use super::{Automation, Change, FREQUENCY};
use crate::midi::{Note, Performance};

/// A string is not above a note that is so much lower, which is far less than a cent.
const TUNED: f64 = 1.0 + 1e-5;

/// Notes on strings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fingered {
    /// What the pitches become.
    pub automation: Automation,
    /// Notes that no string was free for, or could be.
    pub unplayed: usize,
}

/// A pitch that notes set.
struct Voice {
    live: usize,
    /// Its pitch if no note has it (Hz), and the lowest and highest that it may have.
    open_hz: f64,
    range_hz: [f64; 2],
    /// The notes that have it, the last one sounds.
    held: Vec<usize>,
}

/// Sets the pitches that are called so, `strings.pitch` those of all strings of a bank, by notes.
///
/// # Errors
/// No live value is called so, or it is no frequency; in words.
pub fn finger(played: &Performance, model: &Model, name: &str) -> Result<Fingered, String> {
    let mut voices = voices(model, name)?;
    let notes = &played.notes;
    let mut fingered = Fingered::default();
    let mut changes = Vec::new();
    for (t_s, step) in steps(notes) {
        let note = match step {
            Step::End(note) | Step::Begin(note) => note,
        };
        let pitch_hz = pitch_hz(notes[note].key);
        let voice = match step {
            Step::End(_) => voices.iter_mut().find(|voice| voice.held.contains(&note)),
            Step::Begin(_) => free(&mut voices, pitch_hz),
        };
        let Some(voice) = voice else {
            fingered.unplayed += usize::from(matches!(step, Step::Begin(_)));
            continue;
        };
        match step {
            Step::Begin(_) => voice.held.push(note),
            Step::End(_) => voice.held.retain(|held| *held != note),
        }
        let sounding = voice
            .held
            .last()
            .map(|held| self::pitch_hz(notes[*held].key));
        changes.push(Change {
            t_s,
            live: voice.live,
            value: sounding.unwrap_or(voice.open_hz),
        });
    }
    fingered.automation = Automation::new(changes);
    Ok(fingered)
}

/// What a note does.
#[derive(Clone, Copy)]
enum Step {
    End(usize),
    Begin(usize),
}

/// Ends before beginnings at one time, and the highest beginning first; a note that has no length
/// is none.
fn steps(notes: &[Note]) -> Vec<(f64, Step)> {
    let lasting = (notes.iter().enumerate()).filter(|(_, note)| note.off_s > note.on_s);
    let both =
        |(at, note): (usize, &Note)| [(note.on_s, Step::Begin(at)), (note.off_s, Step::End(at))];
    let mut steps: Vec<(f64, Step)> = lasting.flat_map(both).collect();
    let order = |step: &Step| match step {
        Step::End(_) => 0,
        Step::Begin(note) => 1 + 127 - i32::from(notes[*note].key),
    };
    steps.sort_by(|a, b| a.0.total_cmp(&b.0).then(order(&a.1).cmp(&order(&b.1))));
    steps
}

/// Where a note of this pitch is stopped.
fn free(voices: &mut [Voice], pitch_hz: f64) -> Option<&mut Voice> {
    let is_alone = voices.len() == 1;
    let takes = |voice: &&mut Voice| {
        let [low, high] = voice.range_hz;
        let is_free = voice.held.is_empty() && voice.open_hz <= pitch_hz * TUNED;
        (is_alone || is_free) && (low..=high).contains(&pitch_hz)
    };
    let takers = voices.iter_mut().filter(takes);
    takers.max_by(|a, b| a.open_hz.total_cmp(&b.open_hz))
}

fn voices(model: &Model, name: &str) -> Result<Vec<Voice>, String> {
    let all = model.lives.iter().enumerate();
    let found: Vec<(usize, &Live)> = all
        .filter(|(_, live)| is_called(&live.name, name))
        .collect();
    let is_pitch = |live: &Live| live.dim == Some(FREQUENCY);
    if let Some((_, live)) = found.iter().find(|(_, live)| !is_pitch(live)) {
        return Err(format!("`{}` is no frequency", live.name));
    }
    if found.is_empty() {
        let pitches = model.lives.iter().filter(|live| is_pitch(live));
        let mut names: Vec<String> = pitches.map(|live| without_number(&live.name)).collect();
        names.dedup();
        return Err(match names.is_empty() {
            true => format!("`{}` has no live pitch", model.name),
            false => format!(
                "`{name}` is no live pitch of `{}`, but `{}`",
                model.name,
                names.join("`, `")
            ),
        });
    }
    let voice = |(live, of): (usize, &Live)| Voice {
        live,
        open_hz: of.value,
        range_hz: [of.range.low, of.range.high],
        held: Vec::new(),
    };
    Ok(found.into_iter().map(voice).collect())
}

/// Whether a live value is called so, or is of a member of a bank whose values are.
fn is_called(live: &str, name: &str) -> bool {
    live == name || without_number(live) == name
}

/// `strings[2].pitch` as `strings.pitch`.
fn without_number(name: &str) -> String {
    let mut pieces = name.split('[');
    let first = pieces.next().unwrap_or_default().to_string();
    pieces.fold(first, |all, piece| {
        all + piece.split_once(']').map_or(piece, |(_, rest)| rest)
    })
}

/// Of a MIDI number, in equal temperament with A4 at 440 Hz.
fn pitch_hz(key: u8) -> f64 {
    440.0 * libm::exp2((f64::from(key) - 69.0) / 12.0)
}
