//! Few points for a column that can still be zoomed: the ticks between which it is a straight line.
//!
//! ```text
//!   every tick    . . . : ' ' ' ' : . . . . .          ticks kept    .     : '     ' :         .
//! ```
//!
//! Every kept point is a tick with its own value, and the line through the kept points is nowhere
//! further than a tolerance from any tick: a ten-thousandth of what the column spans. Its lowest
//! and its highest value are always kept. Where that takes too many points (noise), the tolerance
//! is doubled up to eight times; where that is not enough either, every stretch of equal length
//! keeps its first, lowest, highest and last value. So no peak is ever hidden, and a column never
//! takes more than [`KNOTS_MAX`] points, however long it is.

use crate::plot::decimate::extremes;
use crate::record::{Kept, Record};

/// So many points of a column are kept at the most.
pub const KNOTS_MAX: usize = 16_384;

/// The finest tolerance, of the span of the column.
const FINEST: f64 = 1e-4;

/// The coarsest tolerance, of the span: a few pixels of a panel. A stroke under noise is still seen
/// better so than by extremes.
const COARSEST: f64 = 256.0 * FINEST;

/// How far ahead of the last good end a line is tried, in ticks.
const AHEAD_MAX: usize = 4096;

/// What was kept of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Ticks and their values, by rising tick. A value that is not finite breaks the line.
    pub kept: Vec<Kept>,
    /// How true the line through them is.
    pub truth: Truth,
}

/// How true a line through knots is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// At every tick it is at most this far from the value.
    Within(f64),
    /// Of every stretch of so many ticks it shows the first, lowest, highest and last value.
    Extremes(usize),
}

/// The knots of a column: of a long one, of which not every tick was kept, the extremes.
pub fn knots(record: &Record) -> Knots {
    match record.values() {
        Some(values) => knots_of_all(values),
        None => stretches(record),
    }
}

/// The knots of the values of every tick.
fn knots_of_all(values: &[f64]) -> Knots {
    let fixed = fixed(values);
    let span = fixed.iter().map(|&i| values[i]).filter(|v| v.is_finite());
    let (low, high) = span.fold((f64::MAX, f64::MIN), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let span = (high - low).max(0.0);
    let mut tolerance = FINEST;
    while tolerance <= COARSEST {
        if let Some(kept) = lines(values, &fixed, tolerance * span) {
            return Knots {
                kept,
                truth: Truth::Within(tolerance * span),
            };
        }
        tolerance *= 2.0;
    }
    let every = values.len().div_ceil(KNOTS_MAX / 4);
    extremes_of(values.iter().copied().enumerate(), every)
}

/// The extremes of whole numbers of the stretches that were kept.
fn stretches(record: &Record) -> Knots {
    let wanted = record.ticks().div_ceil(KNOTS_MAX / 4);
    extremes_of(record.points(), wanted.next_multiple_of(record.stretch()))
}

fn extremes_of(values: impl Iterator<Item = Kept>, every: usize) -> Knots {
    let kept = extremes(values, |tick| (tick / every) as f64);
    Knots {
        kept: kept.concat(),
        truth: Truth::Extremes(every),
    }
}

/// Ticks that are kept in any case: the ends, the extremes, both sides of where the values stop or
/// begin to be finite.
fn fixed(values: &[f64]) -> Vec<usize> {
    let mut ticks = Vec::new();
    let finite = || values.iter().enumerate().filter(|(_, v)| v.is_finite());
    ticks.extend(finite().min_by(|a, b| a.1.total_cmp(b.1)).map(|(i, _)| i));
    // The first of equal ones.
    ticks.extend(
        finite()
            .max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)))
            .map(|(i, _)| i),
    );
    let edge = |i: &usize| values[*i].is_finite() != values[i - 1].is_finite();
    ticks.extend((1..values.len()).filter(edge).flat_map(|i| [i - 1, i]));
    ticks.extend(values.first().map(|_| 0));
    ticks.extend(values.len().checked_sub(1));
    ticks.sort_unstable();
    ticks.dedup();
    ticks
}

/// The knots for a tolerance; none if they are too many.
fn lines(values: &[f64], fixed: &[usize], tolerance: f64) -> Option<Vec<Kept>> {
    let mut kept: Vec<Kept> = fixed.first().map(|&i| (i, values[i])).into_iter().collect();
    for pair in fixed.windows(2) {
        let mut anchor = pair[0];
        while anchor < pair[1] {
            anchor = if values[anchor].is_finite() {
                reach(values, anchor, pair[1], tolerance)
            } else {
                pair[1]
            };
            kept.push((anchor, values[anchor]));
            if kept.len() > KNOTS_MAX {
                return None;
            }
        }
    }
    Some(kept)
}

/// The furthest tick up to `end` to which a straight line from `anchor` passes all ticks within the
/// tolerance.
fn reach(values: &[f64], anchor: usize, end: usize, tolerance: f64) -> usize {
    let (mut flattest, mut steepest) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut good = anchor + 1;
    for tick in anchor + 1..=end {
        let (rise, run) = (values[tick] - values[anchor], (tick - anchor) as f64);
        if (flattest..=steepest).contains(&(rise / run)) {
            good = tick;
        }
        flattest = flattest.max((rise - tolerance) / run);
        steepest = steepest.min((rise + tolerance) / run);
        if flattest > steepest || tick - good > AHEAD_MAX {
            break;
        }
    }
    good
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_column_keeps_its_peaks() {
        let ticks = 5_000_000;
        let mut record = Record::bounded();
        for tick in 0..ticks {
            record.push(match tick {
                3_456_789 => 7.0,
                4_567_890 => -7.0,
                _ => 0.0,
            });
        }
        let Knots { kept, truth } = knots(&record);
        let Truth::Extremes(every) = truth else {
            panic!("{truth:?}")
        };
        assert!(
            every % record.stretch() == 0 && kept.len() <= KNOTS_MAX,
            "{every}"
        );
        assert!(kept.contains(&(3_456_789, 7.0)) && kept.contains(&(4_567_890, -7.0)));
    }

    /// The largest distance of the line through the knots from any tick.
    fn worst(values: &[f64], kept: &[Kept]) -> f64 {
        let distance = |pair: &[Kept]| {
            let ((i, a), (j, b)) = (pair[0], pair[1]);
            let at = |t: usize| a + (b - a) * (t - i) as f64 / (j - i) as f64;
            (i..=j)
                .map(|t| (at(t) - values[t]).abs())
                .fold(0.0, f64::max)
        };
        kept.windows(2).map(distance).fold(0.0, f64::max)
    }

    #[test]
    fn smooth_columns_keep_few_points_within_the_tolerance() {
        let values: Vec<f64> = (0..441_000).map(|i| (f64::from(i) * 1e-4).sin()).collect();
        let Knots { kept, truth } = knots_of_all(&values);
        let Truth::Within(tolerance) = truth else {
            panic!("{truth:?}")
        };
        assert!(
            (1.9e-4..2.1e-4).contains(&tolerance),
            "a ten-thousandth of the span, not {tolerance}"
        );
        assert!(
            worst(&values, &kept) <= tolerance * (1.0 + 1e-9) && kept.len() < 1500,
            "{}",
            kept.len()
        );
        assert!(kept.iter().all(|&(tick, value)| values[tick] == value));
    }

    #[test]
    fn a_peak_of_one_tick_is_kept() {
        let mut values = vec![0.0; 1_600_000];
        values[777_777] = 5.0;
        values[1_234_567] = -7e-3;
        assert_eq!(
            knots_of_all(&values).kept,
            [
                (0, 0.0),
                (777_776, 0.0),
                (777_777, 5.0),
                (777_778, 0.0),
                (1_234_566, 0.0),
                (1_234_567, -7e-3)
            ]
            .into_iter()
            .chain([(1_234_568, 0.0), (1_599_999, 0.0)])
            .collect::<Vec<_>>()
        );
    }

    #[test]
    fn noise_keeps_its_extremes_within_the_limit() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut values: Vec<f64> = (0..1_000_000).map(|_| 18.0 * noise() - 9.0).collect();
        (values[500_000], values[600_000]) = (9.5, -9.5);
        let Knots { kept, truth } = knots_of_all(&values);
        assert_eq!(truth, Truth::Extremes(245));
        assert!(kept.len() <= KNOTS_MAX, "{}", kept.len());
        assert!(kept.contains(&(500_000, 9.5)) && kept.contains(&(600_000, -9.5)));
        // A little noise on something slow is drawn through.
        let values: Vec<f64> = (0..1_000_000)
            .map(|i| (f64::from(i) * 1e-5).sin() + 0.02 * noise())
            .collect();
        let Knots { kept, truth } = knots_of_all(&values);
        let Truth::Within(tolerance) = truth else {
            panic!("{truth:?}")
        };
        assert!(
            tolerance < 0.026 && worst(&values, &kept) <= tolerance * (1.0 + 1e-9),
            "{tolerance}"
        );
    }

    #[test]
    fn stretches_of_noise_keep_their_highest_values() {
        let mut state = 7_u64;
        let values: Vec<f64> = (0..1_000_000)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64
            })
            .collect();
        let kept = knots_of_all(&values).kept;
        for (at, stretch) in values.chunks(245).enumerate() {
            let highest = stretch.iter().copied().fold(f64::MIN, f64::max);
            assert!(
                kept.iter()
                    .any(|&(tick, value)| tick / 245 == at && value == highest),
                "stretch {at}"
            );
        }
    }

    #[test]
    fn short_level_and_broken_columns() {
        assert!(knots_of_all(&[]).kept.is_empty());
        assert_eq!(knots_of_all(&[3.0]).kept, [(0, 3.0)]);
        assert_eq!(knots_of_all(&[3.0; 1000]).kept, [(0, 3.0), (999, 3.0)]);
        assert_eq!(knots_of_all(&[3.0; 2]).truth, Truth::Within(0.0));
        let nan = f64::NAN;
        let ticks: Vec<usize> = knots_of_all(&[1.0, 1.0, nan, nan, nan, 2.0, 3.0])
            .kept
            .iter()
            .map(|k| k.0)
            .collect();
        assert_eq!(ticks, [0, 1, 2, 4, 5, 6]);
        assert_eq!(knots_of_all(&[nan; 9]).kept.len(), 2);
    }
}
