//! Memory interference: cycles that accesses and fetches take beyond one, as the board describes
//! its memories, banks and buses.
//!
//! Charged are, for each word:
//! * what the memory or the bus takes beyond a cycle;
//! * an access of every other manager that may use the bank, as the phase of the round robin is not
//!   documented;
//! * an own fetch, where the word may lie in a bank that the code is fetched from;
//! * at a bridge to devices that a DMA uses too, one read and one write of its;
//! * at one that the other core goes to in its ticks, what it may do there first.
//!
//! All are upper bounds, by rules. An address that facts do not narrow is taken for the core's own
//! data; what may be fetched or accessed in memory without a known time is an error.

mod access;
mod bases;
mod graph_memory;
mod indexed;
mod pipelining;
mod waits;

use whippen_arm::image::Linked;
use whippen_board::{AccessTime, BankSet, Board, Bus, Memory, Target};
use whippen_isa::timing::Outcome;
use whippen_isa::{Inst, reg};

use super::facts::{Facts, Interval};
use super::unknown::{Unknown, UnknownTime};
use bases::Bases;
pub use graph_memory::GraphMemory;
pub use waits::{Accessed, Waits};

use access::{addresses, roughly};

/// Cycles that an access costs more, at most, that meets an own fetch: "can sometimes", says the
/// RP2350 datasheet (3.7.4.9.12).
const FETCH_CYCLES: u16 = 1;

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
    /// Where the core's stack lies: data of code that hands out its addresses.
    pub stack: Reach,
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
    /// Whether data in a bank that the core fetches from costs a cycle.
    pub fetches: bool,
    /// For each other manager of the bus, of the same priority, the banks that it may use.
    pub contenders: Vec<BankSet>,
    /// How many accesses of others come in a tick besides: each makes one of ours wait for one
    /// access at most.
    pub remote_accesses: u32,
    /// What a DMA does besides.
    pub dma: Option<Dma>,
    /// The other core at a bridge.
    pub neighbour: Option<Neighbour>,
}

/// The other core at a bridge to devices that both go to in their ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neighbour {
    /// An address behind the bridge.
    pub device: u32,
    /// Cycles that one access there waits for it, at most.
    pub wait_cycles: u16,
}

/// A DMA at work in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dma {
    /// An address behind the bridge that it uses.
    pub device: u32,
    /// Cycles that one access there waits for it, at most: what is under way is not ended, and of
    /// its reads and writes one each may come first.
    pub wait_cycles: u16,
    /// Its accesses of memory for which an access of ours may wait: none where the cores go first.
    pub in_memory: u32,
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
    /// Banks that may be fetched from meanwhile.
    fetched: BankSet,
}

/// Where the parts of a core's program lie.
#[derive(Debug, Clone, Default)]
pub struct Lies {
    /// The banks of its code.
    pub code: BankSet,
    /// Its data.
    pub data: Reach,
    /// Its stack.
    pub stack: Reach,
}

impl<'a> Interference<'a> {
    /// A board with others at work.
    pub fn new(board: &'a Board, sections: &'a [Extent], lies: Lies, others: Others) -> Self {
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
            data: lies.data,
            stack: lies.stack,
            code: lies.code,
            others,
            banks,
        }
    }

    /// Where the parts of the core's program lie.
    pub fn lies(&self) -> Lies {
        Lies {
            code: self.code,
            data: self.data.clone(),
            stack: self.stack.clone(),
        }
    }

    /// Cycles that an instruction of a graph may wait for its data and for what is fetched behind
    /// it.
    ///
    /// # Errors
    /// It may meet memory without a known time.
    pub fn waits(
        &self,
        inst: &Inst,
        at: u32,
        facts: &Facts,
        graph: &GraphMemory,
        outcome: &Outcome,
    ) -> Result<Waits, UnknownTime> {
        let mut waits = Waits::default();
        for word in inst.fetched_words(at, outcome.target.map(|target| target.address)) {
            waits += self.fetch(at, word)?;
        }
        let words = if outcome.skipped { 0 } else { inst.words() };
        if words == 0 {
            return Ok(waits);
        }
        let access = Access {
            at,
            store: inst.class().is_store(),
            fetched: graph.fetched,
        };
        if let Some(first) = addresses(inst, at, facts) {
            for word in 0..words {
                waits += self.word(access, first, word)?;
            }
            return Ok(waits);
        }
        let mut each = self.anywhere(access, &self.reach(inst, at, graph))?;
        if let Some(base) = roughly(inst, facts) {
            each = each.max(self.beyond(access, base)?);
        }
        Ok(waits + each.times(words))
    }

    /// As [`Self::waits`] where nothing is known but the bases, and any other address may be a
    /// device's or in another core's memory.
    ///
    /// # Errors
    /// It may meet memory without a known time.
    pub fn waits_max(
        &self,
        inst: &Inst,
        at: u32,
        graph: &GraphMemory,
    ) -> Result<Waits, UnknownTime> {
        let waits = self.waits(inst, at, &Facts::nothing(), graph, &Outcome::NEXT)?;
        if graph.bases.reach(inst, at).is_some() {
            return Ok(waits);
        }
        let buses = self.board.buses.iter();
        let device = buses
            .map(|bus| self.device(bus, bus.read_cycles.max(bus.write_cycles)))
            .fold(Waits::default(), Waits::max);
        let all = self.board.memory.iter().flat_map(|memory| &memory.banks);
        let more = all
            .map(|&bank| self.bank(graph.fetched, bank))
            .fold(device, Waits::max);
        Ok(waits + more.times(inst.words()))
    }

    /// What an instruction's data are.
    pub fn accessed(&self, inst: &Inst, at: u32, facts: &Facts, graph: &GraphMemory) -> Accessed {
        match addresses(inst, at, facts) {
            _ if inst.words() == 0 => Accessed::Nothing,
            _ if inst.base() == reg::PC => Accessed::Constant,
            Some(address) => Accessed::At(address.low as u32),
            None => graph
                .bases
                .pointer(inst, at)
                .map_or(Accessed::Unknown, Accessed::By),
        }
    }

    /// Waiting for a word of instructions.
    fn fetch(&self, at: u32, word: u32) -> Result<Waits, UnknownTime> {
        let others = |others: u16| Waits {
            others,
            ..Waits::default()
        };
        if word == SOMEWHERE {
            let contention = banks_of(self.code).map(|bank| self.cycles(bank).contention);
            return Ok(others(contention.max().unwrap_or(0)));
        }
        if let Target::Memory(memory) = self.board.target(word)
            && memory.fetch == AccessTime::Cycles(1)
        {
            let contention = memory.bank(word).map(|bank| self.cycles(bank).contention);
            return Ok(others(contention.unwrap_or(0)));
        }
        Err(self.unknown(at, true, self.unknown_at(word)))
    }

    /// The word that stands so many behind one of these.
    fn word(&self, access: Access, first: Interval, nth: u16) -> Result<Waits, UnknownTime> {
        let address = |first: i64| (first as u32).wrapping_add(4 * u32::from(nth));
        let (low, high) = (address(first.low), address(first.high));
        if low == high {
            return self.one_word(access, low);
        }
        let mut most = Waits::default();
        for word in (low & !3..=high).step_by(4) {
            most = most.max(self.one_word(access, word)?);
        }
        Ok(most)
    }

    /// A word near an address that may also be no address: an index, to which the address is
    /// added.
    fn beyond(&self, access: Access, base: Interval) -> Result<Waits, UnknownTime> {
        match self.word(access, base, 0) {
            Err(UnknownTime {
                what: Unknown::Nothing { .. },
                ..
            }) => Ok(Waits::default()),
            other => other,
        }
    }

    /// A word at an address.
    fn one_word(&self, access: Access, word: u32) -> Result<Waits, UnknownTime> {
        match self.board.target(word) {
            Target::Memory(memory) if memory.access.extra_cycles().is_some() => Ok(memory
                .bank(word)
                .map_or(Waits::default(), |bank| self.bank(access.fetched, bank))),
            Target::Bus(bus) if access.store => Ok(self.device(bus, bus.write_cycles)),
            Target::Bus(bus) => Ok(self.device(bus, bus.read_cycles)),
            _ => Err(self.unknown(access.at, false, self.unknown_at(word))),
        }
    }

    /// One access behind a bridge, which takes so many cycles.
    fn device(&self, bus: &Bus, cycles: u16) -> Waits {
        let dma = self.others.dma.filter(|dma| bus.contains(dma.device));
        let neighbour = self.others.neighbour;
        let neighbour = neighbour.filter(|other| bus.contains(other.device));
        Waits {
            access: cycles.saturating_sub(1),
            others: neighbour.map_or(0, |other| other.wait_cycles),
            dma: dma.map_or(0, |dma| dma.wait_cycles),
            ..Waits::default()
        }
    }

    /// One word anywhere in what can be reached.
    fn anywhere(&self, access: Access, reach: &Reach) -> Result<Waits, UnknownTime> {
        if let Some(what) = &reach.unknown {
            return Err(self.unknown(access.at, false, what.clone()));
        }
        let each = banks_of(reach.banks).map(|bank| self.bank(access.fetched, bank));
        Ok(each.fold(Waits::default(), Waits::max))
    }

    /// Where an instruction's access goes whose address is not known: a table of branches lies
    /// behind its branch, and nobody has an address of the stack to whom the code gave none.
    fn reach(&self, inst: &Inst, at: u32, graph: &GraphMemory) -> Reach {
        let code = (inst.n == reg::PC)
            .then(|| self.board.memory_at(at))
            .flatten();
        if let Some(memory) = code {
            return Reach {
                banks: memory.bank_set(),
                unknown: None,
            };
        }
        let known = graph.bases.reach(inst, at).cloned();
        known.unwrap_or_else(|| match graph.hands_stack || inst.n == reg::SP {
            true => self.data.clone().and(self.stack.clone()),
            false => self.data.clone(),
        })
    }

    /// One word of an exception's frame or a vector: what is fetched meanwhile, the end of what is
    /// interrupted and the beginning of what follows, is code of this core.
    ///
    /// # Errors
    /// Stack or vectors lie in memory without a known time.
    pub fn exception_word(&self, at: u32, reach: &Reach) -> Result<Waits, UnknownTime> {
        let access = Access {
            at,
            store: true,
            fetched: self.code,
        };
        self.anywhere(access, reach)
    }

    /// Cycles that accesses wait for a DMA at memory, at most: each of its may hold up a load and a
    /// fetch at once.
    pub fn dma_cycles(&self) -> u32 {
        let accesses = self.others.dma.map_or(0, |dma| dma.in_memory);
        2 * accesses * self.remote_access_cycles()
    }

    /// Cycles that one access of somebody else makes one of ours wait, at most.
    pub fn remote_access_cycles(&self) -> u32 {
        let slowest = self.banks.iter().map(|cycles| cycles.extra).max();
        1 + u32::from(slowest.unwrap_or(0))
    }

    /// One word of a bank, while these may be fetched from.
    fn bank(&self, fetched: BankSet, bank: u8) -> Waits {
        let meets = self.others.fetches && fetched >> bank & 1 != 0;
        let cycles = self.cycles(bank);
        Waits {
            access: cycles.extra,
            fetches: if meets { FETCH_CYCLES } else { 0 },
            others: cycles.contention,
            dma: 0,
        }
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

/// The banks of a set.
fn banks_of(set: BankSet) -> impl Iterator<Item = u8> {
    (0..BankSet::BITS as u8).filter(move |bank| set >> bank & 1 != 0)
}

#[cfg(test)]
mod tests;
