//! Curves: a table of parabolas, cell by cell, whose slope costs one product more.
//!
//! ```text
//!   i = c1 + c2 t      value = c0 + i t      slope a cell = i + c2 t        t in -1/2 .. 1/2
//! ```
//!
//! The grid covers a power of two of the operand's units, so that the cell is one saturation of the
//! operand that is moved down; beyond, and in the outermost cells, a curve is flat.

use super::Lowerer;
use super::format::{self, exp2, quantize};
use super::real::Real;
use whippen_kernel::{Op, OpError, Range, Value};
use whippen_lang::model::curve::Curve;
use whippen_lang::model::{Interval, NodeId};

/// Cells either way, as a power of two.
const CELLS: u8 = 8;
/// What a curve may change by where it is taken as flat, as a part of its reach.
const FLAT: f64 = 1e-7;
/// Roundings of a value and of its slope a cell, in units of the result.
const ROUNDINGS: f64 = 1.5;

/// A curve and its slope at a value.
pub(super) type Curves = std::collections::HashMap<(Curve, NodeId), [Real; 2]>;

/// Where in the grid of a curve its operand is.
struct GridPlace {
    /// The row.
    cell: Value,
    /// How far from the middle of the cell: a word is a cell.
    place: Value,
    /// Of a cell (SI).
    width: f64,
    /// The middle of cell 0, in cells.
    middle: f64,
    /// Whether operands beyond the grid are in its outermost cells.
    is_held: bool,
    /// Error of the operand (SI).
    inherited: f64,
}

impl Lowerer<'_> {
    /// The curve at `x`, and its derivative by it.
    pub(super) fn curve(&mut self, curve: &Curve, x: NodeId) -> Result<[Real; 2], OpError> {
        let key = (curve.clone(), x);
        if let Some(known) = self.curves.get(&key) {
            return Ok(*known);
        }
        let found = match curve.table() {
            Some(table) => self.grid_of_table(table, x)?,
            None => self.tabled_curve(curve, x)?,
        };
        self.curves.insert(key, found);
        Ok(found)
    }

    fn tabled_curve(&mut self, curve: &Curve, x: NodeId) -> Result<[Real; 2], OpError> {
        let (reach, slopes) = (curve.reach(), curve.slopes());
        let GridPlace {
            cell,
            place,
            width,
            middle,
            is_held,
            inherited,
        } = self.cells_of(curve, x)?;
        let (step, over) = (self.step, self.ranges.get(x));
        let at = |cells: f64| {
            let x = ((cells + middle) * width).clamp(over.low, over.high);
            curve.value(&step.model, x).unwrap_or(0.0)
        };
        let cells = -(1_i32 << CELLS)..1 << CELLS;
        let parabolas = cells.clone().map(|k| parabola(&at, k.into()));
        let mut parabolas: Vec<[f64; 3]> = parabolas.collect();
        if is_held && let [first, .., last] = &mut parabolas[..] {
            [first[1], first[2], last[1], last[2]] = [0.0; 4];
        }
        let off = parabolas
            .iter()
            .zip(cells)
            .map(|(row, k)| worst(&at, row, k));
        let off = off.fold(FLAT * reach.magnitude(), f64::max);
        // What parabolas reach is known; of the curve an interval tells, which may be much wider.
        let all = parabolas.iter().map(reached).reduce(Interval::union);
        let reach = all.unwrap_or(reach);
        let rows = parabolas.iter().flat_map(|[a, b, c]| [*a, *b, *c, 0.0]);
        let rows: Vec<f64> = rows.collect();
        let largest = |most: f64, c: &f64| most.max(c.abs());
        let mut lsb = rows.iter().fold(reach.magnitude(), largest) / format::TOP;
        let [value, slope] = loop {
            let table = self.table("curve", &rows, lsb);
            match self.parabola_at(table, cell, place) {
                Err(OpError::Overflow { .. }) => lsb *= 2.0,
                found => break found?,
            }
        };
        let (unit, error) = (lsb / width, off + ROUNDINGS * lsb);
        // The parabolas' slopes are not bounded by the curve's; they are near them.
        let slack = 0.25 * slopes.magnitude() + ROUNDINGS * unit;
        let value = self.known_within(value, lsb, (reach.low - error, reach.high + error))?;
        let slope = self.known_within(slope, unit, (slopes.low - slack, slopes.high + slack))?;
        Ok([
            Real::new(value, lsb, error + slopes.magnitude() * inherited),
            Real::new(slope, unit, slack),
        ])
    }

    /// Which cell of its grid an operand lies in.
    fn cells_of(&mut self, curve: &Curve, x: NodeId) -> Result<GridPlace, OpError> {
        let real = self.real(x)?;
        let Real {
            value, lsb, error, ..
        } = self.plain(real)?;
        let (model, over) = (&self.step.model, self.ranges.get(x));
        let known = self.b.range(value);
        let holds = |bits: u8| Range::new(-(1 << bits), (1 << bits) - 1).contains(known);
        let fits = |bits: &u8| {
            let inner = (exp2((*bits).into()) - exp2((bits - CELLS).into())) * lsb;
            holds(*bits) || curve.is_flat_beyond(model, inner, over, FLAT)
        };
        let bits = (CELLS..31).find(fits).unwrap_or(31);
        let shift = bits - CELLS;
        let cell = match shift {
            0 => value,
            _ => self.b.op(Op::Sar(shift), &[value])?,
        };
        let cell = self.clamped(cell, Range::new(-(1 << CELLS), (1 << CELLS) - 1))?;
        let first = self.constant(-(1 << CELLS))?;
        let (place, middle) = match shift {
            0 => (self.constant(0)?, 0.0),
            _ => {
                let half = self.constant(1 << (shift - 1))?;
                let from_middle = self.b.op(Op::SubWrap, &[value, half])?;
                (self.b.op(Op::ShlWrap(32 - shift), &[from_middle])?, 0.5)
            }
        };
        Ok(GridPlace {
            cell: self.b.op(Op::Sub, &[cell, first])?,
            place,
            width: exp2(shift.into()) * lsb,
            middle,
            is_held: !holds(bits),
            inherited: error,
        })
    }

    fn parabola_at(
        &mut self,
        table: u32,
        cell: Value,
        place: Value,
    ) -> Result<[Value; 2], OpError> {
        let mut row = [cell; 3];
        for (column, c) in row.iter_mut().enumerate() {
            *c = self.b.op(Op::Lookup(table, column as u32), &[cell])?;
        }
        let [c0, c1, c2] = row;
        let inner = self.b.op(Op::MacTop, &[c1, place, c2])?;
        Ok([
            self.b.op(Op::MacTop, &[c0, place, inner])?,
            self.b.op(Op::MacTop, &[inner, place, c2])?,
        ])
    }

    /// Intervals do not see which coefficients belong together.
    pub(super) fn known_within(
        &mut self,
        value: Value,
        lsb: f64,
        (low, high): (f64, f64),
    ) -> Result<Value, OpError> {
        let known = self.b.range(value);
        let kept = Op::Assume(
            quantize(low, lsb).max(known.low),
            quantize(high, lsb).min(known.high),
        );
        self.b.op(kept, &[value])
    }
}

/// The parabola through a function's values at the Chebyshev points of the cell around `k`, by
/// powers of the distance in cells.
fn parabola(at: &dyn Fn(f64) -> f64, k: f64) -> [f64; 3] {
    // cos(pi/6)/2
    const OUTER: f64 = 0.433_012_701_892_219_3;
    let [low, middle, high] = [-OUTER, 0.0, OUTER].map(|point| at(k + point));
    let slope = (high - low) / (2.0 * OUTER);
    let bend = (high + low - 2.0 * middle) / (2.0 * OUTER * OUTER);
    [middle, slope, bend]
}

/// From where to where a parabola goes in its cell.
fn reached(&[a, b, c]: &[f64; 3]) -> Interval {
    let at = |t: f64| Interval::point(a + t * (b + t * c));
    let ends = at(-0.5).union(at(0.5));
    let top = -0.5 * b / c;
    match top.abs() < 0.5 {
        true => ends.union(at(top)),
        false => ends,
    }
}

/// How far it is off at places between.
fn worst(at: &dyn Fn(f64) -> f64, [a, b, c]: &[f64; 3], k: i32) -> f64 {
    let off = |t: f64| (a + t * (b + t * c) - at(f64::from(k) + t)).abs();
    [-0.5, -0.25, 0.2, 0.5]
        .map(off)
        .into_iter()
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::{parabola, reached, worst};

    /// As far as a friction's law that sticks goes.
    fn law(cells: f64) -> f64 {
        let w = (cells / 32.0).clamp(-8.0, 8.0);
        w * libm::exp(0.5 * (1.0 - w * w))
    }

    #[test]
    fn parabolas_are_no_further_off_than_is_told() {
        let mut told: f64 = 0.0;
        let mut found = [0.0_f64; 2];
        for k in -256..=256 {
            let row = parabola(&law, k.into());
            told = told.max(worst(&law, &row, k));
            let [a, b, c] = row;
            for place in -50..=50 {
                let t = f64::from(place) / 100.0;
                let at = f64::from(k) + t;
                let slope = 500.0 * (law(at + 1e-3) - law(at - 1e-3));
                let value = a + t * (b + t * c);
                let reach = reached(&row);
                assert!((reach.low..=reach.high).contains(&value), "{k} {t}");
                found[0] = found[0].max((value - law(at)).abs());
                found[1] = found[1].max((b + 2.0 * c * t - slope).abs());
            }
        }
        assert!(found[0] < 1.1 * told && told < 2e-6, "{found:?} {told:e}");
        // Of a slope that is a twentieth of the force a cell.
        assert!(found[1] < 3e-5, "{found:?}");
    }
}
