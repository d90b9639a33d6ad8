//! From notes to a key's motion: every note a synthetic stroke.
//!
//! ```text
//!   depth   start     note-on       note-off        the law, at the key's front
//!     0 _____                                        press    0.25 m/s * 2^((velocity - 64) / 30)   greatest speed
//!            \          .           ______           release  0.1 m/s + 0.3 m/s * velocity / 127
//!    dip      \_________._________/                  note-on  when the press has gone 80 % of the dip
//! ```
//!
//! Both moves are of minimum jerk ([`crate::gesture`]). The law is ours: equal steps of velocity
//! are equal ratios of speed, as instruments that record hammers have it, and the two constants put
//! forte (80 to 96) at 0.36 to 0.52 m/s, with only the last steps above 1 m/s. The press begins so
//! early that the key is about where a grand lets off when the note is to sound.
//!
//! A struck key goes down to its stop, then rises when its note ends, but early enough to be up
//! again for the next note. Where there is too little time the rise is as fast as a key rises, and
//! the next press begins from wherever the key then is: the two moves are blended, so position,
//! speed and acceleration have no jumps and the key never leaves 0 .. dip.
//!
//! Not here: which notes (`midi`), what the instrument does with them (`keyboard`).

use crate::gesture::Move;
use crate::midi::Note;

/// Greatest over mean speed of a move of minimum jerk.
const PEAK: f64 = 15.0 / 8.0;

/// The part of a press's time after which it has gone 80 % of its way.
const NOTE_AT: f64 = 0.6734;

/// The shortest rise (s): about what the lightest keys need by themselves.
const RISE_MIN_S: f64 = 0.030;

/// The earliest a press may follow the beginning of a rise (s): a hand turns round no faster.
const TURN_S: f64 = 0.015;

/// One note as the key plays it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Index of the note among those the strokes were made from.
    pub note: usize,
    /// When the key begins to go down (s).
    pub start_s: f64,
    /// When it would have begun, had it been free (s).
    pub wanted_s: f64,
    /// When it is down (s).
    pub down_s: f64,
    /// Greatest speed going down (m/s), from rest.
    pub speed_m_per_s: f64,
    /// Where the key was when it began to go down (m).
    pub from_m: f64,
}

/// Greatest speed of the key's front going down (m/s), by velocity.
pub fn press_speed(velocity: u8) -> f64 {
    0.25 * libm::exp2((f64::from(velocity) - 64.0) / 30.0)
}

/// Greatest speed of the key's front coming up (m/s), by release velocity.
pub fn release_speed(velocity: u8) -> f64 {
    0.1 + 0.3 * f64::from(velocity) / 127.0
}

/// How long before its note-on a press begins that goes so far (s).
fn lead_s(velocity: u8, dip_m: f64) -> f64 {
    NOTE_AT * PEAK * dip_m / press_speed(velocity)
}

/// The moves of one key, which goes so far (m), and the stroke of each note. The notes are all on
/// this key, by time; `later_s` is added to all times.
pub fn strokes(notes: &[(usize, Note)], later_s: f64, dip_m: f64) -> (Vec<Move>, Vec<Stroke>) {
    let (mut moves, mut strokes) = (Vec::new(), Vec::new());
    let mut free_s = f64::NEG_INFINITY;
    for (at, (index, note)) in notes.iter().enumerate() {
        let speed = press_speed(note.velocity);
        let press_s = PEAK * dip_m / speed;
        let wanted_s = note.on_s + later_s - NOTE_AT * press_s;
        let start_s = wanted_s.max(free_s);
        let down_s = start_s + press_s;
        let next = notes
            .get(at + 1)
            .map(|(_, next)| next.on_s + later_s - lead_s(next.velocity, dip_m));
        let up_s = PEAK * dip_m / release_speed(note.release);
        let off_s = (note.off_s + later_s).max(down_s);
        let (rise_s, length_s) = rise(up_s, off_s, down_s, next);
        free_s = rise_s + TURN_S;
        moves.push(Move {
            start_s,
            duration_s: press_s,
            to_m: dip_m,
        });
        moves.push(Move {
            start_s: rise_s,
            duration_s: length_s,
            to_m: 0.0,
        });
        strokes.push(Stroke {
            note: *index,
            start_s,
            wanted_s,
            down_s,
            speed_m_per_s: speed,
            from_m: 0.0,
        });
    }
    let mut key = crate::gesture::Follower::new(&moves);
    for stroke in &mut strokes {
        stroke.from_m = key.at(stroke.start_s);
    }
    (moves, strokes)
}

/// When a key begins to rise, and how long that takes: when its note ends, but in time for the
/// next.
fn rise(wanted_s: f64, off_s: f64, down_s: f64, next: Option<f64>) -> (f64, f64) {
    let Some(next_s) = next else {
        return (off_s, wanted_s);
    };
    let start_s = off_s.min(next_s - wanted_s).max(down_s);
    (start_s, wanted_s.min(next_s - start_s).max(RISE_MIN_S))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gesture::{DIP_M, Follower};

    const RATE_HZ: f64 = 44_100.0;

    fn note(on_s: f64, off_s: f64, velocity: u8) -> Note {
        Note {
            key: 60,
            on_s,
            off_s,
            velocity,
            release: 64,
        }
    }

    fn motion(notes: &[Note]) -> (Vec<f64>, Vec<Stroke>) {
        let numbered: Vec<(usize, Note)> = notes.iter().copied().enumerate().collect();
        let (moves, strokes) = strokes(&numbered, 0.5, DIP_M);
        let end_s = moves
            .iter()
            .map(|m| m.start_s + m.duration_s)
            .fold(0.0, f64::max)
            + 0.01;
        let mut key = Follower::new(&moves);
        (
            (0..(end_s * RATE_HZ) as usize)
                .map(|i| key.at(i as f64 / RATE_HZ))
                .collect(),
            strokes,
        )
    }

    #[test]
    fn the_law_has_the_speeds_it_says() {
        assert_eq!(press_speed(64), 0.25);
        assert!(
            (0.30..=0.55).contains(&press_speed(80)) && (0.30..=0.55).contains(&press_speed(96))
        );
        assert!(press_speed(124) < 1.01 && press_speed(127) < 1.1 && press_speed(1) > 0.05);
        let (x, strokes) = motion(&[note(0.2, 0.6, 90)]);
        let fastest = x
            .windows(2)
            .map(|w| (w[1] - w[0]) * RATE_HZ)
            .fold(0.0, f64::max);
        assert!((fastest / press_speed(90) - 1.0).abs() < 1e-3, "{fastest}");
        assert!(
            (x[(0.7 * RATE_HZ) as usize] / DIP_M - 0.8).abs() < 0.01,
            "80 % of the dip at note-on"
        );
        assert!(
            (strokes[0].start_s - (0.7 - lead_s(90, DIP_M))).abs() < 1e-12
                && strokes[0].from_m == 0.0
        );
    }

    #[test]
    fn however_fast_the_notes_the_motion_is_smooth_and_inside() {
        for (rate_hz, velocity) in [
            (4.0, 64),
            (8.0, 90),
            (14.0, 100),
            (25.0, 127),
            (60.0, 20),
            (200.0, 127),
        ] {
            let notes: Vec<Note> = (0..30)
                .map(|i| f64::from(i) / rate_hz)
                .map(|t| note(t, t + 0.7 / rate_hz, velocity))
                .collect();
            let (x, strokes) = motion(&notes);
            assert_eq!(strokes.len(), 30);
            assert!(
                x.iter().all(|x| (0.0..=DIP_M).contains(x)),
                "{rate_hz} a second"
            );
            let v: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]) * RATE_HZ).collect();
            let fastest = v.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            // What two moves do at once adds up at the most.
            assert!(
                fastest < press_speed(velocity) + PEAK * DIP_M / RISE_MIN_S,
                "{fastest} at {rate_hz} a second"
            );
            let step = v
                .windows(2)
                .map(|w| (w[1] - w[0]).abs())
                .fold(0.0, f64::max);
            let (press, rise) = (PEAK * DIP_M / press_speed(velocity), RISE_MIN_S);
            // Greatest acceleration of a move of minimum jerk, twice, and what the blend adds, over
            // one tick.
            let bound =
                5.8 * DIP_M * (1.0 / press.powi(2) + 1.0 / rise.powi(2) + 2.0 / (press * rise))
                    / RATE_HZ;
            assert!(
                step <= bound,
                "speed jumps by {step} at {rate_hz} a second, bound {bound}"
            );
        }
    }

    #[test]
    fn a_key_is_up_again_for_the_next_note_if_there_is_time() {
        let (_, strokes) = motion(&[note(0.0, 0.5, 80), note(0.5, 1.0, 80)]);
        assert!(strokes[1].from_m < 1e-9, "{:?}", strokes[1]);
        let (_, strokes) = motion(&[note(0.0, 0.05, 80), note(0.07, 0.1, 80)]);
        assert!(
            strokes[1].from_m > 1e-3,
            "re-pressed half way: {:?}",
            strokes[1]
        );
    }

    #[test]
    fn a_key_goes_as_far_as_it_can() {
        let dip_m = 0.9 * 0.008;
        let notes = [(0, note(0.2, 0.6, 80))];
        let (moves, strokes) = strokes(&notes, 0.5, dip_m);
        let mut key = Follower::new(&moves);
        let deepest = (0..60_000)
            .map(|i| key.at(f64::from(i) / RATE_HZ))
            .fold(0.0, f64::max);
        assert!((deepest - dip_m).abs() < 1e-12, "{deepest}");
        // The speed is that of the note, whatever the way.
        let press_s = strokes[0].down_s - strokes[0].start_s;
        assert!((PEAK * dip_m / press_s - press_speed(80)).abs() < 1e-12);
    }
}
