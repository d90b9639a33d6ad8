//! Determinism where it is easily lost: work that threads share, and random numbers.
//!
//! Results depend neither on the number of threads nor on the platform.

pub mod parallel;
mod rng;

pub use rng::Rng;
