//! A delay line in f64.

use std::collections::VecDeque;

use whippen_lang::model::Delay;

/// What was fed, the last first.
#[derive(Debug, Clone)]
pub(super) struct RealLine {
    values: VecDeque<f64>,
}

impl RealLine {
    /// An empty one, as long as its declaration and one tick more, so that all times lie between
    /// two ticks.
    pub fn new(delay: &Delay) -> RealLine {
        RealLine {
            values: VecDeque::from(vec![0.0; delay.ticks as usize + 1]),
        }
    }

    /// What was fed so many whole ticks ago, at least 1.
    fn whole(&self, ticks: usize) -> f64 {
        let last = self.values.len();
        self.values[ticks.clamp(1, last) - 1]
    }

    /// Linear between ticks.
    pub fn at(&self, ticks: f64) -> f64 {
        let ticks = ticks.clamp(1.0, (self.values.len() - 1) as f64);
        let (whole, part) = (ticks.floor(), ticks.fract());
        let (near, far) = (self.whole(whole as usize), self.whole(whole as usize + 1));
        near + part * (far - near)
    }

    /// By the allpass `y = eta (x - y1) + x1`, whose last value is `y1`.
    pub fn tuned(&self, ticks: f64, last: f64) -> f64 {
        let longest = (self.values.len() - 1) as f64;
        let ticks = ticks.clamp(Delay::TUNED_TICKS_MIN, longest);
        let whole = (ticks - Delay::FRACTION_MIN).floor();
        let eta = Delay::allpass(ticks - whole);
        let (now, before) = (self.whole(whole as usize), self.whole(whole as usize + 1));
        eta * (now - last) + before
    }

    pub fn feed(&mut self, value: f64) {
        self.values.pop_back();
        self.values.push_front(value);
    }

    /// Takes over what another engine holds.
    pub fn adopt(&mut self, values: Vec<f64>) {
        self.values = values.into();
    }
}
