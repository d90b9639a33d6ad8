//! The monitor's side of the host: what a board that plays says of itself, and what it is told.
//!
//! ```text
//!   Link (bytes) <--frame: COBS, CRC--> Client (requests) --BoardMemory--> status, gains, cells
//!                                          `--Capture: rows at tick rate --jit--> differences, Trace
//! ```
//!
//! A [`Client`] speaks to the firmware of an image with the monitor (docs/monitor.md); a debugger
//! that only reads and writes memory ([`openocd`]) has the status as well. Neither halts a board.
//!
//! Not here: which port, and the command line.

mod align;
mod capture;
mod client;
mod frame;
pub mod openocd;
mod replay;
mod status;

pub use align::{align, align_by_mailbox};
pub use capture::{Capture, CapturedRow, CapturedRows, Trigger, capture_room, rows_of};
pub use client::{Client, Facts, Link, MonitorError};
pub use frame::{decode, encode};
pub use replay::{Difference, Replay};
pub use status::{BoardMemory, BoardWrite, CoreStatus, Status, read_status};
