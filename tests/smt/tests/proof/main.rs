//! Claims about all numbers, proven by solvers; `docs/proofs.md` says which and how.

mod counts;
mod lifter;
mod machine;
mod meaning;
mod operators;
mod pcode;
mod selection;
mod simplification;
mod target;
