//! A Cortex-M that counts.
pub mod elf;
