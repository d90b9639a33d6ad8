//! Unit expressions: `unit(^int)?([*/]unit(^int)?)*`, without spaces.

use super::dim::Dim;
use super::table::{NamedUnit, UNITS};

/// A unit expression: a number in it is worth `number * up / down` in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Factor.
    pub up: f64,
    /// Divisor.
    pub down: f64,
    /// Its dimension.
    pub dim: Dim,
}

impl Unit {
    /// The unit of a plain number.
    pub const ONE: Unit = Unit {
        up: 1.0,
        down: 1.0,
        dim: Dim::NUMBER,
    };

    /// A number in this unit, in SI.
    pub fn to_si(self, number: f64) -> f64 {
        number * self.up / self.down
    }

    /// What one of it is worth in SI.
    pub fn factor(self) -> f64 {
        self.up / self.down
    }

    /// The unit of a product.
    pub fn times(self, other: Unit) -> Unit {
        Unit {
            up: self.up * other.up,
            down: self.down * other.down,
            dim: self.dim.mul(other.dim),
        }
    }

    fn power(self, n: i8) -> Unit {
        let (up, down) = if n < 0 {
            (self.down, self.up)
        } else {
            (self.up, self.down)
        };
        let size = i32::from(n).abs();
        Unit {
            up: up.powi(size),
            down: down.powi(size),
            dim: self.dim.powi(n),
        }
    }
}

/// Reads a whole unit expression (`N*s/m`). `None` where something in it is no unit.
pub fn parse_unit(text: &str) -> Option<Unit> {
    longest_unit(text).and_then(|(length, unit)| (length == text.len()).then_some(unit))
}

/// The unit of SI that a unit expression is so many of, in the same words: `kHz` is of `Hz`,
/// `deg/s` of `rad/s`. What is no unit stays as it is.
pub fn si_unit(text: &str) -> String {
    let mut of_si = String::new();
    let mut rest = text;
    while !rest.is_empty() {
        let (word, after) = rest.split_at(word_length(rest));
        let named = UNITS.iter().find(|unit| unit.name == word);
        let is_of = |unit: &&NamedUnit, of: &NamedUnit| {
            (unit.dim, unit.up, unit.down) == (of.dim, 1.0, 1.0)
        };
        let in_si = named.and_then(|of| UNITS.iter().find(|unit| is_of(unit, of)));
        of_si.push_str(in_si.map_or(word, |unit| unit.name));
        // Signs and exponents.
        let next = after.find(|c: char| c.is_ascii_alphabetic());
        let (between, next) = after.split_at(next.unwrap_or(after.len()));
        of_si.push_str(between);
        rest = next;
    }
    of_si
}

/// The longest unit expression of known units at the beginning of the text: its length in bytes and
/// the unit.
pub fn longest_unit(text: &str) -> Option<(usize, Unit)> {
    let (mut at, mut unit) = factor(text)?;
    loop {
        let sign = match text.as_bytes().get(at) {
            Some(b'*') => 1,
            Some(b'/') => -1,
            _ => return Some((at, unit)),
        };
        let Some((length, next)) = factor(&text[at + 1..]) else {
            return Some((at, unit));
        };
        at += 1 + length;
        unit = unit.times(next.power(sign));
    }
}

/// One unit with its exponent at the beginning of the text.
fn factor(text: &str) -> Option<(usize, Unit)> {
    let name = &text[..word_length(text)];
    let named = UNITS.iter().find(|u| u.name == name)?;
    let unit = Unit {
        up: named.up,
        down: named.down,
        dim: named.dim,
    };
    match exponent(&text[name.len()..]) {
        Some((length, n)) => Some((name.len() + length, unit.power(n))),
        None => Some((name.len(), unit)),
    }
}

/// Length of the word at the beginning of the text: 0 if it begins with something else.
pub(crate) fn word_length(text: &str) -> usize {
    let digit_first = text.starts_with(|c: char| c.is_ascii_digit());
    if digit_first {
        0
    } else {
        text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .unwrap_or(text.len())
    }
}

/// `^2` or `^-1`: one digit, and not the beginning of a longer or broken number, which is left to
/// the power operator.
fn exponent(text: &str) -> Option<(usize, i8)> {
    let digits = text.strip_prefix('^')?;
    let (sign, digits) = match digits.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, digits),
    };
    let digit = digits.bytes().next().filter(u8::is_ascii_digit)?;
    let mut after = digits[1..].chars();
    let longer = match after.next() {
        Some('.') => after.next().is_some_and(|c| c.is_ascii_digit()),
        Some(c) => c.is_ascii_alphanumeric() || c == '_',
        None => false,
    };
    (!longer).then(|| (text.len() - digits.len() + 1, sign * (digit - b'0') as i8))
}
