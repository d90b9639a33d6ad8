//! Programs that come with Whippen: the standard library and the instruments, as text.
//!
//! The texts are the crate of `instruments/`; every test that means "all of them" reads these
//! lists.

pub use whippen_instruments::{INSTRUMENTS, KEYBOARDS, STD};

/// The boards that a keyboard may name: the files in `instruments/hardware/`.
pub const BOARDS: &[&str] = &[
    "pico2_four_knobs",
    "pico2_knob",
    "pico2_strings",
    "pico2_two_knobs",
    "rp2040",
    "rp2350",
    "rp2350_columns",
    "rp2350b_bench",
    "stm32f4",
];

/// The devices that a keyboard may name, likewise.
pub const DEVICES: &[&str] = &[
    "chain",
    "column_coil",
    "gimbal",
    "knob",
    "mikey",
    "mouse",
    "pad",
    "touch",
    "voice_coil",
];

/// The presets that a command may name: the files in `instruments/presets/`.
pub const PRESETS: &[&str] = &["onofrei", "open-g", "pentatonic"];

/// All of them: instruments, keyboards, library.
pub fn programs() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    INSTRUMENTS.iter().chain(KEYBOARDS).chain(STD)
}
