//! The GNU assembler: our text becomes our bits, and what may not be written is refused.
//!
//! Its disassembler is not asked: it reads the instructions of every extension there ever was,
//! whatever the core. Without `arm-none-eabi-as` the tests say so and pass.

use crate::{assert_all_met, samples};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use whippen_isa::{Arch, Class, Cond, Encoding, Inst, ItRule, ItState, Op, Why, decode, is_wide};

/// One line of assembly: the instruction, and the word that it was read from.
struct Line {
    word: u32,
    inst: Inst,
}

/// What the assembler made of a line.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Verdict {
    Refused(String),
    /// The bits, and the instruction that they are.
    Bits(Vec<u8>, Option<Inst>),
}

/// A core as the assembler names it.
struct Core {
    arch: Arch,
    options: &'static [&'static str],
}

/// With the double-precision unit, because `VMOV.32 D0[0], R0` of the single-precision ones is only
/// known there.
const CORES: [Core; 3] = [
    Core {
        arch: Arch::V6M,
        options: &["-mcpu=cortex-m0plus"],
    },
    Core {
        arch: Arch::V7EM,
        options: &["-mcpu=cortex-m4", "-mfpu=fpv5-d16"],
    },
    Core {
        arch: Arch::V8M,
        options: &["-mcpu=cortex-m33", "-mfpu=fpv5-d16"],
    },
];

/// The units of the cores themselves.
const OWN_UNITS: [Core; 3] = [
    Core {
        arch: Arch::V6M,
        options: &["-mcpu=cortex-m0plus"],
    },
    Core {
        arch: Arch::V7EM,
        options: &["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"],
    },
    Core {
        arch: Arch::V8M,
        options: &["-mcpu=cortex-m33", "-mfpu=fpv5-sp-d16"],
    },
];

fn is_installed() -> bool {
    whippen_need::tools(&["arm-none-eabi-as", "arm-none-eabi-objcopy"])
}

/// The instruction with what it needs around: an IT before it, or after an IT the block it opens.
fn source(inst: &Inst) -> String {
    if inst.op() == Op::IT {
        let followers: String = block_of(inst).iter().map(|c| format!("; nop{c}")).collect();
        return format!("{inst}{followers}\n\n");
    }
    match inst
        .cond
        .filter(|_| inst.encoding.it_rule() != ItRule::Never)
    {
        Some(cond) => format!("it {}\n{inst}\n", cond.name()),
        None => format!("{inst}\n\n"),
    }
}

/// The conditions of an IT instruction's block.
fn block_of(it: &Inst) -> Vec<Cond> {
    let mut state = it.it_behind(ItState::OUTSIDE).unwrap_or_default();
    let mut block = Vec::new();
    while let Some(cond) = state.cond() {
        block.push(cond);
        state = state.advance();
    }
    block
}

/// Messages of the assembler by the index of the line they are about.
type Messages = BTreeMap<usize, String>;

/// The messages of one kind, `Error` or `Warning`, in the assembler's output. A line of ours is two
/// of its source.
fn messages(output: &str, kind: &str) -> Messages {
    let of_kind = output.lines().filter_map(|message| {
        let mut parts = message.splitn(4, ':').skip(1);
        let number: usize = parts.next()?.trim().parse().ok()?;
        (parts.next()?.trim() == kind).then_some(())?;
        Some(((number - 3) / 2, parts.next()?.trim().to_string()))
    });
    of_kind.collect()
}

/// What one run gives: errors, warnings, and the code if there are no errors.
struct Output {
    errors: Messages,
    warnings: Messages,
    code: Vec<u8>,
}

/// Runs the assembler over the lines without those in `skip`.
fn run(name: &str, core: &Core, lines: &[Line], skip: &Messages) -> Output {
    let path = |extension: &str| {
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.{extension}"))
    };
    let mut text = String::from(".syntax unified\n.thumb\n");
    for (i, line) in lines.iter().enumerate() {
        text += &if skip.contains_key(&i) {
            "\n\n".to_string()
        } else {
            source(&line.inst)
        };
    }
    std::fs::write(path("s"), text).expect("the target directory can be written");
    let mut assembler = Command::new("arm-none-eabi-as");
    let output = assembler
        .args(core.options)
        .arg("-o")
        .arg(path("o"))
        .arg(path("s"))
        .output();
    let text = String::from_utf8_lossy(&output.expect("the assembler runs").stderr).into_owned();
    let (errors, warnings) = (messages(&text, "Error"), messages(&text, "Warning"));
    if !errors.is_empty() {
        return Output {
            errors,
            warnings,
            code: Vec::new(),
        };
    }
    let copied = Command::new("arm-none-eabi-objcopy")
        .args(["-O", "binary"])
        .arg(path("o"))
        .arg(path("bin"))
        .status();
    assert!(copied.expect("objcopy runs").success());
    Output {
        errors,
        warnings,
        code: std::fs::read(path("bin")).expect("objcopy has written"),
    }
}

/// Assembles the lines for a core; also the warnings.
fn assemble(name: &str, core: &Core, lines: &[Line]) -> (Vec<Verdict>, Messages) {
    // Branch targets are only looked at when all else is right.
    let mut refused = Messages::new();
    let output = loop {
        let output = run(name, core, lines, &refused);
        if output.errors.is_empty() {
            break output;
        }
        // A refused instruction leaves its IT open for the next line, which must then be asked
        // again.
        let before = refused.len();
        let stray = |(i, message): (&usize, &String)| {
            message.contains("not allowed in IT block")
                && *i > 0
                && output.errors.contains_key(&(i - 1))
        };
        let own: Messages = output
            .errors
            .iter()
            .filter(|e| !stray(*e))
            .map(|e| (*e.0, e.1.clone()))
            .collect();
        refused.extend(own);
        assert!(
            refused.len() > before,
            "what is left after refusals assembles"
        );
    };
    let mut rest = output.code.as_slice();
    let mut take = |size: usize| {
        let (taken, after) = rest.split_at(size.min(rest.len()));
        rest = after;
        taken.to_vec()
    };
    let mut verdicts = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        if let Some(message) = refused.get(&i) {
            verdicts.push(Verdict::Refused(message.clone()));
            continue;
        }
        let cond = line
            .inst
            .cond
            .filter(|_| source(&line.inst).starts_with("it ") && line.inst.op() != Op::IT);
        take(if cond.is_some() { 2 } else { 0 });
        let mut code = take(2);
        let hw1 = u16::from_le_bytes([code[0], code[1]]);
        if is_wide(hw1) {
            code.extend(take(2));
        }
        if line.inst.op() == Op::IT {
            take(2 * block_of(&line.inst).len());
        }
        let hw2 = code
            .get(2..4)
            .map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
        let it = cond.map_or(ItState::OUTSIDE, |c| samples::it_block(c).1);
        verdicts.push(Verdict::Bits(code, decode(hw1, hw2, core.arch, it).ok()));
    }
    (verdicts, output.warnings)
}

/// Whether the bits are the word, or a no longer encoding of the same instruction with the same
/// operands.
fn is_same(line: &Line, bits: &[u8], read: Option<Inst>) -> bool {
    let other = |r: Inst| {
        r.size() <= line.inst.size()
            && Inst {
                encoding: r.encoding,
                ..line.inst
            } == r
    };
    bits == samples::bytes(line.word, line.inst.size()) || read.is_some_and(other)
}

/// What it assembles otherwise or refuses, and why we do not follow.
type Known = (&'static str, fn(&Line, Arch) -> bool);

const KNOWN: &[Known] = &[
    ("the offset #-0 loses its sign", |l, _| {
        l.inst.imm == 0 && !l.inst.add
    }),
    (
        "coprocessor 9 is taken for half precision, whose offsets count halfwords",
        |l, _| l.inst.class() == Class::Coprocessor && l.inst.a == 9,
    ),
    ("MRC2 to the flags is refused, though MRC is not", |l, _| {
        l.inst.op() == Op::MRC2_APSR
    }),
    ("a far BL is refused for v6-M, which has it", |l, arch| {
        l.inst.op() == Op::BL && arch == Arch::V6M
    }),
    ("NOP of v6-M is written as MOV R8, R8", |l, arch| {
        matches!(l.inst.op(), Op::NOP | Op::HINT) && arch == Arch::V6M
    }),
    ("UDF.W is refused for v6-M, which has it", |l, arch| {
        l.inst.op() == Op::UDF && arch == Arch::V6M
    }),
    (
        "PLDW is thought to need the multiprocessing extension",
        |l, _| l.inst.to_string().starts_with("pldw"),
    ),
];

#[test]
fn our_text_becomes_our_bits() {
    if !is_installed() {
        return;
    }
    let mut met = vec![false; KNOWN.len()];
    for core in &CORES {
        let encodings = Encoding::all().filter(|e| e.exists_in(core.arch));
        let lines = encodings
            .enumerate()
            .flat_map(|(seed, e)| samples::of_encoding(e, 300, 1000 + seed as u64));
        let in_arch = |(word, inst): (u32, Inst)| {
            // In a block of AL the assembler wants the suffix, which we leave out; ARMv6-M has no
            // blocks.
            let blocks = core.arch != Arch::V6M || inst.encoding.it_rule() == ItRule::Never;
            let writable = inst.cond.is_none_or(|c| c != Cond::AL && blocks);
            (writable && inst.encode(core.arch).is_ok()).then_some(Line { word, inst })
        };
        let lines: Vec<_> = lines.filter_map(in_arch).collect();
        let (mut known, mut unknown) = (
            BTreeMap::<&str, u32>::new(),
            BTreeMap::<String, String>::new(),
        );
        for (line, verdict) in lines
            .iter()
            .zip(assemble(&format!("bits-{:?}", core.arch), core, &lines).0)
        {
            match verdict {
                Verdict::Bits(bits, read) if is_same(line, &bits, read) => {}
                _ => match KNOWN.iter().position(|k| k.1(line, core.arch)) {
                    Some(k) => {
                        met[k] = true;
                        *known.entry(KNOWN[k].0).or_default() += 1;
                    }
                    None => {
                        let example = format!("{:08x} {}: {verdict:x?}", line.word, line.inst);
                        unknown.insert(line.inst.encoding.to_string(), example);
                    }
                },
            }
        }
        println!("{:?}: {} lines, of which {known:?}", core.arch, lines.len());
        assert!(unknown.is_empty(), "differ: {unknown:#?}");
    }
    assert_all_met(&met, KNOWN.iter().map(|k| k.0));
}

#[test]
fn what_a_core_lacks_is_refused() {
    if !is_installed() {
        return;
    }
    for core in &OWN_UNITS {
        // What has no syntax is accepted as data; the last three are given to every unit of M
        // class.
        let tolerated = [Op::HINT_memory, Op::VCVT_directed, Op::VMAXNM, Op::VMINNM];
        let has_syntax = |e: &Encoding| !tolerated.contains(&e.op());
        let encodings: Vec<_> = Encoding::all()
            .filter(|e| !e.exists_in(core.arch))
            .filter(has_syntax)
            .collect();
        let lines = encodings
            .iter()
            .enumerate()
            .flat_map(|(seed, e)| samples::of_encoding(*e, 40, 5000 + seed as u64));
        let plain =
            |(word, inst): (u32, Inst)| (inst.cond.is_none()).then_some(Line { word, inst });
        let lines: Vec<_> = lines.filter_map(plain).collect();
        let mut accepted = BTreeMap::<String, String>::new();
        for (line, verdict) in lines
            .iter()
            .zip(assemble(&format!("absent-{:?}", core.arch), core, &lines).0)
        {
            if let Verdict::Bits(bits, None) = verdict {
                accepted.insert(
                    line.inst.encoding.to_string(),
                    format!("{} {bits:x?}", line.inst),
                );
            }
        }
        println!(
            "{:?}: {} encodings absent, {} lines",
            core.arch,
            encodings.len(),
            lines.len()
        );
        assert!(
            accepted.is_empty(),
            "accepted for {:?}: {accepted:#?}",
            core.arch
        );
    }
}

/// What is UNPREDICTABLE and assembled all the same, bit for bit and without a warning.
type Tolerated = (&'static str, fn(&Inst, Why) -> bool);

const TOLERATED: &[Tolerated] = &[
    ("words without syntax", |i, _| i.op() == Op::HINT_memory),
    (
        "SP in the instructions that v8-M added, since v8-A allows it",
        |i, why| {
            let added = i.encoding.exists_in(Arch::V8M) && !i.encoding.exists_in(Arch::V7EM);
            added && why == Why::Sp
        },
    ),
    ("a long product with RdLo = RdHi", |i, why| {
        matches!(i.class(), Class::MultiplyLong | Class::MultiplyAddLong)
            && why == Why::SameRegister
    }),
    (
        "LDRD to the same register twice, STREX with Rd = Rt or Rd = Rn",
        |i, why| {
            matches!(i.op(), Op::LDRD_immediate | Op::LDRD_literal | Op::STREX)
                && why == Why::SameRegister
        },
    ),
    ("ADD PC, PC", |i, why| {
        i.op() == Op::ADD_register && why == Why::Pc
    }),
    ("a block of AL with an else", |i, _| i.op() == Op::IT),
];

#[test]
fn what_is_unpredictable_is_refused() {
    if !is_installed() {
        return;
    }
    let core = &CORES[2];
    let mut lines = Vec::new();
    let mut whys = Vec::new();
    for (seed, encoding) in Encoding::all().enumerate() {
        for (word, reading, why) in samples::unpredictable(encoding, 400, seed as u64) {
            lines.push(Line {
                word,
                inst: reading,
            });
            whys.push(why);
        }
    }
    let mut accepted = BTreeMap::<String, (u32, String)>::new();
    let mut met = vec![false; TOLERATED.len()];
    let (verdicts, warnings) = assemble("unpredictable", core, &lines);
    for (i, ((line, why), verdict)) in lines.iter().zip(whys).zip(verdicts).enumerate() {
        let bytes = samples::bytes(line.word, line.inst.size());
        let same = matches!(&verdict, Verdict::Bits(bits, _) if *bits == bytes);
        if !same || warnings.contains_key(&i) {
            continue;
        }
        if let Some(tolerated) = TOLERATED.iter().position(|t| t.1(&line.inst, why)) {
            met[tolerated] = true;
        } else {
            let entry = accepted
                .entry(format!("{} {why:?}", line.inst.encoding))
                .or_default();
            *entry = (entry.0 + 1, format!("{:08x} {}", line.word, line.inst));
        }
    }
    println!("{} lines", lines.len());
    assert!(accepted.is_empty(), "accepted: {accepted:#?}");
    assert_all_met(&met, TOLERATED.iter().map(|t| t.0));
}
