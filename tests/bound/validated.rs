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
use whippen_compiler::validate::{Code, Question, Report, Verdict, validate, validate_mode};
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
const QUICK_OF_M0PLUS: [&str; 6] = [
    "virtual_spring",
    "baker",
    "two_body",
    "hammond",
    "harpsichord",
    "clavichord",
];

#[test]
fn validated_modes_of_a_cortex_m0plus() {
    insta::assert_snapshot!(reports("rp2040", |name| QUICK_OF_M0PLUS.contains(&name)));
}

/// The instruction that does nothing.
const NOP: u16 = 0xbf00;

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
        return is_possible.then(|| ("left out", vec![NOP; halves as usize]));
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

/// Where faults are put: the code of which keys or part, or the entry of their tick.
#[derive(Clone, Copy)]
struct Target {
    board: &'static str,
    file: &'static str,
    code: &'static str,
    is_entry: bool,
    /// How many of a hundred.
    share: usize,
}

const fn modes(file: &'static str, code: &'static str, share: usize) -> Target {
    Target {
        board: "rp2350",
        file,
        code,
        is_entry: false,
        share,
    }
}

/// Besides plain instruments one that reads a delay line at an index, exact quotients in the entry
/// and in a part, and quotients for searches.
const TARGETS: [Target; 8] = [
    modes("hammond.whip", "core0", 30),
    modes("celesta.whip", "core0", 30),
    modes("harpsichord.whip", "core0", 30),
    modes("clavichord-heard.whip", "core0", 5),
    Target {
        is_entry: true,
        ..modes("snap-dome.whip", "core0", 3)
    },
    Target {
        board: "rp2040",
        ..modes("harpsichord.whip", "core0", 20)
    },
    modes("keytar.whip", "core1_part0", 1),
    modes("rubbed-mouse.whip", "core0_part1", 1),
];

/// How many of the targets take little time.
const QUICK: usize = 6;

/// What became of faults.
#[derive(Default)]
struct Told {
    kinds: BTreeMap<&'static str, usize>,
    /// How many are refuted with numbers.
    refuted: usize,
    /// Those that are validated all the same.
    survivors: String,
}

impl Told {
    fn line(&self) -> String {
        let all: usize = self.kinds.values().sum();
        let kinds = self.kinds.iter().map(|(what, n)| format!("{n} {what}"));
        let kinds: Vec<String> = kinds.collect();
        let (kinds, refuted) = (kinds.join(", "), self.refuted);
        format!("{all} faults, {refuted} refuted with numbers: {kinds}")
    }
}

/// The verdict on the code that has a fault: the worst.
fn judge(question: &Question, mode: Option<ModeId>) -> Verdict {
    let Some(mode) = mode else {
        let Report {
            entry,
            shared,
            tables,
            modes,
        } = validate(question);
        let mut all = vec![entry, tables];
        all.extend(shared.into_iter().chain(modes));
        let is_refuted = |verdict: &Verdict| matches!(verdict, Verdict::Refuted { .. });
        let worst = all.iter().position(is_refuted);
        let worst = worst.or_else(|| all.iter().position(|own| !own.is_validated()));
        return all.swap_remove(worst.unwrap_or(0));
    };
    validate_mode(question, mode)
}

/// Puts faults into an image.
fn with_faults(built: &Built, target: Target, count: usize, rng: &mut Rng) -> Told {
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
    let code = code_of(&built.whole);
    let all = questions(&built.whole, &instruments);
    let asked = all.iter().find(|asked| asked.name == target.code);
    let asked: &Asked = asked.expect("the image has that code");
    let question = asked.question(&built.whole, &code);
    let arch = built.whole.image.arch;
    let ids: Vec<ModeId> = asked.modes().modes.ids().collect();
    let symbols = built.whole.image.symbols.iter();
    let begins: Vec<u32> = symbols.map(|symbol| symbol.address).collect();
    let mut told = Told::default();
    let mut left = count;
    while left > 0 {
        let mode = (!target.is_entry).then(|| rng.pick(&ids));
        let from = mode.map_or(question.symbols.tick, |mode| asked.code_of_mode(mode));
        let to = begins.iter().filter(|at| **at > from).min().copied();
        let placed = rng.pick(&instructions(&code, arch, from, to.unwrap_or(from)));
        let Some((what, words)) = fault(rng, &code, arch, placed) else {
            continue;
        };
        let mut faulty = code.clone();
        for (at, word) in (placed.0..).step_by(2).zip(&words) {
            faulty.put(at, *word);
        }
        left -= 1;
        *told.kinds.entry(what).or_default() += 1;
        let question = Question {
            code: &faulty,
            ..question.clone()
        };
        match judge(&question, mode) {
            Verdict::Refuted { .. } => told.refuted += 1,
            Verdict::Unproven { .. } => {}
            Verdict::Validated { .. } if is_commuted(&code, &faulty, arch, placed) => {}
            Verdict::Validated { .. } => {
                let second = words.get(1).copied().unwrap_or(0);
                let now = match decode(words[0], second, arch, placed.1) {
                    Ok(inst) => inst.to_string(),
                    Err(_) => "no instruction".to_string(),
                };
                let whose = mode.map_or("entry".to_string(), |mode| format!("mode {mode}"));
                let (offset, was) = (placed.0 - from, placed.2);
                let _ = writeln!(
                    told.survivors,
                    "  {whose} + {offset:#x}: {what}: {was} -> {now}"
                );
            }
        }
    }
    told
}

fn built_of(file: &str, board: &str) -> Built {
    let compiled = common::instruments(file, &[]).remove(0);
    built(&compiled, board).expect("it has an image")
}

#[test]
fn faults_are_not_validated() {
    let wanted = whippen_need::asked("WHIPPEN_FAULTS");
    let count: usize = wanted.unwrap_or(240);
    let mut text = String::new();
    let mut rng = Rng::new(7);
    let targets = match wanted {
        Some(_) => &TARGETS[..],
        None => &TARGETS[..QUICK],
    };
    for target in targets.iter().copied() {
        let built = built_of(target.file, target.board);
        let told = with_faults(&built, target, count * target.share / 100, &mut rng);
        let (file, line, survivors) = (target.file, told.line(), told.survivors);
        let told = format!("{file} on {}: {line}\n{survivors}", target.board);
        if wanted.is_some() {
            print!("{told}");
        }
        text += &told;
    }
    if wanted.is_some() {
        return;
    }
    insta::assert_snapshot!(text);
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
    let placed = instructions(&code, arch, from, behind.min().expect("there is more"));
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
        ("stm32f4", "validated: 2 of 2 modes"),
        ("rp2040", "validated: 4 of 4 modes"),
    ] {
        let built = built(&compiled, board).expect("it has an image");
        let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&built.instrument));
        let told = validate_image(&built.whole, &instruments).to_string();
        assert_eq!(told, words, "{board}");
    }
}
