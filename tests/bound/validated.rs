//! Translation validation of shipped images: what is validated.

use std::fmt::Write;

use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::{INSTRUCTIONS, ModeId};
use whippen_compiler::pipeline::{self, Compiled, compile, unobserved};
use whippen_compiler::validate::{
    Report, Routine, Verdict, validate, validate_mode, validate_routine,
};
use whippen_compiler::validation::{code_of, questions, validate_image};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup_to_bound};

use crate::common;
use crate::faults::{NOP, Placed, code_of_key};

/// The image of a few keys of a bundled instrument, and what it is made of.
pub struct Built {
    pub instrument: ImageInstrument,
    pub whole: FirmwareImage,
}

fn built(model: &Compiled, board_name: &str) -> Result<Built, String> {
    built_with(model, board_name, 2)
}

/// With so many keys, where it has keys.
fn built_with(model: &Compiled, board_name: &str, keys: u32) -> Result<Built, String> {
    let device = Device::of(&model.model);
    let compiled = compile(model.model.clone(), device.scales(), false);
    let compiled = compiled.map_err(|e| format!("{e:?}"))?;
    let board = board::bundled(board_name).ok_or("no such board")?;
    let keys = if compiled.model.is_of_key() { keys } else { 1 };
    let setup = setup_to_bound(&compiled, &device, keys, board.cores, 21);
    let setup = setup.map_err(|e| format!("{e:?}"))?;
    let layout = Layout::of_one_instrument(&compiled.model.name, keys, 21);
    let instrument = ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved);
    let instrument = instrument.map_err(|e| format!("{e:?}"))?;
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
    let whole = pipeline::build(&layout, &instruments, &setup, &board, &mut unobserved);
    let whole = whole.map_err(|e| e.to_string())?;
    Ok(Built { instrument, whole })
}

/// A report in a few lines: how many modes, and whatever is unproven.
fn told(report: &Report) -> String {
    let validated = report
        .modes
        .iter()
        .filter(|mode| mode.is_validated())
        .count();
    let mut text = format!("{validated} of {} modes", report.modes.len());
    let routines = Routine::ALL.iter().zip(&report.routines);
    for (routine, _) in routines.clone().filter(|(_, own)| own.is_validated()) {
        let _ = write!(text, ", {routine}");
    }
    text.push('\n');
    let routines = routines.map(|(routine, own)| (routine.to_string(), own));
    let modes = report.modes.iter().enumerate();
    let modes = modes.map(|(at, mode)| (format!("mode {at}"), mode));
    let shared = report.shared.iter().enumerate();
    let shared = shared.map(|(at, word)| (format!("shared word {at}"), word));
    let others = [("entry", &report.entry), ("tables", &report.tables)];
    let others = others.map(|(what, verdict)| (what.to_string(), verdict));
    let all = others.into_iter().chain(shared).chain(modes);
    for (what, verdict) in all.chain(routines) {
        if !verdict.is_validated() {
            let _ = writeln!(text, "  {what}: {verdict}");
        }
    }
    text
}

/// Instruments whose parts are like those of others and take long.
const SLOW: [&str; 4] = ["grand_action", "rubbed_bank", "rubbed_pad", "keytar"];

fn reports(board_name: &str, is_asked: impl Fn(&str) -> bool) -> String {
    let mut text = String::new();
    let all = common::all().into_iter();
    for compiled in all.filter(|own| is_asked(&own.model.name)) {
        let name = &compiled.model.name;
        match built(&compiled, board_name) {
            Err(why) => {
                let _ = writeln!(text, "{name}: no image: {why}");
            }
            Ok(built) => {
                let instruments = std::slice::from_ref(&built.instrument);
                let instruments = ImageInstrument::borrow_all(instruments);
                let code = code_of(&built.whole);
                for asked in questions(&built.whole, &instruments) {
                    // Core 1 has the same keys.
                    if asked.name == "core1" {
                        continue;
                    }
                    let report = validate(&asked.question(&built.whole, &code));
                    let _ = write!(text, "{name} {}: {}", asked.name, told(&report));
                }
            }
        }
    }
    text
}

#[test]
fn validated_modes_of_a_cortex_m33() {
    insta::assert_snapshot!(reports("rp2350", |name| !SLOW.contains(&name)));
}

/// Instruments that are quickly validated on a core without long products.
const QUICK_OF_M0PLUS: [&str; 9] = [
    "snap_dome",
    "virtual_spring",
    "baker",
    "knob",
    "tracker_organ",
    "two_body",
    "hammond",
    "harpsichord",
    "clavichord",
];

#[test]
fn validated_modes_of_a_cortex_m0plus() {
    insta::assert_snapshot!(reports("rp2040", |name| QUICK_OF_M0PLUS.contains(&name)));
}

/// The image of the first instrument of a bundled file.
pub fn built_of(file: &str, board: &str) -> Built {
    built_of_keys(file, board, 2)
}

/// With so many keys.
pub fn built_of_keys(file: &str, board: &str, keys: u32) -> Built {
    let compiled = common::instruments(file, &[]).remove(0);
    built_with(&compiled, board, keys).expect("it has an image")
}

/// Whatever the number of keys: `init` goes round for each.
#[test]
fn routines_of_several_keys_are_validated() {
    for (board, keys) in [("rp2350", 7), ("rp2040", 4), ("stm32f4", 3)] {
        for file in ["hammond.whip", "snap-dome.whip", "harpsichord.whip"] {
            let built = built_of_keys(file, board, keys);
            let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
            let code = code_of(&built.whole);
            for asked in questions(&built.whole, &instruments) {
                let question = asked.question(&built.whole, &code);
                for routine in Routine::ALL {
                    let verdict = validate_routine(&question, routine);
                    let what = format!("{file}, {board}, {}, {routine}", asked.name);
                    assert!(verdict.is_validated(), "{what}: {verdict}");
                }
            }
        }
    }
}

/// `build` writes no image that is refuted.
#[test]
fn an_image_with_a_fault_is_refuted() {
    let mut built = built_of("hammond.whip", "rp2350");
    let code = code_of(&built.whole);
    let instrument = built.instrument.clone();
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
    assert_eq!(validate_image(&built.whole, &instruments).refuted(), None);
    let from = questions(&built.whole, &instruments)[0].code_of_mode(ModeId(0));
    let arch = built.whole.image.arch;
    let symbols = built.whole.image.symbols.iter();
    let behind = symbols.map(|symbol| symbol.address).filter(|at| *at > from);
    let placed = code_of_key(&code, arch, from, behind.min().expect("there is more"));
    let all = questions(&built.whole, &instruments);
    let is_missed = |(at, _, inst): &&Placed| {
        let mut faulty = code.clone();
        for half in 0..inst.size() / 2 {
            faulty.put(at + 2 * half, NOP);
        }
        let question = all[0].question(&built.whole, &faulty);
        matches!(validate_mode(&question, ModeId(0)), Verdict::Refuted { .. })
    };
    let (at, _, inst) = placed.iter().find(is_missed).expect("one is needed");
    let sections = &mut built.whole.image.sections;
    let own = sections.iter_mut().find_map(|section| {
        let offset = at.checked_sub(section.run)? as usize;
        section.bytes.get_mut(offset..offset + inst.size() as usize)
    });
    for half in own.expect("it is somewhere").chunks_mut(2) {
        half.copy_from_slice(&NOP.to_le_bytes());
    }
    let refuted = validate_image(&built.whole, &instruments).refuted();
    let why = refuted.expect("it is missed");
    assert!(why.starts_with("mode 0 of core0: "), "{why}");
}

#[test]
fn what_is_not_followed_is_said() {
    let compiled = common::instruments("hammond.whip", &[]).remove(0);
    for (board, words) in [
        ("stm32f4", "validated: 2 of 2 modes, 2 of 2 routines"),
        ("rp2040", "validated: 4 of 4 modes, 4 of 4 routines"),
    ] {
        let built = built(&compiled, board).expect("it has an image");
        let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
        let told = validate_image(&built.whole, &instruments).to_string();
        assert_eq!(told, words, "{board}");
    }
}

/// On each board, in a mode and in the tick's entry.
#[test]
fn roots_are_followed() {
    for board in ["rp2350", "rp2040", "stm32f4"] {
        let built = built_of("../tests/programs/roots.whip", board);
        let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
        let validation = validate_image(&built.whole, &instruments);
        assert_eq!(validation.not_validated().len(), 0, "{board}: {validation}");
    }
}
