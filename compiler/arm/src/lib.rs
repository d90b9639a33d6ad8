//! Code for Cortex-M: from modes to linked images.
//!
//! ```text
//!   Modes --thumb--> Object --.
//!                              image::link (Board) --> Image --> ELF, UF2, listing, map
//!   text --asm-----> Object --'
//! ```
//!
//! `control` and `stack` say what single instructions do to the flow of control and to the stack.
//!
//! Not here: the firmware around the keys (`whippen-firmware`), bounds (`whippen-budget`).

pub mod asm;
pub mod control;
mod features;
pub mod image;
pub mod thumb;
