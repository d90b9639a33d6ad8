//! Code for Cortex-M: from modes to linked images.
//!
//! ```text
//!   Modes --thumb--> Object --.
//!                              image::link (Board) --> Image --> ELF, UF2, listing, map
//!   text --asm-----> Object --'
//! ```
//!
//! Not here: the firmware around the keys (`whippen-firmware`), bounds (`whippen-budget`).

pub mod asm;
mod features;
pub mod image;
pub mod thumb;
