//! A sensed value and its window, in raw words.

use std::collections::VecDeque;
use whippen_rate::Rate;

use crate::scales::Scales;
use whippen_lang::model::Sense;

/// One sense of one key.
#[derive(Debug, Clone)]
pub(super) struct SenseState {
    words: VecDeque<i64>,
    accepted: (i64, i64),
    step: i64,
    scales: Scales,
    rate_hz: f64,
}

impl SenseState {
    /// The window is filled with the first word (rule 6).
    pub fn new(sense: &Sense, scales: Scales, rate_hz: Rate, first: u16) -> SenseState {
        let accepted = scales.words_in(sense.range);
        let step = sense
            .slew_per_s
            .map_or(i64::MAX / 2, |v| scales.words_per_tick(v, rate_hz));
        let first = i64::from(first).clamp(accepted.0, accepted.1);
        let words = VecDeque::from(vec![first; sense.window as usize]);
        SenseState {
            words,
            accepted,
            step,
            scales,
            rate_hz: f64::from(rate_hz),
        }
    }

    /// Takes this tick's word: clamped to the range, then held back to the slew.
    pub fn push(&mut self, word: u16) {
        let last = self.last();
        let word = i64::from(word)
            .clamp(self.accepted.0, self.accepted.1)
            .clamp(last - self.step, last + self.step);
        self.words.pop_front();
        self.words.push_back(word);
    }

    fn last(&self) -> i64 {
        *self.words.back().expect("a window is never empty")
    }

    /// The sensed value.
    pub fn value(&self) -> f64 {
        self.scales.sensed(self.last())
    }

    /// Slope of the least-squares line: `sum j w_j / sum j^2`, j centred.
    pub fn slope(&self) -> f64 {
        let m = (self.words.len() as i64 - 1) / 2;
        let sum: i64 = self.words.iter().zip(-m..).map(|(w, j)| w * j).sum();
        let squares: i64 = (-m..=m).map(|j| j * j).sum();
        sum as f64 / squares as f64 * self.scales.sensor_lsb * self.rate_hz
    }

    /// Second derivative of the least-squares parabola: `2 sum p_j w_j / sum p_j^2` with `p_j = j^2
    /// - m (m + 1) / 3`, here with everything times 3 to stay in integers.
    pub fn curvature(&self) -> f64 {
        let m = (self.words.len() as i64 - 1) / 2;
        let p = |j: i64| 3 * j * j - m * (m + 1);
        let sum: i64 = self.words.iter().zip(-m..).map(|(w, j)| w * p(j)).sum();
        let squares: i64 = (-m..=m).map(|j| p(j) * p(j)).sum();
        6.0 * sum as f64 / squares as f64 * self.scales.sensor_lsb * self.rate_hz * self.rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_lang::model::{Interval, Moves};
    use whippen_lang::units::Dim;
    use whippen_source::Span;

    #[test]
    fn a_parabola_of_words_gives_its_own_derivatives() {
        let scales = Scales {
            sensor_zero: 0.0,
            sensor_lsb: 1.0,
            drive_lsb: 1.0,
            update_hz: None,
        };
        let range = Interval {
            low: 0.0,
            high: 65535.0,
        };
        let sense = Sense {
            name: "x".into(),
            dim: Dim::default(),
            unit: "",
            moves: Moves::Not,
            range,
            window: 5,
            slew_per_s: None,
            span: Span::default(),
        };
        let parabola = |t: i64| (100 + 7 * t + 3 * t * t) as u16;
        let mut state = SenseState::new(&sense, scales, 10.into(), parabola(0));
        (1..=4).for_each(|t| state.push(parabola(t)));
        assert_eq!(state.value(), 176.0);
        // At the middle of the window (t = 2): 7 + 6 * 2 words per tick, 6 words per tick squared,
        // at 10 ticks a second.
        assert!((state.slope() - 190.0).abs() < 1e-9);
        assert!((state.curvature() - 600.0).abs() < 1e-9);
    }
}
