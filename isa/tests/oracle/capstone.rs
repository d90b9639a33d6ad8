//! Capstone: what decodes, and as what.

use crate::{assert_all_met, normal, samples};
use capstone::arch::arm::{ArchExtraMode, ArchMode};
use capstone::prelude::*;
use std::collections::BTreeMap;
use whippen_isa::{Arch, Class, Encoding, Inst, ItRule, ItState, NotDecoded, Op, decode, is_wide};

/// Where instructions are, so that branch targets can be told.
const ADDRESS: u32 = 0x1000;

/// Capstone for M class, with the instructions of v8 or without.
pub fn open(v8: bool) -> Capstone {
    let extra: &[ArchExtraMode] = if v8 {
        &[ArchExtraMode::MClass, ArchExtraMode::V8]
    } else {
        &[ArchExtraMode::MClass]
    };
    let builder = Capstone::new()
        .arm()
        .mode(ArchMode::Thumb)
        .extra_mode(extra.iter().copied());
    builder.build().expect("Capstone has Thumb for M class")
}

/// The text of the last of `count` instructions, if they decode.
fn ask(capstone: &Capstone, code: &[u8], count: usize) -> Option<String> {
    let all = capstone
        .disasm_count(code, u64::from(ADDRESS), count)
        .expect("Capstone answers");
    let last = all.get(count - 1)?;
    Some(format!(
        "{} {}",
        last.mnemonic().unwrap_or(""),
        last.op_str().unwrap_or("")
    ))
}

/// One question and both answers.
struct Case {
    v8: bool,
    word: u32,
    size: u32,
    ours: Result<Inst, NotDecoded>,
    theirs: Option<String>,
    /// Where the instruction is.
    address: u32,
}

impl Case {
    fn of_word(capstone: &Capstone, arch: Arch, word: u32, size: u32) -> Self {
        let (hw1, hw2) = samples::halves(word, size);
        let ours = decode(hw1, hw2, arch, ItState::OUTSIDE);
        let theirs = ask(capstone, &samples::bytes(word, size), 1);
        Self {
            v8: arch == Arch::V8M,
            word,
            size,
            ours,
            theirs,
            address: ADDRESS,
        }
    }

    /// An instruction in the IT block that it was decoded in.
    fn of_inst(capstone: &Capstone, v8: bool, word: u32, inst: Inst) -> Self {
        let block = inst
            .cond
            .filter(|_| inst.encoding.it_rule() != ItRule::Never);
        let it = block.map_or(vec![], |cond| {
            samples::it_block(cond).0.to_le_bytes().to_vec()
        });
        let code = [it.clone(), samples::bytes(word, inst.size())].concat();
        let theirs = ask(capstone, &code, 1 + it.len() / 2);
        Self {
            v8,
            word,
            size: inst.size(),
            ours: Ok(inst),
            theirs,
            address: ADDRESS + it.len() as u32,
        }
    }

    /// UNPREDICTABLE words may be read or not, and read in any way.
    fn agrees(&self) -> bool {
        match (&self.ours, &self.theirs) {
            (Ok(inst), Some(theirs)) => {
                normal::text(&inst.to_string(), self.address) == normal::text(theirs, self.address)
            }
            (Err(NotDecoded::Unpredictable { .. }), _) | (Err(NotDecoded::Undefined), None) => true,
            (Ok(_), None) | (Err(NotDecoded::Undefined), Some(_)) => false,
        }
    }

    fn describe(&self) -> String {
        let ours = self
            .ours
            .as_ref()
            .map_or("-".to_string(), |i| format!("{i} ({})", i.encoding));
        format!(
            "{:0width$x}: {ours} / {}",
            self.word,
            self.theirs.as_deref().unwrap_or("-"),
            width = 2 * self.size as usize
        )
    }

    fn undefined(&self) -> bool {
        self.ours == Err(NotDecoded::Undefined)
    }

    fn is(&self, op: Op) -> bool {
        self.ours.is_ok_and(|i| i.op() == op)
    }

    /// Whether Capstone's mnemonic starts with one of `names`.
    fn reads(&self, names: &[&str]) -> bool {
        self.theirs
            .as_deref()
            .is_some_and(|t| names.iter().any(|n| t.starts_with(n)))
    }

    fn mentions(&self, part: &str) -> bool {
        self.theirs.as_deref().is_some_and(|t| t.contains(part))
    }
}

/// A difference: the reason, and when it applies.
type Known = (&'static str, fn(&Case) -> bool);

/// What Capstone reads differently, and why we do not follow.
const KNOWN: &[Known] = &[
    ("no mode without Advanced SIMD: data processing", |c| {
        c.undefined() && c.word >> 24 & 0xef == 0xef
    }),
    ("no mode without Advanced SIMD: element loads", |c| {
        c.undefined() && c.word >> 20 & 0xff1 == 0xf90 && c.reads(&["vld", "vst"])
    }),
    (
        "no mode without Advanced SIMD: scalars of 8 and 16 bits, VDUP",
        |c| {
            c.undefined()
                && c.reads(&[
                    "vdup", "vmov.8", "vmov.16", "vmov.s8", "vmov.u8", "vmov.s16", "vmov.u16",
                ])
        },
    ),
    (
        "cryptography and Advanced SIMD of v8-A, read whatever the first byte",
        |c| {
            let vectors = c.word >> 24 != 0xfe && c.reads(&["vcvt", "vrint", "vmaxnm", "vminnm"]);
            (c.undefined() && vectors) || c.reads(&["sha", "aes"])
        },
    ),
    ("no mode without double precision", |c| {
        c.undefined() && c.mentions(".f64")
    }),
    ("no mode without D16 to D31", |c| {
        c.undefined() && (16..32).any(|n| c.mentions(&format!("d{n}")))
    }),
    ("half precision arithmetic of v8.2-A and v8.1-M", |c| {
        c.undefined() && c.mentions(".f16")
    }),
    (
        "FPv5 is read without v8, where it is no part of FPv4-SP",
        |c| {
            !c.v8
                && c.undefined()
                && c.reads(&[
                    "vsel", "vrint", "vcvta", "vcvtm", "vcvtn", "vcvtp", "vmaxnm", "vminnm",
                ])
        },
    ),
    ("load-acquire and store-release are read without v8", |c| {
        !c.v8 && c.undefined() && c.reads(&["lda", "stl"])
    }),
    ("system registers of A profile", |c| {
        c.undefined() && c.reads(&["vmsr", "vmrs"])
    }),
    ("CRC32 is A profile", |c| {
        c.undefined() && c.reads(&["crc32"])
    }),
    ("HVC and SMC are A profile", |c| {
        c.undefined() && c.reads(&["hvc", "smc"])
    }),
    ("HLT and SETPAN are A profile", |c| {
        c.undefined() && c.reads(&["hlt", "setpan"])
    }),
    (
        "reserved memory hints are refused, or taken for PLD, PLI",
        |c| c.is(Op::HINT_memory) && (c.theirs.is_none() || c.reads(&["pl"])),
    ),
    ("UDF #249 and #254 have meanings of their own", |c| {
        matches!(c.word, 0xdef9 | 0xdefe) && c.is(Op::UDF)
    }),
    ("UDF has no condition", |c| {
        c.is(Op::UDF) && c.reads(&["udf"])
    }),
    ("PUSH and POP of one register read as STR and LDR", |c| {
        (c.is(Op::PUSH) || c.is(Op::POP)) && c.reads(&["str", "ldr"])
    }),
    ("hints and barriers of A profile", |c| {
        (c.is(Op::HINT) || c.is(Op::DSB)) && c.reads(&["sevl", "esb", "tsb", "dfb"])
    }),
    (
        "SIMD and half precision in the place of coprocessors 8, 9, 12, 13",
        |c| {
            c.ours
                .is_ok_and(|i| i.class() == Class::Coprocessor && matches!(i.a, 8 | 9 | 12 | 13))
                && c.reads(&["v"])
        },
    ),
    (
        "coprocessors 10 and 11 are the floating-point unit: what is not its instruction is UNDEFINED",
        |c| {
            let generic = c.reads(&["ldc", "stc", "mcr", "mrc", "mrrc", "mcrr", "cdp"]);
            c.undefined() && generic && (c.mentions(" p10,") || c.mentions(" p11,"))
        },
    ),
    (
        "with v8, coprocessors other than 14 and 15 are refused",
        |c| c.v8 && c.ours.is_ok_and(|i| i.class() == Class::Coprocessor) && c.theirs.is_none(),
    ),
];

/// Differences by reason; what has none is kept as text.
#[derive(Default)]
struct Verdicts {
    asked: u32,
    known: BTreeMap<usize, u32>,
    unknown: Vec<String>,
}

impl Verdicts {
    fn add(&mut self, case: &Case) {
        self.asked += 1;
        if case.agrees() {
            return;
        }
        match KNOWN.iter().position(|(_, applies)| applies(case)) {
            Some(i) => *self.known.entry(i).or_default() += 1,
            None => self.unknown.push(case.describe()),
        }
    }

    /// Prints the reasons and marks them as met; fails if a difference has none.
    fn report(&self, what: &str, met: &mut [bool]) {
        println!("{what}: {} asked", self.asked);
        for (i, count) in &self.known {
            println!("  {count:8} {}", KNOWN[*i].0);
            met[*i] = true;
        }
        let shown = &self.unknown[..self.unknown.len().min(40)];
        assert!(
            self.unknown.is_empty(),
            "{} differences without a reason:\n{}",
            self.unknown.len(),
            shown.join("\n")
        );
    }
}

#[test]
fn what_capstone_reads_is_what_we_read() {
    let mut met = vec![false; KNOWN.len()];
    let mut verdicts = Verdicts::default();
    rows(&mut verdicts);
    verdicts.report("rows", &mut met);
    for (arch, capstone) in [(Arch::V8M, open(true)), (Arch::V7EM, open(false))] {
        let mut verdicts = Verdicts::default();
        for hw1 in (0..=u16::MAX).filter(|hw| !is_wide(*hw)) {
            verdicts.add(&Case::of_word(&capstone, arch, u32::from(hw1), 2));
        }
        verdicts.report(&format!("halfwords, {arch:?}"), &mut met);
        let mut verdicts = Verdicts::default();
        random_words(&mut verdicts, &capstone, arch);
        verdicts.report(&format!("random words, {arch:?}"), &mut met);
    }
    assert_all_met(&met, KNOWN.iter().map(|known| known.0));
}

/// Every row with random operands.
fn rows(verdicts: &mut Verdicts) {
    let (v7, v8) = (open(false), open(true));
    for (seed, encoding) in Encoding::all().enumerate() {
        let samples = samples::of_encoding(encoding, 600, seed as u64);
        assert!(!samples.is_empty(), "no word of {encoding} decodes");
        // With v8 Capstone refuses most coprocessors.
        let with_v8 = encoding.class() != Class::Coprocessor;
        for (word, inst) in samples {
            verdicts.add(&Case::of_inst(
                if with_v8 { &v8 } else { &v7 },
                with_v8,
                word,
                inst,
            ));
        }
    }
}

/// A million 32-bit words.
fn random_words(verdicts: &mut Verdicts, capstone: &Capstone, arch: Arch) {
    let mut random = samples::Random::new(1);
    while verdicts.asked < 1_000_000 {
        for _ in 0..1000 {
            verdicts.add(&Case::of_word(
                capstone,
                arch,
                samples::wide(&mut random),
                4,
            ));
        }
    }
}
