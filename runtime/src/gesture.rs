//! Synthetic gestures: key motions made by the project, for the tour and for tests.
//!
//! A gesture is a sequence of moves from one depth to another, each of minimum jerk, with rests
//! between them:
//!
//! ```text
//!   depth      rise      hold      fall
//!     0 ______       ___________        ______
//!             \     '           '     /
//!     d        `---'             `---'              s(u) = 10 u^3 - 15 u^4 + 6 u^5
//!           start
//! ```
//!
//! The minimum-jerk polynomial is how a hand moves freely from rest to rest (Flash and Hogan 1985):
//! position, velocity and acceleration are continuous, the greatest velocity is 15/8 of depth over
//! time, half way. Only additions and multiplications are used, so a gesture has the same bits on
//! every machine.
//!
//! A knob is moved in the same way; its positions are angles (rad).
//!
//! Not here: recorded motions (`motion`), strokes made from MIDI notes (`stroke`).

mod hands;

use whippen_compiler::model::{Model, Sense};
use whippen_compiler::rate::Rate;

/// One move to a depth, at rest there afterwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// When it begins (s).
    pub start_s: f64,
    /// How long it takes (s).
    pub duration_s: f64,
    /// Where it ends (m, positive down).
    pub to_m: f64,
}

/// A key that follows moves, asked at rising times.
///
/// A move that begins while another has not ended takes over smoothly: what the earlier ones would
/// do fades out as the later one's share grows from 0 to 1, itself with minimum jerk. So position,
/// speed and acceleration never jump, and the key stays between the depths that the moves name.
#[derive(Debug, Clone)]
pub struct Follower<'a> {
    /// By the time they begin.
    moves: &'a [Move],
    /// Those that have begun and not ended.
    now: std::ops::Range<usize>,
    /// Where the key was left by those before.
    from_m: f64,
}

impl<'a> Follower<'a> {
    /// A key at depth 0. The moves are by the time they begin.
    pub fn new(moves: &'a [Move]) -> Follower<'a> {
        Follower {
            moves,
            now: 0..0,
            from_m: 0.0,
        }
    }

    /// Where the key is at a time (s), not before the time asked for last (m).
    pub fn at(&mut self, t_s: f64) -> f64 {
        while self
            .moves
            .get(self.now.end)
            .is_some_and(|next| next.start_s <= t_s)
        {
            self.now.end += 1;
        }
        let ended = |m: &Move| t_s >= m.start_s + m.duration_s;
        if let Some(last) = self.now.clone().rev().find(|&i| ended(&self.moves[i])) {
            (self.from_m, self.now.start) = (self.moves[last].to_m, last + 1);
        }
        let go =
            |x: f64, m: &Move| x + (m.to_m - x) * minimum_jerk((t_s - m.start_s) / m.duration_s);
        self.moves[self.now.clone()].iter().fold(self.from_m, go)
    }
}

/// A key motion over time: starts at rest at depth 0, moves, and ends at [`Gesture::duration_s`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gesture {
    moves: Vec<Move>,
    end_s: f64,
}

impl Gesture {
    /// A key at rest, for no time.
    pub fn new() -> Gesture {
        Gesture::default()
    }

    /// Stays where it is for a while. Negative and unbounded times count as none, here and in the
    /// other builders.
    #[must_use]
    pub fn hold(mut self, seconds: f64) -> Gesture {
        self.end_s += duration(seconds);
        self
    }

    /// Moves to a depth (m, positive down) in the given time.
    #[must_use]
    pub fn to(mut self, depth_m: f64, seconds: f64) -> Gesture {
        self.moves.push(Move {
            start_s: self.end_s,
            duration_s: duration(seconds),
            to_m: depth_m,
        });
        self.hold(seconds)
    }

    /// A stroke from where the key is down to `depth_m` and back to rest. It begins at `start_s`;
    /// what is already there is finished first.
    #[must_use]
    pub fn stroke(
        self,
        start_s: f64,
        rise_s: f64,
        hold_s: f64,
        fall_s: f64,
        depth_m: f64,
    ) -> Gesture {
        let wait_s = start_s - self.end_s;
        self.hold(wait_s)
            .to(depth_m, rise_s)
            .hold(hold_s)
            .to(0.0, fall_s)
    }

    /// `count` equal strokes from `start_s`, `rate_hz` of them per second: of each period 45 % go
    /// down, 10 % hold and 45 % go up again.
    #[must_use]
    pub fn repeated(self, start_s: f64, rate_hz: f64, count: usize, depth_m: f64) -> Gesture {
        let period_s = duration(1.0 / rate_hz);
        let begin_s = start_s.max(self.end_s);
        (0..count).fold(self, |gesture, i| {
            gesture.stroke(
                begin_s + i as f64 * period_s,
                0.45 * period_s,
                0.1 * period_s,
                0.45 * period_s,
                depth_m,
            )
        })
    }

    /// When the last move or hold ends (s).
    pub fn duration_s(&self) -> f64 {
        self.end_s
    }

    /// The depths (m) at the ticks of a rate: tick `i` is at `i / rate_hz`, the first at 0, the
    /// last before the end.
    pub fn positions(&self, rate_hz: impl Into<Rate>) -> Vec<f64> {
        let rate_hz = rate_hz.into();
        let mut key = Follower::new(&self.moves);
        (0..self.ticks(rate_hz))
            .map(|i| key.at(i as f64 / f64::from(rate_hz)))
            .collect()
    }

    /// How many ticks of a rate it lasts.
    pub fn ticks(&self, rate_hz: Rate) -> usize {
        (self.end_s * f64::from(rate_hz)) as usize
    }

    /// The depth (m) at a time (s). Moves follow each other, so the last that has begun decides.
    pub fn at(&self, t_s: f64) -> f64 {
        let begun = self.moves.partition_point(|m| m.start_s <= t_s);
        Follower::new(&self.moves[begun.saturating_sub(2)..begun]).at(t_s)
    }
}

/// The dip of a piano's key (m).
pub const DIP_M: f64 = 0.010;

/// How far the keys of an instrument go (m): as those of a piano, or nine tenths of what it senses
/// where that is less.
pub fn dip_m(model: &Model) -> f64 {
    let (_, end) = sensed(model);
    if end >= DIP_M { DIP_M } else { 0.9 * end }
}

/// The bundled gesture of a key of 10 mm.
pub fn default_gesture() -> Gesture {
    strokes(DIP_M)
}

/// The bundled gesture of an instrument: strokes as far as its keys [go](dip_m), or turns of a
/// knob.
pub fn bundled(model: &Model) -> Gesture {
    let (low, end) = sensed(model);
    if model.turns() {
        turns(low, end)
    } else {
        strokes(dip_m(model))
    }
}

/// The bundled gestures of the ports of an instrument, of equal length.
pub fn bundled_ports(model: &Model) -> Vec<Gesture> {
    if model.is_of_key() {
        return vec![bundled(model)];
    }
    hands::of(model).map_or_else(|| rounds(model), |(_, gestures)| gestures)
}

/// What they are, in words.
pub fn bundled_name(model: &Model) -> &'static str {
    match hands::of(model) {
        _ if model.is_of_key() => "gesture",
        Some((name, _)) => name,
        None => "gesture of several ports",
    }
}

/// The ports of any instrument: each goes from its rest, which is 0 or the end nearest to it, far
/// to one side, far to the other and back, slowly and then fast; each a quarter of a period later
/// than the one before it, so that two go round each other.
fn rounds(model: &Model) -> Vec<Gesture> {
    let ports = model.senses.len();
    let all: f64 = ROUNDS_S.iter().sum();
    let last = ROUNDS_S[0] * 0.25 * ports as f64;
    let round = |(port, sense): (usize, &Sense)| {
        let (low, high) = (sense.range.low, sense.range.high);
        let rest = 0.0_f64.clamp(low, high);
        let side = |end: f64| rest + FAR * (end - rest);
        let start = Gesture::new().to(rest, 0.0).hold(0.05);
        let begun = start.hold(0.25 * ROUNDS_S[0] * port as f64);
        let moved = ROUNDS_S.iter().fold(begun, |gesture, seconds| {
            let (quarter, half) = (0.25 * seconds, 0.5 * seconds);
            let gesture = gesture.to(side(high), quarter).to(side(low), half);
            gesture.to(rest, quarter)
        });
        let ends_s = 0.05 + all + last;
        let wait_s = ends_s - moved.duration_s();
        moved.hold(wait_s)
    };
    model.senses.iter().enumerate().map(round).collect()
}

/// The rounds of the ports' gesture last so long (s).
const ROUNDS_S: [f64; 3] = [2.0, 1.0, 0.5];
/// How much of its range a port goes through.
const FAR: f64 = 0.8;

/// The bundled gesture of an instrument with one port, as far (m or rad) as is wanted.
pub fn bundled_to(model: &Model, travel: f64) -> Gesture {
    if model.turns() {
        turns(sensed(model).0, travel / FURTHEST)
    } else {
        strokes(travel)
    }
}

/// The ends of what an instrument senses.
fn sensed(model: &Model) -> (f64, f64) {
    let range = model.senses.first().map(|sense| sense.range);
    range.map_or((0.0, DIP_M), |range| (range.low, range.high))
}

/// 4.2 s on a key: a slow press that does not strike, a soft, a medium and a forte stroke (the
/// forte one stays down, so a hammer is caught), a half-held stroke, three fast repetitions, rest.
fn strokes(dip_m: f64) -> Gesture {
    Gesture::new()
        .stroke(0.05, 1.5, 0.05, 0.15, dip_m) // slow press
        .stroke(1.85, 0.090, 0.06, 0.10, dip_m) // soft
        .stroke(2.20, 0.050, 0.06, 0.10, dip_m) // medium
        .stroke(2.50, 0.028, 0.35, 0.12, dip_m) // forte, held: caught
        .stroke(3.10, 0.040, 0.20, 0.10, 0.7 * dip_m) // half held: the hammer falls back on the key
        .repeated(3.50, 9.0, 3, dip_m)
        .hold(0.37)
}

/// How much of its range a knob is turned.
const FURTHEST: f64 = 0.97;

/// 5 s on a knob that is sensed up to `end` (rad): a slow turn and back, two small steps, a flick,
/// and into the stops of both sides, but not below `low` (rad).
fn turns(low: f64, end: f64) -> Gesture {
    let path = [
        (0.45, 1.2, 0.1), // slowly, through some detents
        (0.0, 0.8, 0.1),
        (0.1, 0.1, 0.1), // a step, and another
        (0.2, 0.1, 0.1),
        (0.8, 0.2, 0.15),      // a flick
        (FURTHEST, 0.3, 0.15), // against the stop
        (-FURTHEST, 0.8, 0.15),
        (0.0, 0.5, 0.2),
    ];
    path.iter()
        .fold(Gesture::new().hold(0.05), |gesture, (to, seconds, rest)| {
            gesture.to((to * end).max(low), *seconds).hold(*rest)
        })
}

fn minimum_jerk(u: f64) -> f64 {
    // Rounding may carry it a hair beyond the end, and so beyond what an instrument senses.
    (u * u * u * (10.0 + u * (6.0 * u - 15.0))).min(1.0)
}

/// A time that can be waited for.
fn duration(seconds: f64) -> f64 {
    if seconds.is_finite() {
        seconds.max(0.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: u32 = 44_100;

    fn speeds(x: &[f64]) -> Vec<f64> {
        x.windows(2)
            .map(|w| (w[1] - w[0]) * f64::from(RATE_HZ))
            .collect()
    }

    #[test]
    fn turns_stay_within_what_is_sensed() {
        let ends = |low: f64, end: f64| {
            let angles = turns(low, end).positions(RATE_HZ);
            angles
                .iter()
                .fold((0.0_f64, 0.0_f64), |(least, most), angle| {
                    (least.min(*angle), most.max(*angle))
                })
        };
        assert_eq!(ends(-1.0, 1.0), (-FURTHEST, FURTHEST));
        assert_eq!(ends(0.0, 1.0), (0.0, FURTHEST));
    }

    #[test]
    fn ports_go_round_within_what_they_sense() {
        use whippen_compiler::check::Options;
        use whippen_compiler::front::compile_front;
        let text = "instrument i { sense x: length in -100 mm .. 50 mm sense p: pressure in 10 Pa .. 20 Pa }";
        let mut map = whippen_compiler::source::SourceMap::default();
        map.add("test.whip", text);
        let (program, _) = compile_front(&mut map, &Options::default());
        let gestures = bundled_ports(&program.expect("it is correct").instruments[0]);
        let all: Vec<Vec<f64>> = gestures.iter().map(|g| g.positions(RATE_HZ)).collect();
        assert!(all[0].len() == all[1].len() && gestures[0].duration_s() < 6.0);
        let ends = |x: &[f64]| {
            let low = x.iter().copied().fold(f64::INFINITY, f64::min);
            (low, x.iter().copied().fold(f64::NEG_INFINITY, f64::max))
        };
        let near =
            |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-9 && (b - d).abs() < 1e-9;
        assert!(near(ends(&all[0]), (-0.08, 0.04)));
        assert!(
            near(ends(&all[1]), (10.0, 18.0)),
            "it begins where it rests"
        );
    }

    #[test]
    fn a_stroke_goes_where_it_says_when_it_says() {
        let x = Gesture::new()
            .stroke(0.1, 0.2, 0.3, 0.1, 0.010)
            .hold(0.1)
            .positions(10_000);
        assert_eq!(x.len(), 8000);
        assert!(x[..=1000].iter().all(|&x| x == 0.0));
        assert!(
            (x[2000] - 0.005).abs() < 1e-12,
            "half way down in half the time"
        );
        assert!(x[3001..6000].iter().all(|&x| x == 0.010));
        assert!(x[7001..].iter().all(|&x| x == 0.0));
        assert!(
            x[1001..3000].windows(2).all(|w| w[1] > w[0]),
            "down all the way"
        );
    }

    #[test]
    fn strokes_from_12_ms_to_1500_ms_are_smooth() {
        for rise_s in [0.012, 0.05, 0.3, 1.5] {
            let v = speeds(
                &Gesture::new()
                    .stroke(0.01, rise_s, 0.1, 0.1, 0.010)
                    .hold(0.1)
                    .positions(RATE_HZ),
            );
            let peak = v.iter().fold(0.0_f64, |a, &v| a.max(v));
            assert!(
                (peak / (15.0 / 8.0 * 0.010 / rise_s) - 1.0).abs() < 1e-3,
                "peak speed {peak} for {rise_s} s"
            );
            // Greatest acceleration of a minimum-jerk move: 10/sqrt(3) depth / time^2.
            let bound = 5.7736 * 0.010 / rise_s.min(0.1).powi(2) * 1.001;
            let a = v
                .windows(2)
                .map(|w| (w[1] - w[0]).abs() * f64::from(RATE_HZ))
                .fold(0.0, f64::max);
            assert!(a <= bound, "acceleration {a} > {bound} for {rise_s} s");
        }
    }

    #[test]
    fn half_held_and_repeated_strokes() {
        for depth_m in [0.004, 0.0065, 0.009] {
            let x = Gesture::new()
                .stroke(0.0, 0.03, 0.2, 0.1, depth_m)
                .positions(RATE_HZ);
            assert_eq!(x.iter().copied().fold(0.0, f64::max), depth_m);
            assert!(
                x.iter().filter(|&&x| x == depth_m).count() >= 8819,
                "held for 0.2 s"
            );
        }
        let x = Gesture::new()
            .repeated(0.1, 12.0, 10, 0.010)
            .positions(RATE_HZ);
        let tops = x
            .windows(2)
            .filter(|w| w[0] < 0.0099 && w[1] >= 0.0099)
            .count();
        assert_eq!(tops, 10);
        assert!((x.len() as f64 / f64::from(RATE_HZ) - (0.1 + 10.0 / 12.0)).abs() < 1e-3);
    }

    #[test]
    fn the_default_gesture_has_seven_full_strokes_and_a_half_one() {
        let x = default_gesture().positions(RATE_HZ);
        assert!(
            (4.1..4.3).contains(&(x.len() as f64 / f64::from(RATE_HZ))),
            "{}",
            x.len()
        );
        let reaches = |m: f64| x.windows(2).filter(|w| w[0] < m && w[1] >= m).count();
        assert_eq!((reaches(0.0099), reaches(0.0069)), (7, 8));
        assert_eq!((x[0], x[x.len() - 1]), (0.0, 0.0));
        assert!(
            speeds(&x).iter().all(|v| v.abs() < 0.7),
            "forte keys move at 0.3 to 0.7 m/s"
        );
    }

    #[test]
    fn nonsense_is_harmless() {
        let g = Gesture::new()
            .stroke(f64::NAN, -1.0, f64::INFINITY, 0.0, 0.010)
            .repeated(0.0, 0.0, 3, 0.01);
        assert_eq!(g.duration_s(), 0.0);
        assert!(g.positions(RATE_HZ).is_empty());
    }
}
