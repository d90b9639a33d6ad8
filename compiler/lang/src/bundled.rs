//! Programs that come with Whippen: the standard library and the instruments, as text.
//!
//! The texts are the crate of `instruments/`; every test that means "all of them" reads these
//! lists.

use whippen_instruments::{BOARDS, DEVICES, PRESETS, Text};
pub use whippen_instruments::{INSTRUMENTS, KEYBOARDS, STD};

/// The boards that a keyboard may name, by name.
pub fn boards() -> Vec<&'static str> {
    names(BOARDS)
}

/// The devices that a keyboard may name, likewise.
pub fn devices() -> Vec<&'static str> {
    names(DEVICES)
}

/// The presets that a command may name, likewise.
pub fn presets() -> Vec<&'static str> {
    names(PRESETS)
}

fn names(texts: &[Text]) -> Vec<&'static str> {
    let name = |(file, _): &Text| file.trim_end_matches(".toml");
    let mut names: Vec<&str> = texts.iter().map(name).collect();
    names.sort_unstable();
    names
}

/// All of them: instruments, keyboards, library.
pub fn programs() -> impl Iterator<Item = &'static Text> {
    INSTRUMENTS.iter().chain(KEYBOARDS).chain(STD)
}
