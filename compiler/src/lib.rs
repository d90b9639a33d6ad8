//! The Whippen compiler: source text to Model to Kernel to code. No input or output, no clock.

pub mod bundled;
pub mod c;
pub mod check;
pub mod diag;
pub mod fix;
pub mod front;
pub mod host;
pub mod ideal;
pub mod kernel;
pub mod lint;
pub mod model;
pub mod pipeline;
pub mod range;
pub mod scales;
pub mod simplify;
pub mod source;
pub mod syntax;
pub mod units;
