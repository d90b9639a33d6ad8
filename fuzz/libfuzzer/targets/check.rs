//! The target `check` of `whippen_fuzz`, guided by coverage.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| whippen_fuzz::targets::must_hold("check", bytes));
