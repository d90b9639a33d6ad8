//! The firmware around the keys: one core or two, the converter's tick, safety, parameters, MIDI,
//! watchdog.
//!
//! ```text
//!   core 0   tick: converter -> keys -> service, guard      between ticks: mailbox, watchdog
//!   core 1   tick: converter -> keys -> service, guard      between ticks: events of both cores -> MIDI (a single core: here too)
//! ```
//!
//! The texts in `firmware/` are assembled with the constants of a program and a board; `tick`,
//! `service` and `guard` once for each core, because every number in them is a constant of that
//! core. What a board must say is in two texts of its own. docs/firmware.md describes what the
//! texts do, for those who use it.
//!
//! [`build_image`] compiles the keys' code and puts it into it: an image that starts by itself.
//!
//! Not here: the code of the keys (`thumb`), addresses (`image`), files.

use whippen_rate::Rate;

mod bench;
mod board_texts;
mod boards;
mod code;
mod columns;
mod constants;
mod emptying;
mod error;
mod i2s;
mod image;
mod knob;
mod monitor;
mod near;
mod objects;
mod offsets;
mod own;
mod parts;
mod ports;
mod running;
mod safety;
mod self_test;
mod sound;
mod tables;
mod tuning;
mod unsupported;
mod wires;
mod zones;

pub use boards::{Support, support, support_with};
pub use code::{CoreCode, ProgramCode, ZoneCode, is_split, with_values_from};
pub use columns::{LOOKS, SEND_CYCLES_MAX, TIMED};
pub use constants::constants;
pub use error::FirmwareError;
pub use image::{
    FirmwareImage, ImageError, Instrument, build_divided, build_image, divide_equally,
};
pub use knob::Coil;
pub use monitor::{CAPTURED_MAX, Fact, Monitor, PROTOCOL, image_identity, monitor_identity};
pub use objects::{frame_constants, objects, sources};
pub use offsets::{
    FAULTS, Fault, bench_block, captured, columns_handed, core_block, key_guard, knob_block,
    passed, status,
};
pub use own::{OwnText, OwnTexts, UnknownText, all_texts, text_name};
pub use parts::{
    Cut, DONE, EARLY, FINISHED, InParts, LATE, LED, LEFT, MEET, MEMBERS, POLL, PartCode, UNMET,
    WAIT, WENT,
};
pub use ports::{GuardedDrive, GuardedPort};
pub use running::{BEGINS, DEAD, Owner, PARTS, RUNNING, Running, owner};
pub use safety::{
    SAFETY_BYTES, SAFETY_WORDS, safe_tick_name, safety_faults, safety_numbers, safety_object,
};
pub use self_test::{SelfTest, SelfTestError, self_test_block};
pub use sound::{mute_name, sound_table_name};
pub use tuning::{CURVE_PIECES, SensorTuning, TunedSensor, Watched};
pub use unsupported::Unsupported;
pub use whippen_parts::Role;
pub use zones::zone_name;

/// What a program and its keyboard say.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Setup {
    /// Keys of each core that plays, 1 to 255: of all cores of the board, or of the first alone
    /// where an instrument is played once.
    pub keys: Vec<u32>,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// What is guarded of a key: its port. Of an instrument that is played once, each of its ports.
    pub ports: Vec<GuardedPort>,
    /// The MIDI note of the first key; 21 is A0.
    pub first_note: u32,
    /// What a board whose driver makes voltages must know of the motor's coil.
    pub coil: Option<Coil>,
    /// How much energy a key may give, where that is limited.
    pub passivity: Option<Passivity>,
    /// Through what sensors are read, where they are tuned on the board.
    pub tuning: Option<SensorTuning>,
    /// Whether notes are sent with 14 bits of velocity, not seven.
    pub fine_velocity: bool,
    /// Whether MIDI that arrives is sent on, among what the keys send: to the next chip of a
    /// keyboard.
    pub passes_midi: bool,
    /// What is at the serial port in place of MIDI, if something is.
    pub monitor: Option<Monitor>,
    /// What takes the place of bundled texts.
    pub own_texts: OwnTexts,
}

/// What a key may give beyond what it got, in any span of time, and how that is observed. The unit
/// of energy is a drive word times a sensor word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Passivity {
    /// That energy, 2^18 to 2^30.
    pub credit: u32,
    /// Ticks from a drive word to the sensor word that ends the way on which it acted, 1 to 16.
    pub past: u32,
    /// The key's own damping, which takes a part of what the motor gives: 1/256 of a drive word for
    /// a sensor word a tick, at most 8191.
    pub damping: u32,
}

/// What a motor stands, in drive words: 32768 is its peak current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Motor {
    /// The word of its rated current.
    pub rated: u32,
    /// How long it stands its peak current (ms).
    pub peak_ms: u32,
    /// The word of 1 N.
    pub newton: u32,
}

/// Which events become MIDI messages.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Midi {
    /// The event whose first argument is a speed.
    pub note: Option<u32>,
    /// The event that ends a note.
    pub release: Option<u32>,
    /// Velocities of a note.
    pub velocities: Velocities,
    /// Velocities of its end, where that has a speed too: its first argument, up or down.
    pub release_velocities: Option<Velocities>,
}

/// Velocities by speed.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Velocities {
    /// How far a speed is shifted right to be an index of the table, 1 to 24.
    pub speed_shift: u32,
    /// Velocities, 14 bits of them, rising, of the multiples of a shifted speed; lines between.
    pub table: [u16; 129],
}

/// From a sensor word to the drive word of the same key (bytes), for so many words each way of a
/// core: what [`thumb::compile_for_frame`](whippen_arm::thumb::compile_for_frame) must be told.
pub fn drive_offset_bytes(words: u32) -> u32 {
    (2 * words).next_multiple_of(4)
}

/// Names of the cores' blocks, and of the objects of the keys of the first program.
pub const CORES: [&str; 2] = ["core0", "core1"];

/// The name of the object of a core's keys of a program.
pub fn keys_name(core: usize, program: usize) -> String {
    if program == 0 {
        CORES[core].to_string()
    } else {
        format!("{}_{program}", CORES[core])
    }
}
