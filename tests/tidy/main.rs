//! The rules of the repository, enforced: what the compiler may not do, how long files, functions
//! and lines may be, who may depend on whom, what documents may claim.
//!
//! An exception is a line of a table beside its rule, with its reason. One that is not needed any
//! more fails as well.

mod documents;
mod lex;
mod names;
mod packages;
mod prose;
mod purity;
mod repository;
mod size;
mod texts;
mod walls;
mod words;

use texts::{Text, crate_of, crates, has_word, none, only_listed, paths, root, rust, texts};
