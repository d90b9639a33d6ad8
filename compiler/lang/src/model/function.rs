//! Functions of one number that are no algebra: the exponential function and its inverse, sine and
//! cosine, the hyperbolic tangent.
//!
//! They are computed by `libm`, in plain Rust, so that every machine gives the same bits. Its
//! results are off by less than a unit in the last place; intervals leave four.

use std::f64::consts::PI;

use super::Interval;

/// Units in the last place by which an interval is wider than what `libm` computes at its ends.
const MARGIN_ULPS: f64 = 4.0;

/// Which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    /// `e^x`
    Exp,
    /// The natural logarithm, of what is above zero.
    Log,
    /// The sine of an angle in radians.
    Sin,
    /// The cosine of an angle in radians.
    Cos,
    /// The hyperbolic tangent.
    Tanh,
}

impl Function {
    /// Every one.
    pub const ALL: [Function; 5] = [
        Function::Exp,
        Function::Log,
        Function::Sin,
        Function::Cos,
        Function::Tanh,
    ];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Function::Exp => "exp",
            Function::Log => "log",
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tanh => "tanh",
        }
    }

    /// Its value; not a number outside of its domain.
    pub fn value(self, x: f64) -> f64 {
        match self {
            Function::Exp => libm::exp(x),
            Function::Log => libm::log(x),
            Function::Sin => libm::sin(x),
            Function::Cos => libm::cos(x),
            Function::Tanh => libm::tanh(x),
        }
    }

    /// Its values over an interval; `None` where part of that is outside of its domain.
    pub fn interval(self, of: Interval) -> Option<Interval> {
        match self {
            Function::Log if of.low <= 0.0 => None,
            Function::Exp | Function::Log | Function::Tanh => {
                let ends = self.ends(of);
                let (least, most) = match self {
                    Function::Exp => (0.0, f64::INFINITY),
                    // It has the sign of its operand, margins or not.
                    Function::Tanh => (
                        if of.low >= 0.0 { 0.0 } else { -1.0 },
                        if of.high <= 0.0 { 0.0 } else { 1.0 },
                    ),
                    _ => (f64::NEG_INFINITY, f64::INFINITY),
                };
                Some(ends.cut(least, most))
            }
            // Extremes at the odd quarters of a turn, and at the halves.
            Function::Sin => Some(self.wave(of, 0.5 * PI)),
            Function::Cos => Some(self.wave(of, 0.0)),
        }
    }

    /// Its derivative over an interval; `None` where part of that is outside of its domain.
    pub fn slope(self, of: Interval) -> Option<Interval> {
        let one = Interval::point(1.0);
        match self {
            Function::Exp => self.interval(of),
            Function::Log => one.quotient(of).filter(|_| of.low > 0.0),
            Function::Sin => Function::Cos.interval(of),
            Function::Cos => Some(-Function::Sin.interval(of)?),
            Function::Tanh => Some((one - self.interval(of)?.power(4)).cut(0.0, 1.0)),
        }
    }

    /// How steep it is over an interval, as a size; infinite outside of its domain.
    pub fn slope_max(self, of: Interval) -> f64 {
        match self {
            Function::Exp => libm::exp(of.high) * (1.0 + MARGIN_ULPS * f64::EPSILON),
            Function::Log if of.low > 0.0 => 1.0 / of.low,
            Function::Log => f64::INFINITY,
            Function::Sin | Function::Cos | Function::Tanh => 1.0,
        }
    }

    /// Size of its fourth derivative over an interval, at most; infinite outside of its domain.
    /// That of the hyperbolic tangent is `8 t (1 - t^2) (2 - 3 t^2)` of its value `t`, at most
    /// 4.0864.
    pub fn fourth_max(self, of: Interval) -> f64 {
        match self {
            Function::Log if of.low > 0.0 => 6.0 / of.low.powi(4),
            Function::Exp | Function::Log => self.slope_max(of),
            Function::Sin | Function::Cos => 1.0,
            Function::Tanh => 4.09,
        }
    }

    /// What lies between the values at the ends.
    fn ends(self, of: Interval) -> Interval {
        let (a, b) = (self.value(of.low), self.value(of.high));
        Interval {
            low: a.min(b),
            high: a.max(b),
        }
        .wider(MARGIN_ULPS * f64::EPSILON)
    }

    /// Sine or cosine: what lies between the values at the ends, and the extremes between them,
    /// one of which is a whole number of half turns away from each other.
    fn wave(self, of: Interval, extreme: f64) -> Interval {
        let whole = Interval {
            low: -1.0,
            high: 1.0,
        };
        // Half turns beyond which their number is not exact enough.
        const FAR: f64 = 1e9;
        let turns = |x: f64| (x - extreme) / PI;
        let (first, last) = (turns(of.low), turns(of.high));
        if last - first >= 2.0 || first.abs().max(last.abs()) > FAR {
            return whole;
        }
        // An extreme that is close by counts as met.
        let near = 1e-6;
        let mut values = self.ends(of);
        let mut at = (first - near).ceil();
        while at <= last + near {
            let value = if at.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
            values = values.union(Interval::point(value));
            at += 1.0;
        }
        values.cut(-1.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intervals() -> Vec<Interval> {
        let ends = [
            -40.0, -7.0, -3.2, -1.6, -1.5, -0.1, 0.0, 0.3, 1.5, 1.6, 3.1, 3.2, 4.8, 6.3, 30.0,
        ];
        let pairs = ends
            .iter()
            .flat_map(|low| ends.iter().map(move |high| (*low, *high)));
        pairs
            .filter(|(low, high)| low <= high)
            .map(|(low, high)| Interval { low, high })
            .collect()
    }

    fn samples(of: Interval) -> impl Iterator<Item = f64> {
        (0..=200).map(move |k| (of.low + of.width() * f64::from(k) / 200.0).min(of.high))
    }

    #[test]
    fn intervals_hold_sampled_values_and_little_else() {
        let mut cases = 0;
        for function in Function::ALL {
            for of in intervals() {
                let Some(bound) = function.interval(of) else {
                    assert!(function == Function::Log && of.low <= 0.0);
                    continue;
                };
                let values = samples(of).map(|x| function.value(x));
                let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                    assert!(bound.low <= v && v <= bound.high, "{function:?} {of:?} {v}");
                    (l.min(v), h.max(v))
                });
                let slack = 0.05 * bound.width() + 1e-12 * bound.magnitude() + 1e-300;
                assert!(low - bound.low <= slack && bound.high - high <= slack);
                cases += 1;
            }
        }
        assert_eq!(cases, 4 * 120 + 36);
    }

    #[test]
    fn the_hyperbolic_tangent_has_the_sign_of_its_operand() {
        let tanh = |low, high| Function::Tanh.interval(Interval { low, high });
        assert_eq!(tanh(0.0, 3.0).map(|of| of.low), Some(0.0));
        assert_eq!(tanh(-3.0, 0.0).map(|of| of.high), Some(0.0));
    }

    #[test]
    fn slopes_and_fourth_derivatives_are_not_exceeded() {
        for function in Function::ALL {
            for of in intervals().into_iter().filter(|of| of.width() > 0.0) {
                if function.interval(of).is_none() || of.high > 7.0 || of.width() < 0.5 {
                    continue;
                }
                let step = 1e-3 * of.width();
                let f = |x: f64| function.value(x);
                for x in
                    samples(of).filter(|x| *x - 2.0 * step > of.low && *x + 2.0 * step < of.high)
                {
                    let slope = (f(x + step) - f(x - step)) / (2.0 * step);
                    assert!(slope.abs() <= function.slope_max(of) * (1.0 + 1e-3));
                    let bound = function.slope(of).expect("inside");
                    let slack = 1e-3 * bound.magnitude();
                    assert!(bound.low - slack <= slope && slope <= bound.high + slack);
                }
                let wide = 0.02 * of.width();
                for x in
                    samples(of).filter(|x| *x - 2.0 * wide > of.low && *x + 2.0 * wide < of.high)
                {
                    let fourth = (f(x - 2.0 * wide) - 4.0 * f(x - wide) + 6.0 * f(x)
                        - 4.0 * f(x + wide)
                        + f(x + 2.0 * wide))
                        / wide.powi(4);
                    assert!(
                        fourth.abs() <= function.fourth_max(of) * 1.001 + 1e-3,
                        "{function:?}"
                    );
                }
            }
        }
    }
}
