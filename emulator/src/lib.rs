//! A Cortex-M that counts: Cortex-M0+, M4 and M33, functional and cycle by cycle. It runs any bare-metal image.
//!
//! No input, no output, no clock: images come in as bytes, what a program prints comes out as bytes.

#![allow(dead_code, reason = "execution follows")]

mod board;
mod boards;
mod bus;
mod cpu;
mod device;
pub mod elf;
mod float;
mod lines;
mod machine;
mod memory;
mod observe;
mod op;
mod register;
mod semihosting;
mod stop;
mod system;
mod trap;

pub use board::{Board, BoardError, CoreKind, Region};
pub use boards::{BoardKind, ConverterSetup, Ports, build};
pub use bus::{Access, Bus, BusError, Device, DeviceId, Waits};
pub use cpu::{Activity, Cpu};
pub use device::converter::Converter;
pub use device::uart::Uart;
pub use lines::{Lines, Start};
pub use machine::{Machine, Watch};
pub use memory::{Memory, MemoryError};
pub use observe::{Observer, Step};
pub use register::Register;
pub use semihosting::Semihosting;
pub use stop::{Fault, FaultKind, Reason, Stop};
