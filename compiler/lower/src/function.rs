//! Functions that are no algebra: cubic polynomials between the points of a grid, with a proven
//! bound of their error.
//!
//! ```text
//!   cell  k = (a + 2^(s-1)) >> s                       the nearest point of the grid
//!   place u = a << (32 - s), modulo 2^32               from there, -1/2 .. 1/2 of a cell
//!   value   = c0 + top(u * (c1 + top(u * (c2 + top(u * c3)))))      c0 .. c3: row k of the table
//! ```
//!
//! The polynomial of a cell takes the function's values at the four Chebyshev points of the cell,
//! so it is off by at most `max |f''''| (h/4)^4 / 12` for a cell of width `h`. The grid is the
//! coarsest that keeps this below [`PRECISION`] of the function's reach, with at most [`CELLS_MAX`]
//! cells. Sine and cosine share one table of one turn: their operand becomes turns first, modulo
//! one, which a word does by itself.

use super::Lowerer;
use super::format::{self, exp2, exponent, quantize};
use super::real::Real;
use std::f64::consts::{LN_2, PI, TAU};
use whippen_kernel::{Op, OpError, Range, Value};
use whippen_lang::model::{Function, Interval, NodeId};

/// Error of the polynomials that is aimed at, as a part of the function's reach: 23 bits.
const PRECISION: i32 = -23;
/// Most cells of a grid: 8 KiB of table.
const CELLS_MAX: i64 = 512;
/// Cells of a turn, as a power of two: (2 pi / 64 / 4)^4 / 12 is 2^-25.
const TURN_CELLS: u8 = 6;
/// Roundings of a value, in units of the result: half a unit for each coefficient and each top
/// word, those of the inner ones halved by every factor that follows.
const ROUNDINGS: f64 = 1.9;

/// A function over a grid: where its points are, and what the integers of the result count.
struct Grid<'f> {
    /// The function at a place of the grid, in cells from its first point.
    at: &'f dyn Fn(f64) -> f64,
    /// Its values, proven.
    reach: Interval,
    /// Of the polynomials (SI).
    error: f64,
    cells: i64,
}

impl Lowerer<'_> {
    /// The value of a function, in units of `lsb` or as much coarser as the integers need.
    pub(super) fn function(
        &mut self,
        function: Function,
        a: NodeId,
        lsb: f64,
    ) -> Result<Real, OpError> {
        let real = self.real(a)?;
        let real = self.plain(real)?;
        match function {
            Function::Sin | Function::Cos => self.wave(function, real, self.ranges.get(a), lsb),
            _ => self.tabled(function, real, self.ranges.get(a), lsb),
        }
    }

    /// By a grid over the operand's interval.
    fn tabled(
        &mut self,
        function: Function,
        a: Real,
        range: Interval,
        lsb: f64,
    ) -> Result<Real, OpError> {
        let (telling, left_out) = telling(function, range);
        // Integers beyond the proven interval are errors of rounding.
        let mut ends = format::nearest(telling, a.lsb);
        if function == Function::Log {
            ends = Range::new(ends.low.max(1), ends.high.max(1));
        }
        let reach = function.interval(range).unwrap_or(Interval::point(0.0));
        let wanted = reach.magnitude() * exp2(PRECISION);
        let (shift, error) = coarsest(function, ends, a.lsb, wanted);
        if function == Function::Log && error > wanted {
            return self.logarithm(a, ends, lsb);
        }
        // The ends are rounded to integers.
        let cut = match ends.contains(self.b.range(a.value)) {
            true => 0.0,
            false => 0.5 * a.lsb,
        };
        let word = self.clamped(a.value, ends)?;
        let (first, last) = (cell_of(ends.low, shift), cell_of(ends.high, shift));
        let lowest = ends.low as f64 * a.lsb;
        let width = exp2(shift.into()) * a.lsb;
        let grid = Grid {
            at: &|cells| continued(function, (first as f64 + cells) * width, lowest),
            reach,
            error: error + left_out,
            cells: last - first + 1,
        };
        let cell = self.b.op(Op::SarRound(shift), &[word])?;
        let first = self.constant(first)?;
        let cell = self.b.op(Op::Sub, &[cell, first])?;
        let place = match shift {
            0 => None,
            _ => Some(self.b.op(Op::ShlWrap(32 - shift), &[word])?),
        };
        let inside = Interval {
            low: lowest,
            high: ends.high as f64 * a.lsb,
        };
        let inherited = function.slope_max(inside) * (a.error + cut);
        self.interpolated(function.name(), &grid, cell, place, (lsb, inherited))
    }

    /// The logarithm over many octaves: `log(m 2^-k) = log(m) - k log(2)`, with `k` such that `m`
    /// fills a word.
    fn logarithm(&mut self, a: Real, ends: Range, lsb: f64) -> Result<Real, OpError> {
        let room = |integer: i64| i64::from(integer.leading_zeros()) - 33;
        let (least, most) = (room(ends.high), room(ends.low));
        let mut word = self.clamped(a.value, ends)?;
        word = self.moved(word, least as i32)?;
        let mut doubled = Vec::new();
        for n in [16_u8, 8, 4, 2, 1]
            .into_iter()
            .filter(|n| i64::from(*n) <= most - least)
        {
            let limit = self.constant(1 << (31 - n))?;
            let small = self.b.op(Op::Lt, &[word, limit])?;
            let moved = self.b.op(Op::ShlWrap(n), &[word])?;
            word = self.b.op(Op::Select, &[small, moved, word])?;
            doubled.push((small, n));
        }
        // What is less than a power of two is doubled until it is not.
        let word = self.b.op(Op::Assume(1 << 30, i32::MAX.into()), &[word])?;
        let unit = Real {
            value: word,
            lsb: exp2(-30),
            offset: 0.0,
            error: 0.0,
        };
        let octave = Interval {
            low: 1.0,
            high: 2.0,
        };
        let reach = libm::log(a.lsb * ends.low as f64)
            .abs()
            .max(libm::log(a.lsb * ends.high as f64).abs());
        let mantissa = self.tabled(
            Function::Log,
            unit,
            octave,
            lsb.max(4.0 * reach / format::TOP),
        )?;
        let lsb = mantissa.lsb;
        let exponent = libm::log(a.lsb) + (30 - least) as f64 * LN_2;
        let shift = self.constant(quantize(exponent, lsb))?;
        let mut value = self.b.op(Op::Add, &[mantissa.value, shift])?;
        for (small, n) in &doubled {
            let (octaves, zero) = (
                self.constant(quantize(f64::from(*n) * LN_2, lsb))?,
                self.constant(0)?,
            );
            let octaves = self.b.op(Op::Select, &[*small, octaves, zero])?;
            value = self.b.op(Op::Sub, &[value, octaves])?;
        }
        let rounded = 0.5 * lsb * (1 + doubled.len()) as f64;
        let lowest = ends.low as f64 * a.lsb;
        let inherited = (a.error + a.lsb) / lowest;
        Ok(Real::new(value, lsb, mantissa.error + rounded + inherited))
    }

    /// Sine or cosine: the operand in turns, modulo one.
    fn wave(
        &mut self,
        function: Function,
        a: Real,
        range: Interval,
        lsb: f64,
    ) -> Result<Real, OpError> {
        let turns_per_unit = a.lsb / TAU * exp2(32);
        let n = (29 - exponent(turns_per_unit)).clamp(0, 62);
        let factor = quantize(turns_per_unit, exp2(-n)) as i32;
        let constant = self.constant(factor.into())?;
        let wide = self.b.op(Op::MulWide, &[a.value, constant])?;
        let wide = self.b.op(Op::Sar(n as u8), &[wide])?;
        let mut phase = self.b.op(Op::Low, &[wide])?;
        if function == Function::Cos {
            let quarter = self.constant(1 << 30)?;
            phase = self.b.op(Op::AddWrap, &[phase, quarter])?;
        }
        let cells = 1_i64 << TURN_CELLS;
        let shift = 32 - TURN_CELLS;
        let cell = self.b.op(Op::SarRound(shift), &[phase])?;
        let middle = self.constant(cells / 2)?;
        let cell = self.b.op(Op::Add, &[cell, middle])?;
        let place = self.b.op(Op::ShlWrap(TURN_CELLS), &[phase])?;
        let at = |k: f64| Function::Sin.value(TAU * (k - cells as f64 / 2.0) / cells as f64);
        let grid = Grid {
            at: &at,
            reach: function.interval(range).unwrap_or(Interval::point(0.0)),
            error: (TAU / cells as f64 / 4.0).powi(4) / 12.0,
            cells: cells + 1,
        };
        // What the rounded factor adds over the whole reach, and the floor of the shift.
        let off = (f64::from(factor) * exp2(-n) - turns_per_unit).abs();
        let phase_error = (off * range.magnitude() / a.lsb + 1.0) * TAU * exp2(-32);
        let inherited = a.error + phase_error;
        self.interpolated("sin", &grid, cell, Some(place), (lsb, inherited))
    }

    /// The coefficient of an allpass over a grid of fractions, in 31 bits.
    pub(super) fn allpass_coefficient(
        &mut self,
        at: &dyn Fn(f64) -> f64,
        cell: Value,
        place: Value,
        cells: i64,
    ) -> Result<Real, OpError> {
        let ends = [at(0.0), at((cells - 1) as f64)];
        let grid = Grid {
            at,
            reach: Interval {
                low: ends[1],
                high: ends[0],
            },
            // The fourth derivative is at most 13, and a cell is a sixteenth of a tick.
            error: 1e-7,
            cells,
        };
        let unit = (exp2(-31), 0.0);
        self.interpolated("allpass", &grid, cell, Some(place), unit)
    }

    /// The polynomial of a cell at a place, in units of `lsb` or as much coarser as it needs.
    fn interpolated(
        &mut self,
        name: &str,
        grid: &Grid,
        cell: Value,
        place: Option<Value>,
        (lsb, inherited): (f64, f64),
    ) -> Result<Real, OpError> {
        let rows = (0..grid.cells).flat_map(|k| coefficients(grid.at, k as f64));
        let rows: Vec<f64> = rows.collect();
        // Where the interval is a small part of the grid, slopes reach further than values.
        let largest = rows.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let reach = grid.reach.magnitude().max(largest);
        let mut lsb = lsb.max(reach / format::TOP);
        loop {
            let table = self.table(name, &rows, lsb);
            match self.horner(table, cell, place) {
                Err(OpError::Overflow { .. }) => lsb *= 2.0,
                Err(other) => return Err(other),
                Ok(value) => {
                    let error = grid.error + ROUNDINGS * lsb;
                    // Intervals do not see which coefficients belong together; the bound of the
                    // error does.
                    let (low, high) = (grid.reach.low - error, grid.reach.high + error);
                    let known = self.b.range(value);
                    let kept = Op::Assume(
                        ((low / lsb).floor() as i64).max(known.low),
                        ((high / lsb).ceil() as i64).min(known.high),
                    );
                    let value = self.b.op(kept, &[value])?;
                    return Ok(Real::new(value, lsb, error + inherited));
                }
            }
        }
    }

    fn horner(&mut self, table: u32, cell: Value, place: Option<Value>) -> Result<Value, OpError> {
        let Some(place) = place else {
            return self.b.op(Op::Lookup(table, 0), &[cell]);
        };
        let mut coefficient = |column| self.b.op(Op::Lookup(table, column), &[cell]);
        let [c0, c1, c2, c3] = [
            coefficient(0)?,
            coefficient(1)?,
            coefficient(2)?,
            coefficient(3)?,
        ];
        let slope = self.b.op(Op::MacTop, &[c2, place, c3])?;
        let slope = self.b.op(Op::MacTop, &[c1, place, slope])?;
        self.b.op(Op::MacTop, &[c0, place, slope])
    }

    /// The table of these rows of four, one for all that ask for the same.
    pub(super) fn table(&mut self, name: &str, rows: &[f64], lsb: f64) -> u32 {
        self.table_of(name, 4, rows, lsb)
    }

    /// The table of these rows of so many columns.
    pub(super) fn table_of(&mut self, name: &str, columns: u32, rows: &[f64], lsb: f64) -> u32 {
        let values: Vec<i32> = rows.iter().map(|c| quantize(*c, lsb) as i32).collect();
        if let Some(&known) = self.tables.get(&(columns, values.clone())) {
            return known;
        }
        let name = match self.tables.len() {
            0 => name.to_string(),
            n => format!("{name}_{}", n + 1),
        };
        let table = self.b.table(&name, columns, values.clone());
        self.tables.insert((columns, values), table);
        table
    }
}

/// The function; a logarithm below the lowest operand by its cubic there, whose fourth derivative
/// is zero: half a cell below that it need not be defined.
fn continued(function: Function, x: f64, lowest: f64) -> f64 {
    if function == Function::Log && x < lowest {
        let t = (x - lowest) / lowest;
        return function.value(lowest) + t - t * t / 2.0 + t * t * t / 3.0;
    }
    function.value(x)
}

/// The cell of `2^shift` integers around whose middle an integer lies.
fn cell_of(integer: i64, shift: u8) -> i64 {
    (integer + ((1_i64 << shift) >> 1)) >> shift
}

/// The part of an interval in which a function is not as good as constant, and what is left out
/// beyond it (SI).
fn telling(function: Function, range: Interval) -> (Interval, f64) {
    // e^-18 is 2^-26.
    const FAR: f64 = 18.0;
    match function {
        Function::Tanh if range.magnitude() > 0.5 * FAR => {
            let cut = |x: f64| x.clamp(-0.5 * FAR, 0.5 * FAR);
            let telling = Interval {
                low: cut(range.low),
                high: cut(range.high),
            };
            (telling, 2.0 * libm::exp(-FAR))
        }
        Function::Exp if range.width() > FAR => {
            let telling = Interval {
                low: range.high - FAR,
                high: range.high,
            };
            (telling, libm::exp(range.high - FAR))
        }
        _ => (range, 0.0),
    }
}

/// The coarsest grid over the integers between `ends` whose polynomials are off by no more than
/// `wanted` (SI), else the finest that fits: the shift that makes a cell of an integer, and how far
/// they are off.
fn coarsest(function: Function, ends: Range, lsb: f64, wanted: f64) -> (u8, f64) {
    let cells = |shift: u8| cell_of(ends.high, shift) - cell_of(ends.low, shift) + 1;
    let error = |shift: u8| match shift {
        0 => 0.0,
        _ => worst_cell(function, ends, lsb, shift),
    };
    let mut best = (31, f64::INFINITY);
    for shift in (0..=30)
        .rev()
        .take_while(|shift| cells(*shift) <= CELLS_MAX)
    {
        best = (shift, error(shift));
        if best.1 <= wanted {
            break;
        }
    }
    best
}

/// Error of the polynomial in the cell where it is worst (SI).
fn worst_cell(function: Function, ends: Range, lsb: f64, shift: u8) -> f64 {
    let width = exp2(shift.into()) * lsb;
    let (first, last) = (cell_of(ends.low, shift), cell_of(ends.high, shift));
    let of = |cell: i64| {
        let middle = cell as f64 * width;
        let lowest = match function {
            Function::Log => ends.low as f64 * lsb,
            _ => f64::NEG_INFINITY,
        };
        let of = Interval {
            low: (middle - 0.5 * width).max(lowest),
            high: middle + 0.5 * width,
        };
        function.fourth_max(of) * (0.25 * width).powi(4) / 12.0
    };
    (first..=last).map(of).fold(0.0, f64::max)
}

/// The cubic through a function's values at the Chebyshev points of the cell around `k`, by powers
/// of the distance in cells.
fn coefficients(f: &dyn Fn(f64) -> f64, k: f64) -> [f64; 4] {
    let point = |j: usize| 0.5 * libm::cos((2.0 * j as f64 + 1.0) * PI / 8.0);
    let mut slopes: [f64; 4] = std::array::from_fn(|j| f(k + point(j)));
    // Divided differences, then Newton's form by powers.
    for order in 1..4 {
        for j in (order..4).rev() {
            slopes[j] = (slopes[j] - slopes[j - 1]) / (point(j) - point(j - order));
        }
    }
    let mut powers = [0.0; 4];
    for j in (0..4).rev() {
        for n in (1..4).rev() {
            powers[n] = powers[n - 1] - point(j) * powers[n];
        }
        powers[0] = slopes[j] - point(j) * powers[0];
    }
    powers
}
