//! Notes against strikes: which note struck, when and how fast, which did not and why, which struck
//! more often.

use std::ops::Range;
use whippen_compiler::rate::Rate;

use super::KeyLog;
use crate::midi::Note;
use crate::stroke::Stroke;

/// A key that is further down than this (m) when it is pressed again may not have reloaded.
const RISEN_M: f64 = 2e-3;

/// One strike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strike {
    /// When (s).
    pub t_s: f64,
    /// The first argument of the event, usually a speed (m/s); 0 where it has none.
    pub speed: f64,
}

/// One note and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayedNote {
    /// The note; its times are those of the file.
    pub note: Note,
    /// How the key moved for it.
    pub stroke: Stroke,
    /// What it struck, by time, up to the next note's stroke.
    pub strikes: Vec<Strike>,
}

impl PlayedNote {
    /// Why there was no strike, as far as the motion tells.
    pub fn reason(&self) -> String {
        let (speed, from_mm) = (self.stroke.speed_m_per_s, self.stroke.from_m * 1e3);
        if self.stroke.from_m > RISEN_M {
            format!("pressed again from {from_mm:.1} mm: not up far enough to reload")
        } else {
            format!("too soft: the key went down at {speed:.2} m/s at the most")
        }
    }

    /// Whether the key was still busy with the note before when it should have gone down.
    pub fn waited(&self) -> bool {
        self.stroke.start_s > self.stroke.wanted_s + 1e-6
    }

    /// From note-on to the first strike (s). `later_s` is what the performance was moved by.
    pub fn latency_s(&self, later_s: f64) -> Option<f64> {
        self.strikes
            .first()
            .map(|strike| strike.t_s - self.note.on_s - later_s)
    }
}

/// All notes of a performance and what became of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// By the time of the note, then key.
    pub notes: Vec<PlayedNote>,
    /// How many strikes a note usually makes: 2 where two rows are plucked.
    pub usual: usize,
    /// Strikes that no note caused.
    pub stray: usize,
}

impl Outcome {
    /// Compares. `strokes` are the strokes of each key of `logs`, `emission` says which event of a
    /// key is a strike; the notes of a key that has none are left out.
    pub fn new(
        notes: &[Note],
        logs: &[KeyLog],
        strokes: &[Vec<Stroke>],
        emission: impl Fn(usize) -> Option<usize>,
        rate_hz: Rate,
    ) -> Outcome {
        let mut out = Outcome {
            usual: 1,
            ..Outcome::default()
        };
        for (log, strokes) in logs.iter().zip(strokes) {
            let Some(emission) = emission(log.index) else {
                continue;
            };
            let struck = log.events.iter().filter(|(_, kind, _)| *kind == emission);
            let strikes: Vec<Strike> = struck
                .map(|(tick, _, args)| Strike {
                    t_s: *tick as f64 / f64::from(rate_hz),
                    speed: args.first().copied().unwrap_or_default(),
                })
                .collect();
            out.stray += strikes.len();
            for (at, stroke) in strokes.iter().enumerate() {
                let end_s = strokes
                    .get(at + 1)
                    .map_or(f64::INFINITY, |next| next.start_s);
                let own = strikes[within(&strikes, stroke.start_s, end_s)].to_vec();
                out.stray -= own.len();
                out.notes.push(PlayedNote {
                    note: notes[stroke.note],
                    stroke: *stroke,
                    strikes: own,
                });
            }
        }
        out.notes.sort_by(|a, b| {
            a.note
                .on_s
                .total_cmp(&b.note.on_s)
                .then(a.note.key.cmp(&b.note.key))
        });
        out.usual = out.most_common();
        out
    }

    /// The commonest number of strikes of a note that struck; the smaller of equally common ones.
    fn most_common(&self) -> usize {
        let mut counts = [0_usize; 16];
        self.notes
            .iter()
            .for_each(|n| counts[n.strikes.len().min(15)] += 1);
        (1..16)
            .rev()
            .max_by_key(|&n| counts[n])
            .filter(|&n| counts[n] > 0)
            .unwrap_or(1)
    }

    /// Notes that struck.
    pub fn matched(&self) -> usize {
        self.notes.iter().filter(|n| !n.strikes.is_empty()).count()
    }

    /// Notes that did not.
    pub fn missed(&self) -> impl Iterator<Item = &PlayedNote> {
        self.notes.iter().filter(|n| n.strikes.is_empty())
    }

    /// Notes that struck more often than usual.
    pub fn doubled(&self) -> impl Iterator<Item = &PlayedNote> {
        self.notes.iter().filter(|n| n.strikes.len() > self.usual)
    }
}

/// Indices of the strikes from `start_s` on and before `end_s`.
fn within(strikes: &[Strike], start_s: f64, end_s: f64) -> Range<usize> {
    strikes.partition_point(|s| s.t_s < start_s)..strikes.partition_point(|s| s.t_s < end_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(ticks: &[usize]) -> Outcome {
        let note = |on_s| Note {
            key: 60,
            on_s,
            off_s: on_s + 0.2,
            velocity: 64,
            release: 64,
        };
        let stroke = |note, start_s, from_m| Stroke {
            wanted_s: start_s,
            note,
            start_s,
            down_s: start_s + 0.08,
            speed_m_per_s: 0.25,
            from_m,
        };
        let log = KeyLog {
            events: ticks
                .iter()
                .map(|&tick| (tick, 1, vec![tick as f64]))
                .chain([(1500, 0, vec![])])
                .collect(),
            ..KeyLog::default()
        };
        let strokes = vec![vec![
            stroke(0, 1.0, 0.0),
            stroke(1, 2.0, 0.0),
            stroke(2, 3.0, 0.004),
        ]];
        Outcome::new(
            &[note(1.05), note(2.05), note(3.05)],
            &[log],
            &strokes,
            |_| Some(1),
            1000.into(),
        )
    }

    #[test]
    fn strikes_belong_to_the_stroke_before_them() {
        let out = outcome(&[500, 1060, 1200, 2070]);
        assert_eq!(
            (
                out.matched(),
                out.missed().count(),
                out.doubled().count(),
                out.stray,
                out.usual
            ),
            (2, 1, 1, 1, 1)
        );
        assert_eq!(
            out.notes[0].strikes,
            [
                Strike {
                    t_s: 1.06,
                    speed: 1060.0
                },
                Strike {
                    t_s: 1.2,
                    speed: 1200.0
                }
            ]
        );
        assert!((out.notes[1].latency_s(0.0).expect("struck") - 0.02).abs() < 1e-12);
        assert!(
            out.notes[2].reason().contains("pressed again from 4.0 mm"),
            "{}",
            out.notes[2].reason()
        );
    }

    #[test]
    fn two_rows_are_not_a_double_strike() {
        let out = outcome(&[1060, 1061, 2060, 2061, 3060, 3061, 3062]);
        assert_eq!(
            (out.usual, out.doubled().count(), out.missed().count()),
            (2, 1, 0)
        );
        assert_eq!(outcome(&[]).usual, 1);
        assert!(
            outcome(&[]).notes[0]
                .reason()
                .contains("too soft: the key went down at 0.25 m/s")
        );
    }
}
