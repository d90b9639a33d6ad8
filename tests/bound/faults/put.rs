//! What is done to an instruction.

use whippen_compiler::Rng;
use whippen_compiler::modes::ModeId;
use whippen_compiler::validate::{Code, Routine};
use whippen_isa::{Arch, Code as Halfwords, Inst, ItState, Op, decode, is_wide, reg};

use super::none::is_commuted;

/// The instruction that does nothing.
pub const NOP: u16 = 0xbf00;

/// An instruction where it stands.
pub type Placed = (u32, ItState, Inst);

/// The instructions of a piece of code.
pub fn instructions(code: &Code, arch: Arch, from: u32, to: u32) -> Vec<Placed> {
    let (mut at, mut it) = (from, ItState::OUTSIDE);
    let mut all = Vec::new();
    while let Some(first) = code.half(at).filter(|_| at < to) {
        let second = code.half(at + 2).filter(|_| is_wide(first)).unwrap_or(0);
        let Ok(inst) = decode(first, second, arch, it) else {
            break;
        };
        all.push((at, it, inst));
        it = inst.it_behind(it).expect("it was decoded");
        at += inst.size();
    }
    all
}

/// The instructions of a mode, of a tick's entry or end, or of one key's preparation: the last goes
/// to a key's code, or back.
pub fn code_of_key(code: &Code, arch: Arch, from: u32, to: u32) -> Vec<Placed> {
    up_to(instructions(code, arch, from, to), |inst| {
        inst.op() == Op::BX || inst.op() == Op::POP && returns(inst)
    })
}

/// The instructions of what prepares all keys: the last goes back to the loop over them.
pub fn code_of_loop(code: &Code, arch: Arch, from: u32, to: u32) -> Vec<Placed> {
    up_to(instructions(code, arch, from, to), |inst| {
        inst.op() == Op::B && !inst.is_conditional()
    })
}

fn up_to(mut all: Vec<Placed>, goes: impl Fn(&Inst) -> bool) -> Vec<Placed> {
    let last = all.iter().rposition(|(.., inst)| goes(inst));
    all.truncate(last.map_or(0, |last| last + 1));
    all
}

/// Whether it takes PC from the stack, or from memory elsewhere.
pub fn returns(inst: &Inst) -> bool {
    inst.defs().core_bits() & 1 << reg::PC != 0
}

/// Whose code it is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Whose {
    Mode(ModeId),
    Entry,
    End,
    Routine(Routine),
}

/// What is done to an instruction.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Swapped,
    /// What is added to its constant.
    Constant(i8),
    Shift,
    Condition,
    Result,
    Operand,
    Data,
    LeftOut,
    StoreLeftOut,
    Bit,
}

/// All kinds, with their names.
pub const KINDS: [(Kind, &str); 12] = [
    (Kind::Swapped, "operands swapped"),
    (Kind::Constant(1), "a constant + 1"),
    (Kind::Constant(-1), "a constant - 1"),
    (Kind::Constant(4), "a constant + 4"),
    (Kind::Shift, "a shift + 1"),
    (Kind::Condition, "the opposite condition"),
    (Kind::Result, "another result"),
    (Kind::Operand, "another operand"),
    (Kind::Data, "another register of memory"),
    (Kind::LeftOut, "left out"),
    (Kind::StoreLeftOut, "a store left out"),
    (Kind::Bit, "a bit turned"),
];

pub fn name(kind: Kind) -> &'static str {
    let own = KINDS.iter().find(|(own, _)| *own == kind);
    own.map_or("", |(_, name)| name)
}

/// Other halfwords for an instruction.
pub struct Fault {
    pub kind: Kind,
    /// Whose instruction it is.
    pub whose: Whose,
    /// Where its code begins.
    pub from: u32,
    pub placed: Placed,
    pub words: Vec<u16>,
}

impl Fault {
    pub fn put(&self, code: &Code) -> Code {
        let mut faulty = code.clone();
        for (at, word) in (self.placed.0..).step_by(2).zip(&self.words) {
            faulty.put(at, *word);
        }
        faulty
    }

    /// The instruction that is there now; none where there is none.
    pub fn now(&self, arch: Arch) -> Option<Inst> {
        let second = self.words.get(1).copied().unwrap_or(0);
        decode(self.words[0], second, arch, self.placed.1).ok()
    }

    pub fn is_commuted(&self, arch: Arch) -> bool {
        let now = self.now(arch);
        now.is_some_and(|now| is_commuted(&self.placed.2, &now))
    }

    pub fn line(&self, arch: Arch) -> String {
        let now = self.now(arch).map(|inst| inst.to_string());
        let now = now.unwrap_or("no instruction".to_string());
        let whose = match self.whose {
            Whose::Mode(mode) => format!("mode {mode}"),
            Whose::Entry => "entry".to_string(),
            Whose::End => "end".to_string(),
            Whose::Routine(routine) => routine.to_string(),
        };
        let (offset, was) = (self.placed.0 - self.from, self.placed.2);
        let kind = name(self.kind);
        format!("{whose} + {offset:#x}: {kind}: {was} -> {now}")
    }
}

/// What an instruction becomes, as halfwords; none where nothing would be other, or where its
/// length would.
pub fn faulty(
    rng: &mut Rng,
    code: &Code,
    arch: Arch,
    placed: Placed,
    kind: Kind,
) -> Option<Vec<u16>> {
    let (at, it, inst) = placed;
    let halves = inst.size() / 2;
    let old: Vec<u16> = (0..halves)
        .filter_map(|half| code.half(at + 2 * half))
        .collect();
    let words = match kind {
        Kind::LeftOut | Kind::StoreLeftOut => {
            let is_asked = kind == Kind::LeftOut || is_store(inst.op());
            let is_possible = halves == 1 || !it.inside();
            (is_possible && is_asked).then(|| vec![NOP; halves as usize])?
        }
        Kind::Bit => {
            let mut words = old.clone();
            let half = rng.below(halves.into()) as usize;
            words[half] ^= 1 << rng.below(16);
            (is_wide(words[0]) == (halves == 2)).then_some(words)?
        }
        _ => match faulty_operands(kind, inst)?.encode(arch).ok()? {
            Halfwords::Narrow(first) => vec![first],
            Halfwords::Wide(first, second) => vec![first, second],
        },
    };
    (words != old && words.len() == old.len()).then_some(words)
}

fn faulty_operands(kind: Kind, inst: Inst) -> Option<Inst> {
    let mut faulty = inst;
    let next = |register: u8| (register + 1) & 7;
    match kind {
        Kind::Swapped => std::mem::swap(&mut faulty.n, &mut faulty.m),
        Kind::Constant(by) => faulty.imm = faulty.imm.wrapping_add_signed(by.into()),
        Kind::Shift => faulty.amount = (faulty.amount + 1) & 31,
        Kind::Condition if inst.op() == Op::IT => faulty.imm ^= 0x10,
        Kind::Condition => faulty.cond = faulty.cond?.invert(),
        Kind::Result => faulty.d = next(faulty.d),
        Kind::Operand => faulty.n = next(faulty.n),
        Kind::Data => faulty.t = next(faulty.t),
        Kind::LeftOut | Kind::StoreLeftOut | Kind::Bit => return None,
    }
    Some(faulty)
}

pub fn is_store(op: Op) -> bool {
    matches!(
        op,
        Op::STR_immediate
            | Op::STR_register
            | Op::STRH_immediate
            | Op::STRH_register
            | Op::STRB_immediate
            | Op::STRB_register
            | Op::STRD_immediate
            | Op::STM
            | Op::STMDB
            | Op::PUSH
    )
}
