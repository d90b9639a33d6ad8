//! A block: instructions that follow each other in memory, decoded, up to one after which another
//! place must follow.
//!
//! Branches that may fall through lie inside a block, and so do conditional instructions: which of
//! them were passed is part of what the block's cycles are remembered under.

use crate::exec;
use crate::fabric::fetched_word;
use crate::memo::{Known, Link, Memo};
use crate::memory::Memory;
use crate::op::Op;
use crate::outcome::DIVIDE_BITS;
use crate::stop::Reason;
use crate::translate::Translated;
use whippen_isa::timing::{Core as Timing, Timed};
use whippen_isa::{Class, Inst, ItState, NotDecoded, Op as I, RegSet, decode, is_wide};

/// Instructions of a block at most.
const LENGTH_MAX: usize = 64;
/// Bits of outcomes that a block may gather.
const OUTCOME_BITS_MAX: u32 = 60;

/// A decoded run of instructions.
pub(crate) struct Block {
    pub ops: Vec<Op>,
    /// Beside each op: what only counting and tracing need.
    pub infos: Vec<Info>,
    /// The address after the last instruction, and the state of IT there.
    pub end: u32,
    pub end_it: ItState,
    /// Whether the first instruction has 32 bits.
    pub wide: bool,
    /// Cycles that it takes at most.
    pub cycles_max: u64,
    /// Cycles that it took the last time that a core ran it apart.
    pub took: u32,
    /// The ports that its words are fetched at, a bit each.
    pub ports: u32,
    /// Cycles of runs through some of its instructions, and what follows from whole ones.
    pub memo: Memo<Known>,
    pub links: Memo<Link>,
    pub translated: Translated,
}

/// What counting and tracing need of an instruction.
pub(crate) struct Info {
    pub address: u32,
    /// The state of IT before it.
    pub it: ItState,
    /// The instruction, or why there is none.
    pub inst: Result<(Inst, Timed), Reason>,
    /// It pushes whether it was passed.
    pub conditional: bool,
    /// It pushes its quotient's bits.
    pub divides: bool,
    /// What it cost when it ran alone.
    pub memo: Memo<Known>,
}

impl Block {
    /// Decodes from an address on.
    pub fn decode(memory: &mut Memory, timing: &Timing, address: u32, it: ItState) -> Self {
        let mut block = Self {
            ops: Vec::new(),
            infos: Vec::new(),
            end: address,
            end_it: it,
            wide: memory.halfword(address).is_some_and(is_wide),
            cycles_max: 0,
            took: 0,
            ports: 0,
            memo: Memo::default(),
            links: Memo::default(),
            translated: Translated::default(),
        };
        let mut bits = 0;
        while block.ops.len() < LENGTH_MAX && bits < OUTCOME_BITS_MAX - DIVIDE_BITS {
            let goes_on = block.push(memory, timing);
            let info = &block.infos[block.infos.len() - 1];
            bits += u32::from(info.conditional) + if info.divides { DIVIDE_BITS } else { 0 };
            if !goes_on {
                break;
            }
        }
        block
    }

    /// The address of its first instruction.
    pub fn start(&self) -> u32 {
        self.place(0).0
    }

    /// Forgets what is known by numbers of pipeline states.
    pub fn forget_cycles(&mut self) {
        self.memo = Default::default();
        self.links = Default::default();
        self.translated = Default::default();
        self.infos
            .iter_mut()
            .for_each(|info| info.memo = Default::default());
    }

    /// Whether something is known to follow from a run through it.
    #[cfg(test)]
    pub fn is_linked(&self) -> bool {
        !self.links.is_empty()
    }

    /// The address and the state of IT of instruction `index`, or after the last one.
    pub fn place(&self, index: usize) -> (u32, ItState) {
        self.infos
            .get(index)
            .map_or((self.end, self.end_it), |info| (info.address, info.it))
    }

    /// Decodes one more instruction; whether the next one can follow it.
    fn push(&mut self, memory: &mut Memory, timing: &Timing) -> bool {
        let (address, it) = (self.end, self.end_it);
        self.ports |= memory.port_bit(fetched_word(address));
        match fetch(memory, timing.arch, address, it) {
            Ok(inst) => {
                (0..inst.size() / 2).for_each(|i| memory.mark_code(address.wrapping_add(2 * i)));
                self.push_inst(inst, timing.prepare(&inst));
                !ends(&inst)
            }
            Err(reason) => {
                if !matches!(reason, Reason::Fetch | Reason::ExecuteNever) {
                    memory.mark_code(address);
                }
                self.ops.push(exec::absent(address));
                self.infos.push(Info {
                    address,
                    it,
                    inst: Err(reason),
                    conditional: false,
                    divides: false,
                    memo: Default::default(),
                });
                false
            }
        }
    }

    fn push_inst(&mut self, inst: Inst, timed: Timed) {
        let (address, it) = (self.end, self.end_it);
        let conditional = inst.is_conditional() || inst.class() == Class::CompareBranch;
        let divides = inst.class() == Class::Divide;
        self.ops.push(exec::prepare(&inst, address));
        self.infos.push(Info {
            address,
            it,
            inst: Ok((inst, timed)),
            conditional,
            divides,
            memo: Default::default(),
        });
        self.end = address.wrapping_add(inst.size());
        self.end_it = inst.it_behind(it).unwrap_or_default();
        self.cycles_max += cycles_max(&inst);
    }
}

/// Whether nothing can follow the instruction without looking.
fn ends(inst: &Inst) -> bool {
    let branches = inst.defs().contains(RegSet::core(15)) && !inst.is_conditional();
    let calls = matches!(inst.class(), Class::Exception | Class::Wait) || inst.op() == I::ISB;
    (branches && inst.class() != Class::CompareBranch) || calls
}

/// Cycles that an instruction takes at most, generously.
fn cycles_max(inst: &Inst) -> u64 {
    let registers = u64::from(inst.imm.count_ones().max(inst.imm & 31).min(32));
    match inst.class() {
        Class::Divide | Class::FloatDivide => 24,
        Class::FloatMultiplyAdd => 24,
        Class::LoadMultiple | Class::StoreMultiple => 24,
        Class::FloatLoadMultiple | Class::FloatStoreMultiple => 24 + registers,
        class if waits_for_float(class) => 20,
        _ => 6,
    }
}

/// Whether an instruction may wait for the floating-point unit.
fn waits_for_float(class: Class) -> bool {
    matches!(
        class,
        Class::FloatAlu
            | Class::FloatCompare
            | Class::FloatConvert
            | Class::FloatMove
            | Class::FloatTransfer
            | Class::FloatLoad
            | Class::FloatStore
    )
}

/// The instruction at an address, or why there is none.
fn fetch(
    memory: &Memory,
    arch: whippen_isa::Arch,
    address: u32,
    it: ItState,
) -> Result<Inst, Reason> {
    let never = matches!(address >> 29, 2 | 5..);
    let halfword = |address: u32| memory.halfword(address).ok_or(Reason::Fetch);
    if never {
        return Err(Reason::ExecuteNever);
    }
    let hw1 = halfword(address)?;
    let hw2 = if is_wide(hw1) {
        halfword(address.wrapping_add(2))?
    } else {
        0
    };
    decode(hw1, hw2, arch, it).map_err(|error| match error {
        NotDecoded::Undefined => Reason::Undefined,
        NotDecoded::Unpredictable { why, .. } => Reason::Unpredictable(why),
    })
}
