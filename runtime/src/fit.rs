//! Fitting parameters of an instrument to recordings.
//!
//! ```text
//!   recording -> motion -> run -> columns, events -> residuals -> least squares -> values,
//!             \-> what was measured ----------------^                            confidence
//! ```
//!
//! Not here: what compiles a program with other values (the caller), pictures.

pub mod data;
pub mod description;
pub mod residuals;
pub mod solve;
pub mod statistics;
pub mod strokes;

#[cfg(test)]
mod tests;
