//! The language: source text to [`model::Model`], with diagnostics.
//!
//! ```text
//!   text --syntax--> tree --check (units)--> Model --range--> proven ranges --lint--> warnings
//! ```
//!
//! No input or output, no clock. Not here: integers (`whippen-lower`).

pub mod bundled;
pub mod check;
pub mod diag;
pub mod front;
pub mod index;
pub mod lint;
pub mod model;
pub mod range;
pub mod syntax;
pub mod units;
