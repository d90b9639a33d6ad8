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

    fn of(low: f64, high: f64) -> Interval {
        Interval { low, high }
    }

    /// Places from one end to the other, 0 among them where it lies inside.
    fn samples(i: Interval) -> Vec<f64> {
        let inside = (0..=8).map(|k| i.low + i.width() * f64::from(k) / 8.0);
        inside
            .chain([0.0].into_iter().filter(|&zero| i.holds(zero)))
            .collect()
    }

    impl Interval {
        fn holds(self, v: f64) -> bool {
            self.low <= v && v <= self.high
        }

        /// Whether it goes from the least of these to the greatest, but for a few roundings.
        fn spans(self, results: &[f64]) -> bool {
            let least = results.iter().copied().fold(f64::INFINITY, f64::min);
            let most = results.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let rounding = 4.0 * f64::EPSILON;
            let near = |end: f64, of: f64| (end - of).abs() <= rounding * of.abs();
            self.holds(least) && self.holds(most) && near(self.low, least) && near(self.high, most)
        }
    }

    const SOME: [(f64, f64); 6] = [
        (-2.0, 3.0),
        (0.5, 4.0),
        (-3.0, -0.25),
        (0.0, 0.0),
        (0.0, 1.0),
        (-1.5, 0.0),
    ];

    #[test]
    fn an_operation_of_two_spans_its_sampled_results() {
        type Operation = (
            fn(Interval, Interval) -> Option<Interval>,
            fn(f64, f64) -> f64,
        );
        let operations: [Operation; 6] = [
            (|a, b| Some(a + b), |x, y| x + y),
            (|a, b| Some(a - b), |x, y| x - y),
            (|a, b| Some(a * b), |x, y| x * y),
            (|a, b| Some(a.min(b)), f64::min),
            (|a, b| Some(a.max(b)), f64::max),
            (|a, b| a.quotient(b), |x, y| x / y),
        ];
        let mut cases = 0;
        for (a, b) in SOME.iter().flat_map(|a| SOME.iter().map(move |b| (a, b))) {
            let (a, b) = (of(a.0, a.1), of(b.0, b.1));
            for (op, (interval, value)) in operations.iter().enumerate() {
                let Some(found) = interval(a, b) else {
                    assert!(op == 5 && b.holds(0.0));
                    continue;
                };
                let pairs = samples(a).into_iter();
                let results: Vec<f64> = pairs
                    .flat_map(|x| samples(b).into_iter().map(move |y| value(x, y)))
                    .collect();
                assert!(found.spans(&results), "{op} of {a:?} and {b:?}: {found:?}");
                cases += 1;
            }
        }
        assert_eq!(cases, 5 * 36 + 6 * 2);
    }

    #[test]
    fn an_operation_of_one_spans_its_sampled_results() {
        for (low, high) in SOME {
            let a = of(low, high);
            let results = |value: &dyn Fn(f64) -> f64| samples(a).into_iter().map(value).collect();
            let spans = |found: Interval, value: &dyn Fn(f64) -> f64| {
                let results: Vec<f64> = results(value);
                assert!(found.spans(&results), "{a:?}: {found:?}");
            };
            spans(-a, &|x| -x);
            spans(a.abs(), &f64::abs);
            spans(of(a.magnitude(), a.magnitude()), &|_| {
                low.abs().max(high.abs())
            });
            for halves in (2..=8).filter(|halves| low >= 0.0 || halves % 2 == 0) {
                spans(a.power(halves), &|x| x.powf(f64::from(halves) / 2.0));
                let slope = |x: f64| {
                    let exponent = f64::from(halves) / 2.0;
                    exponent * x.powf(exponent - 1.0)
                };
                spans(a.slope_of_power(halves).expect("bounded"), &slope);
            }
        }
        let slope = of(1.0, 4.0).slope_of_power(1).expect("bounded");
        assert!(slope.spans(&[0.25, 0.5]), "{slope:?}");
        assert_eq!(of(0.0, 4.0).slope_of_power(1), None);
    }

    /// The exact result of what a double rounds lies strictly inside; 0 is exact.
    #[test]
    fn rounding_is_outwards() {
        let (a, b) = (Interval::point(0.1), Interval::point(0.2));
        let around = |found: Interval, value: f64| found.low < value && value < found.high;
        assert!(around(a + b, 0.1 + 0.2) && around(a - b, 0.1 - 0.2) && around(a * b, 0.1 * 0.2));
        assert!(a.quotient(b).is_some_and(|q| around(q, 0.1 / 0.2)));
        assert!(around(a.power(6), 0.1 * 0.1 * 0.1));
        assert_eq!(Interval::around(1.0), of(-1f64.next_up(), 1f64.next_up()));
        assert_eq!(of(0.0, 1.0).outwards(), of(0.0, 1f64.next_up()));
        assert_eq!(of(-1.0, 0.0).outwards(), of(-1f64.next_up(), 0.0));
        // The square of what may be small is never below 0.
        assert!(of(0.0, 1e-200).power(4).low == 0.0);
    }

    #[test]
    fn intervals_beside_each_other() {
        let (a, b) = (of(-1.0, 2.0), of(0.0, 3.0));
        assert_eq!([a.union(b), b.union(a)], [of(-1.0, 3.0); 2]);
        assert!(a.union(b).contains(a) && a.union(b).contains(b) && a.contains(a));
        assert!(!a.contains(b) && !b.contains(a) && !of(0.0, 1.0).contains(of(0.0, 1.5)));
        assert!(!of(0.0, 1.0).contains(of(-0.5, 1.0)));
        assert_eq!(a.cut(0.0, 1.0), of(0.0, 1.0));
        assert_eq!(a.cut(-5.0, 5.0), a);
        assert_eq!(of(-2.0, 4.0).wider(0.5), of(-3.0, 6.0));
        let least = f64::MIN_POSITIVE;
        assert_eq!(of(0.0, 0.0).wider(0.5), of(-least, least));
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
