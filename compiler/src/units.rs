//! Units and dimensions.

/// A physical dimension: exponents of metre, kilogram, second and ampere. Angles count as dimensionless, but a radian is
/// remembered for display where the language's tables say so.
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
