//! Strokes, like for like: how fast what moves is before it strikes, seen in the same way in what
//! was measured and in what was computed.
//!
//! A sensor that reads no more before the string, and a slope over some rows, show another speed
//! than that of the strike. So computed values go through both, too. A speed is judged in copies of
//! the motion that differ by as much as the recording may be wrong.

use whippen_compiler::pipeline::Compiled;

use super::data::{FitColumn, FitData};
use super::residuals;
use crate::device::Device;
use crate::engine::EngineKind;
use crate::trajectory::Trajectory;

/// So long before it arrives a stroke's speed is looked for (s).
const BEFORE_S: f64 = 0.05;

/// What is nearer to the end than this part of what the sensor reads has arrived.
const NEAR: f64 = 0.02;

/// It must have gone back by this part to arrive once more.
const BACK: f64 = 0.2;

/// How strokes of a recording are judged.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeRule {
    /// The column of what moves.
    pub title: String,
    /// The rows of a slope.
    pub rows: usize,
    /// From a slope to a speed.
    pub times: f64,
    /// Copies of the motion.
    pub copies: Vec<Trajectory>,
}

/// A stroke as it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenStroke {
    /// The greatest speed before it arrived.
    pub speed: f64,
    /// When it arrived (s from the first row), each time.
    pub arrivals_s: Vec<f64>,
}

/// One stroke, measured and computed.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokePair {
    /// As it was measured.
    pub measured: SeenStroke,
    /// As it was computed of the motion as recorded.
    pub computed: SeenStroke,
    /// And of each copy.
    pub copies: Vec<SeenStroke>,
    /// The greatest speed of the key before.
    pub key_speed: f64,
    /// How far what moves is from what was measured, from where that leaves its lowest place until
    /// it arrives (root of the mean square, times what makes a speed of a slope).
    pub path: f64,
}

impl StrokePair {
    /// Whether it arrived at all.
    pub fn is_struck(&self) -> bool {
        !self.measured.arrivals_s.is_empty()
    }

    /// In how many copies it arrives as often as measured.
    pub fn as_often(&self) -> usize {
        let often =
            |stroke: &&SeenStroke| stroke.arrivals_s.len() == self.measured.arrivals_s.len();
        self.copies.iter().filter(often).count()
    }

    /// How much later than measured it arrives first (s).
    pub fn late_s(&self) -> Option<f64> {
        Some(self.computed.arrivals_s.first()? - self.measured.arrivals_s.first()?)
    }

    /// Computed over measured speed in each copy; none where it does not arrive.
    pub fn ratios(&self) -> impl Iterator<Item = Option<f64>> {
        let ratio = |stroke: &SeenStroke| {
            let arrives = !stroke.arrivals_s.is_empty();
            arrives.then_some(stroke.speed / self.measured.speed)
        };
        self.copies.iter().map(ratio)
    }
}

/// What holds of the strokes of many recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrokeVerdict {
    /// Computed over measured speed, the median of strokes that were fitted.
    pub scale: f64,
    /// The median error of strokes that were not fitted, without that scale.
    pub error: f64,
    /// Measured speed over the key's, the median of strokes that were fitted.
    pub key_factor: f64,
    /// The median error of strokes that were not fitted, of the key's speed times that.
    pub key_error: f64,
}

impl StrokeVerdict {
    /// Of fitted strokes and others; none where there are not both.
    pub fn of(fitted: &[&StrokePair], others: &[&StrokePair]) -> Option<StrokeVerdict> {
        let struck = |all: &[&StrokePair]| -> Vec<StrokePair> {
            let all = all.iter().filter(|c| c.is_struck());
            all.map(|c| (*c).clone()).collect()
        };
        let (fitted, others) = (struck(fitted), struck(others));
        let key = |c: &StrokePair| c.measured.speed / c.key_speed;
        let scale = median(
            fitted
                .iter()
                .flat_map(|c| c.ratios().flatten().collect::<Vec<_>>()),
        )?;
        let key_factor = median(fitted.iter().map(key))?;
        // A stroke that does not arrive is wholly wrong.
        let error = |ratio: Option<f64>| ratio.map_or(1.0, |ratio| (ratio / scale - 1.0).abs());
        let errors = others
            .iter()
            .flat_map(|c| c.ratios().map(error).collect::<Vec<_>>());
        Some(StrokeVerdict {
            scale,
            error: median(errors)?,
            key_factor,
            key_error: median(others.iter().map(|c| (key_factor / key(c) - 1.0).abs()))?,
        })
    }
}

/// Plays a recording and its copies, and compares their strokes; none where the recording has none
/// to be compared, or where it cannot be played.
pub fn compare(
    compiled: &Compiled,
    device: &Device,
    engine: EngineKind,
    data: &FitData,
) -> Option<StrokePair> {
    let strokes = data.strokes.as_ref()?;
    let column = data.columns.iter().find(|c| c.title == strokes.title)?;
    let play = |places: &[Trajectory]| {
        let played = FitData {
            places: places.to_vec(),
            columns: vec![column.clone()],
            ..data.clone()
        };
        let trace = residuals::play(compiled, device, engine, &played).ok()?;
        residuals::at_rows(&trace, column)
    };
    let see = |values: &[f64]| strokes.see(values, column);
    let computed = play(&data.places)?;
    let copies: Option<Vec<SeenStroke>> = (strokes.copies.iter())
        .map(|copy| Some(see(&play(std::slice::from_ref(copy))?)))
        .collect();
    let measured = see(&column.values);
    let until = until_row(&measured, column);
    let ticks_a_row = f64::from(compiled.model.rate_hz) / column.rate_hz;
    let last = data.places[0].ticks().checked_sub(1)?;
    let place = |row: usize| data.places[0].at(((row as f64 * ticks_a_row) as usize).min(last));
    let key: Vec<f64> = (0..until).map(place).collect();
    let from = leaves(&column.values[..until]);
    let pairs = computed.iter().zip(&column.values).take(until).skip(from);
    let squares: Vec<f64> = pairs.map(|(c, m)| (c - m).powi(2)).collect();
    Some(StrokePair {
        path: strokes.times * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
        key_speed: fastest(&key, column.rate_hz, strokes.rows),
        computed: see(&computed),
        measured,
        copies: copies?,
    })
}

impl StrokeRule {
    /// A stroke as a column shows it.
    fn see(&self, values: &[f64], column: &FitColumn) -> SeenStroke {
        let arrivals_s = arrivals(values, column);
        let mut stroke = SeenStroke {
            speed: 0.0,
            arrivals_s,
        };
        let until = until_row(&stroke, column);
        let from = until.saturating_sub((BEFORE_S * column.rate_hz) as usize + self.rows);
        let rows = match stroke.arrivals_s.is_empty() {
            true => values,
            false => &values[from..until.min(values.len())],
        };
        stroke.speed = self.times * fastest(rows, column.rate_hz, self.rows);
        stroke
    }
}

/// The row at which a stroke has arrived, with as many behind it as it still may be fastest in; the
/// number of rows where it does not.
fn until_row(stroke: &SeenStroke, column: &FitColumn) -> usize {
    let rows = column.values.len();
    let first = stroke.arrivals_s.first();
    first.map_or(rows, |at| ((at * column.rate_hz) as usize + 1).min(rows))
}

/// The row behind the last that is within a twentieth of the lowest value.
fn leaves(values: &[f64]) -> usize {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let last = values.iter().rposition(|v| v - low <= 0.05 * (high - low));
    last.map_or(0, |row| row + 1)
}

/// When a column comes to the end of what its sensor reads, or to its own greatest value (s).
fn arrivals(values: &[f64], column: &FitColumn) -> Vec<f64> {
    let fold = |of: fn(f64, f64) -> f64, from: f64| column.values.iter().copied().fold(from, of);
    let low = fold(f64::min, f64::INFINITY);
    let high = match column.reads.1.is_finite() {
        true => column.reads.1,
        false => fold(f64::max, f64::NEG_INFINITY),
    };
    let (mut is_there, mut arrivals) = (false, Vec::new());
    for (row, value) in values.iter().enumerate() {
        let left = (high - value) / (high - low).max(f64::MIN_POSITIVE);
        if !is_there && left < NEAR {
            is_there = true;
            arrivals.push(row as f64 / column.rate_hz);
        } else if left > BACK {
            is_there = false;
        }
    }
    arrivals
}

/// The greatest slope of a least-squares line over so many rows (per second).
fn fastest(values: &[f64], rate_hz: f64, rows: usize) -> f64 {
    let middle = (rows as f64 - 1.0) / 2.0;
    let weight: f64 = (0..rows).map(|row| (row as f64 - middle).powi(2)).sum();
    let slope = |window: &[f64]| {
        let terms = window.iter().enumerate();
        let sum: f64 = terms
            .map(|(row, value)| (row as f64 - middle) * value)
            .sum();
        sum / weight * rate_hz
    };
    values.windows(rows).map(slope).fold(0.0, f64::max)
}

/// The middle one.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values.get((values.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp to 1 at a second, up to which the sensor reads 0.8.
    fn column(slope: f64) -> FitColumn {
        let values = (0..2000).map(|row| (slope * f64::from(row) / 1000.0).min(0.8));
        FitColumn {
            reads: (f64::NEG_INFINITY, 0.8),
            ..FitColumn::new("phi_rad".into(), 1000.0, values.collect())
        }
    }

    fn strokes() -> StrokeRule {
        StrokeRule {
            title: "phi_rad".into(),
            rows: 15,
            times: 0.5,
            copies: Vec::new(),
        }
    }

    #[test]
    fn a_stroke_is_seen_up_to_the_end_of_its_sensor() {
        let ramp = column(2.0);
        let seen = strokes().see(&ramp.values, &ramp);
        assert!((seen.speed - 1.0).abs() < 1e-9, "{seen:?}");
        assert_eq!(seen.arrivals_s, [0.393]);
        let slow = strokes().see(&column(0.3).values, &ramp);
        assert!((slow.speed - 0.15).abs() < 1e-9, "{slow:?}");
        assert!(slow.arrivals_s.is_empty());
        let mut twice = ramp.values.clone();
        (500..700).for_each(|row| twice[row] = 0.5);
        assert_eq!(strokes().see(&twice, &ramp).arrivals_s, [0.393, 0.7]);
    }

    #[test]
    fn a_common_scale_is_no_error_and_a_missed_stroke_is() {
        let stroke = |speed, times: usize| SeenStroke {
            speed,
            arrivals_s: vec![0.1; times],
        };
        let compared = |measured: f64, copies: &[f64]| StrokePair {
            measured: stroke(measured, 1),
            computed: stroke(copies[0], 1),
            copies: copies.iter().map(|speed| stroke(*speed, 1)).collect(),
            key_speed: 0.25 * measured,
            path: 0.0,
        };
        let fitted = [&compared(2.0, &[2.2]), &compared(1.0, &[1.1])];
        let verdict =
            StrokeVerdict::of(&fitted, &[&compared(3.0, &[3.3, 3.63, 3.63])]).expect("both");
        assert!((verdict.scale - 1.1).abs() < 1e-9, "{verdict:?}");
        assert!((verdict.error - 0.1).abs() < 1e-9, "{verdict:?}");
        assert!((verdict.key_factor - 4.0).abs() < 1e-9 && verdict.key_error < 1e-9);
        let missed = StrokePair {
            copies: vec![stroke(0.0, 0); 3],
            ..compared(3.0, &[3.3])
        };
        assert_eq!(missed.as_often(), 0);
        let verdict = StrokeVerdict::of(&fitted, &[&missed]).expect("both");
        assert_eq!(verdict.error, 1.0);
        assert_eq!(StrokeVerdict::of(&fitted, &[]), None);
    }
}
