//! What the firmware looks up: programs, live parameters with their ranges, velocities by speed.

use std::fmt::Write;

use super::{CORES, Played, keys_name};

/// The tables as assembly.
///
/// ```text
///   programs            how many, then of each the descriptors for each core
///   programN_coreM      a descriptor: the offsets P_.. name its words
///   lives               how many of all programs, then words on core 0 and core 1 (or the only core, twice), lowest and highest value of each
///   readerN_coreM       what their reader knows: the offsets R_.. name its words
///   velocitiesN         128 bytes
/// ```
pub(super) fn text(programs: &[Played], keys: &[u32]) -> String {
    let mut text =
        String::from("        .section .rodata.tables, \"a\"\n        .balign 4\n        .global programs, lives\n");
    let mut line = |words: &str| {
        let _ = writeln!(text, "{words}");
    };
    line(&format!("programs: .word {}", programs.len()));
    for program in 0..programs.len() {
        let descriptors = (0..keys.len()).map(|core| format!("program{program}_core{core}"));
        line(&format!("        .word   {}", descriptors.collect::<Vec<_>>().join(", ")));
    }
    let count: usize = programs.iter().map(|program| program.kernel.lives.len()).sum();
    line(&format!("lives:  .word   {count}"));
    for (number, program) in programs.iter().enumerate() {
        for (index, live) in program.kernel.lives.iter().enumerate() {
            let at = [0, keys.len() - 1].map(|core| {
                let place = program.layouts[core].live(index).unwrap_or(0);
                format!("{}_state + {place}", keys_name(core, number))
            });
            line(&format!("        .word   {}, {}", at[0], at[1]));
            line(&format!("        .word   {}, {}         @ {}", live.range.low, live.range.high, live.name));
        }
    }
    // A descriptor is looked up by its core's tick and by who reads its events.
    for (core, &keys) in keys.iter().enumerate() {
        line(&format!("        .section .rodata.near.{}.programs, \"a\"\n        .balign 4", CORES[core]));
        for (number, program) in programs.iter().enumerate() {
            line(&descriptor(program, number, core, keys));
        }
    }
    // Looked up by core 1 alone.
    line("        .section .rodata.core1.tables, \"a\"\n        .balign 4");
    for (number, program) in programs.iter().enumerate() {
        (0..keys.len()).for_each(|core| line(&reader(program, number, core)));
        line(&format!("velocities{number}:"));
        for row in program.midi.velocities.chunks(16) {
            let bytes: Vec<String> = row.iter().map(u8::to_string).collect();
            line(&format!("        .byte   {}", bytes.join(", ")));
        }
    }
    text
}

fn descriptor(program: &Played, number: usize, core: usize, keys: u32) -> String {
    let (name, layout) = (keys_name(core, number), program.layouts[core]);
    let label = format!("program{number}_core{core}");
    format!(
        "        .global {label}
{label}: .word {block}, {name}_state, {name}_init, {name}_tick, {name}_begin
        .word   {name}_state + {gains}, {name}_state + {records}, {name}_state + {end}
        .word   reader{number}_core{core}",
        block = CORES[core],
        gains = layout.gain(0).unwrap_or(4),
        records = layout.record(0),
        end = layout.record(keys),
    )
}

/// What the reader of a core's events knows of a program.
fn reader(program: &Played, number: usize, core: usize) -> String {
    let name = keys_name(core, number);
    // Without events nobody looks for them: the ring's head stays where its tail is.
    let (events, event_bytes, mask) = match program.layouts[core].events() {
        Some(ring) => (format!("{name}_events"), ring.event, ring.bytes - 1),
        None => ("0".to_string(), 0, 0),
    };
    let none = program.kernel.events.len() as u32;
    let event = |index: Option<u32>| index.unwrap_or(none);
    format!(
        "reader{number}_core{core}: .word {name}_state, {events}
        .word   {event_bytes}, {note}, {release}, {shift}, velocities{number}, {mask}",
        note = event(program.midi.note),
        release = event(program.midi.release),
        shift = program.midi.speed_shift,
    )
}
