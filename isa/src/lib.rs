//! The Thumb instruction set of the Cortex-M0+, M4 and M33, as one table.
#![no_std]

mod arch;
mod class;
mod cond;
mod decode;
mod effects;
mod encode;
pub mod imm;
mod inst;
mod limits;
mod pattern;
pub mod reg;
mod row;
mod rules;
mod table;
mod text;
mod words;

pub use arch::Arch;
pub use class::Class;
pub use cond::{Cond, ItState};
pub use decode::{NotDecoded, decode, is_wide};
pub use effects::{FlagUse, Flags};
pub use encode::{Code, NotEncoded};
pub use imm::ShiftType;
pub use inst::Inst;
pub use limits::Why;
pub use reg::RegSet;
pub use row::{Encoding, Form, ItRule};
pub use table::Op;
