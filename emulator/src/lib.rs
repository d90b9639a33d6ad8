//! A Cortex-M that counts: Cortex-M0+, M4 and M33, functional and cycle by cycle. It runs any
//! bare-metal image.
//!
//! ```text
//!   image bytes --> Memory <--- Bus ---> devices (boards', the caller's)
//!                     |          |
//!     Code (blocks of decoded Ops, cycles by pipeline state)
//!                     |          |
//!                   Core: Cpu + pipeline + cycle  <-- schedule: cores, timers, exceptions in time
//! ```
//!
//! No input, no output, no clock: images come in as bytes, what a program prints comes out as
//! bytes.
//!
//! ```
//! use whippen_emulator::{Board, CoreKind, Machine, Stop};
//!
//! let mut machine = Machine::new(Board::generic(CoreKind::CortexM33)).unwrap();
//! machine.bus.memory.write(0x2000_0000, &[0x40, 0x1c, 0x70, 0x47]).unwrap(); // adds r0, #1; bx lr
//! let stop = machine.call(0x2000_0001, [41, 0, 0, 0], 1000);
//! assert!(matches!(stop, Stop::Returned { result: [42, _], .. }));
//! ```
//!
//! # Absent
//!
//! * The Security extension as a barrier: one state, which is the one a core starts in (Secure on
//!   RP2350). Non-secure names of special registers and the alias at 0xE002E000 are those of the
//!   only state; SG does nothing, BXNS and BLXNS are BX and BLX, TT finds everything accessible,
//!   VLSTM and VLLDM are undefined.
//! * The MPU, ITM, breakpoint and watchpoint units, the debug registers: they read as zero and
//!   ignore writes.
//! * LDRT, STRT and their kin access as LDR and STR do.
//! * Coprocessors other than the floating-point unit: UsageFault (NOCP).

// What is for translated code alone has no use where there is none.
#![cfg_attr(
    not(any(target_arch = "x86_64", target_arch = "aarch64")),
    allow(dead_code, unused_imports)
)]

mod access;
mod alu;
mod apart;
mod block;
mod board;
mod boards;
mod bus;
mod code;
mod core;
mod cpu;
mod device;

pub mod elf;
mod exception;
mod exec;
mod fabric;
mod faults;
mod float;
mod lines;
mod machine;
mod memo;
mod memory;
mod observe;
mod op;
mod outcome;
mod outside;
mod pins;
mod register;
mod schedule;
mod semihosting;
mod step;
mod stop;
mod system;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod translate;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
#[path = "translate/absent.rs"]
mod translate;
mod trap;
mod vcd;

pub use board::{Board, BoardError, CoreKind, Region};
pub use boards::{BoardKind, ConverterSetup, Ports, build};
pub use bus::{Access, Bus, BusError, Device, DeviceId, Waits};
pub use cpu::{Activity, Cpu};
pub use device::converter::Converter;
pub use device::uart::Uart;
pub use fabric::Banks;
pub use lines::{Lines, Start};
pub use machine::Machine;
pub use memory::{Memory, MemoryError, Watch};
pub use observe::{Observer, Step};
pub use outside::{
    BenchKey, BenchPins, Column, ColumnErrors, ColumnKeyParts, ColumnKeys, ColumnParts, ColumnPins,
    ColumnUpdate, Columns, ColumnsPins, DacErrors, DacPins, Finger, Hand, HeardFrame, KeyBench,
    KeyParts, KeyPins, Knob, KnobParts, KnobPins, Motor, MotorParameters, ScanFault, SensorFault,
    SoundDac,
};
pub use pins::{PinChange, Pins};
pub use register::Register;
pub use semihosting::Semihosting;
pub use stop::{Fault, FaultKind, Reason, Stop};
pub use vcd::vcd;
