//! The static bound of whole images against the emulator: nobody takes longer, and how close they
//! come.
//!
//! `WHIPPEN_TICKS=N` plays N ticks instead of some thousand, `WHIPPEN_ROUNDS=N` searches for so
//! many rounds.

mod around;
mod audit;
mod board;
mod faults;
mod friction;
mod image;
mod late;
mod memories;
mod own;
mod played;
mod searched;
mod states;
mod switched;
mod table;
mod validated;

#[path = "../../audit/tests/made/changed.rs"]
mod changed;
#[path = "../it/common.rs"]
#[expect(dead_code, reason = "other tests want more of it")]
mod common;
