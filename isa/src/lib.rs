//! The Thumb instruction set of the Cortex-M0+, M4 and M33, as one table.
//!
//! ```text
//!                       table: one line per encoding
//!       picture, syntax, registers and flags, class, what is UNPREDICTABLE
//!                                   |
//!   halfwords --decode--> Inst (encoding + operands) --encode--> halfwords
//!                                   |
//!        Display, parse (UAL)   uses, defs, flags   class, it_rule, shortest
//! ```
//!
//! An emulator decodes once and executes by [`Op`] and operands; a compiler fills operands in, asks
//! what is read and written, and encodes. Both stand on the same lines, which others judge:
//! Capstone and the GNU assembler in `tests/oracle`.
//!
//! ```
//! use whippen_isa::{Arch, Code, Encoding, Form, Inst, ItState, Op, RegSet, decode};
//!
//! let inst = decode(0xfb51, 0x3012, Arch::V8M, ItState::OUTSIDE).unwrap();
//! assert_eq!((inst.op(), inst.to_string().as_str()), (Op::SMMLA, "smmlar r0, r1, r2, r3"));
//! assert!(inst.uses().contains(RegSet::core(3)));
//!
//! let add = Encoding::new(Op::ADD_immediate, Form::T3).unwrap();
//! let add = Inst { d: 1, n: 1, imm: 5, s: true, ..Inst::new(add) };
//! assert_eq!(add.encode(Arch::V8M), Ok(Code::Wide(0xf111, 0x0105)));
//! assert_eq!(add.shortest(Arch::V8M).unwrap().encode(Arch::V8M), Ok(Code::Narrow(0x1d49)));
//! ```
//!
//! # Complete
//!
//! * ARMv6-M.
//! * ARMv7E-M with FPv4-SP: Thumb-2, the DSP extension, coprocessor instructions.
//! * ARMv8-M Mainline with the DSP and Security extensions and FPv5-SP, as in RP2350: load-acquire
//!   and store-release, SG, BXNS, BLXNS, TT, VLSTM, VLLDM, FPv5's VSEL, VMAXNM, VMINNM, VRINT and
//!   directed VCVT.
//!
//! UNDEFINED and UNPREDICTABLE are outcomes of [`decode`], never guesses: an UNPREDICTABLE word
//! comes with its reading and the reason. SG and the other instructions of the Secure state decode
//! whatever the state; hints without a name decode as `HINT` and, where the assembler has no
//! syntax, `HINT_memory`; both do nothing.
//!
//! # Absent
//!
//! * Double precision arithmetic (FPv5-D16), half precision arithmetic, D16 to D31. VLDR, VSTR,
//!   VLDM, VSTM and VMOV of D0 to D15 are here, because the single-precision units have them.
//! * ARMv8.1-M: MVE, low-overhead loops and branch future, VSCCLRM, CLRM, CSEL and its kin, PACBTI.
//!   Custom datapath instructions (CDE).
//! * A and R profile: the ARM instruction set, Advanced SIMD, SETEND, SMC, HVC, SRS, RFE, CRC32,
//!   LDREXD, STREXD.
//! * What FPSCR does besides its condition flags: cumulative exception bits and modes are no
//!   operands here.
//! * Meaning (the emulator's).
#![no_std]

extern crate alloc;

mod access;
mod arch;
mod class;
mod cond;
mod cores;
mod decode;
mod effects;
mod encode;
pub mod imm;
mod inst;
mod limits;
mod parse;
mod pattern;
pub mod reg;
mod row;
mod rules;
mod stack;
mod table;
mod text;
pub mod timing;
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
pub use parse::{NotParsed, parse};
pub use reg::RegSet;
pub use row::{Encoding, Form, ItRule};
pub use stack::Stored;
pub use table::Op;
