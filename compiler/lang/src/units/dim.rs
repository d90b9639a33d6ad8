//! Physical dimensions: exponents of the base units, their algebra, and how they are shown.

use std::fmt;

use super::table::{DIMENSIONS, SHOWN};

/// A physical dimension: exponents of metre, kilogram, second and ampere. Angles count as
/// dimensionless, but a radian is remembered for display where the language's tables say so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dim {
    /// Exponent of the metre.
    pub length: i8,
    /// Exponent of the kilogram.
    pub mass: i8,
    /// Exponent of the second.
    pub time: i8,
    /// Exponent of the ampere.
    pub current: i8,
}

impl Dim {
    /// Plain numbers and angles.
    pub const NUMBER: Dim = Dim::new(0, 0, 0, 0);
    /// m
    pub const LENGTH: Dim = Dim::new(1, 0, 0, 0);
    /// kg
    pub const MASS: Dim = Dim::new(0, 1, 0, 0);
    /// s
    pub const TIME: Dim = Dim::new(0, 0, 1, 0);
    /// A
    pub const CURRENT: Dim = Dim::new(0, 0, 0, 1);
    /// m/s
    pub const SPEED: Dim = Dim::new(1, 0, -1, 0);
    /// m/s^2
    pub const ACCELERATION: Dim = Dim::new(1, 0, -2, 0);
    /// N
    pub const FORCE: Dim = Dim::new(1, 1, -2, 0);
    /// rad/s, and Hz
    pub const PER_TIME: Dim = Dim::new(0, 0, -1, 0);
    /// N*m, and J
    pub const TORQUE: Dim = Dim::new(2, 1, -2, 0);
    /// kg*m^2
    pub const INERTIA: Dim = Dim::new(2, 1, 0, 0);

    /// From the exponents of metre, kilogram, second and ampere.
    pub const fn new(length: i8, mass: i8, time: i8, current: i8) -> Dim {
        Dim {
            length,
            mass,
            time,
            current,
        }
    }

    /// Dimension of a product. Exponents stop at the ends of `i8`, far beyond anything that has a
    /// meaning.
    #[must_use]
    pub const fn mul(self, other: Dim) -> Dim {
        Dim {
            length: self.length.saturating_add(other.length),
            mass: self.mass.saturating_add(other.mass),
            time: self.time.saturating_add(other.time),
            current: self.current.saturating_add(other.current),
        }
    }

    /// Dimension of a quotient.
    #[must_use]
    pub const fn div(self, other: Dim) -> Dim {
        self.mul(other.powi(-1))
    }

    /// Dimension of a power.
    #[must_use]
    pub const fn powi(self, n: i8) -> Dim {
        Dim {
            length: self.length.saturating_mul(n),
            mass: self.mass.saturating_mul(n),
            time: self.time.saturating_mul(n),
            current: self.current.saturating_mul(n),
        }
    }

    /// Dimension of the power `halves / 2`; `None` where an exponent would not be whole.
    pub fn pow_halves(self, halves: i8) -> Option<Dim> {
        let doubled = self.powi(halves);
        let whole = [doubled.length, doubled.mass, doubled.time, doubled.current]
            .iter()
            .all(|e| e % 2 == 0);
        whole.then(|| {
            Dim::new(
                doubled.length / 2,
                doubled.mass / 2,
                doubled.time / 2,
                doubled.current / 2,
            )
        })
    }

    /// Whether it is a plain number (or an angle).
    pub const fn is_number(self) -> bool {
        self.length == 0 && self.mass == 0 && self.time == 0 && self.current == 0
    }

    /// Its first name in the table of dimensions (`force`), if it has one.
    pub fn name(self) -> Option<&'static str> {
        DIMENSIONS.iter().find(|d| d.dim == self).map(|d| d.name)
    }

    /// The SI unit its values are shown in, as it would be written in a program (`N*s/m`); empty
    /// for plain numbers.
    pub fn unit(self) -> String {
        if self.is_number() {
            return String::new();
        }
        match SHOWN.iter().find(|(_, dim)| *dim == self) {
            Some((unit, _)) => (*unit).to_string(),
            None => self.base_units(),
        }
    }

    /// As [`Dim::unit`] where nothing is known to turn: one over a time is `1/s`, and no angular
    /// rate.
    pub fn unit_without_angle(self) -> String {
        let times = Dim::new(0, 0, self.time, 0);
        match self.time {
            -1 if self == times => "1/s".to_string(),
            ..-1 if self == times => format!("1/s^{}", self.time.saturating_neg()),
            _ => self.unit(),
        }
    }

    /// In metre, kilogram, second and ampere (`kg*m/s^3`).
    fn base_units(self) -> String {
        let factors = [
            ("kg", self.mass),
            ("m", self.length),
            ("s", self.time),
            ("A", self.current),
        ];
        let power = |unit: &str, n: i8| {
            if n == 1 {
                unit.to_string()
            } else {
                format!("{unit}^{n}")
            }
        };
        let above: Vec<String> = factors
            .iter()
            .filter(|f| f.1 > 0)
            .map(|f| power(f.0, f.1))
            .collect();
        let below = factors.iter().filter(|f| f.1 < 0);
        if above.is_empty() {
            return below.map(|f| power(f.0, f.1)).collect::<Vec<_>>().join("*");
        }
        let below: String = below
            .map(|f| format!("/{}", power(f.0, f.1.saturating_neg())))
            .collect();
        above.join("*") + &below
    }
}

/// The suffix of a column that holds values of a unit (`m`, `m_per_s`, `per_s`); empty for plain
/// numbers.
pub fn unit_suffix(unit: &str) -> String {
    let mut words = Vec::new();
    let mut sign = '*';
    for factor in unit.split_inclusive(['*', '/']) {
        let name = factor.trim_end_matches(['*', '/']);
        words.push(match name.split_once("^-") {
            _ if name == "1" => String::new(),
            Some((base, n)) => format!("per_{base}{}", if n == "1" { "" } else { n }),
            None if sign == '/' => format!("per_{}", name.replace('^', "")),
            None => name.replace('^', ""),
        });
        sign = factor.chars().last().unwrap_or('*');
    }
    words.retain(|word| !word.is_empty());
    words.join("_").to_lowercase()
}

/// The unit, or `1` for plain numbers.
impl fmt::Display for Dim {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.is_number() {
            f.write_str("1")
        } else {
            f.write_str(&self.unit())
        }
    }
}
