//! Random cases: an instruction of every encoding with operands, flags, registers and memory.

use crate::harness::{MICROBIT, MPS2_AN386, MPS2_AN505};
use crate::random::Random;
use std::fmt;
use whippen_isa::{Arch, Class, Encoding, Inst, ItState, Op, RegSet, decode};

/// One instruction and the state before it.
pub struct Case {
    pub encoding: Encoding,
    pub inst: Inst,
    /// The instruction, with an IT before it if it is conditional.
    pub code: Vec<u16>,
    /// R0 to R12, SP, LR.
    pub core: [u32; 15],
    pub apsr: u32,
    pub fpscr: u32,
    pub singles: [u32; 32],
    pub seed: u32,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let read = self.inst.uses();
        write!(f, "{} [", self.inst)?;
        for (i, value) in self
            .core
            .iter()
            .enumerate()
            .filter(|(i, _)| read.core_bits() >> i & 1 != 0)
        {
            write!(f, " r{i}={value:08x}")?;
        }
        for (i, value) in self
            .singles
            .iter()
            .enumerate()
            .filter(|(i, _)| read.single_bits() >> i & 1 != 0)
        {
            write!(f, " s{i}={value:08x}")?;
        }
        write!(f, " apsr={:08x} fpscr={:08x} ]", self.apsr, self.fpscr)
    }
}

/// Why an encoding is not among the random cases. Those that change where execution goes on are
/// judged by `programs`.
pub fn unjudged(encoding: Encoding) -> Option<&'static str> {
    use Class::*;
    match encoding.class() {
        Branch | BranchLink | BranchRegister | CompareBranch | TableBranch => Some("branches"),
        It => Some("in front of other cases"),
        Wait => Some("waits"),
        Exception => Some("ends a case"),
        Special if encoding.op() != Op::MSR_APSR => Some("special registers"),
        Security => Some("depends on the security extension, which is absent here"),
        _ => None,
    }
}

/// `count` cases of every encoding that can be judged.
pub fn all(arch: Arch, count: usize) -> Vec<Case> {
    let mut random = Random::new(0x5eed + arch as u64);
    let judged = Encoding::all().filter(|e| e.exists_in(arch) && unjudged(*e).is_none());
    let mut cases = Vec::new();
    for encoding in judged {
        cases.extend((0..count).map(|_| case(encoding, arch, &mut random)));
    }
    if arch == Arch::V6M {
        // QEMU keeps Q and GE, which ARMv6-M does not have.
        cases.iter_mut().for_each(|case| case.apsr &= 0xf000_0000);
    }
    cases
}

fn case(encoding: Encoding, arch: Arch, random: &mut Random) -> Case {
    for _ in 0..100_000 {
        let conditional = arch != Arch::V6M && random.one_in(4);
        let cond = random.below(14) as u8;
        let it = if conditional {
            ItState::after_it(cond, 8)
        } else {
            None
        };
        let Some((inst, halfwords)) =
            instruction(encoding, arch, it.unwrap_or(ItState::OUTSIDE), random)
        else {
            continue;
        };
        let mut code = if conditional {
            vec![0xbf08 | u16::from(cond) << 4]
        } else {
            vec![]
        };
        code.extend(halfwords);
        if let Some(core) = registers(&inst, arch, random) {
            return finish(encoding, inst, code, core, random);
        }
    }
    panic!("{encoding}: no case found")
}

fn finish(
    encoding: Encoding,
    inst: Inst,
    code: Vec<u16>,
    core: [u32; 15],
    random: &mut Random,
) -> Case {
    let mut singles = [0; 32];
    singles.iter_mut().for_each(|s| *s = single(random));
    let fpscr = if random.one_in(2) {
        0
    } else {
        random.word() & 0xf7c0_009f
    };
    let apsr = random.word() & 0xf80f_0000;
    Case {
        encoding,
        inst,
        code,
        core,
        apsr,
        fpscr,
        singles,
        seed: random.word(),
    }
}

/// A word of the encoding that decodes to it and stays in line.
fn instruction(
    encoding: Encoding,
    arch: Arch,
    it: ItState,
    random: &mut Random,
) -> Option<(Inst, Vec<u16>)> {
    let (mask, bits) = encoding.fixed_bits();
    let word = random.word() & !mask | bits;
    let halfwords = if encoding.size() == 4 {
        vec![(word >> 16) as u16, word as u16]
    } else {
        vec![word as u16]
    };
    let inst = decode(
        halfwords[0],
        halfwords.get(1).copied().unwrap_or(0),
        arch,
        it,
    )
    .ok()?;
    let in_line = !inst.defs().contains(RegSet::core(15));
    (inst.encoding == encoding && in_line).then_some((inst, halfwords))
}

/// Registers with which the instruction reaches only memory that exists; nothing when it would move
/// the stack away.
fn registers(inst: &Inst, arch: Arch, random: &mut Random) -> Option<[u32; 15]> {
    let target = match arch {
        Arch::V6M => MICROBIT,
        Arch::V7EM => MPS2_AN386,
        Arch::V8M => MPS2_AN505,
    };
    let mut core = [0; 15];
    core.iter_mut().for_each(|r| *r = value(random));
    core[13] = target.window + 0x800 + 4 * random.below(16);
    let memory = has_memory(inst.class());
    let moves_sp =
        inst.defs().contains(RegSet::core(13)) && !(memory && inst.wback && inst.n == 13);
    if moves_sp && !keeps_stack(inst, &mut core, random) {
        return None;
    }
    if memory && !inst.uses().contains(RegSet::core(15)) {
        aim(inst, target.window, &mut core, random)?;
    }
    Some(core)
}

fn has_memory(class: Class) -> bool {
    use Class::*;
    matches!(
        class,
        Load | LoadDual
            | LoadMultiple
            | LoadOrdered
            | Store
            | StoreDual
            | StoreMultiple
            | StoreOrdered
            | FloatLoad
            | FloatStore
            | FloatLoadMultiple
            | FloatStoreMultiple
    )
}

/// Additions to and subtractions from SP by little.
fn keeps_stack(inst: &Inst, core: &mut [u32; 15], random: &mut Random) -> bool {
    let adds = matches!(
        inst.op(),
        Op::ADD_SP_plus_immediate
            | Op::SUB_SP_minus_immediate
            | Op::ADD_SP_plus_register
            | Op::SUB_SP_minus_register
    );
    if !adds || inst.imm > 0x300 {
        return false;
    }
    if inst.op().identifier().ends_with("_register") {
        core[inst.m as usize % 13] = random.below(32);
        return inst.m < 13 && inst.amount <= 3;
    }
    true
}

/// Sets base and index so that the access lies in the window.
fn aim(inst: &Inst, window: u32, core: &mut [u32; 15], random: &mut Random) -> Option<()> {
    let unaligned = if random.one_in(8) { random.below(4) } else { 0 };
    let target = window + 0x80 + 4 * random.below(32) + unaligned;
    let indexed = inst.op().identifier().ends_with("_register");
    let list = matches!(
        inst.class(),
        Class::LoadMultiple
            | Class::StoreMultiple
            | Class::FloatLoadMultiple
            | Class::FloatStoreMultiple
    );
    let offset = if inst.add {
        inst.imm
    } else {
        inst.imm.wrapping_neg()
    };
    let base = if list || !inst.index {
        target
    } else {
        target.wrapping_sub(offset)
    };
    let far = inst.n == 13 && base.abs_diff(window) > 0x600;
    if far || (indexed && inst.m == inst.n) || inst.n == 15 {
        return None;
    }
    core[inst.n as usize] = base;
    if indexed {
        let index = random.below(64);
        core[inst.m as usize] = index;
        core[inst.n as usize] = target.wrapping_sub(index << inst.amount);
        return (inst.n != 13 && inst.m != 13).then_some(());
    }
    Some(())
}

/// A register's value: often one at which arithmetic changes.
fn value(random: &mut Random) -> u32 {
    const EDGES: &[u32] = &[
        0,
        1,
        u32::MAX,
        0x8000_0000,
        0x7fff_ffff,
        0x8000,
        0xffff,
        0x7fff_8000,
        0x80,
        0x7f,
        0xffff_8000,
        31,
        32,
        33,
    ];
    match random.below(4) {
        0 => random.pick(EDGES),
        1 => random.word() >> random.below(32),
        _ => random.word(),
    }
}

/// A float: often one at which arithmetic changes.
fn single(random: &mut Random) -> u32 {
    const EDGES: &[u32] = &[
        0,
        0x8000_0000,
        0x3f80_0000,
        0xbf80_0000,
        0x7f80_0000,
        0xff80_0000,
        0x7fc0_0000,
        0x7fa0_0000,
        0xffc1_2345,
        0x7f7f_ffff,
        0x0080_0000,
        0x007f_ffff,
        1,
        0x8000_0001,
        0x4f00_0000,
        0xcf00_0000,
        0x4f80_0000,
        0x3f00_0000,
        0x3fc0_0000,
    ];
    let near_one =
        |random: &mut Random| random.word() & 0x807f_ffff | (0x70 + random.below(0x20)) << 23;
    match random.below(4) {
        0 => random.pick(EDGES),
        1 => near_one(random),
        2 => near_one(random) & !0x0000_ffff,
        _ => random.word(),
    }
}
