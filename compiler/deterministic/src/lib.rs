//! Determinism where it is easily lost: work that threads share, results that are kept, and random
//! numbers.
//!
//! Results depend neither on the number of threads nor on the platform, nor on what was made
//! before.

mod memo;
pub mod parallel;
mod rng;
mod shared;

pub use memo::Memo;
pub use rng::Rng;
pub use shared::Shared;
