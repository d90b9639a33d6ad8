//! The tables: units that may be written, dimensions that may be declared, units that are shown.

use super::dim::Dim;
use crate::diag::nearest;

/// One unit with a name of its own. A number in this unit is worth `number * up / down` in SI: two
/// factors, because dividing by 1000 is exact where multiplying by 0.001 is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedUnit {
    /// As written.
    pub name: &'static str,
    /// Factor.
    pub up: f64,
    /// Divisor.
    pub down: f64,
    /// Its dimension.
    pub dim: Dim,
    /// What it is called.
    pub title: &'static str,
}

/// One dimension with a name that may be used as a type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedDim {
    /// As written.
    pub name: &'static str,
    /// Its dimension.
    pub dim: Dim,
    /// Its SI unit, for the manual.
    pub unit: &'static str,
}

const fn unit(name: &'static str, up: f64, down: f64, dim: Dim, title: &'static str) -> NamedUnit {
    NamedUnit {
        name,
        up,
        down,
        dim,
        title,
    }
}

const VOLTAGE: Dim = Dim::new(2, 1, -3, -1);
const RESISTANCE: Dim = Dim::new(2, 1, -3, -2);
const INDUCTANCE: Dim = Dim::new(2, 1, -2, -2);
const POWER: Dim = Dim::new(2, 1, -3, 0);
const PRESSURE: Dim = Dim::new(-1, 1, -2, 0);

/// The units that may be written after a number.
pub const UNITS: &[NamedUnit] = &[
    unit("m", 1.0, 1.0, Dim::LENGTH, "metre"),
    unit("cm", 1.0, 1e2, Dim::LENGTH, "centimetre"),
    unit("mm", 1.0, 1e3, Dim::LENGTH, "millimetre"),
    unit("um", 1.0, 1e6, Dim::LENGTH, "micrometre"),
    unit("km", 1e3, 1.0, Dim::LENGTH, "kilometre"),
    unit("s", 1.0, 1.0, Dim::TIME, "second"),
    unit("ms", 1.0, 1e3, Dim::TIME, "millisecond"),
    unit("us", 1.0, 1e6, Dim::TIME, "microsecond"),
    unit("ns", 1.0, 1e9, Dim::TIME, "nanosecond"),
    unit("kg", 1.0, 1.0, Dim::MASS, "kilogram"),
    unit("g", 1.0, 1e3, Dim::MASS, "gram"),
    unit("mg", 1.0, 1e6, Dim::MASS, "milligram"),
    unit("N", 1.0, 1.0, Dim::FORCE, "newton"),
    unit("mN", 1.0, 1e3, Dim::FORCE, "millinewton"),
    unit("cN", 1.0, 1e2, Dim::FORCE, "centinewton"),
    unit("kN", 1e3, 1.0, Dim::FORCE, "kilonewton"),
    unit("gf", 9.80665, 1e3, Dim::FORCE, "gram-force"),
    unit("rad", 1.0, 1.0, Dim::NUMBER, "radian"),
    unit("mrad", 1.0, 1e3, Dim::NUMBER, "milliradian"),
    unit("deg", std::f64::consts::PI, 180.0, Dim::NUMBER, "degree"),
    unit("Hz", 1.0, 1.0, Dim::PER_TIME, "hertz"),
    unit("kHz", 1e3, 1.0, Dim::PER_TIME, "kilohertz"),
    unit("MHz", 1e6, 1.0, Dim::PER_TIME, "megahertz"),
    unit("J", 1.0, 1.0, Dim::TORQUE, "joule"),
    unit("mJ", 1.0, 1e3, Dim::TORQUE, "millijoule"),
    unit("W", 1.0, 1.0, POWER, "watt"),
    unit("mW", 1.0, 1e3, POWER, "milliwatt"),
    unit("Pa", 1.0, 1.0, PRESSURE, "pascal"),
    unit("kPa", 1e3, 1.0, PRESSURE, "kilopascal"),
    unit("A", 1.0, 1.0, Dim::CURRENT, "ampere"),
    unit("mA", 1.0, 1e3, Dim::CURRENT, "milliampere"),
    unit("uA", 1.0, 1e6, Dim::CURRENT, "microampere"),
    unit("V", 1.0, 1.0, VOLTAGE, "volt"),
    unit("mV", 1.0, 1e3, VOLTAGE, "millivolt"),
    unit("ohm", 1.0, 1.0, RESISTANCE, "ohm"),
    unit("H", 1.0, 1.0, INDUCTANCE, "henry"),
    unit("mH", 1.0, 1e3, INDUCTANCE, "millihenry"),
];

/// What people write for a unit, and what is meant.
const MEANT: &[(&str, &str)] = &[
    ("Nm", "N*m"),
    ("mNm", "mN*m"),
    ("Ns", "N*s"),
    ("Nms", "N*m*s"),
    ("sec", "s"),
    ("msec", "ms"),
    ("usec", "us"),
    ("Newton", "N"),
    ("Newtons", "N"),
    ("amp", "A"),
    ("amps", "A"),
    ("meter", "m"),
    ("meters", "m"),
    ("millimeter", "mm"),
    ("millimeters", "mm"),
];

const fn dim(name: &'static str, dim: Dim, unit: &'static str) -> NamedDim {
    NamedDim { name, dim, unit }
}

/// The names of dimensions that may be used as types. Where two share a dimension, the first is
/// used in messages.
pub const DIMENSIONS: &[NamedDim] = &[
    dim("number", Dim::NUMBER, ""),
    dim("angle", Dim::NUMBER, "rad"),
    dim("length", Dim::LENGTH, "m"),
    dim("area", Dim::new(2, 0, 0, 0), "m^2"),
    dim("volume", Dim::new(3, 0, 0, 0), "m^3"),
    dim("time", Dim::TIME, "s"),
    dim("mass", Dim::MASS, "kg"),
    dim("force", Dim::FORCE, "N"),
    dim("speed", Dim::SPEED, "m/s"),
    dim("acceleration", Dim::ACCELERATION, "m/s^2"),
    dim("angular_rate", Dim::PER_TIME, "rad/s"),
    dim("frequency", Dim::PER_TIME, "Hz"),
    dim("angular_acceleration", Dim::new(0, 0, -2, 0), "rad/s^2"),
    dim("stiffness", Dim::new(0, 1, -2, 0), "N/m"),
    dim("damping", Dim::new(0, 1, -1, 0), "N*s/m"),
    dim("impulse", Dim::new(1, 1, -1, 0), "N*s"),
    dim("torque", Dim::TORQUE, "N*m"),
    dim("energy", Dim::TORQUE, "J"),
    dim("torsional_stiffness", Dim::TORQUE, "N*m/rad"),
    dim("torsional_damping", Dim::new(2, 1, -1, 0), "N*m*s/rad"),
    dim("inertia", Dim::INERTIA, "kg*m^2"),
    dim("power", POWER, "W"),
    dim("pressure", PRESSURE, "Pa"),
    dim("current", Dim::CURRENT, "A"),
    dim("voltage", VOLTAGE, "V"),
    dim("resistance", RESISTANCE, "ohm"),
    dim("inductance", INDUCTANCE, "H"),
    dim("force_constant", Dim::new(1, 1, -2, -1), "N/A"),
    dim("torque_constant", Dim::new(2, 1, -2, -1), "N*m/A"),
];

/// The unit a dimension is shown in, where it is not the product of base units.
pub(super) const SHOWN: &[(&str, Dim)] = &[
    ("N", Dim::FORCE),
    ("rad/s", Dim::PER_TIME),
    ("rad/s^2", Dim::new(0, 0, -2, 0)),
    ("N/m", Dim::new(0, 1, -2, 0)),
    ("N*s/m", Dim::new(0, 1, -1, 0)),
    ("N*s", Dim::new(1, 1, -1, 0)),
    ("N*m", Dim::TORQUE),
    ("N*m*s", Dim::new(2, 1, -1, 0)),
    ("W", POWER),
    ("Pa", PRESSURE),
    ("V", VOLTAGE),
    ("ohm", RESISTANCE),
    ("H", INDUCTANCE),
    ("N/A", Dim::new(1, 1, -2, -1)),
    ("N*m/A", Dim::new(2, 1, -2, -1)),
];

/// The dimension of that name, if there is one.
pub fn dimension(name: &str) -> Option<Dim> {
    DIMENSIONS.iter().find(|d| d.name == name).map(|d| d.dim)
}

/// The SI unit of the dimension of that name, if there is one; empty for plain numbers.
pub fn unit_of_dimension(name: &str) -> Option<&'static str> {
    DIMENSIONS.iter().find(|d| d.name == name).map(|d| d.unit)
}

/// The names of all dimensions, in the order of the table.
pub fn dimension_names() -> impl Iterator<Item = &'static str> {
    DIMENSIONS.iter().map(|d| d.name)
}

/// The names of all units, in the order of the table.
pub fn unit_names() -> impl Iterator<Item = &'static str> {
    UNITS.iter().map(|u| u.name)
}

/// What was probably meant by a word that is no unit: a unit expression.
pub fn nearest_unit(word: &str) -> Option<&'static str> {
    if let Some((_, meant)) = MEANT.iter().find(|(written, _)| *written == word) {
        return Some(meant);
    }
    let singular = word.strip_suffix('s').unwrap_or(word);
    match UNITS
        .iter()
        .find(|u| u.title == word || u.title == singular)
    {
        Some(unit) => Some(unit.name),
        None => nearest(word, unit_names()),
    }
}
