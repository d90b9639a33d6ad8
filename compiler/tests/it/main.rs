//! Tests of all phases together, one binary: engines against each other, the manual, the pages of
//! diagnostics, the assembler against GNU's.

mod asm;
mod engines;
mod manual;
mod modes;
mod operators;
mod pages;
mod text;
