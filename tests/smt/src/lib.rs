//! Claims about integers and words as queries of SMT-LIB, and the answers of solvers to them.
//!
//! | part | what it is |
//! | --- | --- |
//! | [`term`] | terms, each kept once |
//! | `fold` | terms of numbers are numbers |
//! | [`number`] | what meanings of operators are run with, so that a claim is about the very table |
//! | [`query`] | a claim as text |
//! | [`solver`] | the solvers, with a limit of time |
//! | [`answers`] | what was answered, kept by the text that was asked |
//!
//! A solver is not believed to end: what it does not answer in time is open, and listed as that.

pub mod answers;
mod fold;
pub mod number;
pub mod query;
pub mod solver;
pub mod term;
#[cfg(test)]
mod tests;

pub use answers::check;
pub use number::{Bounded, Unbounded};
pub use query::Query;
pub use solver::{Answer, Verdict, ask};
pub use term::{Head, Node, Sort, Term};
