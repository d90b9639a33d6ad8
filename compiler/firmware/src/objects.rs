//! The objects of a firmware: its texts, assembled with the constants of programs, keyboard and
//! board; the frame of a tick once for each core, under that core's names.

use std::collections::BTreeMap;
use std::sync::Arc;

use whippen_arm::asm::{AsmError, Source, assemble};
use whippen_arm::image::{Hint, Object};
use whippen_deterministic::{Memo, parallel};
use whippen_isa::Arch;

use super::boards::{Support, frame, shared};
use super::code::{ProgramCode, begins_later, is_split};
use super::constants::constants;
use super::emptying::{self, empties};
use super::image::has_helper;
use super::ports::Guards;
use super::{CORES, FirmwareError, Instrument, Setup, drive_offset_bytes, keys_name};
use super::{bench, columns, knob, monitor, parts, ports, sound, tables, zones};

/// The objects of a firmware, to be linked with those of the keys of all programs. The image begins
/// at `reset`, with the first program.
///
/// # Errors
/// Programs, keys, records or motor are out of range; a text of the board is wrong.
pub fn objects(
    programs: &[ProgramCode],
    instruments: &[Instrument],
    setup: &Setup,
    board: &Support,
) -> Result<Vec<Object>, FirmwareError> {
    let constants = constants(programs, setup, board)?;
    let called = Called {
        programs: programs.len(),
        begins: begins_later(programs, setup),
        empties: empties(programs, setup),
        tunes: setup.tuning.is_some(),
    };
    let mut tables = tables(programs, instruments, setup, board);
    let period = setup.rate_hz.cycles_min(board.board.clock_hz);
    for core in programs.iter().flat_map(|program| &program.cores) {
        let calls = |cut| parts::as_assembly(core, cut, period, setup.words_of(1));
        tables.extend(core.cut.iter().flat_map(calls));
    }
    if setup.guards() == Guards::Ports {
        let distance = drive_offset_bytes(setup.words_of(1));
        tables.push(ports::table_as_assembly(setup, distance)?);
    }
    let cores = setup.keys.len();
    let started = cores + usize::from(has_helper(programs));
    let monitored = setup.monitor.is_some();
    let alone = shared(board, started, monitored).chain([board.tick]);
    let mut texts: Vec<(Vec<Source>, Option<usize>)> =
        alone.map(|source| (vec![source], None)).collect();
    let start = texts.len() - 1;
    let guards = setup.guards();
    texts.extend((0..cores).map(|core| (frame(board, guards, monitored), Some(core))));
    let table = |text| Source {
        name: "tables",
        text,
    };
    texts.extend(tables.iter().map(|text| (vec![table(text)], None)));
    let all = parallel::map(texts, |(sources, core)| {
        let Some(core) = core else {
            return assembled(&sources, &constants, board.board.arch);
        };
        let mut own = constants.clone();
        own.extend(frame_constants(setup, board, core));
        let frame = assembled(&sources, &own, board.board.arch)?;
        Ok(frame_of_core(frame, core, called))
    });
    let mut objects = all.into_iter().collect::<Result<Vec<Object>, AsmError>>()?;
    if has_helper(programs) {
        let sections = objects.iter_mut().flat_map(|object| &mut object.sections);
        sections.for_each(|section| section.name = name_with_helper(&section.name));
    }
    let frame = objects[start]
        .sections
        .iter_mut()
        .filter(|section| section.name == ".text.frame");
    frame.for_each(|section| section.name = ".text.start.board".into());
    Ok(objects)
}

/// Texts of a process that are kept assembled: of some boards and programs.
static ASSEMBLED: Memo<Object> = Memo::new(128);

/// Texts, assembled: most are the same for any number of keys.
fn assembled(
    sources: &[Source],
    constants: &BTreeMap<String, i64>,
    arch: Arch,
) -> Result<Object, AsmError> {
    // A text knows no constant but those that it names.
    let is_named = |name: &String| sources.iter().any(|source| source.text.contains(name));
    let named = constants.iter().filter(|(name, _)| is_named(name));
    let named = named.map(|(name, value)| (name.clone(), *value)).collect();
    let object =
        ASSEMBLED.get_or_make(&(sources, &named, arch), || assemble(sources, &named, arch));
    object.map(Arc::unwrap_or_clone)
}

/// What a section is called where core 1 only helps: core 0 sends MIDI then, so that is none of
/// core 1's.
fn name_with_helper(section: &str) -> String {
    let of_midi = section.contains(".core1.firmware") || section.ends_with(".core1.midi");
    match of_midi {
        true => section.replacen(".core1", "", 1),
        false => section.to_string(),
    }
}

/// The constants of a core's frame besides the [`constants`] of all texts.
pub fn frame_constants(setup: &Setup, board: &Support, core: usize) -> BTreeMap<String, i64> {
    let keys = setup.keys[core];
    let words = setup.words_of(keys);
    let all = [
        ("KEYS", keys),
        ("WORDS", words),
        ("DISTANCE", drive_offset_bytes(words)),
        ("STACK", board.board.stacks[core]),
        ("CORE", core as u32),
    ];
    let of_columns = columns::frame_constants(board.board, core);
    all.into_iter()
        .chain(of_columns)
        .map(|(name, value)| (name.to_string(), value.into()))
        .collect()
}

/// The texts of a firmware as they are assembled, those of a frame together; a frame has
/// [`frame_constants`] besides the [`constants`].
pub fn sources<'a>(board: &Support<'a>, setup: &Setup) -> Vec<Vec<Source<'a>>> {
    let monitored = setup.monitor.is_some();
    shared(board, setup.keys.len(), monitored)
        .map(|source| vec![source])
        .chain([frame(board, setup.guards(), monitored)])
        .collect()
}

/// The tables of programs, those of sensors that are tuned, of a knob, a bench or columns, and the
/// calls of zones where some core has several, as assembly.
fn tables(
    programs: &[ProgramCode],
    instruments: &[Instrument],
    setup: &Setup,
    board: &Support,
) -> Vec<String> {
    let tuning = setup.tuning.as_ref();
    let mut texts = vec![tables::assembly(programs, instruments, setup)];
    if empties(programs, setup) {
        for (number, program) in programs.iter().enumerate() {
            let of_core = |core| emptying::table_as_assembly(core, number);
            texts.extend(program.cores.iter().map(of_core));
        }
    }
    if setup.monitor.is_some() {
        texts.push(monitor::tables_as_assembly(
            programs,
            instruments,
            setup,
            board,
        ));
    }
    texts.extend(tuning.map(|tuning| tuning.tables_as_assembly(&setup.keys)));
    texts.extend(board.board.knob.iter().map(knob::tables_as_assembly));
    let keys = setup.keys.iter().sum();
    let of_bench = |own| bench::tables_as_assembly(own, keys);
    texts.extend(board.board.bench.iter().map(of_bench));
    let of_columns = board.board.columns.iter();
    texts.extend(of_columns.map(|own| columns::tables_as_assembly(own, &setup.keys)));
    let channels = sound::channels(programs);
    if channels > 0 {
        for (number, program) in programs.iter().enumerate() {
            let of_core = |core| sound::table_as_assembly(core, number, channels);
            texts.extend(program.cores.iter().map(of_core));
        }
    }
    if !is_split(programs) {
        return texts;
    }
    for core in programs.iter().flat_map(|program| &program.cores) {
        texts.push(zones::records_as_assembly(core));
        texts.extend(core.is_split().then(|| zones::calls_as_assembly(core)));
    }
    texts
}

/// The frame of one core: its names and sections say so, and nobody else sees what is in it but the
/// tick.
fn frame_of_core(mut object: Object, core: usize, called: Called) -> Object {
    for section in &mut object.sections {
        let own = format!(".{}.frame", CORES[core]);
        section.name = section.name.replace(".frame", &own);
        for fixup in &mut section.fixups {
            fixup.symbol = symbol_of_core(&fixup.symbol, core);
        }
        for hint in &mut section.hints {
            if let Hint::Targets { symbols, .. } = hint {
                let all = symbols.iter();
                *symbols = all
                    .flat_map(|symbol| targets_of_core(symbol, core, called))
                    .collect();
            }
        }
    }
    for symbol in &mut object.symbols {
        symbol.global &= symbol.section.is_none() || SEEN.contains(&symbol.name.as_str());
        symbol.name = symbol_of_core(&symbol.name, core);
    }
    object
}

/// Symbols of a frame that others see.
const SEEN: &[&str] = &["tick", "exceptions", "linearise"];

/// What a symbol of the frame's texts is called on a core.
fn symbol_of_core(symbol: &str, core: usize) -> String {
    match symbol {
        "tick" | "linearise" | "tuning" => format!("{symbol}_{}", CORES[core]),
        "block" => CORES[core].to_string(),
        "entry" => ["reset", "core1_start"][core].to_string(),
        "exceptions" => format!("vectors{core}"),
        "guards" | "ledger" | "sound" | "tuned" | "curve" | "watched" | "captured" => {
            format!("{symbol}{core}")
        }
        other => other.to_string(),
    }
}

/// What the frame may call in place of the keys.
#[derive(Debug, Clone, Copy)]
struct Called {
    programs: usize,
    /// What begins a program after the start.
    begins: bool,
    /// What empties its lines.
    empties: bool,
    /// What tunes sensors.
    tunes: bool,
}

/// Where an indirect branch of the frame may go on a core.
fn targets_of_core(symbol: &str, core: usize, called: Called) -> Vec<String> {
    let of_all = |what: &str| -> Vec<String> {
        let name = |program| format!("{}_{what}", keys_name(core, program));
        (0..called.programs).map(name).collect()
    };
    match symbol {
        "keys_tick" => of_all("tick"),
        "keys_begin" => of_all("begin"),
        "beginning" if !called.begins => Vec::new(),
        "emptying" if !called.empties => Vec::new(),
        "watch" if !called.tunes => Vec::new(),
        other => vec![symbol_of_core(other, core)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_of_the_constants_that_a_text_names() {
        let text =
            "    .section .rodata.keys\n    .word KEYS + 1\n    .rept WORDS\n    nop\n    .endr\n";
        let of = |[keys, words, other]: [i64; 3]| {
            let constants = [("KEYS", keys), ("WORDS", words), ("OTHER", other)];
            let constants = constants.map(|(name, value)| (name.to_string(), value));
            let (sources, constants) = ([Source { name: "keys", text }], constants.into());
            let kept = assembled(&sources, &constants, Arch::V8M);
            assert_eq!(kept, assemble(&sources, &constants, Arch::V8M));
            kept.expect("assembly")
        };
        assert_eq!(of([3, 2, 1]), of([3, 2, 9]));
        assert_ne!(of([3, 2, 1]), of([4, 2, 1]));
        assert_ne!(of([3, 2, 1]), of([3, 5, 1]));
    }
}
