//! Fuzzing: what the world may hand to Whippen, mutated, and what must be true whatever it is.
//!
//! ```text
//!   seeds (instruments, filetests, pages, corpus/) ─ mutate ─> target(bytes) ─> Ok, or what went wrong
//! ```
//!
//! * [`targets`] is one function per door: text, check, the whole pipeline, kernels, recordings,
//!   device files. A panic, an error it returns, or more time than [`SLOW`] is a finding.
//! * [`mutate`] makes new inputs: bytes, words of the language, lines of other inputs. Everything
//!   follows from the seed.
//! * [`run`] spends a time on the targets in turn. `cargo run --release -p whippen-fuzz --
//!   --seconds 600 --seed 7` does it at length; the test `timed` does it in every run of the tests,
//!   after the corpus of old findings.
//!
//! The same targets are guided by coverage in `libfuzzer/`, for long runs by hand.
//!
//! Not here: the emulator, which has tests of its own.

pub mod mutate;
pub mod run;
pub mod seeds;
pub mod targets;

use std::time::Duration;

/// An input that takes longer is a finding. Generous: other work may share the machine.
pub const SLOW: Duration = Duration::from_secs(20);
