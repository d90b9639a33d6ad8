//! Sound: which words of a core's keys are heard.
//!
//! ```text
//!   programN_coreM_sound   of each key, for each channel of the image: the address of its sample
//! ```
//!
//! An image has as many channels as the instrument with the most. What has one is heard on both
//! sides; what has none has the word `muteM`, which is 0.

use std::fmt::Write;

use super::CORES;
use super::code::{CoreCode, ProgramCode};

/// Channels of an image: none, one, or left and right.
pub(super) fn channels(programs: &[ProgramCode]) -> u32 {
    let zones = programs.iter().flat_map(ProgramCode::zones);
    let channels = zones.map(|zone| zone.channels.len() as u32);
    channels.max().unwrap_or(0)
}

/// What the table of a core's keys in a program is called.
pub fn sound_table_name(number: usize, core: usize) -> String {
    format!("program{number}_core{core}_sound")
}

/// What is read of a key without sound on a core.
pub fn mute_name(core: usize) -> String {
    format!("mute{core}")
}

/// The table of a core's keys in the program of that number, as assembly.
pub(super) fn table_as_assembly(code: &CoreCode, number: usize, channels: u32) -> String {
    let core = code.core.index();
    let name = sound_table_name(number, core);
    let mut text = format!(
        "        .section .rodata.{}.sound, \"a\"\n        .balign 4\n        .global {name}\n{name}:\n",
        CORES[core]
    );
    for zone in &code.zones {
        for key in 0..zone.keys() {
            let heard = code.cut.as_ref().map(|cut| cut.heard(zone));
            let (name, built) = heard.unwrap_or((&zone.name, &zone.built));
            let sample = |channel: u32| {
                let own = zone.channels.get(channel as usize);
                let cell = own.or(zone.channels.first());
                match cell.and_then(|cell| built.layout.cell(key, *cell)) {
                    Some(at) => format!("{name}_state + {at}"),
                    None => mute_name(core),
                }
            };
            let row: Vec<String> = (0..channels).map(sample).collect();
            let _ = writeln!(text, "        .word   {}", row.join(", "));
        }
    }
    text
}
