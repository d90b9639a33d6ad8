//! What was struck, as a MIDI file: the notes that firmware sends, with velocities of 14 bits.
//!
//! ```text
//!   `note` (speed)    --> [control change 88: low seven bits] note on
//!   `release` (speed) --> [control change 88: low seven bits] note off; 64 without a speed
//! ```
//!
//! A file has one track of 22050 ticks a beat at 120 beats a minute, so a tick of MIDI is
//! 1/44100 s. Keys that are still down at the end are let go there.
//!
//! Not here: MIDI files that are played (`midi`), what firmware sends (`compiler/firmware`).

use std::collections::BTreeSet;
use std::path::Path;

use midly::num::{u7, u15, u28};
use midly::{Format, Header, MetaMessage, MidiMessage, Timing, TrackEvent, TrackEventKind};
use whippen_compiler::pipeline::Compiled;

use crate::files::{FileError, write_whole};

/// The speed (m/s) that velocity 64 stands for: a hammer that is five times as fast as its key,
/// whose 64 is 0.25 m/s ([`crate::stroke::press_speed`]).
const MIDDLE_M_PER_S: f64 = 1.25;

/// Ticks of a beat, of which there are two a second.
const BEAT_TICKS: u16 = 22_050;

/// High resolution velocity prefix (MMA CA-031).
const FINE_VELOCITY: u8 = 88;

/// The velocity of 14 bits of a note off that has no speed.
const PLAIN_RELEASE: u16 = 64 << 7;

/// The velocity of a speed (m/s, of either sign): 128 to 16383, of which the upper seven bits are
/// MIDI's. 1.25 m/s are 64, each doubling is 30 more.
///
/// Firmware takes it from a table with lines between its entries.
pub fn velocity(speed_m_per_s: f64) -> u16 {
    let of_seven_bits = 64.0 + 30.0 * libm::log2(speed_m_per_s.abs() / MIDDLE_M_PER_S);
    // Less than 128 would be the end of a note.
    (128.0 * of_seven_bits).round().clamp(128.0, 16_383.0) as u16
}

/// Notes that were struck and let go, in the order of their times.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StruckNotes {
    /// Tick of MIDI, key, velocity of 14 bits; of a note off if it is not on.
    sent: Vec<(u64, u7, u16, bool)>,
    down: BTreeSet<u7>,
}

impl StruckNotes {
    /// Whether an instrument strikes notes at all.
    pub fn of_instrument(compiled: &Compiled) -> bool {
        let mut events = compiled.lowered.kernel.events.iter();
        events.any(|event| event.name == "note" && event.args > 0)
    }

    /// Takes an event of a key (its MIDI number) with its arguments in SI; others than `note` and
    /// `release` are passed over, and keys that MIDI has no number for. Times (s) do not go
    /// backwards.
    pub fn event(&mut self, t_s: f64, key: u8, name: &str, args: &[f64]) {
        let at = midi_tick(t_s);
        let Some(key) = u7::try_from(key) else {
            return;
        };
        match (name, args.first()) {
            ("note", Some(speed)) => {
                self.down.insert(key);
                self.sent.push((at, key, velocity(*speed), true));
            }
            ("release", speed) => {
                self.down.remove(&key);
                let fine = speed.map_or(PLAIN_RELEASE, |speed| velocity(*speed));
                self.sent.push((at, key, fine, false));
            }
            _ => {}
        }
    }

    /// How many notes were struck.
    pub fn notes(&self) -> usize {
        self.sent.iter().filter(|sent| sent.3).count()
    }

    /// Writes the file; `end_s` is how long was played.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(mut self, path: &Path, end_s: f64) -> Result<(), FileError> {
        for key in std::mem::take(&mut self.down) {
            self.sent
                .push((midi_tick(end_s), key, PLAIN_RELEASE, false));
        }
        let track = self.track();
        let header = Header::new(Format::SingleTrack, Timing::Metrical(u15::new(BEAT_TICKS)));
        let mut bytes = Vec::new();
        midly::write_std(&header, std::iter::once(&track), &mut bytes)
            .map_err(|e| FileError::not_written(path, &e))?;
        write_whole(path, |file| file.write_all(&bytes))
    }

    fn track(&self) -> Vec<TrackEvent<'static>> {
        let mut track = Vec::new();
        let mut now = 0;
        let mut push = |at: u64, kind| {
            // A longer pause than a delta can say is several.
            while at - now > u64::from(u28::max_value().as_int()) {
                now += u64::from(u28::max_value().as_int());
                track.push(event(
                    u28::max_value(),
                    TrackEventKind::Meta(MetaMessage::Text(b"")),
                ));
            }
            track.push(event(u28::new((at - now) as u32), kind));
            now = at;
        };
        let mut last = 0;
        for &(at, key, fine, is_on) in &self.sent {
            let (vel, low) = (u7::new((fine >> 7) as u8), u7::new((fine & 127) as u8));
            if low != 0 {
                push(
                    at,
                    of_channel(MidiMessage::Controller {
                        controller: u7::new(FINE_VELOCITY),
                        value: low,
                    }),
                );
            }
            push(
                at,
                of_channel(match is_on {
                    true => MidiMessage::NoteOn { key, vel },
                    false => MidiMessage::NoteOff { key, vel },
                }),
            );
            last = at;
        }
        push(last, TrackEventKind::Meta(MetaMessage::EndOfTrack));
        track
    }
}

/// The tick of the file at a time (s).
fn midi_tick(t_s: f64) -> u64 {
    (t_s * 2.0 * f64::from(BEAT_TICKS)).round().max(0.0) as u64
}

fn event(delta: u28, kind: TrackEventKind<'static>) -> TrackEvent<'static> {
    TrackEvent { delta, kind }
}

fn of_channel(message: MidiMessage) -> TrackEventKind<'static> {
    TrackEventKind::Midi {
        channel: 0.into(),
        message,
    }
}

#[cfg(test)]
mod tests {
    use super::{StruckNotes, velocity};
    use crate::midi::read;
    use midly::{MidiMessage, Smf, TrackEventKind};

    fn written(struck: StruckNotes, end_s: f64) -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("played.mid");
        struck.write(&path, end_s).expect("writable");
        std::fs::read(path).expect("it is there")
    }

    #[test]
    fn velocities_are_those_of_the_formula() {
        let of = [
            (1.25, 64 << 7),
            (2.5, 94 << 7),
            (-0.625, 34 << 7),
            (0.0, 128),
            (100.0, 16_383),
        ];
        for (speed, wanted) in of {
            assert_eq!(velocity(speed), wanted, "{speed} m/s");
        }
    }

    #[test]
    fn a_file_has_what_was_struck() {
        let mut struck = StruckNotes::default();
        struck.event(0.5, 60, "note", &[2.0]);
        struck.event(0.75, 60, "bump", &[1.0]);
        struck.event(1.0, 60, "release", &[]);
        struck.event(1.5, 64, "note", &[1.25]);
        assert_eq!(struck.notes(), 2);
        let bytes = written(struck, 3.0);
        let performance = read(&bytes).expect("a MIDI file");
        let notes: Vec<_> = (performance.notes.iter())
            .map(|note| (note.key, note.on_s, note.off_s, note.velocity, note.release))
            .collect();
        assert_eq!(notes, [(60, 0.5, 1.0, 84, 64), (64, 1.5, 3.0, 64, 64)]);
        let smf = Smf::parse(&bytes).expect("a MIDI file");
        let low: Vec<u8> = (smf.tracks[0].iter())
            .filter_map(|event| match event.kind {
                TrackEventKind::Midi {
                    message: MidiMessage::Controller { controller, value },
                    ..
                } if controller == 88 => Some(value.as_int()),
                _ => None,
            })
            .collect();
        assert_eq!(low, [(velocity(2.0) & 127) as u8], "64 has no low bits");
    }

    #[test]
    fn a_pause_of_hours_is_kept() {
        let mut struck = StruckNotes::default();
        struck.event(20_000.0, 60, "note", &[2.0]);
        let performance = read(&written(struck, 20_001.0)).expect("a MIDI file");
        assert_eq!(
            (performance.notes[0].on_s, performance.notes[0].off_s),
            (20_000.0, 20_001.0)
        );
    }
}
