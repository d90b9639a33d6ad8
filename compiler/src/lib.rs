//! The Whippen compiler: source text to Model to Kernel to code. No input or output, no clock.

pub mod asm;
pub mod budget;
pub mod bundled;
pub mod c;
pub mod check;
pub mod diag;
pub mod firmware;
pub mod fix;
pub mod front;
pub mod host;
pub mod ideal;
pub mod image;
pub mod index;
pub mod kernel;
pub mod lint;
pub mod model;
pub mod modes;
pub mod pipeline;
pub mod range;
pub mod scales;
pub mod simplify;
pub mod source;
pub mod stability;
pub mod syntax;
pub mod thumb;
pub mod units;
