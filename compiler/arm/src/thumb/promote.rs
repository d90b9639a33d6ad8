//! Register promotion of tick constants: words that are the same for all keys of a core stay in
//! registers from key to key instead of being loaded or made by each.
//!
//! ```text
//!   ldr r0, [r6, #68]                       tick, before the first key:   ldr r9, [r6, #68]
//!   smmlar r1, r2, r0, r3        =>         every key:                    smmlar r1, r2, r9, r3
//! ```
//!
//! Live values, what all keys share, the number of the tick and literals do not change within a
//! tick. A register that holds one of them is lost to everything else, so the number of promoted
//! words is searched (`search`).

use super::func::{BlockId, Edge, Func, Terminator};
use super::minst::{Access, AliasClass, MInst, Operand, Reg, Role, Use, VReg};
use super::registers::STATE;
use super::tuning::PROMOTED_MAX;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};
use whippen_isa::Op;

/// The registers that may hold such a word, in the order in which they are taken; short encodings
/// do not name them.
const REGISTERS: [u8; PROMOTED_MAX] = [9, 8, 12, 5, 4];

/// A word that is the same for all keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum TickConstant {
    /// At an offset in STATE.
    InState(u32),
    /// A number.
    Immediate(u32),
}

/// Words with registers.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Promotions {
    all: Vec<(TickConstant, u8)>,
}

/// The words that most modes need; first those of their entry blocks, which are on every path.
pub(super) fn rank_candidates(funcs: &[Func]) -> Vec<TickConstant> {
    // In how many modes at the entry, and anywhere.
    let mut wanted: BTreeMap<TickConstant, [usize; 2]> = BTreeMap::new();
    for func in funcs {
        let words = |blocks: usize| {
            func.blocks
                .iter()
                .take(blocks)
                .flat_map(|block| &block.code)
                .filter_map(constant_made_by)
        };
        let [entry, all]: [BTreeSet<TickConstant>; 2] =
            [words(1).collect(), words(func.blocks.len()).collect()];
        for word in all {
            let [at_entry, anywhere] = wanted.entry(word).or_default();
            *at_entry += usize::from(entry.contains(&word));
            *anywhere += 1;
        }
    }
    let mut wanted: Vec<(TickConstant, [usize; 2])> = wanted.into_iter().collect();
    wanted.retain(|(_, [_, anywhere])| 2 * anywhere > funcs.len());
    wanted.sort_by_key(|(_, modes)| std::cmp::Reverse(*modes));
    wanted.truncate(PROMOTED_MAX);
    wanted.into_iter().map(|(word, _)| word).collect()
}

/// The word that an instruction loads or makes, if that is all it does.
fn constant_made_by(code: &MInst) -> Option<TickConstant> {
    let inst = &code.inst;
    match inst.op() {
        Op::LDR_immediate if code.access == Access::Read(AliasClass::Constant) && !inst.wback => {
            let base = code.operands[Role::N as usize].map(|operand| operand.reg);
            (base == Some(Reg::Fixed(STATE)) && inst.add).then_some(TickConstant::InState(inst.imm))
        }
        Op::MOV_immediate if inst.cond.is_none() && !inst.s && code.address.is_none() => {
            Some(TickConstant::Immediate(inst.imm))
        }
        _ => None,
    }
}

impl Promotions {
    /// Registers for these words.
    pub fn new(words: &[TickConstant]) -> Promotions {
        Promotions {
            all: words.iter().copied().zip(REGISTERS).collect(),
        }
    }

    /// The words and their registers.
    pub fn iter(&self) -> impl Iterator<Item = (TickConstant, u8)> + '_ {
        self.all.iter().copied()
    }

    /// The function with these words in their registers.
    pub fn promote_in(&self, mut func: Func) -> Func {
        let mut held: FxHashMap<VReg, u8> = FxHashMap::default();
        for block in func.blocks.iter_mut() {
            block.code.retain(|code| {
                let found = constant_made_by(code)
                    .and_then(|word| self.all.iter().find(|(promoted, _)| *promoted == word));
                found.is_none_or(|(_, reg)| code.writes().any(|to| held.insert(to, *reg).is_some()))
            });
        }
        if !held.is_empty() {
            for at in func.blocks.ids() {
                read_promoted(&mut func, at, &held);
            }
        }
        func.free = self
            .all
            .iter()
            .fold(func.free, |free, (_, reg)| free & !(1 << reg));
        func
    }
}

/// Makes a block read the promoted registers; a word that is changed in place, or passed to another
/// block, is copied.
fn read_promoted(func: &mut Func, at: BlockId, held: &FxHashMap<VReg, u8>) {
    let old = std::mem::take(&mut func.blocks[at].code);
    let mut code = Vec::with_capacity(old.len());
    for mut next in old {
        let uses: Vec<Use> = next.uses().collect();
        for Use {
            role,
            operand,
            writes,
            ..
        } in uses
        {
            if let (Reg::Virtual(reg), false) = (operand.reg, writes)
                && let Some(promoted) = held.get(&reg)
            {
                let read = if next.convention().is_some() {
                    // Operands of a call have registers of their own.
                    let copy = func.fresh();
                    code.push(copy_inst(copy, *promoted, next.origin));
                    Reg::Virtual(copy)
                } else {
                    Reg::Fixed(*promoted)
                };
                next = next.with(role, read);
            }
            if let Some(promoted) = operand.old.and_then(|old| held.get(&old)) {
                let copy = func.fresh();
                code.push(copy_inst(copy, *promoted, next.origin));
                next.operands[role as usize] = Some(Operand {
                    old: Some(copy),
                    ..operand
                });
            }
        }
        code.push(next);
    }
    let mut end = func.blocks[at].end.clone();
    let leaving: Vec<&mut VReg> = match &mut end {
        Terminator::Jump(Edge { args, .. }) => args.iter_mut().collect(),
        Terminator::NextKey(code) => vec![code],
        Terminator::Branch { .. } | Terminator::FallThrough => Vec::new(),
    };
    for reg in leaving {
        if let Some(promoted) = held.get(reg) {
            *reg = func.fresh();
            code.push(copy_inst(*reg, *promoted, None));
        }
    }
    (func.blocks[at].code, func.blocks[at].end) = (code, end);
}

fn copy_inst(to: VReg, from: u8, origin: Option<u32>) -> MInst {
    MInst {
        origin,
        ..MInst::new(Op::MOV_register)
            .reg(Role::D, to)
            .with(Role::M, Reg::Fixed(from))
    }
}
