//! Fewer points for the same picture.
//!
//! A line over time is reduced per column of the page to its first, lowest, highest and last point,
//! in their order: whatever the number of ticks, nothing is lost that could be seen. A loop is
//! reduced to the steps between cells of the page that were not drawn before; points on a straight
//! line are left out of both. A machine is reduced to runs.

use std::collections::HashSet;

use super::axis::Axis;
use super::drawing::Point;
use crate::record::Kept;

/// Points of a line over time, in stretches between values that are not finite. `place` gives a
/// tick's abscissa; columns are one point wide.
pub fn line(
    values: impl Iterator<Item = Kept>,
    place: impl Fn(usize) -> f64,
    y: &Axis,
) -> Vec<Vec<Point>> {
    let points = |stretch: Vec<Kept>| {
        let mut to = Vec::new();
        stretch
            .into_iter()
            .for_each(|(tick, value)| push(&mut to, (place(tick), y.place(value))));
        simplified(to)
    };
    extremes(values, |tick| place(tick).floor())
        .into_iter()
        .map(points)
        .map(simplified)
        .collect()
}

/// Of every column of ticks the first, lowest, highest and last value, in stretches between values
/// that are not finite. `column` gives the column of a tick.
pub fn extremes(
    values: impl Iterator<Item = Kept>,
    column: impl Fn(usize) -> f64,
) -> Vec<Vec<Kept>> {
    let mut stretches: Vec<Vec<Kept>> = Vec::new();
    let mut open: Option<PixelColumn> = None;
    let mut goes_on = false;
    for (tick, value) in values {
        let left = column(tick);
        match &mut open {
            Some(c) if value.is_finite() && left == c.left => c.add(tick, value),
            _ => {
                if let (Some(done), Some(last)) = (open.take(), stretches.last_mut()) {
                    done.flush(last);
                }
                if value.is_finite() {
                    if !goes_on {
                        stretches.push(Vec::new());
                    }
                    open = Some(PixelColumn::new(left, tick, value));
                }
            }
        }
        goes_on = value.is_finite();
    }
    if let (Some(done), Some(last)) = (open, stretches.last_mut()) {
        done.flush(last);
    }
    stretches
}

/// What one column has seen: tick and value.
struct PixelColumn {
    left: f64,
    first: Kept,
    lowest: Kept,
    highest: Kept,
    last: Kept,
}

impl PixelColumn {
    fn new(left: f64, tick: usize, value: f64) -> PixelColumn {
        let only = (tick, value);
        PixelColumn {
            left,
            first: only,
            lowest: only,
            highest: only,
            last: only,
        }
    }

    fn add(&mut self, tick: usize, value: f64) {
        self.last = (tick, value);
        if value < self.lowest.1 {
            self.lowest = self.last;
        }
        if value > self.highest.1 {
            self.highest = self.last;
        }
    }

    fn flush(self, to: &mut Vec<Kept>) {
        let mut kept = [self.first, self.lowest, self.highest, self.last];
        kept.sort_by_key(|k| k.0);
        to.extend(
            kept.iter()
                .enumerate()
                .filter(|(i, k)| *i == 0 || kept[i - 1].0 != k.0)
                .map(|(_, k)| *k),
        );
    }
}

/// Adds a point, which takes the place of the one before where a level line merely goes on.
fn push(to: &mut Vec<Point>, point: Point) {
    if let [.., a, b] = to[..]
        && a.1 == b.1
        && b.1 == point.1
    {
        to.pop();
    }
    to.push(point);
}

/// Points of a path in the plane without the steps that were drawn before, in stretches. Steps
/// within a cell of half a point are left out.
pub fn path(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut drawn = HashSet::new();
    let mut stretches: Vec<Vec<Point>> = Vec::new();
    let mut before: Option<(Point, (i32, i32))> = None;
    let mut pen_down = false;
    for point in points {
        if !(point.0.is_finite() && point.1.is_finite()) {
            (before, pen_down) = (None, false);
            continue;
        }
        let cell = (
            (point.0 * 2.0).floor() as i32,
            (point.1 * 2.0).floor() as i32,
        );
        let Some((from, from_cell)) = before else {
            stretches.push(vec![point]);
            (before, pen_down) = (Some((point, cell)), true);
            continue;
        };
        if cell == from_cell {
            continue;
        }
        let is_new = drawn.insert((from_cell.min(cell), from_cell.max(cell)));
        match stretches.last_mut() {
            Some(stretch) if is_new && pen_down => stretch.push(point),
            _ if is_new => stretches.push(vec![from, point]),
            _ => {}
        }
        (before, pen_down) = (Some((point, cell)), is_new);
    }
    stretches.into_iter().map(simplified).collect()
}

/// A line may be moved by so much (points): less than a screen shows.
const TOLERANCE: f64 = 0.05;

/// The line without points that lie within the tolerance of the line through the others (Douglas
/// and Peucker 1973).
fn simplified(points: Vec<Point>) -> Vec<Point> {
    let Some(last) = points.len().checked_sub(1) else {
        return points;
    };
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let off = |i: usize| (i, distance(points[i], points[from], points[to]));
        let farthest = (from + 1..to).map(off).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = farthest.filter(|f| f.1 > TOLERANCE) {
            kept[i] = true;
            open.extend([(from, i), (i, to)]);
        }
    }
    points
        .into_iter()
        .zip(kept)
        .filter_map(|(point, kept)| kept.then_some(point))
        .collect()
}

/// From a point to a stretch of line between two others.
fn distance(point: Point, from: Point, to: Point) -> f64 {
    let (along, off) = (
        (to.0 - from.0, to.1 - from.1),
        (point.0 - from.0, point.1 - from.1),
    );
    let length2 = along.0 * along.0 + along.1 * along.1;
    let part = if length2 > 0.0 {
        ((off.0 * along.0 + off.1 * along.1) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (right, down) = (off.0 - part * along.0, off.1 - part * along.1);
    (right * right + down * down).sqrt()
}

/// One run of a state: from and to (places on the page) and its index.
pub type Run = (f64, f64, usize);

/// From a tick on a machine is in a state; in none where the value is no state.
pub type Change = (usize, Option<usize>);

/// The ticks at which a machine with `states` states changes, the first tick among them.
pub fn changes(values: impl Iterator<Item = Kept>, states: usize) -> Vec<Change> {
    let state = |value: f64| (value >= 0.0 && value < states as f64).then_some(value as usize);
    let mut changes: Vec<Change> = Vec::new();
    for (tick, value) in values {
        let now = state(value);
        if changes.last().is_none_or(|last| last.1 != now) {
            changes.push((tick, now));
        }
    }
    changes
}

/// The runs of a machine with `states` states that lasts for so many ticks, in columns of one
/// point. `place` gives a tick's abscissa. A column in which several states were visited shows the
/// one that is rarest overall, so that short visits stay visible.
pub fn runs(
    changes: &[Change],
    (ticks, states): (usize, usize),
    place: impl Fn(usize) -> f64,
) -> Vec<Run> {
    let ends = changes.iter().skip(1).map(|c| c.0).chain([ticks]);
    let visits = || {
        let visits = changes.iter().zip(ends.clone());
        visits.filter_map(|((from, now), end)| now.map(|now| (*from, end, now)))
    };
    let mut ticks_in = vec![0_usize; states];
    visits().for_each(|(from, end, now)| ticks_in[now] += end - from);
    let left = place(0);
    let count = (place(ticks) - left).clamp(0.0, 1e5).ceil() as usize;
    let mut columns: Vec<Option<usize>> = vec![None; count];
    for (from, end, now) in visits() {
        let first = (place(from) - left) as usize;
        let end = ((place(end) - left).ceil() as usize).clamp(first, count);
        for column in columns.iter_mut().take(end).skip(first) {
            *column = column
                .filter(|before| ticks_in[*before] <= ticks_in[now])
                .or(Some(now));
        }
    }
    let mut runs: Vec<Run> = Vec::new();
    for (i, now) in columns
        .iter()
        .enumerate()
        .filter_map(|(i, c)| c.map(|now| (i, now)))
    {
        let from = left + i as f64;
        match runs.last_mut().filter(|run| run.2 == now && run.1 == from) {
            Some(run) => run.1 = from + 1.0,
            None => runs.push((from, from + 1.0, now)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values as ticks and values.
    fn of(values: &[f64]) -> impl Iterator<Item = Kept> {
        values.iter().copied().enumerate()
    }

    fn bands(values: &[f64], states: usize, place: impl Fn(usize) -> f64) -> Vec<Run> {
        runs(&changes(of(values), states), (values.len(), states), place)
    }

    #[test]
    fn a_line_keeps_its_extremes_and_ends_with_few_points() {
        let ticks = 1_600_000;
        let mut values: Vec<f64> = (0..ticks).map(|i| (i as f64 * 1e-4).sin()).collect();
        values[777_777] = 5.0;
        values[1_234_567] = -7.0;
        let y = Axis::exact(-10.0, 10.0, 200.0, 0.0);
        let lines = line(
            of(&values),
            |tick| 50.0 + 750.0 * tick as f64 / ticks as f64,
            &y,
        );
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() <= 4 * 751, "{}", lines[0].len());
        let ordinates = || lines[0].iter().map(|p| p.1);
        assert_eq!(ordinates().fold(f64::MAX, f64::min), y.place(5.0));
        assert_eq!(ordinates().fold(f64::MIN, f64::max), y.place(-7.0));
        assert_eq!(
            (lines[0][0].1, lines[0][lines[0].len() - 1].1),
            (y.place(values[0]), y.place(values[ticks - 1]))
        );
        assert!(lines[0].windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn short_and_level_and_broken_lines() {
        let y = Axis::exact(0.0, 1.0, 100.0, 0.0);
        let at = |tick| tick as f64 * 10.0;
        assert_eq!(
            line(of(&[0.0, 1.0, 0.5]), at, &y),
            [vec![(0.0, 100.0), (10.0, 0.0), (20.0, 50.0)]]
        );
        assert_eq!(
            line(of(&[0.5; 1000]), at, &y),
            [vec![(0.0, 50.0), (9990.0, 50.0)]]
        );
        assert_eq!(line(of(&[0.5]), at, &y), [vec![(0.0, 50.0)]]);
        assert!(line(of(&[]), at, &y).is_empty() && line(of(&[f64::NAN; 5]), at, &y).is_empty());
        let broken = line(of(&[0.0, f64::NAN, 1.0, 0.0]), at, &y);
        assert_eq!(
            broken,
            [vec![(0.0, 100.0)], vec![(20.0, 0.0), (30.0, 100.0)]]
        );
    }

    #[test]
    fn a_path_that_repeats_itself_is_drawn_once() {
        let circle = |i: usize| {
            let angle = i as f64 / 500.0 * std::f64::consts::TAU;
            (100.0 + 50.0 * angle.cos(), 100.0 + 50.0 * angle.sin())
        };
        let once: usize = path((0..=500).map(circle)).iter().map(Vec::len).sum();
        let often: usize = path((0..=500_000).map(circle)).iter().map(Vec::len).sum();
        assert!(once > 100 && often < once + once / 8, "{once} {often}");
        assert_eq!(
            path([(1.0, 1.0), (1.1, 1.1), (f64::NAN, 0.0), (9.0, 9.0)].into_iter()).len(),
            2
        );
        assert!(path(std::iter::empty()).is_empty());
    }

    #[test]
    fn runs_cover_the_time_and_show_short_visits() {
        let mut values = vec![0.0; 100_000];
        values[40_000..60_000].fill(1.0);
        values[80_000] = 2.0;
        let place = |tick| tick as f64 / 200.0;
        assert_eq!(
            bands(&values, 3, place),
            [
                (0.0, 200.0, 0),
                (200.0, 300.0, 1),
                (300.0, 400.0, 0),
                (400.0, 401.0, 2),
                (401.0, 500.0, 0)
            ]
        );
        assert_eq!(
            bands(&[1.0, 1.0, 0.0], 2, |t| t as f64 * 10.0),
            [(0.0, 20.0, 1), (20.0, 30.0, 0)]
        );
        assert!(
            bands(&[], 2, place).is_empty()
                && bands(&[7.0, f64::NAN, -1.0], 2, |t| t as f64).is_empty()
        );
    }
}
