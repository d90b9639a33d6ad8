//! MIDI files: which keys were played when, and how fast.
//!
//! ```text
//!   tracks --merged by tick--> events --tempo map--> seconds --pairs of on and off--> notes
//! ```
//!
//! Formats 0 and 1 are one performance; the tracks of format 2 are played one after the other.
//! Notes of all channels play on the same keys, without percussion (channel 10). A pedal holds
//! strings, not keys: it is counted and otherwise left out.
//!
//! Not here: how a key moves for a note (`stroke`), which keys there are (`keyboard`).

use std::path::Path;

use midly::{Format, MetaMessage, MidiMessage, Smf, Timing, TrackEventKind};

use crate::files::{FileError, InputKind, read_bytes};

/// Percussion: channel 10, counted from 0.
const PERCUSSION: u8 = 9;

/// The controller that is the sustain pedal.
const SUSTAIN: u8 = 64;

/// Notes on one key that begin within this time (s) are one stroke.
const UNISON_S: f64 = 1e-3;

/// A note.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Note {
    /// MIDI number of the key (60 is C4).
    pub key: u8,
    /// When it begins (s).
    pub on_s: f64,
    /// When it ends (s), not before it begins.
    pub off_s: f64,
    /// How fast it was struck, 1 to 127.
    pub velocity: u8,
    /// How fast it was let go, 0 to 127; 64 where the file does not say.
    pub release: u8,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Performance {
    /// By time, then key.
    pub notes: Vec<Note>,
    /// When the last event is (s).
    pub end_s: f64,
    /// What else one should know about it, in sentences.
    pub told: Vec<String>,
}

/// Reads a MIDI file.
///
/// # Errors
/// The file cannot be read, is no MIDI file, or holds no notes.
pub fn load(path: &Path) -> Result<Performance, FileError> {
    let bytes = read_bytes(path, InputKind::MIDI)?;
    read(&bytes).map_err(|message| FileError::new(path, message))
}

/// Reads the bytes of a MIDI file.
///
/// # Errors
/// They are no MIDI file, or hold no notes; in one sentence.
pub fn read(bytes: &[u8]) -> Result<Performance, String> {
    let smf = Smf::parse(bytes).map_err(|e| format!("is not a MIDI file: {e}"))?;
    let mut reader = Reader::default();
    match smf.header.format {
        Format::Sequential => {
            for track in &smf.tracks {
                let start_s = reader.out.end_s;
                reader.play(
                    events(std::slice::from_ref(track)),
                    smf.header.timing,
                    start_s,
                )?;
            }
        }
        Format::SingleTrack | Format::Parallel => {
            reader.play(events(&smf.tracks), smf.header.timing, 0.0)?
        }
    }
    reader.finish()
}

/// The events of some tracks by tick; at one tick, by track.
fn events<'a>(tracks: &[midly::Track<'a>]) -> Vec<(u64, TrackEventKind<'a>)> {
    let mut all = Vec::new();
    for track in tracks {
        let mut tick = 0_u64;
        for event in track {
            tick += u64::from(event.delta.as_int());
            all.push((tick, event.kind));
        }
    }
    all.sort_by_key(|(tick, _)| *tick);
    all
}

/// Turns events into notes.
#[derive(Default)]
struct Reader {
    out: Performance,
    /// Notes that have not ended: channel and index.
    open: Vec<(u8, usize)>,
    percussion: usize,
    pedals: usize,
    endless: usize,
}

impl Reader {
    fn play(
        &mut self,
        events: Vec<(u64, TrackEventKind)>,
        timing: Timing,
        start_s: f64,
    ) -> Result<(), String> {
        let ticks_per = |seconds: f64| match timing {
            Timing::Metrical(beat) => f64::from(beat.as_int()) / seconds,
            Timing::Timecode(fps, sub) => f64::from(fps.as_f32()) * f64::from(sub),
        };
        // 120 beats a minute, until the file says otherwise.
        let mut ticks_per_s = ticks_per(0.5);
        if ticks_per_s <= 0.0 {
            return Err("its header divides a beat into no ticks".into());
        }
        let (mut now_s, mut now) = (start_s, 0);
        for (tick, kind) in events {
            now_s += (tick - now) as f64 / ticks_per_s;
            now = tick;
            match kind {
                TrackEventKind::Meta(MetaMessage::Tempo(us)) if us.as_int() > 0 => {
                    ticks_per_s = ticks_per(f64::from(us.as_int()) * 1e-6);
                }
                TrackEventKind::Midi { channel, message } => {
                    self.message(channel.as_int(), message, now_s)
                }
                _ => {}
            }
        }
        self.endless += self.open.len();
        for (_, note) in std::mem::take(&mut self.open) {
            self.out.notes[note].off_s = now_s;
        }
        self.out.end_s = now_s;
        Ok(())
    }

    fn message(&mut self, channel: u8, message: MidiMessage, now_s: f64) {
        match message {
            MidiMessage::NoteOn { .. } | MidiMessage::NoteOff { .. } if channel == PERCUSSION => {
                self.percussion += 1
            }
            MidiMessage::NoteOn { key, vel } if vel.as_int() > 0 => {
                // A note that is struck again ends first.
                self.end(channel, key.as_int(), 64, now_s);
                let (key, velocity) = (key.as_int(), vel.as_int());
                self.open.push((channel, self.out.notes.len()));
                self.out.notes.push(Note {
                    key,
                    on_s: now_s,
                    off_s: now_s,
                    velocity,
                    release: 64,
                });
            }
            MidiMessage::NoteOn { key, .. } => self.end(channel, key.as_int(), 64, now_s),
            MidiMessage::NoteOff { key, vel } => {
                self.end(channel, key.as_int(), vel.as_int(), now_s)
            }
            MidiMessage::Controller { controller, value }
                if controller == SUSTAIN && value.as_int() >= 64 =>
            {
                self.pedals += 1;
            }
            _ => {}
        }
    }

    fn end(&mut self, channel: u8, key: u8, release: u8, now_s: f64) {
        if let Some(at) = self
            .open
            .iter()
            .position(|&(c, note)| c == channel && self.out.notes[note].key == key)
        {
            let note = &mut self.out.notes[self.open.remove(at).1];
            (note.off_s, note.release) = (now_s, release);
        }
    }

    fn finish(mut self) -> Result<Performance, String> {
        let notes = &mut self.out.notes;
        notes.sort_by(|a, b| a.on_s.total_cmp(&b.on_s).then(a.key.cmp(&b.key)));
        let doubled = unisons(notes);
        if notes.is_empty() {
            return Err(match self.percussion {
                0 => "holds no notes".into(),
                _ => "holds no notes but percussion (channel 10), which has no keys".into(),
            });
        }
        let told = [
            (
                doubled,
                "notes double another on the same key and are one stroke with it",
            ),
            (
                self.percussion / 2,
                "notes of percussion (channel 10) have no keys",
            ),
            (
                self.pedals,
                "times the sustain pedal goes down: it holds strings, not keys",
            ),
            (self.endless, "notes never end; they end with the file"),
        ];
        let said = told.iter().filter(|(count, _)| *count > 0);
        self.out.told = said
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        Ok(self.out)
    }
}

/// Joins notes on one key that begin together: the loudest, until the last ends. Gives how many
/// went.
fn unisons(notes: &mut Vec<Note>) -> usize {
    let mut last: [Option<usize>; 128] = [None; 128];
    let mut kept: Vec<Note> = Vec::with_capacity(notes.len());
    for note in notes.iter() {
        let slot = &mut last[usize::from(note.key & 127)];
        match slot
            .and_then(|at| kept.get_mut(at))
            .filter(|first| note.on_s - first.on_s <= UNISON_S)
        {
            Some(first) => {
                first.velocity = first.velocity.max(note.velocity);
                first.off_s = first.off_s.max(note.off_s);
            }
            None => {
                *slot = Some(kept.len());
                kept.push(*note);
            }
        }
    }
    let gone = notes.len() - kept.len();
    *notes = kept;
    gone
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one track or several, of a format, 480 ticks a beat.
    fn file(format: u8, tracks: &[&[u8]]) -> Vec<u8> {
        let mut bytes = [
            b"MThd",
            &[0, 0, 0, 6, 0, format, 0, tracks.len() as u8, 1, 0xe0][..],
        ]
        .concat();
        for track in tracks {
            let body = [track, &[0, 0xff, 0x2f, 0][..]].concat();
            bytes.extend([b"MTrk", &(body.len() as u32).to_be_bytes()[..], &body].concat());
        }
        bytes
    }

    fn notes(bytes: &[u8]) -> Vec<(u8, f64, f64, u8, u8)> {
        let performance = read(bytes).expect("a MIDI file");
        performance
            .notes
            .iter()
            .map(|n| (n.key, n.on_s, n.off_s, n.velocity, n.release))
            .collect()
    }

    #[test]
    fn tempo_running_status_and_both_kinds_of_ends() {
        // C4 for a beat at 120; then 60 beats a minute: E4 for a beat, ended by a velocity of 0 in
        // running status.
        let track = [
            &[0, 0x90, 60, 100, 0x83, 0x60, 0x80, 60, 90][..],
            &[
                0, 0xff, 0x51, 3, 0x0f, 0x42, 0x40, 0, 0x90, 64, 50, 0x83, 0x60, 64, 0,
            ],
        ]
        .concat();
        assert_eq!(
            notes(&file(0, &[&track])),
            [(60, 0.0, 0.5, 100, 90), (64, 0.5, 1.5, 50, 64)]
        );
    }

    #[test]
    fn tracks_together_and_one_after_the_other() {
        let tempo = [0, 0xff, 0x51, 3, 0x0f, 0x42, 0x40];
        let (low, high) = (
            [0, 0x90, 40, 80, 0x83, 0x60, 40, 0],
            [0, 0x91, 70, 81, 0x83, 0x60, 70, 0],
        );
        assert_eq!(
            notes(&file(1, &[&tempo, &low, &high])),
            [(40, 0.0, 1.0, 80, 64), (70, 0.0, 1.0, 81, 64)]
        );
        // In format 2 each has its own tempo.
        assert_eq!(
            notes(&file(2, &[&low, &high])),
            [(40, 0.0, 0.5, 80, 64), (70, 0.5, 1.0, 81, 64)]
        );
    }

    #[test]
    fn what_is_no_stroke_is_told() {
        let track = [
            &[
                0, 0xb0, 64, 127, 0, 0x99, 36, 100, 10, 0x89, 36, 0, 0, 0x90, 60, 70, 0, 0x91, 60,
                90,
            ][..],
            &[0x83, 0x60, 0x90, 60, 71, 0x83, 0x60, 0x90, 62, 20],
        ]
        .concat();
        let performance = read(&file(0, &[&track])).expect("a MIDI file");
        let all: Vec<(u8, u8)> = performance
            .notes
            .iter()
            .map(|n| (n.key, n.velocity))
            .collect();
        assert_eq!(
            all,
            [(60, 90), (60, 71), (62, 20)],
            "two channels, one stroke; struck again: ended"
        );
        assert_eq!(performance.told.len(), 4, "{:?}", performance.told);
    }

    #[test]
    fn what_is_no_midi_file_is_an_error() {
        assert!(read(b"").unwrap_err().contains("not a MIDI file"));
        assert!(read(b"RIFF....").unwrap_err().contains("not a MIDI file"));
        assert!(
            read(&file(0, &[&[]]))
                .unwrap_err()
                .contains("holds no notes")
        );
        assert!(
            read(&file(0, &[&[0, 0x99, 36, 100]]))
                .unwrap_err()
                .contains("percussion")
        );
        let whole = file(1, &[&[0, 0x90, 60, 100, 0x83, 0x60, 60, 0]]);
        for end in 0..whole.len() {
            let _ = read(&whole[..end]);
        }
        let mut no_ticks = whole.clone();
        (no_ticks[12], no_ticks[13]) = (0, 0);
        assert!(read(&no_ticks).unwrap_err().contains("no ticks"));
    }
}
