//! Units and dimensions.
//!
//! A *dimension* says what kind of thing a value is (a length, a force); a *unit* says in what
//! measure a number was written (`mm`, `N*s/m`). Inside the compiler everything is SI; units are
//! seen only where text is read or written.
//!
//! ```text
//!   "12.7 mm" -- unit::parse --> Unit { mm } -- to_si --> 0.0127, Dim::LENGTH -- Display --> "m"
//! ```
//!
//! The facts stand in [`table`]: one line per unit, one line per dimension. Not here: converter
//! samples and other measures that only a device knows.

pub mod dim;
pub mod quantity;
mod shown;
pub mod table;
pub mod title;
pub mod unit;

pub use dim::{Dim, unit_suffix};
pub use quantity::{Quantity, QuantityError, parse_quantity};
pub use shown::{shown, shown_range, usual_unit};
pub use table::{
    DIMENSIONS, UNITS, dimension, dimension_names, nearest_unit, unit_names, unit_of_dimension,
};
pub use title::{split_title, unit_of_suffix};
pub(crate) use unit::word_length;
pub use unit::{Unit, longest_unit, parse_unit, si_unit};

#[cfg(test)]
mod tests;
