//! What the firmware looks up: programs, live parameters with their ranges, velocities by speed.

use std::fmt::Write;

use whippen_keyboard::{CoreId, ZoneId};

use super::code::{CoreCode, ProgramCode, ZoneCode, begins_anew, is_split};
use super::emptying::{empties, lines_table_name};
use super::sound::{channels, sound_table_name};
use super::{CORES, Instrument, Setup, zone_name};

/// Ends the name of a program's second descriptor.
const ANEW: &str = "_anew";

/// The tables as assembly.
///
/// ```text
///   programs            how many, then of each the descriptors for each core; where one may begin anew all of them a second time, by which it does
///   linesN_coreM        the pieces of memory that are emptied before it begins (`emptying`)
///   programN_coreM      a descriptor: the offsets P_.. name its words; with zones the first record is a table (`zones`)
///   tuning_coreM        one for the time in which sensors are tuned
///   lives               how many of all programs, then words on core 0 and core 1 (0 for none; or on the only core, twice), lowest and highest value of each
///   readerN_coreM       what their reader knows: the offsets R_.. name its words
///   velocitiesN         129 halfwords, behind them those of releases where these have a speed
/// ```
pub(super) fn assembly(
    programs: &[ProgramCode],
    instruments: &[Instrument],
    setup: &Setup,
) -> String {
    let mut text = String::from(
        "        .section .rodata.tables, \"a\"\n        .balign 4\n        .global programs, lives\n",
    );
    let mut line = |words: &str| {
        let _ = writeln!(text, "{words}");
    };
    let split = is_split(programs);
    let times: &[&str] = match begins_anew(programs, setup) {
        true => &["", ANEW],
        false => &[""],
    };
    line(&format!("programs: .word {}", times.len() * programs.len()));
    for again in times {
        for (number, program) in programs.iter().enumerate() {
            let label = |core| format!("program{number}_core{core}{again}");
            let descriptors: Vec<String> = program.cores.ids().map(label).collect();
            line(&format!("        .word   {}", descriptors.join(", ")));
        }
    }
    let lives = live_parameters(programs, instruments);
    line(&format!("lives:  .word   {}", lives.len()));
    lives.iter().for_each(|live| line(live));
    // A descriptor is looked up by its core's tick and by who reads its events.
    for (core, name) in programs[0].cores.ids().zip(CORES) {
        line(&format!(
            "        .section .rodata.near.{name}.programs, \"a\"\n        .balign 4"
        ));
        let has = Descriptor {
            split,
            sound: channels(programs) > 0,
            lines: empties(programs, setup),
        };
        for again in times {
            for (number, program) in programs.iter().enumerate() {
                let label = format!("program{number}_core{core}{again}");
                line(&descriptor(&label, program.core(core), (number, core), has));
            }
        }
        // While sensors are tuned, what belongs to a program is the first one's.
        if setup.tuning.is_some() {
            let first = programs[0].core(core);
            line(&descriptor(
                &format!("tuning_{name}"),
                first,
                (0, core),
                has,
            ));
        }
    }
    line(&readers(programs, instruments, split));
    text
}

/// What the readers of all programs' events know, and velocities: looked up by core 1 alone.
fn readers(programs: &[ProgramCode], instruments: &[Instrument], split: bool) -> String {
    let mut text =
        String::from("        .section .rodata.core1.tables, \"a\"\n        .balign 4\n");
    let mut line = |words: &str| {
        let _ = writeln!(text, "{words}");
    };
    for (number, program) in programs.iter().enumerate() {
        let readers = Readers {
            program,
            number,
            instruments,
            split,
        };
        for (core, code) in program.cores.enumerated() {
            for at in 0..code.zones.len() {
                line(&readers.reader(core, at));
            }
        }
        for (zone, of) in (0..).map(ZoneId).zip(&program.zones) {
            let midi = instruments[of.instrument.index()].midi;
            line(&format!("{}:", velocities_name(number, zone)));
            let tables = [Some(&midi.velocities), midi.release_velocities.as_ref()];
            for row in tables.iter().flatten().flat_map(|own| own.table.chunks(16)) {
                let row: Vec<String> = row.iter().map(u16::to_string).collect();
                line(&format!("        .short  {}", row.join(", ")));
            }
        }
        // Another program's readers are words.
        line("        .balign 4");
    }
    text
}

/// The words of all live parameters, program by program and zone by zone: where they are on core 0
/// and core 1, or on the only core, their lowest and highest values.
fn live_parameters(programs: &[ProgramCode], instruments: &[Instrument]) -> Vec<String> {
    let mut all = Vec::new();
    for program in programs {
        for (zone, of) in (0..).map(ZoneId).zip(&program.zones) {
            let own: Vec<&ZoneCode> = program
                .zones()
                .filter(|code| code.of.zone == zone)
                .collect();
            let on = |core: u32| own.iter().find(|code| code.of.core == CoreId(core));
            let words = match program.cores.len() {
                1 => [on(0); 2],
                _ => [on(0), on(1)],
            };
            let kernel = &instruments[of.instrument.index()].modes.kernel;
            for (index, live) in kernel.lives.iter().enumerate() {
                let cut = program.cores.iter().find_map(|core| core.cut.as_ref());
                let at = |code: &ZoneCode| {
                    if let Some((name, offset)) = cut.and_then(|cut| cut.live(code, index)) {
                        return format!("{name}_state + {offset}");
                    }
                    let offset = code.layout().live_param(index).unwrap_or(0);
                    format!("{}_state + {offset}", code.name)
                };
                let [first, second] =
                    words.map(|code| code.map_or("0".to_string(), |code| at(code)));
                let [low, high] = [live.range.low, live.range.high];
                all.push(format!(
                    "        .word   {first}, {second}\n        .word   {low}, {high}         @ {}",
                    live.name
                ));
            }
        }
    }
    all
}

/// What a descriptor has.
#[derive(Debug, Clone, Copy)]
struct Descriptor {
    /// A table of records in place of where the first one is.
    split: bool,
    /// The table of samples.
    sound: bool,
    /// The table of lines.
    lines: bool,
}

fn descriptor(
    label: &str,
    code: &CoreCode,
    (number, core): (usize, CoreId),
    has: Descriptor,
) -> String {
    let (name, layout) = (&code.name, code.zones[0].layout());
    let places = if has.split {
        format!("{name}_records, 0, 0")
    } else {
        let (gains, records) = (layout.gain(0).unwrap_or(4), layout.record(0));
        let end = layout.record(code.zones[0].keys());
        format!("{name}_state + {gains}, {name}_state + {records}, {name}_state + {end}")
    };
    format!(
        "        .global {label}
{label}: .word {block}, {name}_state, {name}_init, {name}_tick, {name}_begin
        .word   {places}
        .word   {reader}{sound}{lines}",
        block = CORES[core.index()],
        reader = reader_name(number, core, 0),
        sound = match has.sound {
            true => format!(", {}", sound_table_name(number, core.index())),
            false if has.lines => ", 0".to_string(),
            false => String::new(),
        },
        lines = match has.lines {
            true => format!(", {}", lines_table_name(number, core.index())),
            false => String::new(),
        },
    )
}

fn reader_name(number: usize, core: CoreId, zone: usize) -> String {
    let of_core = format!("reader{number}_core{core}");
    if zone == 0 {
        of_core
    } else {
        zone_name(&of_core, zone)
    }
}

fn velocities_name(number: usize, zone: ZoneId) -> String {
    let of_program = format!("velocities{number}");
    if zone == ZoneId(0) {
        of_program
    } else {
        zone_name(&of_program, zone.index())
    }
}

/// What the readers of a program's events know.
struct Readers<'a> {
    program: &'a ProgramCode,
    number: usize,
    instruments: &'a [Instrument<'a>],
    /// Whether a core may have several zones: then each reader says which follows.
    split: bool,
}

impl Readers<'_> {
    /// What the reader of a core's events knows of one of its zones.
    fn reader(&self, core: CoreId, at: usize) -> String {
        let zones = &self.program.core(core).zones;
        let (zone, number) = (&zones[at], self.number);
        let instrument = &self.instruments[self.program.instrument_of(zone).index()];
        let (kernel, midi, name) = (&instrument.modes.kernel, instrument.midi, &zone.name);
        // Without events nobody looks for them: the ring's head stays where its tail is.
        let (events, event_bytes, mask) = match zone.layout().events() {
            Some(ring) => (format!("{name}_events"), ring.event, ring.bytes - 1),
            None => ("0".to_string(), 0, 0),
        };
        let none = kernel.events.len() as u32;
        let event = |index: Option<u32>| index.unwrap_or(none);
        let next = match (self.split, at + 1 < zones.len()) {
            (false, _) => String::new(),
            (true, false) => ", 0".to_string(),
            (true, true) => format!(", {}", reader_name(number, core, at + 1)),
        };
        let velocities = velocities_name(number, zone.of.zone);
        let of_release = match &midi.release_velocities {
            None => "0, 0".to_string(),
            Some(own) => {
                let behind = 2 * midi.velocities.table.len();
                format!("{}, {velocities} + {behind}", own.speed_shift)
            }
        };
        format!(
            "{label}: .word {name}_state, {events}
        .word   {event_bytes}, {note}, {release}, {shift}, {velocities}, {mask}, {of_release}{next}",
            label = reader_name(number, core, at),
            note = event(midi.note),
            release = event(midi.release),
            shift = midi.velocities.speed_shift,
        )
    }
}
