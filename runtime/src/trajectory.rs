//! Lazy evaluation of motions: a position or a force at every tick, computed when it is asked for.
//!
//! An hour at 44.1 kHz is 159 million ticks. A recording is held at its own rate and a gesture as
//! its moves, whatever the time they are played for.
//!
//! Not here: where motions come from (`motion`, `gesture`).

use crate::gesture::Gesture;
use crate::motion::Resampled;
use whippen_compiler::rate::Rate;

/// A value at every tick (m, rad, N or N*m).
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    ticks: usize,
    source: Samples,
}

#[derive(Debug, Clone, PartialEq)]
enum Samples {
    /// One by one.
    Ticks(Vec<f64>),
    /// A recording at its own rate.
    Recording(Resampled),
    /// A gesture, which begins anew after so many ticks.
    Gesture(Gesture, Rate, usize),
}

impl From<Vec<f64>> for Trajectory {
    fn from(values: Vec<f64>) -> Trajectory {
        Trajectory {
            ticks: values.len(),
            source: Samples::Ticks(values),
        }
    }
}

impl From<Resampled> for Trajectory {
    fn from(recording: Resampled) -> Trajectory {
        Trajectory {
            ticks: recording.len(),
            source: Samples::Recording(recording),
        }
    }
}

impl Trajectory {
    /// A gesture at a tick rate, once.
    pub fn of_gesture(gesture: Gesture, rate_hz: impl Into<Rate>) -> Trajectory {
        let rate_hz = rate_hz.into();
        let ticks = gesture.ticks(rate_hz);
        Trajectory {
            ticks,
            source: Samples::Gesture(gesture, rate_hz, ticks.max(1)),
        }
    }

    /// How many ticks it lasts.
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// The value at a tick; none after the last.
    pub fn get(&self, tick: usize) -> Option<f64> {
        if tick >= self.ticks {
            return None;
        }
        match &self.source {
            Samples::Ticks(values) => values.get(tick).copied(),
            Samples::Recording(recording) => Some(recording.at(tick)),
            Samples::Gesture(gesture, rate_hz, period) => {
                Some(gesture.at((tick % period) as f64 / f64::from(*rate_hz)))
            }
        }
    }

    /// The value at a tick, that of the last after it; 0 if it lasts for no time.
    pub fn at(&self, tick: usize) -> f64 {
        self.get(tick.min(self.ticks.saturating_sub(1)))
            .unwrap_or(0.0)
    }

    /// The same for so many ticks: a gesture is repeated, all else ends where it ends.
    #[must_use]
    pub fn lasting(self, ticks: usize) -> Trajectory {
        let all = match self.source {
            Samples::Gesture(..) if self.ticks > 0 => ticks,
            _ => ticks.min(self.ticks),
        };
        Trajectory { ticks: all, ..self }
    }

    /// The greatest value.
    pub fn greatest(&self) -> Option<f64> {
        let once = match &self.source {
            Samples::Gesture(_, _, period) => self.ticks.min(*period),
            _ => self.ticks,
        };
        (0..once).filter_map(|tick| self.get(tick)).reduce(f64::max)
    }

    /// All values.
    pub fn to_vec(&self) -> Vec<f64> {
        (0..self.ticks).filter_map(|tick| self.get(tick)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gesture::default_gesture;

    #[test]
    fn a_gesture_is_what_it_was_and_repeats() {
        let once = default_gesture().positions(44_100);
        let trajectory = Trajectory::of_gesture(default_gesture(), 44_100);
        assert!(trajectory.to_vec() == once);
        assert_eq!(trajectory.greatest(), once.iter().copied().reduce(f64::max));
        let long = trajectory.clone().lasting(3 * once.len());
        assert_eq!(long.ticks(), 3 * once.len());
        assert!((0..once.len()).all(|i| long.get(2 * once.len() + i) == Some(once[i])));
        assert_eq!(trajectory.lasting(7).to_vec(), once[..7]);
    }

    #[test]
    fn what_was_recorded_ends_where_it_ends() {
        let trajectory = Trajectory::from(vec![1.0, 3.0, 2.0]);
        assert_eq!(trajectory.clone().lasting(10), trajectory);
        let ends = (trajectory.get(3), trajectory.at(3), trajectory.greatest());
        assert_eq!(ends, (None, 2.0, Some(3.0)));
        assert_eq!(trajectory.lasting(1).to_vec(), [1.0]);
        let none = Trajectory::from(Vec::new());
        assert_eq!((none.at(0), none.greatest()), (0.0, None));
    }
}
