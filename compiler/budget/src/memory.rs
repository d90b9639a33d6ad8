//! Memory interference: cycles that accesses and fetches take beyond one, as the board describes
//! its memories, banks and buses.
//!
//! Charged are, for each word:
//! * what the memory or the bus takes beyond a cycle;
//! * an access of every other manager that may use the bank, as the phase of the round robin is not
//!   documented;
//! * an own fetch, where the word may lie in a bank that the code is being fetched from.
//!
//! All are upper bounds, by rules. An address that facts do not narrow is taken for the core's own
//! data; what may be fetched or accessed in memory without a known time is an error.

mod access;
mod pipelining;

use whippen_arm::image::Linked;
use whippen_board::{AccessTime, BankSet, Board, Memory, Target};
use whippen_isa::timing::Outcome;
use whippen_isa::{Class, Inst, Op, reg};

use std::collections::BTreeMap;

use super::facts::{Facts, Interval};
use super::graph::Graph;
use super::unknown::{Unknown, UnknownTime};
use access::{accesses, addresses, fetched, is_by_register, is_literal, is_store, roughly};

/// Cycles that an access costs more, at most, that meets the prefetch: "can sometimes", says the
/// RP2350 datasheet (3.7.4.9.12).
const PREFETCH_CYCLES: u16 = 1;

/// The address of a branch's target that is not known but lies in the core's own code: in the upper
/// half of a word, which is fetched by itself.
pub const SOMEWHERE: u32 = 2;

/// Where accesses may go of which nothing else is known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reach {
    /// Banks of memory.
    pub banks: BankSet,
    /// What of it lies in memory without a known time, if something does.
    pub unknown: Option<Unknown>,
}

impl Reach {
    /// Both.
    pub fn and(self, other: Self) -> Self {
        Self {
            banks: self.banks | other.banks,
            unknown: self.unknown.or(other.unknown),
        }
    }
}

/// A section of the program: what lies where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Its name.
    pub name: String,
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
}

impl Extent {
    /// Whether an address lies inside.
    pub fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.size
    }

    /// A section of an image.
    pub fn of(section: &Linked) -> Self {
        Self {
            name: section.name.clone(),
            base: section.run,
            size: section.size,
        }
    }

    /// The banks that it lies in, where they are known.
    pub fn banks(&self, board: &Board) -> BankSet {
        let memory = board.memory_at(self.base);
        memory.map_or(0, |memory| memory.banks_between(self.base, self.size))
    }

    /// Where accesses to it go.
    pub fn reach(&self, board: &Board) -> Reach {
        let known = |memory: &&Memory| memory.access.extra_cycles().is_some();
        match board.memory_at(self.base) {
            Some(memory) if known(&memory) => Reach {
                banks: memory.banks_between(self.base, self.size),
                unknown: None,
            },
            Some(memory) => Reach {
                banks: 0,
                unknown: Some(Unknown::Memory {
                    memory: memory.name.clone(),
                    section: Some(self.name.clone()),
                }),
            },
            None => Reach {
                banks: 0,
                unknown: Some(Unknown::Nothing { target: self.base }),
            },
        }
    }
}

/// What the memory around a core is, and who else uses it.
#[derive(Debug, Clone)]
pub struct Interference<'a> {
    /// The board.
    pub board: &'a Board,
    /// The sections of the program, for messages.
    pub sections: &'a [Extent],
    /// Where the code's data may lie, when the analysis does not know an address.
    pub data: Reach,
    /// The banks of the core's code, where a branch goes whose target is not known.
    pub code: BankSet,
    /// Who else uses memory.
    pub others: Others,
    /// Of each bank: cycles beyond the first, and cycles of waiting for others.
    banks: Vec<BankCycles>,
}

/// Who else uses memory; by default nobody.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Others {
    /// Whether data in a bank that is being fetched from costs a cycle.
    pub prefetch: bool,
    /// For each other manager of the bus, of the same priority, the banks that it may use.
    pub contenders: Vec<BankSet>,
    /// How many accesses of others come in a tick besides: each makes one of ours wait for one
    /// access at most.
    pub remote_accesses: u32,
}

/// Cycles of an access to a bank, beyond one.
#[derive(Debug, Clone, Copy, Default)]
struct BankCycles {
    /// What the bank itself takes.
    extra: u16,
    /// Waiting for all others that may use it.
    contention: u16,
}

/// What an access is.
#[derive(Debug, Clone, Copy)]
struct Access {
    /// The instruction.
    at: u32,
    store: bool,
}

impl<'a> Interference<'a> {
    /// A board with others at work.
    pub fn new(
        board: &'a Board,
        sections: &'a [Extent],
        (code, data): (BankSet, Reach),
        others: Others,
    ) -> Self {
        let of_bank = |bank: usize| {
            let memories = board.memory.iter();
            let mine = memories.filter(|memory| memory.banks.contains(&(bank as u8)));
            let extra = mine.filter_map(|memory| memory.access.extra_cycles());
            let extra = extra.max().unwrap_or(0);
            let may_use = |other: &&BankSet| **other >> bank & 1 != 0;
            let contenders = others.contenders.iter().filter(may_use).count() as u16;
            BankCycles {
                extra,
                contention: contenders.saturating_mul(1 + extra),
            }
        };
        let banks = (0..board.banks.len()).map(of_bank).collect();
        Self {
            board,
            sections,
            data,
            code,
            others,
            banks,
        }
    }

    /// Cycles that an instruction may wait for its data and for what is fetched behind it.
    ///
    /// # Errors
    /// It may meet memory without a known time.
    pub fn waits(
        &self,
        inst: &Inst,
        at: u32,
        facts: &Facts,
        bases: &Bases,
        outcome: &Outcome,
    ) -> Result<u16, UnknownTime> {
        let mut waits = 0u16;
        for word in fetched(inst, at, outcome.target.map(|target| target.address)) {
            waits = waits.saturating_add(self.fetch(at, word)?);
        }
        let words = if outcome.skipped { 0 } else { accesses(inst) };
        if words == 0 {
            return Ok(waits);
        }
        let access = Access {
            at,
            store: is_store(inst),
        };
        if let Some(first) = addresses(inst, at, facts) {
            for word in 0..words {
                waits = waits.saturating_add(self.word(access, first, word)?);
            }
            return Ok(waits);
        }
        let mut each = self.anywhere(at, &self.reach(inst, at, bases))?;
        if let Some(base) = roughly(inst, facts) {
            each = each.max(self.beyond(access, base)?);
        }
        Ok(waits.saturating_add(words.saturating_mul(each)))
    }

    /// As [`Self::waits`] where nothing is known but the bases, and any other address may be a
    /// device's or in another core's memory.
    ///
    /// # Errors
    /// It may meet memory without a known time.
    pub fn waits_max(&self, inst: &Inst, at: u32, bases: &Bases) -> Result<u16, UnknownTime> {
        let waits = self.waits(inst, at, &Facts::nothing(), bases, &Outcome::NEXT)?;
        if bases.reach(inst).is_some() {
            return Ok(waits);
        }
        let buses = self.board.buses.iter();
        let device = buses
            .map(|bus| bus.read_cycles.max(bus.write_cycles).saturating_sub(1))
            .max();
        let all = self.board.memory.iter();
        let remote = all
            .flat_map(|memory| &memory.banks)
            .map(|&bank| self.bank(at, bank));
        let more = device.unwrap_or(0).max(remote.max().unwrap_or(0));
        Ok(waits.saturating_add(accesses(inst).saturating_mul(more)))
    }

    /// Waiting for a word of instructions.
    fn fetch(&self, at: u32, word: u32) -> Result<u16, UnknownTime> {
        if word == SOMEWHERE {
            let banks = (0..BankSet::BITS as u8).filter(|bank| self.code >> bank & 1 != 0);
            let contention = banks.map(|bank| self.cycles(bank).contention);
            return Ok(contention.max().unwrap_or(0));
        }
        if let Target::Memory(memory) = self.board.target(word)
            && memory.fetch == AccessTime::Cycles(1)
        {
            return Ok(memory
                .bank(word)
                .map_or(0, |bank| self.cycles(bank).contention));
        }
        Err(self.unknown(at, true, self.unknown_at(word)))
    }

    /// The word that stands so many behind one of these.
    fn word(&self, access: Access, first: Interval, nth: u16) -> Result<u16, UnknownTime> {
        let address = |first: i64| (first as u32).wrapping_add(4 * u32::from(nth));
        let (low, high) = (address(first.low), address(first.high));
        if low == high {
            return self.one_word(access, low);
        }
        let mut most = 0;
        for word in (low & !3..=high).step_by(4) {
            most = most.max(self.one_word(access, word)?);
        }
        Ok(most)
    }

    /// A word near an address that may also be no address: an index, to which the address is
    /// added.
    fn beyond(&self, access: Access, base: Interval) -> Result<u16, UnknownTime> {
        match self.word(access, base, 0) {
            Err(UnknownTime {
                what: Unknown::Nothing { .. },
                ..
            }) => Ok(0),
            other => other,
        }
    }

    /// A word at an address.
    fn one_word(&self, access: Access, word: u32) -> Result<u16, UnknownTime> {
        match self.board.target(word) {
            Target::Memory(memory) if memory.access.extra_cycles().is_some() => Ok(memory
                .bank(word)
                .map_or(0, |bank| self.bank(access.at, bank))),
            Target::Bus(bus) if access.store => Ok(bus.write_cycles.saturating_sub(1)),
            Target::Bus(bus) => Ok(bus.read_cycles.saturating_sub(1)),
            _ => Err(self.unknown(access.at, false, self.unknown_at(word))),
        }
    }

    /// One word anywhere in what can be reached.
    fn anywhere(&self, at: u32, reach: &Reach) -> Result<u16, UnknownTime> {
        if let Some(what) = &reach.unknown {
            return Err(self.unknown(at, false, what.clone()));
        }
        let banks = (0..BankSet::BITS as u8).filter(|bank| reach.banks >> bank & 1 != 0);
        Ok(banks.map(|bank| self.bank(at, bank)).max().unwrap_or(0))
    }

    /// Where an instruction's access goes whose address is not known: a table of branches lies
    /// behind its branch.
    fn reach(&self, inst: &Inst, at: u32, bases: &Bases) -> Reach {
        let code = (inst.n == reg::PC)
            .then(|| self.board.memory_at(at))
            .flatten();
        match code {
            Some(memory) => Reach {
                banks: memory.bank_set(),
                unknown: None,
            },
            None => bases.reach(inst).unwrap_or(&self.data).clone(),
        }
    }

    /// One word of an exception's frame or a vector: nothing is fetched meanwhile.
    ///
    /// # Errors
    /// Stack or vectors lie in memory without a known time.
    pub fn exception_word(&self, at: u32, reach: &Reach) -> Result<u16, UnknownTime> {
        if let Some(what) = &reach.unknown {
            return Err(self.unknown(at, false, what.clone()));
        }
        let banks = (0..BankSet::BITS as u8).filter(|bank| reach.banks >> bank & 1 != 0);
        let cycles = banks.map(|bank| {
            let cycles = self.cycles(bank);
            cycles.contention + cycles.extra
        });
        Ok(cycles.max().unwrap_or(0))
    }

    /// Cycles that one access of somebody else makes one of ours wait, at most.
    pub fn remote_access_cycles(&self) -> u32 {
        let slowest = self.banks.iter().map(|cycles| cycles.extra).max();
        1 + u32::from(slowest.unwrap_or(0))
    }

    /// One word of a bank.
    fn bank(&self, at: u32, bank: u8) -> u16 {
        let ahead = [4, 8, 12].map(|words| (at & !3).wrapping_add(words));
        let is_fetched = |word: u32| {
            let memory = self.board.memory_at(word);
            memory.and_then(|memory| memory.bank(word)) == Some(bank)
        };
        let meets = self.others.prefetch && ahead.into_iter().any(is_fetched);
        let prefetch = if meets { PREFETCH_CYCLES } else { 0 };
        let cycles = self.cycles(bank);
        cycles.contention + cycles.extra + prefetch
    }

    fn cycles(&self, bank: u8) -> BankCycles {
        self.banks
            .get(usize::from(bank))
            .copied()
            .unwrap_or_default()
    }

    /// What is at an address whose time is not known.
    fn unknown_at(&self, target: u32) -> Unknown {
        match self.board.memory_at(target) {
            Some(memory) => {
                let section = self.sections.iter().find(|own| own.contains(target));
                Unknown::Memory {
                    memory: memory.name.clone(),
                    section: section.map(|own| own.name.clone()),
                }
            }
            None => Unknown::Nothing { target },
        }
    }

    fn unknown(&self, address: u32, fetch: bool, what: Unknown) -> UnknownTime {
        let bounded = |memory: &&Memory| {
            memory.access.extra_cycles().is_some()
                && (!fetch || memory.fetch == AccessTime::Cycles(1))
        };
        let better = self.board.memory.iter().find(bounded);
        UnknownTime {
            address,
            fetch,
            what,
            better: better.map(|memory| memory.name.clone()),
        }
    }
}

/// Where accesses through registers go.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Bases(BTreeMap<u8, Reach>);

impl Bases {
    /// Of the registers that are said to point into known memory, those that nothing in a graph
    /// moves but by constants.
    pub fn of(said: &BTreeMap<u8, Reach>, graph: &Graph) -> Self {
        let mut bases = said.clone();
        for item in graph.blocks.iter().flat_map(|block| &block.items) {
            let written = item.inst.defs().core_bits();
            bases
                .retain(|register, _| written >> register & 1 == 0 || steps(&item.inst, *register));
        }
        Self(bases)
    }

    /// Where an access by a register and a constant goes.
    fn reach(&self, inst: &Inst) -> Option<&Reach> {
        let by_constant = !is_by_register(inst) && !is_literal(inst);
        by_constant.then(|| self.0.get(&inst.n)).flatten()
    }
}

/// Instructions that add a constant to a register, or take it away.
const STEPS: [Op; 4] = [
    Op::ADD_immediate,
    Op::SUB_immediate,
    Op::ADD_SP_plus_immediate,
    Op::SUB_SP_minus_immediate,
];

/// Whether an instruction that writes a register leaves there what was there, some constant
/// further.
fn steps(inst: &Inst, register: u8) -> bool {
    match inst.class() {
        Class::Load | Class::LoadDual => {
            inst.wback && inst.n == register && inst.t != register && inst.t2 != register
        }
        Class::LoadMultiple => inst.n == register && inst.imm >> register & 1 == 0,
        Class::Store | Class::StoreDual | Class::StoreMultiple => inst.n == register,
        _ => STEPS.contains(&inst.op()) && inst.n == register,
    }
}

#[cfg(test)]
mod tests;
