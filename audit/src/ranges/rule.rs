//! The interval of what each operator computes, from the intervals of its operands. Written from
//! what the operators mean (`docs/numbers.md`, `compiler/kernel/src/op.rs`), not from the
//! compiler's own intervals.

use std::fmt::{self, Display};
use std::ops::{Add, Mul, Sub};

use super::read::Declared;

#[cfg(test)]
mod tests;

/// What computes like whole numbers: numbers, and in tests what a solver has of all of them.
trait Whole: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn of(number: i128) -> Self;
    fn least(self, other: Self) -> Self;
    fn most(self, other: Self) -> Self;
    /// 1 or 0.
    fn is_less(self, other: Self) -> Self;
    /// The second where it is 0, else the first.
    fn unless_zero(self, other: Self, zero: Self) -> Self;
    fn up(self, by: i128) -> Self;
    fn down(self, by: i128) -> Self;
    /// The quotient by what is above 0, downwards.
    fn by(self, divisor: Self) -> Self;
    /// The square root of what is not below 0, downwards.
    fn root(self) -> Self;
}

impl Whole for i128 {
    fn of(number: i128) -> Self {
        number
    }

    fn least(self, other: Self) -> Self {
        self.min(other)
    }

    fn most(self, other: Self) -> Self {
        self.max(other)
    }

    fn is_less(self, other: Self) -> Self {
        (self < other).into()
    }

    fn unless_zero(self, other: Self, zero: Self) -> Self {
        if self == 0 { zero } else { other }
    }

    fn up(self, by: i128) -> Self {
        self << by
    }

    fn down(self, by: i128) -> Self {
        self >> by
    }

    fn by(self, divisor: Self) -> Self {
        self.div_euclid(divisor)
    }

    fn root(self) -> Self {
        self.isqrt()
    }
}

/// Integers from one to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval {
    low: i128,
    high: i128,
}

impl Interval {
    pub fn new(low: i128, high: i128) -> Self {
        Self { low, high }
    }

    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    pub fn holds(self, value: i128) -> bool {
        (self.low..=self.high).contains(&value)
    }

    pub fn contains(self, other: Self) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    pub fn union(self, other: Self) -> Self {
        let (low, high) = (self.low.min(other.low), self.high.max(other.high));
        Self { low, high }
    }

    fn ends(self) -> [i128; 2] {
        [self.low, self.high]
    }

    fn over(values: impl IntoIterator<Item = i128>) -> Option<Self> {
        let one = |value| Self::new(value, value);
        values.into_iter().map(one).reduce(Self::union)
    }
}

impl Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}..{}]", self.low, self.high)
    }
}

/// All that a word holds.
pub(super) const WORD: Interval = Interval {
    low: i32::MIN as i128,
    high: i32::MAX as i128,
};

/// What a quotient for searches is held to.
const QUOTIENT: i128 = 1 << 29;

/// The operand that is stored in what the operator names, of one that stores.
pub(super) fn stored(op: &str) -> Option<usize> {
    match op {
        "out" | "set" | "push" | "fill" => Some(0),
        "set_at" => Some(1),
        _ => None,
    }
}

/// The interval of the result; none where there is none.
///
/// # Errors
/// It is no operator, or not with these operands.
pub(super) fn interval(
    op: &str,
    args: &[Interval],
    named: &[&Declared],
    numbers: &[i128],
) -> Result<Option<Interval>, String> {
    let number = numbers.first().copied();
    let own = named.first();
    Ok(Some(match (op, args) {
        ("const", []) => return Ok(number.map(|k| Interval::new(k, k))),
        ("in" | "live" | "keyed" | "get" | "delay", []) | ("get_at" | "delay_at", [_]) => {
            own.ok_or("reads nothing")?.range
        }
        ("out" | "set" | "push" | "fill" | "probe", [_])
        | ("set_at", [_, _])
        | ("emit" | "wave", _) => return Ok(None),
        ("tick", []) => WORD,
        ("lookup", [row]) => {
            let column = number.ok_or("has no column")?;
            entries(own.ok_or("reads nothing")?, *row, column).ok_or("reads no entry")?
        }
        ("assume", [a]) => {
            let [low, high] = numbers else {
                return Err("promises nothing".into());
            };
            Interval::new(a.low.max(*low), a.high.min(*high))
        }
        ("eq", [a, b]) if a.high < b.low || b.high < a.low => Interval::new(0, 0),
        ("eq", [a, b]) if a.low == a.high && a == b => Interval::new(1, 1),
        ("eq", [_, _]) => Interval::new(0, 1),
        ("div_round", [a, b]) => divided(*a, *b, number.unwrap_or(0)),
        ("quot", [a, b]) => quotient(*a, *b, number.unwrap_or(0)),
        ("low" | "add_wrap" | "sub_wrap" | "mul_wrap" | "shl_wrap", _) => {
            let exact = corners(op, args, number.unwrap_or(0))?;
            if WORD.contains(exact) { exact } else { WORD }
        }
        _ => corners(op, args, number.unwrap_or(0))?,
    }))
}

/// What it computes of whole numbers; it rises or falls with each operand while the others stay, so
/// that its ends are at the ends of theirs.
fn exact<W: Whole>(op: &str, n: i128, args: &[W]) -> Option<W> {
    let top = |product: W| (product + W::of(1 << 31)).down(32);
    let word = |whole: W| whole.most(W::of(WORD.low)).least(W::of(WORD.high));
    Some(match (op, args) {
        ("add" | "add_wrap", [a, b]) => *a + *b,
        ("sub" | "sub_wrap", [a, b]) => *a - *b,
        ("mul" | "mul_wide" | "mul_wrap", [a, b]) => *a * *b,
        ("mac_wide", [a, b, c]) => *a + *b * *c,
        ("mul_top", [a, b]) => top(*a * *b),
        ("mac_top", [a, b, c]) => *a + top(*b * *c),
        ("min", [a, b]) => a.least(*b),
        ("max", [a, b]) => a.most(*b),
        ("shl" | "shl_wrap", [a]) => a.up(n),
        ("sar", [a]) => a.down(n),
        ("sar_round", [a]) => (*a + W::of(1 << n >> 1)).down(n),
        ("sqrt", [a]) => a.most(W::of(0)).root(),
        ("widen" | "narrow" | "low", [a]) => *a,
        ("add_sat", [a, b]) => word(*a + *b),
        ("sub_sat", [a, b]) => word(*a - *b),
        ("lt", [a, b]) => a.is_less(*b),
        ("le", [a, b]) => W::of(1) - b.is_less(*a),
        ("and", [a, b]) => *a * *b,
        ("or", [a, b]) => *a + *b - *a * *b,
        ("not", [a]) => W::of(1) - *a,
        ("select", [a, b, c]) => a.unless_zero(*b, *c),
        ("div_round", [a, b]) => rounded(a.up(n), *b),
        _ => return None,
    })
}

/// `floor(a / b + 1/2)` for a `b` that is not 0.
fn rounded<W: Whole>(a: W, b: W) -> W {
    let sign = W::of(1) - W::of(2) * b.is_less(W::of(0));
    let (twice, divisor) = (W::of(2) * a * sign, b * sign);
    (twice + divisor).by(W::of(2) * divisor)
}

fn corners(op: &str, args: &[Interval], n: i128) -> Result<Interval, String> {
    let all = (0..1_usize << args.len()).map(|corner| {
        let end = |(at, arg): (usize, &Interval)| arg.ends()[corner >> at & 1];
        let args: Vec<i128> = args.iter().enumerate().map(end).collect();
        exact(op, n, &args)
    });
    let all: Option<Vec<i128>> = all.collect();
    all.and_then(Interval::over)
        .ok_or_else(|| format!("`{op}` is no operator of these operands"))
}

/// `floor(a 2^n / b + 1/2)`, 0 where `b` is 0: for a divisor of one sign it rises or falls with
/// each operand.
fn divided(a: Interval, b: Interval, n: i128) -> Interval {
    let below = Interval::new(b.low, b.high.min(-1));
    let above = Interval::new(b.low.max(1), b.high);
    let mut all = Vec::new();
    if b.holds(0) {
        all.push(0);
    }
    for sign in [below, above].into_iter().filter(|sign| !sign.is_empty()) {
        let corners = a.ends().into_iter();
        let corners = corners.flat_map(|x| sign.ends().map(|y| [x, y]));
        all.extend(corners.filter_map(|corner| exact("div_round", n, &corner)));
    }
    Interval::over(all).unwrap_or(Interval::new(0, 0))
}

/// About `a 2^n / b`, 0 where `b` is not positive. Its divisor has the 16 highest bits of `b`, so
/// it is at most by 1 in 2^15 too small, and the quotient as much too large; shifts round
/// downwards.
fn quotient(a: Interval, b: Interval, n: i128) -> Interval {
    let least = b.low.max(1);
    if b.high < least {
        return Interval::new(0, 0);
    }
    let most = |x: i128| ((x.abs() << n) << 15) / (least * ((1 << 15) - 1));
    let high = if a.high > 0 { most(a.high) } else { 0 };
    let low = if a.low < 0 { -most(a.low) - 1 } else { 0 };
    Interval::new(low.max(-QUOTIENT), high.min(QUOTIENT - 1))
}

/// The entries of a column in these rows; a row beyond the table is the nearest one of it.
fn entries(table: &Declared, rows: Interval, column: i128) -> Option<Interval> {
    let columns = table.columns.max(1);
    let column = usize::try_from(column).ok().filter(|at| *at < columns)?;
    let count = table.starts.len() / columns;
    let last = count.checked_sub(1)? as i128;
    let row = |row: i128| row.clamp(0, last) as usize;
    let read = row(rows.low)..=row(rows.high);
    Interval::over(read.map(|row| table.starts[row * columns + column]))
}
