//! Tables: a value over another one, given at knots, with polynomials between them.
//!
//! ```text
//!   value = c0 + c1 t + c2 t^2 + c3 t^3      t = (x - from) / (to - from), 0 .. 1 between two knots
//! ```
//!
//! Beyond its first and its last knot a table is held. A cubic one takes at each knot the slope of
//! Fritsch and Butland (1984), the weighted harmonic mean of the slopes of both sides, and zero
//! where these differ in sign: between two knots it neither overshoots nor turns.

use super::Interval;
use super::dag::Real;
use crate::units::Dim;
use whippen_source::Span;

/// One table.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Table {
    /// Name.
    pub name: String,
    /// Dimension of what it is over.
    pub over: Dim,
    /// Dimension of its values.
    pub dim: Dim,
    /// Where its name is declared.
    pub span: Span,
    /// Whether its slope is continuous between the ends.
    pub is_cubic: bool,
    /// Between neighbouring knots; at least one.
    pieces: Vec<TablePiece>,
}

/// What lies between two knots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TablePiece {
    from: Real,
    to: Real,
    coefficients: [Real; 4],
}

/// Names and dimensions of a table.
#[derive(Debug, Clone)]
pub struct Head {
    /// Name.
    pub name: String,
    /// Dimension of what it is over.
    pub over: Dim,
    /// Dimension of its values.
    pub dim: Dim,
    /// Where its name is declared.
    pub span: Span,
}

impl Table {
    /// Fewest knots.
    pub const KNOTS_MIN: usize = 2;
    /// Most knots.
    pub const KNOTS_MAX: usize = 4096;

    /// The table through knots: at least two, rising. `None` where they are not, or where a slope
    /// is no number.
    pub fn new(head: Head, knots: &[(f64, f64)], is_cubic: bool) -> Option<Table> {
        let Head {
            name,
            over,
            dim,
            span,
        } = head;
        let pieces = || {
            knots
                .windows(2)
                .map(|two| (two[1].0 - two[0].0, two[1].1 - two[0].1))
        };
        let widths: Vec<f64> = pieces().map(|(width, _)| width).collect();
        let secants: Vec<f64> = pieces().map(|(width, rise)| rise / width).collect();
        let rises = knots.windows(2).all(|two| two[0].0 < two[1].0);
        if secants.is_empty() || !rises || secants.iter().any(|slope| !slope.is_finite()) {
            return None;
        }
        let slopes = monotone_slopes(&widths, &secants);
        let piece = |(at, two): (usize, &[(f64, f64)])| {
            let ((from, low), (to, high)) = (two[0], two[1]);
            let (width, rise) = (to - from, high - low);
            let coefficients = match is_cubic {
                false => [low, rise, 0.0, 0.0],
                true => {
                    let (m, n) = (slopes[at] * width, slopes[at + 1] * width);
                    [low, m, 3.0 * rise - 2.0 * m - n, m + n - 2.0 * rise]
                }
            };
            TablePiece {
                from: Real(from),
                to: Real(to),
                coefficients: coefficients.map(Real),
            }
        };
        Some(Table {
            name,
            over,
            dim,
            span,
            is_cubic,
            pieces: knots.windows(2).enumerate().map(piece).collect(),
        })
    }

    /// From the first knot to the last.
    pub fn span_of_knots(&self) -> Interval {
        let last = self.pieces.last().map_or(0.0, |piece| piece.to.0);
        Interval {
            low: self.pieces.first().map_or(0.0, |piece| piece.from.0),
            high: last,
        }
    }

    /// How many knots it has.
    pub fn knots(&self) -> usize {
        self.pieces.len() + 1
    }

    /// Its pieces, from the first knot on.
    pub fn pieces(&self) -> &[TablePiece] {
        &self.pieces
    }

    /// Its value; held beyond the ends.
    pub fn value(&self, x: f64) -> f64 {
        let Interval { low, high } = self.span_of_knots();
        self.continued(x.clamp(low, high))[0]
    }

    /// Its derivative: at a knot that of the right side, zero beyond the ends.
    pub fn slope(&self, x: f64) -> f64 {
        let Interval { low, high } = self.span_of_knots();
        if (low..=high).contains(&x) {
            self.continued(x)[1]
        } else {
            0.0
        }
    }

    /// Value and slope, where beyond the ends the outermost polynomials go on.
    pub fn continued(&self, x: f64) -> [f64; 2] {
        self.pieces[self.index(x)].at(x)
    }

    /// The piece in which a place lies: the right one of a knot, the outermost beyond the ends.
    fn index(&self, x: f64) -> usize {
        let behind = self.pieces.partition_point(|piece| piece.from.0 <= x);
        behind.saturating_sub(1)
    }

    /// Its values over an interval: between two knots it rises or falls all along.
    pub fn values_over(&self, x: Interval) -> Interval {
        let ends = Interval::point(self.value(x.low)).union(Interval::point(self.value(x.high)));
        let knots = self
            .pieces
            .iter()
            .map(|piece| (piece.from.0, piece.coefficients[0].0));
        let all = knots
            .filter(|(at, _)| x.low <= *at && *at <= x.high)
            .fold(ends, |all, (_, value)| all.union(Interval::point(value)));
        // A few roundings of a polynomial between two equal knots.
        let slack = 8.0 * f64::EPSILON * f64::from(u8::from(self.is_cubic)) * all.magnitude();
        Interval {
            low: all.low - slack,
            high: all.high + slack,
        }
        .outwards()
    }

    /// How much its slope between the knots may change where a place in an interval is off by so
    /// much.
    pub fn slope_within(&self, x: Interval, error: f64) -> f64 {
        if error == 0.0 {
            return 0.0;
        }
        let near =
            |piece: &&TablePiece| piece.from.0 <= x.high + error && x.low - error <= piece.to.0;
        let slopes = |piece: &TablePiece| [piece.from.0, piece.to.0].map(|end| piece.at(end)[1]);
        let jump = |two: &[TablePiece]| (slopes(&two[0])[1] - slopes(&two[1])[0]).abs();
        let jumps = self
            .pieces
            .windows(2)
            .filter(|two| near(&&two[0]) && near(&&two[1]));
        let jump = jumps.map(jump).fold(0.0, f64::max);
        let bends = self.pieces.iter().filter(near).map(TablePiece::bend);
        // A place that is off by more than a piece may be beyond several knots.
        let narrow = self
            .pieces
            .iter()
            .filter(near)
            .any(|p| p.to.0 - p.from.0 < 2.0 * error);
        match narrow {
            true => self.slopes_over(x).width(),
            false => jump + error * bends.fold(0.0, f64::max),
        }
    }

    /// Its slopes over an interval.
    pub fn slopes_over(&self, x: Interval) -> Interval {
        let Interval { low, high } = self.span_of_knots();
        let beyond = (x.low < low || x.high > high).then(|| Interval::point(0.0));
        let met = self
            .pieces
            .iter()
            .filter(|piece| piece.from.0 <= x.high && (x.low <= piece.to.0 || piece.to.0 == high));
        let inside = met.filter_map(|piece| {
            let (from, to) = (x.low.max(piece.from.0), x.high.min(piece.to.0));
            (from <= to).then(|| piece.slopes_between(from, to))
        });
        let all = beyond.into_iter().chain(inside).reduce(Interval::union);
        all.unwrap_or(Interval::point(0.0)).outwards()
    }
}

impl TablePiece {
    /// Its knots.
    pub fn ends(&self) -> [f64; 2] {
        [self.from.0, self.to.0]
    }

    fn at(&self, x: f64) -> [f64; 2] {
        let width = self.to.0 - self.from.0;
        let t = (x - self.from.0) / width;
        let [a, b, c, d] = self.coefficients.map(|c| c.0);
        let value = a + t * (b + t * (c + t * d));
        [value, (b + t * (2.0 * c + t * 3.0 * d)) / width]
    }

    /// The largest of its second derivative.
    fn bend(&self) -> f64 {
        let width = self.to.0 - self.from.0;
        let [_, _, c, d] = self.coefficients.map(|c| c.0);
        (2.0 * c).abs().max((2.0 * c + 6.0 * d).abs()) / (width * width)
    }

    /// Its coefficients by `s` between two places, where `s` goes from 0 to 1.
    pub fn between(&self, from: f64, to: f64) -> [f64; 4] {
        let width = self.to.0 - self.from.0;
        let (t, h) = ((from - self.from.0) / width, (to - from) / width);
        let [a, b, c, d] = self.coefficients.map(|c| c.0);
        [
            a + t * (b + t * (c + t * d)),
            h * (b + t * (2.0 * c + t * 3.0 * d)),
            h * h * (c + t * 3.0 * d),
            h * h * h * d,
        ]
    }

    fn slopes_between(&self, from: f64, to: f64) -> Interval {
        if from == to {
            return Interval::point(self.at(from)[1]);
        }
        let [_, b, c, d] = self.between(from, to);
        let hull = [b, b + c, b + 2.0 * c + 3.0 * d];
        let scaled = hull.map(|slope| Interval::point(slope / (to - from)));
        scaled[0].union(scaled[1]).union(scaled[2])
    }
}

/// The slopes at knots of a cubic that rises and falls only where its knots do, from the widths of
/// its pieces and the slopes of their secants: weighted harmonic means, and at an end the parabola
/// through three knots (Fritsch and Butland 1984).
pub fn monotone_slopes(width: &[f64], secant: &[f64]) -> Vec<f64> {
    let last = secant.len() - 1;
    if last == 0 {
        return vec![secant[0]; 2];
    }
    let inner = (0..last).map(|i| {
        let (a, b) = (secant[i], secant[i + 1]);
        if a * b <= 0.0 {
            return 0.0;
        }
        let (wa, wb) = (2.0 * width[i + 1] + width[i], width[i + 1] + 2.0 * width[i]);
        (wa + wb) / (wa / a + wb / b)
    });
    let first = end_slope(width[0], width[1], secant[0], secant[1]);
    let end = end_slope(width[last], width[last - 1], secant[last], secant[last - 1]);
    std::iter::once(first)
        .chain(inner)
        .chain(std::iter::once(end))
        .collect()
}

/// The slope of the parabola through the three points at an end, held back where it would
/// overshoot.
fn end_slope(width: f64, next_width: f64, secant: f64, next_secant: f64) -> f64 {
    let slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width);
    if slope * secant <= 0.0 {
        0.0
    } else if secant * next_secant <= 0.0 && slope.abs() > 3.0 * secant.abs() {
        3.0 * secant
    } else {
        slope
    }
}

#[cfg(test)]
mod tests;
