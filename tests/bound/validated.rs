//! Translation validation of shipped images: what is validated, and that faults in the bytes are
//! not.
//!
//! `WHIPPEN_FAULTS=N` puts in N faults instead of some hundred.

use std::collections::BTreeMap;
use std::fmt::Write;

use whippen_compiler::Rng;
use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::{INSTRUCTIONS, ModeId};
use whippen_compiler::pipeline::{self, Compiled, compile, unobserved};
use whippen_compiler::validate::{Code, Question, Report, Verdict, validate_mode};
use whippen_compiler::validation::{Asked, code_of, questions, validate_image};
use whippen_isa::{Arch, Code as Halfwords, Inst, ItState, Op, decode, is_wide};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup_to_bound};

use crate::common;

/// The image of a few keys of a bundled instrument, and what it is made of.
struct Built {
    instrument: ImageInstrument,
    whole: FirmwareImage,
}

fn built(model: &Compiled, board_name: &str) -> Result<Built, String> {
    let device = Device::of(&model.model);
    let compiled = compile(model.model.clone(), device.scales(), false);
    let compiled = compiled.map_err(|e| format!("{e:?}"))?;
    let board = board::bundled(board_name).ok_or("no such board")?;
    let keys = if compiled.model.is_of_key() { 2 } else { 1 };
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
    let mut text = format!("{validated} of {} modes\n", report.modes.len());
    let modes = report.modes.iter().enumerate();
    let modes = modes.map(|(at, mode)| (format!("mode {at}"), mode));
    let shared = report.shared.iter().enumerate();
    let shared = shared.map(|(at, word)| (format!("shared word {at}"), word));
    let others = [("entry", &report.entry), ("tables", &report.tables)];
    let others = others.map(|(what, verdict)| (what.to_string(), verdict));
    for (what, verdict) in others.into_iter().chain(shared).chain(modes) {
        if !verdict.is_validated() {
            let _ = writeln!(text, "  {what}: {verdict}");
        }
    }
    text
}

fn reports(board_name: &str) -> String {
    let mut text = String::new();
    for compiled in common::all() {
        let name = &compiled.model.name;
        match built(&compiled, board_name) {
            Err(why) => {
                let _ = writeln!(text, "{name}: no image: {why}");
            }
            Ok(built) => {
                let instruments = std::slice::from_ref(&built.instrument);
                let instruments = ImageInstrument::borrow_all(instruments);
                for zone in validate_image(&built.whole, &instruments).zones {
                    let _ = write!(text, "{name} {}: {}", zone.name, told(&zone.report));
                }
            }
        }
    }
    text
}

#[test]
fn validated_modes_of_a_cortex_m33() {
    insta::assert_snapshot!(reports("rp2350"));
}

/// An instruction where it stands.
type Placed = (u32, ItState, Inst);

/// The instructions of a piece of code.
fn instructions(code: &Code, arch: Arch, from: u32, to: u32) -> Vec<Placed> {
    let (mut at, mut it) = (from, ItState::OUTSIDE);
    let mut all = Vec::new();
    while let Some(first) = code.half(at).filter(|_| at < to) {
        let second = code.half(at + 2).filter(|_| is_wide(first)).unwrap_or(0);
        let Ok(inst) = decode(first, second, arch, it) else {
            break;
        };
        all.push((at, it, inst));
        it = match inst.op() {
            Op::IT => ItState::after_it((inst.imm >> 4) as u8, (inst.imm & 15) as u8)
                .expect("it was decoded"),
            _ => it.advance(),
        };
        at += inst.size();
    }
    let last = all.iter().rposition(|(.., inst)| inst.op() == Op::BX);
    all.truncate(last.map_or(0, |last| last + 1));
    all
}

/// What is put into an instruction, as halfwords; none where nothing would be other, or where its
/// length would.
fn fault(
    rng: &mut Rng,
    code: &Code,
    arch: Arch,
    placed: Placed,
) -> Option<(&'static str, Vec<u16>)> {
    let (at, it, inst) = placed;
    let halves = inst.size() / 2;
    let kind = rng.below(10);
    if kind == 8 {
        let is_possible = halves == 1 || !it.inside();
        return is_possible.then(|| ("left out", vec![0xbf00; halves as usize]));
    }
    if kind == 9 {
        let mut words: Vec<u16> = (0..halves)
            .filter_map(|half| code.half(at + 2 * half))
            .collect();
        let half = rng.below(halves.into()) as usize;
        words[half] ^= 1 << rng.below(16);
        return (is_wide(words[0]) == (halves == 2)).then_some(("a bit", words));
    }
    let (what, faulty) = faulty_operands(kind, inst)?;
    let words = match faulty.encode(arch).ok()? {
        Halfwords::Narrow(first) => vec![first],
        Halfwords::Wide(first, second) => vec![first, second],
    };
    let is_other = (0..)
        .step_by(2)
        .zip(&words)
        .any(|(by, half)| code.half(at + by) != Some(*half));
    (is_other && words.len() as u32 == halves).then_some((what, words))
}

fn faulty_operands(kind: u64, inst: Inst) -> Option<(&'static str, Inst)> {
    let mut faulty = inst;
    let next = |register: u8| (register + 1) & 7;
    let what = match kind {
        0 => {
            std::mem::swap(&mut faulty.n, &mut faulty.m);
            "swapped operands"
        }
        1 | 2 => {
            let by = [1, 4][kind as usize - 1];
            faulty.imm = faulty.imm.wrapping_add(by);
            ["a constant + 1", "a constant + 4"][kind as usize - 1]
        }
        3 => {
            faulty.amount = (faulty.amount + 1) & 31;
            "a shift + 1"
        }
        4 => {
            match inst.op() {
                Op::IT => faulty.imm ^= 0x10,
                _ => faulty.cond = faulty.cond?.invert(),
            }
            "the opposite condition"
        }
        5 => {
            faulty.d = next(faulty.d);
            "another result"
        }
        6 => {
            faulty.n = next(faulty.n);
            "another operand"
        }
        _ => {
            faulty.t = next(faulty.t);
            "another register of memory"
        }
    };
    Some((what, faulty))
}

/// Why the fault is none: a product or a sum of the same two operands.
fn is_commuted(code: &Code, faulty: &Code, arch: Arch, (at, it, inst): Placed) -> bool {
    let read = |code: &Code| {
        let first = code.half(at)?;
        decode(first, code.half(at + 2).unwrap_or(0), arch, it).ok()
    };
    let (Some(one), Some(other)) = (read(code), read(faulty)) else {
        return false;
    };
    let commutes = matches!(
        inst.op(),
        Op::ADD_register
            | Op::MUL
            | Op::MLA
            | Op::MLS
            | Op::SMMUL
            | Op::SMMLA
            | Op::SMULL
            | Op::SMLAL
    );
    let swapped = Inst {
        n: other.m,
        m: other.n,
        ..other
    };
    commutes && one.amount == 0 && swapped == one
}

/// Puts faults into the modes of an image; gives how many there were, and those that are validated
/// all the same.
fn survivors(
    built: &Built,
    count: usize,
    rng: &mut Rng,
) -> (BTreeMap<&'static str, usize>, String) {
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let code = code_of(&built.whole);
    let asked: &Asked = &questions(&built.whole, &instruments)[0];
    let question = asked.question(&built.whole, &code);
    let arch = built.whole.image.arch;
    let ids: Vec<ModeId> = asked.modes().modes.ids().collect();
    let symbols = built.whole.image.symbols.iter();
    let begins: Vec<u32> = symbols.map(|symbol| symbol.address).collect();
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    let mut text = String::new();
    let mut left = count;
    while left > 0 {
        let mode = rng.pick(&ids);
        let from = asked.code_of_mode(mode);
        let to = begins
            .iter()
            .filter(|at| **at > from)
            .min()
            .copied()
            .unwrap_or(from);
        let placed = rng.pick(&instructions(&code, arch, from, to));
        let Some((what, words)) = fault(rng, &code, arch, placed) else {
            continue;
        };
        let mut faulty = code.clone();
        for (at, word) in (placed.0..).step_by(2).zip(&words) {
            faulty.put(at, *word);
        }
        left -= 1;
        *kinds.entry(what).or_default() += 1;
        let question = Question {
            code: &faulty,
            ..question.clone()
        };
        let verdict = validate_mode(&question, mode);
        if matches!(verdict, Verdict::Refuted { .. }) {
            *kinds.entry("REFUTED").or_default() += 1;
        }
        if verdict.is_validated() && !is_commuted(&code, &faulty, arch, placed) {
            let second = words.get(1).copied().unwrap_or(0);
            let now = match decode(words[0], second, arch, placed.1) {
                Ok(inst) => inst.to_string(),
                Err(_) => "no instruction".to_string(),
            };
            let offset = placed.0 - from;
            let _ = writeln!(
                text,
                "  mode {mode} + {offset:#x}: {what}: {} -> {now}",
                placed.2
            );
        }
    }
    (kinds, text)
}

#[test]
fn faults_are_not_validated() {
    let wanted = std::env::var("WHIPPEN_FAULTS").ok();
    let count: usize = wanted
        .as_ref()
        .map_or(240, |n| n.parse().expect("a number"));
    let mut text = String::new();
    let mut rng = Rng::new(7);
    for file in ["hammond.whip", "celesta.whip", "harpsichord.whip"] {
        let compiled = common::instruments(file, &[]).remove(0);
        let built = built(&compiled, "rp2350").expect("it has an image");
        let (kinds, left) = survivors(&built, count / 3, &mut rng);
        let kinds: Vec<String> = kinds
            .iter()
            .map(|(what, n)| format!("{n} {what}"))
            .collect();
        let _ = write!(text, "{file}: {}\n{left}", kinds.join(", "));
    }
    if wanted.is_some() {
        return println!("{text}");
    }
    insta::assert_snapshot!(text);
}
