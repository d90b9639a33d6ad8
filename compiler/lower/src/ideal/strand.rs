//! Strings in f64.

use whippen_lang::model::{End, Reading, Strand};
use whippen_rate::Rate;

/// A string: displacements (m) and what they change by in a tick (m), from end to end.
#[derive(Debug, Clone, PartialEq)]
pub struct RealStrand {
    /// Displacements.
    pub u: Vec<f64>,
    /// Changes.
    pub v: Vec<f64>,
}

/// A force at a place: how much it changes over parts of a metre, and where.
pub(super) type RealPush = (f64, f64);

impl RealStrand {
    /// At rest.
    pub fn new(strand: &Strand) -> RealStrand {
        let points = strand.parts as usize + 1;
        RealStrand {
            u: vec![0.0; points],
            v: vec![0.0; points],
        }
    }

    /// What is read of it.
    pub fn read(&self, strand: &Strand, reading: Reading, place: f64, rate_hz: Rate) -> f64 {
        let reach = strand.reach(reading, rate_hz);
        let value = match (reading, strand.is_end(place)) {
            (Reading::Slope, Some(0)) => (self.u[1] - self.u[0]) / strand.part(),
            (Reading::Slope, Some(_)) => {
                let last = self.u.len() - 1;
                (self.u[last] - self.u[last - 1]) / strand.part()
            }
            _ => {
                let (before, part) = strand.cell(place);
                let four = before as usize - 1..before as usize + 3;
                let cubic = |of: &[f64]| -> f64 {
                    let weights = Strand::weights(part);
                    weights
                        .iter()
                        .zip(&of[four.clone()])
                        .map(|(i, x)| i * x)
                        .sum()
                };
                match reading {
                    Reading::Displacement => cubic(&self.u),
                    Reading::Rate => cubic(&self.v) * f64::from(rate_hz),
                    Reading::Slope => {
                        let steps = self.u[four.clone()].windows(2).map(|u| u[1] - u[0]);
                        let slopes = Strand::slopes(part);
                        let sum: f64 = slopes.iter().zip(steps).map(|(c, e)| c * e).sum();
                        sum / strand.part()
                    }
                }
            }
        };
        value.clamp(reach.low, reach.high)
    }

    /// The mean of its rates before and after a tick without friction, at the place, with P, Q, V
    /// and R and the pushes that follow it in `all`.
    pub(super) fn mean(&self, strand: &Strand, rate_hz: Rate, all: &[f64]) -> f64 {
        let [place, p, q, v, r, ref pushes @ ..] = *all else {
            return 0.0;
        };
        let pushes: Vec<RealPush> = pushes.chunks_exact(2).map(|c| (c[0], c[1])).collect();
        let mut after = self.clone();
        after.tick(strand, rate_hz, [p, q, v, r], &pushes, false);
        let rate = |state: &RealStrand| state.read(strand, Reading::Rate, place, rate_hz);
        0.5 * (rate(self) + rate(&after))
    }

    /// One tick with P, Q, V and R.
    pub(super) fn tick(
        &mut self,
        strand: &Strand,
        rate_hz: Rate,
        [p, q, v, r]: [f64; 4],
        pushes: &[RealPush],
        is_held: bool,
    ) {
        if is_held {
            *self = RealStrand::new(strand);
            return;
        }
        let (bend, rate) = (
            strand.largest_bend(rate_hz),
            strand.rate / f64::from(rate_hz),
        );
        let within = |x: f64, most: f64| x.clamp(-most, most);
        let last = self.u.len() - 1;
        let held = |end: End, u: f64| match end {
            End::Pinned => 0.0,
            End::Clamped => within(2.0 * u, bend),
        };
        let u = &self.u;
        let mut w = vec![0.0; last + 1];
        for l in 1..last {
            w[l] = within(u[l + 1] - u[l] - (u[l] - u[l - 1]), bend);
        }
        w[0] = held(strand.ends[0], u[1]);
        w[last] = held(strand.ends[1], u[last - 1]);
        let before = self.v.clone();
        for l in 1..last {
            let change = (p + 2.0 * q) * w[l] - q * within(w[l - 1] + w[l + 1], bend)
                + v * within(before[l - 1] + before[l + 1], rate)
                - (2.0 * v + r) * before[l];
            self.v[l] = within(before[l] + change, rate);
            self.u[l] += self.v[l];
        }
        for (change, place) in pushes {
            let change = within(*change, rate * Strand::PUSH);
            let (first, part) = strand.cell(*place);
            for (j, weight) in Strand::weights(part).into_iter().enumerate() {
                let l = first as usize - 1 + j;
                let new = within(self.v[l] + weight * change, rate);
                self.u[l] += new - self.v[l];
                self.v[l] = new;
            }
        }
    }
}
