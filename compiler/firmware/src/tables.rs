//! What the firmware looks up: programs, live parameters with their ranges, velocities by speed.

use std::fmt::Write;

use super::{CORES, Played, Segment, keys_name, zone_name, zoned};

/// The tables as assembly.
///
/// ```text
///   programs            how many, then of each the descriptors for each core
///   programN_coreM      a descriptor: the offsets P_.. name its words; with zones the first record is a table (`zones`)
///   lives               how many of all programs, then words on core 0 and core 1 (or the only core, twice), lowest and highest value of each
///   readerN_coreM       what their reader knows: the offsets R_.. name its words
///   velocitiesN         128 bytes
/// ```
pub(super) fn text(programs: &[Played]) -> String {
    let mut text = String::from(
        "        .section .rodata.tables, \"a\"\n        .balign 4\n        .global programs, lives\n",
    );
    let mut line = |words: &str| {
        let _ = writeln!(text, "{words}");
    };
    let zoned = zoned(programs);
    line(&format!("programs: .word {}", programs.len()));
    for (number, program) in programs.iter().enumerate() {
        let descriptors =
            (0..program.cores.len()).map(|core| format!("program{number}_core{core}"));
        line(&format!(
            "        .word   {}",
            descriptors.collect::<Vec<_>>().join(", ")
        ));
    }
    let count: usize = programs
        .iter()
        .flat_map(|p| &p.parts)
        .map(|(kernel, _)| kernel.lives.len())
        .sum();
    line(&format!("lives:  .word   {count}"));
    for program in programs {
        for (part, (kernel, _)) in program.parts.iter().enumerate() {
            let own: Vec<&Segment> = program
                .cores
                .iter()
                .flatten()
                .filter(|segment| segment.part == part)
                .collect();
            let (Some(first), Some(last)) = (own.first(), own.last()) else {
                continue;
            };
            for (index, live) in kernel.lives.iter().enumerate() {
                let at = |segment: &Segment| {
                    format!(
                        "{}_state + {}",
                        segment.name,
                        segment.layout.live_param(index).unwrap_or(0)
                    )
                };
                line(&format!("        .word   {}, {}", at(first), at(last)));
                line(&format!(
                    "        .word   {}, {}         @ {}",
                    live.range.low, live.range.high, live.name
                ));
            }
        }
    }
    // A descriptor is looked up by its core's tick and by who reads its events.
    for (core, name) in CORES.iter().enumerate().take(programs[0].cores.len()) {
        line(&format!(
            "        .section .rodata.near.{name}.programs, \"a\"\n        .balign 4"
        ));
        for (number, program) in programs.iter().enumerate() {
            line(&descriptor(&program.cores[core], number, core, zoned));
        }
    }
    // Looked up by core 1 alone.
    line("        .section .rodata.core1.tables, \"a\"\n        .balign 4");
    for (number, program) in programs.iter().enumerate() {
        for (core, segments) in program.cores.iter().enumerate() {
            for (at, segment) in segments.iter().enumerate() {
                line(&reader(
                    program,
                    number,
                    core,
                    segment,
                    zoned.then(|| at + 1 < segments.len()),
                    at,
                ));
            }
        }
        for (part, (_, midi)) in program.parts.iter().enumerate() {
            line(&format!("{}:", velocities(number, part)));
            for row in midi.velocities.chunks(16) {
                let bytes: Vec<String> = row.iter().map(u8::to_string).collect();
                line(&format!("        .byte   {}", bytes.join(", ")));
            }
        }
    }
    text
}

fn descriptor(segments: &[Segment], number: usize, core: usize, zoned: bool) -> String {
    let (name, layout) = (keys_name(core, number), &segments[0].layout);
    let label = format!("program{number}_core{core}");
    let places = if zoned {
        format!("{name}_records, 0, 0")
    } else {
        let (gains, records) = (layout.gain(0).unwrap_or(4), layout.record(0));
        format!(
            "{name}_state + {gains}, {name}_state + {records}, {name}_state + {end}",
            end = layout.record(segments[0].keys)
        )
    };
    format!(
        "        .global {label}
{label}: .word {block}, {name}_state, {name}_init, {name}_tick, {name}_begin
        .word   {places}
        .word   {reader}",
        block = CORES[core],
        reader = reader_name(number, core, 0),
    )
}

fn reader_name(number: usize, core: usize, zone: usize) -> String {
    let of_core = format!("reader{number}_core{core}");
    if zone == 0 {
        of_core
    } else {
        zone_name(&of_core, zone)
    }
}

fn velocities(number: usize, part: usize) -> String {
    let of_program = format!("velocities{number}");
    if part == 0 {
        of_program
    } else {
        zone_name(&of_program, part)
    }
}

/// What the reader of a core's events knows of a zone of a program; where there may be several,
/// also whether another follows.
fn reader(
    program: &Played,
    number: usize,
    core: usize,
    segment: &Segment,
    follows: Option<bool>,
    zone: usize,
) -> String {
    let (kernel, midi) = program.parts[segment.part];
    let name = &segment.name;
    // Without events nobody looks for them: the ring's head stays where its tail is.
    let (events, event_bytes, mask) = match segment.layout.events() {
        Some(ring) => (format!("{name}_events"), ring.event, ring.bytes - 1),
        None => ("0".to_string(), 0, 0),
    };
    let none = kernel.events.len() as u32;
    let event = |index: Option<u32>| index.unwrap_or(none);
    let next = match follows {
        None => String::new(),
        Some(false) => ", 0".to_string(),
        Some(true) => format!(", {}", reader_name(number, core, zone + 1)),
    };
    format!(
        "{label}: .word {name}_state, {events}
        .word   {event_bytes}, {note}, {release}, {shift}, {velocities}, {mask}{next}",
        label = reader_name(number, core, zone),
        note = event(midi.note),
        release = event(midi.release),
        shift = midi.speed_shift,
        velocities = velocities(number, segment.part),
    )
}
