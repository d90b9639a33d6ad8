//! A measured loop of force over travel beside the one that a run computed.
//!
//! Every measured point has a place and a branch. The run's forces there, between the two ticks in
//! which its key passes the place in that direction, are averaged over all such passes, and the
//! distance is the root of the mean square over the points. So a loop counts point by point,
//! however long the run stays where.
//!
//! Not here: how a recording is read, and how its loop is drawn (`plot`).

use crate::plot::stretches_of;
use crate::record::Record;

/// A place and the force there (SI).
pub type Point = (f64, f64);

/// What was measured: each branch by rising places.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MeasuredLoop {
    /// Going down.
    pub press: Vec<Point>,
    /// Coming up.
    pub back: Vec<Point>,
}

/// How far a run's loop is from it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoopDistance {
    /// Root of the mean square (N).
    pub rms_n: f64,
    /// Points that the run's key passed on their branch.
    pub points: usize,
    /// Points that it did not pass.
    pub missed: usize,
    /// The point that is furthest off: its place, and by how much the run lies above it (N).
    pub worst: Option<(f64, f64)>,
}

/// The forces of a run at the place of one point.
#[derive(Debug, Clone, Copy, Default)]
struct Passes {
    sum_n: f64,
    count: f64,
}

impl MeasuredLoop {
    /// The same between two places.
    #[must_use]
    pub fn between(mut self, [low, high]: [f64; 2]) -> MeasuredLoop {
        for branch in [&mut self.press, &mut self.back] {
            branch.retain(|point| (low..=high).contains(&point.0));
        }
        self
    }

    /// All points.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.press.iter().chain(&self.back)
    }

    /// How far the ticks that are kept one by one of a run's travel and force are from it. Travel
    /// comes in steps: a point that is less than one beyond the run's ends counts as its end.
    pub fn distance(&self, travel: &Record, force: &Record, step: f64) -> LoopDistance {
        let (ways, forces) = (travel.head(), force.head());
        let ends = ways
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |e, x| {
                [e[0].min(*x), e[1].max(*x)]
            });
        let held = |place: f64| match place {
            x if x < ends[0] && x > ends[0] - step => ends[0],
            x if x > ends[1] && x < ends[1] + step => ends[1],
            x => x,
        };
        let mut squares = 0.0;
        let mut out = LoopDistance::default();
        for (branch, downward) in [(&self.press, true), (&self.back, false)] {
            let places: Vec<f64> = branch.iter().map(|point| held(point.0)).collect();
            let mut passes = vec![Passes::default(); places.len()];
            for (from, to, way) in stretches_of(ways) {
                if way == downward {
                    let part = ways[from..to].windows(2).zip(forces[from..].windows(2));
                    part.for_each(|(x, f)| pass(&places, &mut passes, [x[0], x[1]], [f[0], f[1]]));
                }
            }
            for ((place, measured), passed) in branch.iter().zip(&passes) {
                if passed.count == 0.0 {
                    out.missed += 1;
                    continue;
                }
                let off = passed.sum_n / passed.count - measured;
                out.points += 1;
                squares += off * off;
                if out.worst.is_none_or(|(_, worst)| off.abs() > worst.abs()) {
                    out.worst = Some((*place, off));
                }
            }
        }
        out.rms_n = (squares / f64::max(out.points as f64, 1.0)).sqrt();
        out
    }
}

/// A tick's way from place to place, with the forces at its ends: the points that lie on it.
fn pass(places: &[f64], passes: &mut [Passes], x: [f64; 2], force: [f64; 2]) {
    if x[0] == x[1] {
        return;
    }
    let [low, high] = if x[0] < x[1] { x } else { [x[1], x[0]] };
    let from = places.partition_point(|place| *place < low);
    for (place, passed) in places.iter().zip(passes).skip(from) {
        if *place > high {
            break;
        }
        let part = (place - x[0]) / (x[1] - x[0]);
        passed.sum_n += force[0] + part * (force[1] - force[0]);
        passed.count += 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(values: impl Iterator<Item = f64>) -> Record {
        let mut record = Record::whole();
        values.for_each(|value| record.push(value));
        record
    }

    /// Down and up by a line each, measured at other places than the run's.
    fn loop_of(offset: f64) -> MeasuredLoop {
        let place = |n: i32| f64::from(n) * 0.37e-3;
        let at = |gap: f64| move |n: i32| (place(n), 80.0 * place(n) + gap + offset);
        MeasuredLoop {
            press: (0..10).map(at(0.1)).collect(),
            back: (0..10).map(at(-0.1)).collect(),
        }
    }

    fn run() -> [Record; 2] {
        let down = (0..=400).map(|n| (f64::from(n) * 1e-5, 0.1));
        let up = (0..400).rev().map(|n| (f64::from(n) * 1e-5, -0.1));
        let all: Vec<(f64, f64)> = down.chain(up).collect();
        let force = all.iter().map(|(x, gap)| 80.0 * x + gap);
        [record(all.iter().map(|tick| tick.0)), record(force)]
    }

    #[test]
    fn a_loop_is_itself_and_an_offset_is_told() {
        let [travel, force] = run();
        let same = loop_of(0.0).distance(&travel, &force, 0.0);
        assert!(same.rms_n < 1e-12 && same.points == 20, "{same:?}");
        let off = loop_of(0.02).distance(&travel, &force, 0.0);
        assert!((off.rms_n - 0.02).abs() < 1e-12, "{off:?}");
        assert!((off.worst.expect("a worst point").1 + 0.02).abs() < 1e-12);
        // The branches exchanged are a whole gap off.
        let of = loop_of(0.0);
        let swapped = MeasuredLoop {
            press: of.back,
            back: of.press,
        };
        let swapped = swapped.distance(&travel, &force, 0.0);
        assert!((swapped.rms_n - 0.2).abs() < 1e-3, "{swapped:?}");
    }

    #[test]
    fn points_beyond_the_run_are_counted() {
        let [travel, force] = run();
        let mut measured = loop_of(0.0);
        measured.press.push((4.005e-3, 0.42));
        measured.press.push((5e-3, 0.5));
        let distance = measured.distance(&travel, &force, 1e-5);
        assert_eq!((distance.points, distance.missed), (21, 1));
        assert_eq!(measured.between([0.0, 4.5e-3]).press.len(), 11);
    }
}
