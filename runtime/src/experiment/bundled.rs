//! The experiments that come with Whippen, and the programs that only they play.

pub use whippen_instruments::{EXPERIMENT_PROGRAMS as PROGRAMS, EXPERIMENTS};
