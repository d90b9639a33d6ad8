//! Capstone: what decodes, and as what.

use crate::{normal, samples};
use capstone::arch::arm::{ArchExtraMode, ArchMode};
use capstone::prelude::*;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use whippen_isa::{Arch, Class, Encoding, Flags, Inst, ItRule, ItState, NotDecoded, Op, RegSet, decode, is_wide};

/// Where instructions are, so that branch targets can be told.
const ADDRESS: u32 = 0x1000;

/// Capstone for M class, with the instructions of v8 or without.
fn open(v8: bool) -> Capstone {
    let extra: &[ArchExtraMode] =
        if v8 { &[ArchExtraMode::MClass, ArchExtraMode::V8] } else { &[ArchExtraMode::MClass] };
    let builder = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode(extra.iter().copied());
    builder.build().expect("Capstone has Thumb for M class")
}

/// The text of the last of `count` instructions, if they decode.
fn ask(capstone: &Capstone, code: &[u8], count: usize) -> Option<String> {
    let all = capstone.disasm_count(code, u64::from(ADDRESS), count).expect("Capstone answers");
    let last = all.get(count - 1)?;
    Some(format!("{} {}", last.mnemonic().unwrap_or(""), last.op_str().unwrap_or("")))
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
        Self { v8: arch == Arch::V8M, word, size, ours, theirs, address: ADDRESS }
    }

    /// An instruction in the IT block that it was decoded in.
    fn of_inst(capstone: &Capstone, v8: bool, word: u32, inst: Inst) -> Self {
        let block = inst.cond.filter(|_| inst.encoding.it_rule() != ItRule::Never);
        let it = block.map_or(vec![], |cond| samples::it_block(cond).0.to_le_bytes().to_vec());
        let code = [it.clone(), samples::bytes(word, inst.size())].concat();
        let theirs = ask(capstone, &code, 1 + it.len() / 2);
        Self { v8, word, size: inst.size(), ours: Ok(inst), theirs, address: ADDRESS + it.len() as u32 }
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
        let ours = self.ours.as_ref().map_or("-".to_string(), |i| format!("{i} ({})", i.encoding));
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
        self.theirs.as_deref().is_some_and(|t| names.iter().any(|n| t.starts_with(n)))
    }

    fn mentions(&self, part: &str) -> bool {
        self.theirs.as_deref().is_some_and(|t| t.contains(part))
    }
}

/// A difference: the reason, and when it applies.
type Known = (&'static str, fn(&Case) -> bool);

/// What Capstone reads differently, and why we do not follow.
const KNOWN: &[Known] = &[
    ("no mode without Advanced SIMD: data processing", |c| c.undefined() && c.word >> 24 & 0xef == 0xef),
    ("no mode without Advanced SIMD: element loads", |c| {
        c.undefined() && c.word >> 20 & 0xff1 == 0xf90 && c.reads(&["vld", "vst"])
    }),
    ("no mode without Advanced SIMD: scalars of 8 and 16 bits, VDUP", |c| {
        c.undefined() && c.reads(&["vdup", "vmov.8", "vmov.16", "vmov.s8", "vmov.u8", "vmov.s16", "vmov.u16"])
    }),
    ("cryptography and Advanced SIMD of v8-A, read whatever the first byte", |c| {
        let vectors = c.word >> 24 != 0xfe && c.reads(&["vcvt", "vrint", "vmaxnm", "vminnm"]);
        (c.undefined() && vectors) || c.reads(&["sha", "aes"])
    }),
    ("no mode without double precision", |c| c.undefined() && c.mentions(".f64")),
    ("no mode without D16 to D31", |c| c.undefined() && (16..32).any(|n| c.mentions(&format!("d{n}")))),
    ("half precision arithmetic of v8.2-A and v8.1-M", |c| c.undefined() && c.mentions(".f16")),
    ("FPv5 is read without v8, where it is no part of FPv4-SP", |c| {
        !c.v8 && c.undefined() && c.reads(&["vsel", "vrint", "vcvta", "vcvtm", "vcvtn", "vcvtp", "vmaxnm", "vminnm"])
    }),
    ("load-acquire and store-release are read without v8", |c| !c.v8 && c.undefined() && c.reads(&["lda", "stl"])),
    ("system registers of A profile", |c| c.undefined() && c.reads(&["vmsr", "vmrs"])),
    ("CRC32 is A profile", |c| c.undefined() && c.reads(&["crc32"])),
    ("HVC and SMC are A profile", |c| c.undefined() && c.reads(&["hvc", "smc"])),
    ("HLT and SETPAN are A profile", |c| c.undefined() && c.reads(&["hlt", "setpan"])),
    ("reserved memory hints are refused, or taken for PLD, PLI", |c| {
        c.is(Op::HINT_memory) && (c.theirs.is_none() || c.reads(&["pl"]))
    }),
    ("UDF #249 and #254 have meanings of their own", |c| matches!(c.word, 0xdef9 | 0xdefe) && c.is(Op::UDF)),
    ("UDF has no condition", |c| c.is(Op::UDF) && c.reads(&["udf"])),
    ("PUSH and POP of one register read as STR and LDR", |c| {
        (c.is(Op::PUSH) || c.is(Op::POP)) && c.reads(&["str", "ldr"])
    }),
    ("hints and barriers of A profile", |c| {
        (c.is(Op::HINT) || c.is(Op::DSB)) && c.reads(&["sevl", "esb", "tsb", "dfb"])
    }),
    ("SIMD and half precision in the place of coprocessors 8, 9, 12, 13", |c| {
        c.ours.is_ok_and(|i| i.class() == Class::Coprocessor && matches!(i.a, 8 | 9 | 12 | 13)) && c.reads(&["v"])
    }),
    ("coprocessors 10 and 11 are the floating-point unit: what is not its instruction is UNDEFINED", |c| {
        let generic = c.reads(&["ldc", "stc", "mcr", "mrc", "mrrc", "mcrr", "cdp"]);
        c.undefined() && generic && (c.mentions(" p10,") || c.mentions(" p11,"))
    }),
    ("with v8, coprocessors other than 14 and 15 are refused", |c| {
        c.v8 && c.ours.is_ok_and(|i| i.class() == Class::Coprocessor) && c.theirs.is_none()
    }),
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

    fn report(&self, what: &str) {
        println!("{what}: {} asked", self.asked);
        for (i, count) in &self.known {
            println!("  {count:8} {}", KNOWN[*i].0);
        }
        let shown = &self.unknown[..self.unknown.len().min(40)];
        assert!(self.unknown.is_empty(), "{} differences without a reason:\n{}", self.unknown.len(), shown.join("\n"));
    }
}

#[test]
fn every_row_with_random_operands() {
    let (v7, v8) = (open(false), open(true));
    let mut verdicts = Verdicts::default();
    for (seed, encoding) in Encoding::all().enumerate() {
        let samples = samples::of_encoding(encoding, 600, seed as u64);
        assert!(!samples.is_empty(), "no word of {encoding} decodes");
        let with_v8 = encoding.class() != Class::Coprocessor;
        for (word, inst) in samples {
            verdicts.add(&Case::of_inst(if with_v8 { &v8 } else { &v7 }, with_v8, word, inst));
        }
    }
    verdicts.report("rows");
}

#[test]
fn every_halfword() {
    for (arch, capstone) in [(Arch::V8M, open(true)), (Arch::V7EM, open(false))] {
        let mut verdicts = Verdicts::default();
        for hw1 in (0..=u16::MAX).filter(|hw| !is_wide(*hw)) {
            verdicts.add(&Case::of_word(&capstone, arch, u32::from(hw1), 2));
        }
        verdicts.report(&format!("halfwords, {arch:?}"));
    }
}

/// Three million words for each of two architectures, or what 12 s allow, and every line of the list above in use.
#[test]
fn random_words() {
    let mut seen = vec![false; KNOWN.len()];
    for (arch, capstone) in [(Arch::V8M, open(true)), (Arch::V7EM, open(false))] {
        let (mut verdicts, mut random) = (Verdicts::default(), samples::Random::new(1));
        let end = Instant::now() + Duration::from_secs(12);
        while verdicts.asked < 3_000_000 && Instant::now() < end {
            for _ in 0..1000 {
                verdicts.add(&Case::of_word(&capstone, arch, samples::wide(&mut random), 4));
            }
        }
        verdicts.report(&format!("random words, {arch:?}"));
        verdicts.known.keys().for_each(|i| seen[*i] = true);
    }
    let unused: Vec<_> = KNOWN.iter().zip(&seen).filter(|(_, seen)| !**seen).map(|(known, _)| known.0).collect();
    println!("not met here: {unused:?}");
}

/// The core and floating-point registers in one of Capstone's lists; PC, which it lists for some branches, left out.
fn registers(capstone: &Capstone, ids: &[RegId]) -> RegSet {
    let one = |id: &RegId| {
        let name = capstone.reg_name(*id).unwrap_or_default();
        let name = normal::text(&format!("- {name}"), 0).replace("- ", "");
        let number = name.get(1..).and_then(|n| n.parse().ok());
        match (name.as_str(), number) {
            ("sp", _) => RegSet::core(13),
            ("lr", _) => RegSet::core(14),
            (r, Some(n)) if r.starts_with('r') => RegSet::core(n),
            (s, Some(n)) if s.starts_with('s') => RegSet::singles(n, 1),
            (d, Some(n)) if d.starts_with('d') => RegSet::doubles(n, 1),
            _ => RegSet::EMPTY,
        }
    };
    ids.iter().map(one).fold(RegSet::EMPTY, RegSet::union)
}

/// Instructions whose registers Capstone lists in part or the wrong way around.
fn lists_wrongly(inst: &Inst) -> bool {
    use Op::*;
    let class = matches!(
        inst.class(),
        // Rm of the extended and the accumulators; what SSAT reads; lists; special registers; all of TT.
        Class::ExtendAdd
            | Class::MultiplyAddLong
            | Class::Saturate
            | Class::FloatLoadMultiple
            | Class::FloatStoreMultiple
            | Class::Security
            | Class::Coprocessor
    );
    // Rm of PKH; the stored register of STRBT; LR of SVC; the other half of D; BXNS at all; Sd of a half conversion.
    let op = matches!(
        inst.op(),
        PKHBT
            | PKHTB
            | STRBT
            | STRHT
            | SVC
            | BXNS
            | BLXNS
            | VMOV_core_to_half
            | VMOV_half_to_core
            | VCVT_single_to_half
            | VMSR
    );
    // The base of STMDB, and the stack pointers by name.
    class || op || (inst.op() == STMDB && inst.wback) || matches!(inst.op(), MRS | MSR)
}

/// Whether Capstone's word on the flags can be taken: it asks for no IT block here, and it counts ADC and SBC, which read
/// them, and UADD8, and forgets MSR.
fn tells_flags(inst: &Inst) -> bool {
    use Op::*;
    let reads_carry = matches!(inst.op(), ADC_immediate | ADC_register | SBC_immediate | SBC_register) && !inst.s;
    inst.cond.is_none() && !reads_carry && !matches!(inst.op(), UADD8 | MSR_APSR)
}

#[test]
fn registers_read_and_written() {
    let mut capstone = open(true);
    capstone.set_detail(true).expect("details can be had");
    let pc = RegSet::core(15);
    let (mut compared, mut left_out, mut wrong) = (0, 0, BTreeMap::new());
    for (seed, encoding) in Encoding::all().enumerate() {
        for (word, inst) in samples::of_encoding(encoding, 100, 9000 + seed as u64) {
            let all = capstone.disasm_count(&samples::bytes(word, inst.size()), 0x1000, 1).expect("Capstone answers");
            let Some(theirs) = all.iter().next().filter(|_| !lists_wrongly(&inst) && inst.op() != Op::HINT_memory)
            else {
                left_out += 1;
                continue;
            };
            let detail = capstone.insn_detail(theirs).expect("details were asked for");
            let reads = registers(&capstone, detail.regs_read());
            let writes = registers(&capstone, detail.regs_write());
            compared += 1;
            if reads != inst.uses().without(pc) || writes != inst.defs().without(pc) {
                let text =
                    format!("{inst}: reads {:?} / {reads:?}, writes {:?} / {writes:?}", inst.uses(), inst.defs());
                wrong.insert(inst.encoding.to_string(), text);
            }
            if let ArchDetail::ArmDetail(arm) = detail.arch_detail()
                && tells_flags(&inst)
                && arm.update_flags() != inst.flags().writes.intersects(Flags::NZCV)
            {
                let text = format!("{inst}: flags {:?} / {}", inst.flags().writes, arm.update_flags());
                wrong.insert(inst.encoding.to_string(), text);
            }
        }
    }
    println!("registers: {compared} compared, {left_out} left out");
    assert!(wrong.is_empty(), "differ: {wrong:#?}");
}
