//! Tables of a program: their knots, which stand anywhere, become a grid of equal cells with a
//! polynomial each, whose slope is had for one or two products more.
//!
//! ```text
//!   cell  k = (x + 2^(s-1)) >> s        place u = x << (32 - s), modulo 2^32: -1/2 .. 1/2 of a cell
//!   linear   value = c0 + top(u c1)                               slope a cell = c1
//!   cubic    i = c2 + top(u c3)    j = c1 + top(u i)
//!            value = c0 + top(u j)                                slope a cell = j + top(u (i + top(u c3)))
//! ```
//!
//! A cell takes the table's values at its two ends, a cubic one the slopes there too, so nothing
//! jumps from cell to cell. How far it is off between them follows from the knots: on each stretch
//! of a cell that lies between two knots the difference is one polynomial, which its Bernstein
//! coefficients bound. The grid is the coarsest that keeps this below [`TOLERANCE`] of the table's
//! reach, with at most [`WORDS_MAX`] words.

use super::Lowerer;
use super::format::{self, exp2};
use super::real::{Real, Scale};
use whippen_kernel::{Op, OpError, Range, Value};
use whippen_lang::model::table::Table;
use whippen_lang::model::{Interval, NodeId};

/// How far a grid may be off, as a part of what the table reaches.
const TOLERANCE: f64 = 1.0 / 4096.0;
/// Words of a grid at most: 8 KiB.
const WORDS_MAX: i64 = 2048;
/// Roundings of a value in units of the result: half a unit for each coefficient and each top word,
/// those of the inner ones halved by every factor that follows.
const ROUNDINGS: f64 = 1.9;
/// Those of a slope a cell.
const SLOPE_ROUNDINGS: f64 = 3.2;

/// Equal cells over the integers of an operand.
#[derive(Debug, Clone, Copy)]
struct TableCells<'t> {
    table: &'t Table,
    /// Integers a cell, as a power of two.
    shift: u8,
    /// Of a cell (SI).
    width: f64,
    /// Number of the first cell, and how many there are.
    first: i64,
    count: i64,
}

impl Lowerer<'_> {
    /// The table at `x`, and its derivative there.
    pub(super) fn grid_of_table(&mut self, table: &Table, x: NodeId) -> Result<[Real; 2], OpError> {
        let real = self.real(x)?;
        let real = self.plain(real)?;
        let (over, knots) = (self.ranges.get(x), table.span_of_knots());
        let inside = Interval {
            low: over.low.clamp(knots.low, knots.high),
            high: over.high.clamp(knots.low, knots.high),
        };
        if inside.low == inside.high {
            // All of it lies beyond the knots, or is one place.
            let both = [table.value(over.low), table.slope(over.low)];
            let [value, slope] = both.map(|known| (known, Scale::plain(finest(known.abs()))));
            return Ok([
                self.constant_real(value.0, value.1)?,
                self.constant_real(slope.0, slope.1)?,
            ]);
        }
        let ends = format::nearest(inside, real.lsb);
        let cells = TableCells::coarsest(table, ends, real.lsb, table.values_over(inside));
        let word = self.clamped(real.value, ends)?;
        let cell = self.b.op(Op::SarRound(cells.shift), &[word])?;
        let first = self.constant(cells.first)?;
        let cell = self.b.op(Op::Sub, &[cell, first])?;
        let place = match cells.shift {
            0 => self.constant(0)?,
            shift => self.b.op(Op::ShlWrap(32 - shift), &[word])?,
        };
        let (lsb, [value, slope]) = self.polynomials(cells, cell, place)?;
        let slopes = table.slopes_over(over);
        // The ends are rounded to integers.
        let cut = match ends.contains(self.b.range(real.value)) {
            true => 0.0,
            false => 0.5 * real.lsb,
        };
        let [off, slope_off] = cells.off();
        let off = off + ROUNDINGS * lsb;
        let reach = table.values_over(inside);
        let slack = off + slopes.magnitude() * cut;
        let value = self.known_within(value, lsb, (reach.low - slack, reach.high + slack))?;
        let unit = lsb / cells.width;
        let slope = match knots.contains(over) {
            true => slope,
            // Beyond the knots it is held.
            false => {
                let (zero, is_inside) =
                    (self.constant(0)?, self.b.op(Op::Eq, &[word, real.value])?);
                self.b.op(Op::Select, &[is_inside, slope, zero])?
            }
        };
        let error = slack + slopes.magnitude() * real.error;
        let moved = table.slope_within(inside, real.error + cut);
        let ends = match knots.contains(over) {
            true => 0.0,
            false => slopes.magnitude(),
        };
        let steps = slope_off + moved.max(ends) + SLOPE_ROUNDINGS * unit;
        Ok([Real::new(value, lsb, error), Real::new(slope, unit, steps)])
    }

    /// Value, and slope a cell, in the finest units that have room.
    fn polynomials(
        &mut self,
        cells: TableCells,
        cell: Value,
        place: Value,
    ) -> Result<(f64, [Value; 2]), OpError> {
        let columns = cells.columns();
        let rows: Vec<f64> = (0..cells.count)
            .flat_map(|k| cells.row(cells.first + k)[..columns].to_vec())
            .collect();
        let largest = rows.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let mut lsb = finest(largest);
        loop {
            let grid = self.table_of("table", columns as u32, &rows, lsb);
            let found = match columns {
                2 => self.line_at(grid, cell, place),
                _ => self.cubic_at(grid, cell, place),
            };
            match found {
                Err(OpError::Overflow { .. }) => lsb *= 2.0,
                found => return Ok((lsb, found?)),
            }
        }
    }

    fn line_at(&mut self, grid: u32, cell: Value, place: Value) -> Result<[Value; 2], OpError> {
        let c0 = self.b.op(Op::Lookup(grid, 0), &[cell])?;
        let c1 = self.b.op(Op::Lookup(grid, 1), &[cell])?;
        Ok([self.b.op(Op::MacTop, &[c0, place, c1])?, c1])
    }

    fn cubic_at(&mut self, grid: u32, cell: Value, place: Value) -> Result<[Value; 2], OpError> {
        let mut row = [cell; 4];
        for (column, c) in row.iter_mut().enumerate() {
            *c = self.b.op(Op::Lookup(grid, column as u32), &[cell])?;
        }
        let [c0, c1, c2, c3] = row;
        let i = self.b.op(Op::MacTop, &[c2, place, c3])?;
        let j = self.b.op(Op::MacTop, &[c1, place, i])?;
        let value = self.b.op(Op::MacTop, &[c0, place, j])?;
        let bend = self.b.op(Op::MacTop, &[i, place, c3])?;
        Ok([value, self.b.op(Op::MacTop, &[j, place, bend])?])
    }
}

impl<'t> TableCells<'t> {
    /// The coarsest cells that are near enough, else the finest that there are words for.
    fn coarsest(table: &'t Table, ends: Range, lsb: f64, reach: Interval) -> TableCells<'t> {
        let middle = |integer: i64, shift: u8| (integer + ((1_i64 << shift) >> 1)) >> shift;
        let of = |shift: u8| {
            let first = middle(ends.low, shift);
            TableCells {
                table,
                shift,
                width: exp2(shift.into()) * lsb,
                first,
                count: middle(ends.high, shift) - first + 1,
            }
        };
        let fits = |cells: &TableCells| cells.count * cells.columns() as i64 <= WORDS_MAX;
        let wanted = TOLERANCE * reach.magnitude();
        // No wider than all of the operand: what lies beyond is nothing's.
        let widest = (64 - (ends.high - ends.low).leading_zeros() as u8).min(30);
        let mut best = of(widest);
        for cells in (0..widest).rev().map(of).take_while(fits) {
            best = cells;
            if best.off()[0] <= wanted {
                break;
            }
        }
        best
    }

    fn columns(&self) -> usize {
        if self.table.is_cubic { 4 } else { 2 }
    }

    /// From where to where a cell goes (SI).
    fn ends(&self, cell: i64) -> [f64; 2] {
        [-0.5, 0.5].map(|half| (cell as f64 + half) * self.width)
    }

    /// Its polynomial, by powers of the distance from its middle in cells.
    fn row(&self, cell: i64) -> [f64; 4] {
        let [[low, m], [high, n]] = self.ends(cell).map(|end| self.table.continued(end));
        let rise = high - low;
        if !self.table.is_cubic {
            return [0.5 * (low + high), rise, 0.0, 0.0];
        }
        let (m, n) = (m * self.width, n * self.width);
        let cubic = m + n - 2.0 * rise;
        [
            0.5 * (low + high) - 0.125 * (n - m),
            rise - 0.25 * cubic,
            0.5 * (n - m),
            cubic,
        ]
    }

    /// How far the polynomials are off, and their slopes (SI), without roundings.
    fn off(&self) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        let mut pieces = self.table.pieces();
        for cell in self.first..self.first + self.count {
            // An integer that is a cell is its middle.
            let [low, high] = match self.shift {
                0 => [cell as f64 * self.width; 2],
                _ => self.ends(cell),
            };
            while pieces.len() > 1 && pieces[0].ends()[1] < low {
                pieces = &pieces[1..];
            }
            let row = self.row(cell);
            let mut from = low;
            for (at, piece) in pieces.iter().enumerate() {
                let is_last = at + 1 == pieces.len();
                let to = if is_last {
                    high
                } else {
                    piece.ends()[1].min(high)
                };
                let (own, theirs) = (self.between(cell, row, from, to), piece.between(from, to));
                let [a, b, c, d] = std::array::from_fn(|n| own[n] - theirs[n]);
                worst[0] = worst[0].max(bernstein([a, b, c, d]));
                if to > from {
                    let slope = bernstein([b, 2.0 * c, 3.0 * d, 0.0]) / (to - from);
                    worst[1] = worst[1].max(slope);
                }
                from = to;
                if from >= high {
                    break;
                }
            }
        }
        worst
    }

    /// The coefficients of a cell between two places, by `s` from 0 to 1 there.
    fn between(&self, cell: i64, [a, b, c, d]: [f64; 4], from: f64, to: f64) -> [f64; 4] {
        let t = from / self.width - cell as f64;
        let h = (to - from) / self.width;
        [
            a + t * (b + t * (c + t * d)),
            h * (b + t * (2.0 * c + t * 3.0 * d)),
            h * h * (c + t * 3.0 * d),
            h * h * h * d,
        ]
    }
}

/// The finest unit for values up to this; any, where all are zero.
fn finest(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    largest / format::TOP
}

/// No value of a cubic between 0 and 1 exceeds its largest Bernstein coefficient.
fn bernstein([a, b, c, d]: [f64; 4]) -> f64 {
    let coefficients = [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d];
    coefficients
        .into_iter()
        .fold(0.0, |most: f64, c| most.max(c.abs()))
}
