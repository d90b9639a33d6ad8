//! Arithmetic of closed intervals, rounded outwards.

use std::ops::{Add, Mul, Neg, Sub};

use crate::model::Interval;
use crate::model::fold::power;

impl Interval {
    /// One value.
    pub fn point(value: f64) -> Interval {
        Interval {
            low: value,
            high: value,
        }
    }

    /// `-magnitude .. magnitude`
    pub fn around(magnitude: f64) -> Interval {
        Interval {
            low: -magnitude,
            high: magnitude,
        }
        .outwards()
    }

    /// Largest absolute value.
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// `high - low`
    pub fn width(self) -> f64 {
        self.high - self.low
    }

    /// Whether `other` lies inside.
    pub fn contains(self, other: Interval) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    /// The smallest interval that holds both.
    pub fn union(self, other: Interval) -> Interval {
        Interval {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Quotient, unless the divisor may be zero.
    pub fn quotient(self, divisor: Interval) -> Option<Interval> {
        if divisor.low <= 0.0 && divisor.high >= 0.0 {
            return None;
        }
        Some(
            self * Interval {
                low: 1.0 / divisor.high,
                high: 1.0 / divisor.low,
            }
            .outwards(),
        )
    }

    /// Pointwise minimum.
    pub fn min(self, other: Interval) -> Interval {
        Interval {
            low: self.low.min(other.low),
            high: self.high.min(other.high),
        }
    }

    /// Pointwise maximum.
    pub fn max(self, other: Interval) -> Interval {
        Interval {
            low: self.low.max(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Absolute value.
    pub fn abs(self) -> Interval {
        let low = if self.low <= 0.0 && self.high >= 0.0 {
            0.0
        } else {
            self.low.abs().min(self.high.abs())
        };
        Interval {
            low,
            high: self.magnitude(),
        }
    }

    /// `self ^ (halves / 2)`; the base must not be negative where `halves` is odd.
    pub fn power(self, halves: u8) -> Interval {
        let of = |x: f64| power(x, halves);
        let even = halves.is_multiple_of(4);
        let monotone = !even || self.low >= 0.0;
        let base = if monotone { self } else { self.abs() };
        let ends = Interval {
            low: of(base.low),
            high: of(base.high),
        }
        .outwards();
        if even {
            ends.max(Interval {
                low: 0.0,
                high: 0.0,
            })
        } else {
            ends
        }
    }

    /// The derivative of `self ^ (halves / 2)`, `h/2 a^(h/2 - 1)`; `None` where it is not bounded.
    pub fn slope_of_power(self, halves: u8) -> Option<Interval> {
        let factor = Interval::point(0.5 * f64::from(halves));
        match halves.checked_sub(2) {
            Some(0) => Some(factor),
            Some(less) => Some(factor * self.power(less)),
            None => factor.quotient(self.power(1)),
        }
    }

    /// Wider at both ends by a part of their size, at least by what is smallest.
    pub(crate) fn wider(self, part: f64) -> Interval {
        let by = |end: f64| part * end.abs() + f64::MIN_POSITIVE;
        Interval {
            low: self.low - by(self.low),
            high: self.high + by(self.high),
        }
    }

    /// What of it lies between two limits that its values are known to keep.
    pub(crate) fn cut(self, low: f64, high: f64) -> Interval {
        Interval {
            low: self.low.max(low),
            high: self.high.min(high),
        }
    }

    /// One unit in the last place wider at both ends; exact zeros stay.
    pub(crate) fn outwards(self) -> Interval {
        let down = |x: f64| if x == 0.0 { 0.0 } else { x.next_down() };
        let up = |x: f64| if x == 0.0 { 0.0 } else { x.next_up() };
        Interval {
            low: down(self.low),
            high: up(self.high),
        }
    }
}

impl Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        Interval {
            low: self.low + other.low,
            high: self.high + other.high,
        }
        .outwards()
    }
}

impl Sub for Interval {
    type Output = Interval;

    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    fn mul(self, other: Interval) -> Interval {
        let p = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let (low, high) = (
            p.into_iter().fold(f64::INFINITY, f64::min),
            p.into_iter().fold(f64::NEG_INFINITY, f64::max),
        );
        Interval { low, high }.outwards()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_contains_sampled_results() {
        let samples =
            |i: Interval| (0..=8).map(move |k| i.low + (i.high - i.low) * f64::from(k) / 8.0);
        let holds = |i: Interval, v: f64| i.low <= v && v <= i.high;
        let intervals = [
            (-2.0, 3.0),
            (0.5, 4.0),
            (-3.0, -0.25),
            (0.0, 0.0),
            (0.0, 1.0),
        ]
        .map(|(low, high)| Interval { low, high });
        let mut cases = 0;
        for a in intervals {
            for b in intervals {
                for (x, y) in samples(a).flat_map(|x| samples(b).map(move |y| (x, y))) {
                    assert!(holds(a + b, x + y) && holds(a - b, x - y) && holds(a * b, x * y));
                    assert!(
                        holds(a.min(b), x.min(y))
                            && holds(a.max(b), x.max(y))
                            && holds(a.abs(), x.abs())
                    );
                    assert!(a.quotient(b).is_none_or(|q| holds(q, x / y)));
                    assert!(
                        [2u8, 4, 6]
                            .iter()
                            .all(|&h| holds(a.power(h), x.powi(i32::from(h / 2))))
                    );
                    assert!(
                        a.low < 0.0
                            || [3u8, 5]
                                .iter()
                                .all(|&h| holds(a.power(h), x.powf(f64::from(h) / 2.0)))
                    );
                    cases += 1;
                }
            }
        }
        assert_eq!(cases, 25 * 81);
    }

    #[test]
    fn a_divisor_that_may_be_zero_has_no_quotient() {
        assert_eq!(
            Interval::point(1.0).quotient(Interval {
                low: 0.0,
                high: 1.0
            }),
            None
        );
        assert_eq!(
            Interval::point(1.0).quotient(Interval {
                low: -1.0,
                high: 1.0
            }),
            None
        );
    }
}
