//! Waiting for memory: what each access and each fetch takes beyond a cycle, from the memories and
//! buses of the certificate and the sections of the file.
//!
//! Charged for each word: what the memory or bus takes beyond a cycle; an access of the other core
//! where its sections or its stack lie in the same bank; an own fetch where the word may lie in a
//! bank that the function is fetched from; behind a bridge that a DMA uses, or the other core in
//! its ticks, what that holds it for.

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use whippen_isa::{Inst, reg};

use crate::Refusal;
use crate::access::{RANGE, addresses};
use crate::certificate::{Bus, Certificate, Memory};
use crate::elf::{Elf, Section};
use crate::facts::{ALL, Facts, Interval, holds};
use crate::step::Decoded;

/// The target of a return whose place is not known: in the upper half of a word of the core's code.
pub(crate) const SOMEWHERE: u32 = 2;
/// How far behind an instruction words may be fetched.
const AHEAD: u32 = 64;

/// A set of banks, bit n for bank n.
pub type Banks = u32;

/// Memory as a core meets it.
#[derive(Debug, Clone)]
pub struct Around<'a> {
    pub(crate) elf: &'a Elf,
    pub(crate) certificate: &'a Certificate,
    /// Which core.
    pub(crate) core: u32,
    /// Instructions that were met, by address and state of IT.
    pub(crate) decoded: RefCell<HashMap<(u32, u8), Rc<Decoded>>>,
    /// Banks of its code, of its data, of its stack.
    pub(crate) code: Banks,
    data: Banks,
    stack: Banks,
    /// Of each bank, cycles beyond the first and cycles that the other core makes it wait.
    banks: [(u16, u16); 32],
}

/// What an instruction does at memory, as far as its waiting depends on it.
pub(crate) struct Access<'a> {
    pub inst: &'a Inst,
    pub at: u32,
    pub facts: &'a Facts,
    /// The section that its base register points into.
    pub section: Option<u32>,
    pub fetched: Banks,
    pub hands_stack: bool,
    pub target: Option<u32>,
    pub skipped: bool,
}

impl Memory {
    fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.size
    }

    fn bank(&self, address: u32) -> Option<u8> {
        let count = self.banks.len() as u32;
        let offset = address.checked_sub(self.base)?;
        let index = match self.striped {
            true => (offset / 4).checked_rem(count)?,
            false => offset / self.size.checked_div(count)?.max(1),
        };
        self.banks
            .get(index as usize)
            .copied()
            .filter(|bank| *bank < 32)
    }

    /// The banks of a range that begins in this memory, as far as it lies there.
    fn banks_of(&self, from: u32, bytes: u32) -> Banks {
        let end = self.size.max(1) - 1;
        let offset = |at: u32| at.saturating_sub(self.base).min(end);
        let [first, last] = [from, from.saturating_add(bytes.max(1) - 1)].map(offset);
        let count = self.banks.len() as u32;
        let step = match self.striped {
            true => 4,
            false => (self.size / count.max(1)).max(1),
        };
        let (first, last) = (first / step, last / step);
        // As many steps as there are banks meet all of them.
        let steps = first..=last.min(first.saturating_add(count));
        let banks = steps.filter_map(|nth| self.bank(self.base + nth * step));
        banks.fold(0, |set, bank| set | 1 << bank)
    }
}

/// Which core uses a section: by its name. None: the start alone.
pub fn owner(name: &str) -> Option<u32> {
    let ends = |end: &&str| name.ends_with(*end);
    let start = name.starts_with(".text.start")
        || !name.starts_with('.')
        || ["vectors", "exceptions"].iter().any(ends)
        || [".boot2", ".image_def", ".copy_table", ".zero_table"].contains(&name);
    let second = name
        .split('.')
        .any(|part| part.split('_').next() == Some("core1"));
    (!start).then_some(u32::from(second))
}

fn banks_in(set: Banks) -> impl Iterator<Item = usize> {
    (0..32).filter(move |bank| set >> bank & 1 != 0)
}

impl<'a> Around<'a> {
    /// Memory around a core.
    ///
    /// # Errors
    /// Data or stacks lie where no time is known.
    pub fn new(certificate: &'a Certificate, elf: &'a Elf, core: u32) -> Result<Self, Refusal> {
        let mut around = Self {
            elf,
            certificate,
            core,
            decoded: RefCell::default(),
            code: 0,
            data: 0,
            stack: 0,
            banks: [(0, 0); 32],
        };
        around.code = around.banks_of_core(core, |own| own.code)?;
        around.data = around.banks_of_core(core, |own| !own.code)?;
        around.stack = around.stack_banks(core)?;
        let mut contenders = Vec::new();
        if certificate.cores == 1 {
            // A single core also runs what is named after another one.
            around.code |= around.banks_of_core(1, |own| own.code)?;
            around.data |= around.banks_of_core(1, |own| !own.code)?;
        }
        for other in (0..certificate.cores).filter(|other| *other != core) {
            contenders.push(around.banks_of_core(other, |own| own.code)?);
            let data = around.banks_of_core(other, |own| !own.code)?;
            contenders.push(data | around.stack_banks(other)?);
        }
        for bank in 0..32 {
            let mine = |memory: &&Memory| memory.banks.contains(&(bank as u8));
            let extra = certificate
                .memories
                .iter()
                .filter(mine)
                .map(|own| own.access)
                .max();
            let extra = extra.unwrap_or(0).saturating_sub(1);
            let others = contenders
                .iter()
                .filter(|set| **set >> bank & 1 != 0)
                .count() as u16;
            around.banks[bank] = (extra, others.saturating_mul(1 + extra));
        }
        Ok(around)
    }

    fn memory_at(&self, address: u32) -> Option<&Memory> {
        self.certificate
            .memories
            .iter()
            .find(|own| own.contains(address))
    }

    /// The memory of an address, by first address.
    pub(crate) fn memory_base(&self, address: u32) -> Option<u32> {
        self.memory_at(address).map(|memory| memory.base)
    }

    /// The memory of the core's stack.
    pub(crate) fn stack_memory(&self) -> Option<u32> {
        let end = self.stack_end(self.core).ok()?;
        self.memory_base(end - 4)
    }

    fn memory_of(&self, section: &Section) -> Result<&Memory, Refusal> {
        let memory = self.memory_at(section.base).filter(|own| own.access > 0);
        memory.ok_or_else(|| {
            Refusal::at(
                section.base,
                format!("`{}` lies where no time is known", section.name),
            )
        })
    }

    fn banks_of_core(&self, core: u32, of: impl Fn(&Section) -> bool) -> Result<Banks, Refusal> {
        let own = |section: &&Section| {
            section.size > 0 && owner(&section.name) == Some(core) && of(section)
        };
        let mut set = 0;
        for section in self.elf.sections.iter().filter(own) {
            set |= self
                .memory_of(section)?
                .banks_of(section.base, section.size);
        }
        Ok(set)
    }

    /// Where the stack of a core ends: the first word of its vectors.
    pub(crate) fn stack_end(&self, core: u32) -> Result<u32, Refusal> {
        let end = self
            .certificate
            .vectors(core)
            .and_then(|vectors| self.elf.word(vectors))
            .filter(|end| *end >= 4 && end & 3 == 0);
        end.ok_or_else(|| Refusal::new(format!("core {core} has no table of vectors")))
    }

    pub(crate) fn stack_banks(&self, core: u32) -> Result<Banks, Refusal> {
        let end = self.stack_end(core)?;
        let memory = self.memory_at(end - 4).filter(|own| own.access > 0);
        let memory =
            memory.ok_or_else(|| Refusal::at(end, "has a stack where no time is known"))?;
        Ok(memory.banks_of(memory.base, memory.size))
    }

    /// That a stack of so many bytes has room above whatever lies below its end.
    pub(crate) fn has_stack_room(&self, core: u32, bytes: u32) -> Result<(), Refusal> {
        let end = self.stack_end(core)?;
        let base = self.memory_at(end - 4).map_or(end, |memory| memory.base);
        let sections = self.elf.sections.iter().filter(|own| own.base < end);
        let mut below = sections
            .map(|own| own.base.saturating_add(own.size))
            .fold(base, u32::max);
        for other in (0..self.certificate.cores).filter(|other| *other != core) {
            let other = self.stack_end(other)?;
            below = below.max(if other <= end { other } else { 0 });
        }
        match bytes <= end.saturating_sub(below) {
            true => Ok(()),
            false => Err(Refusal::at(
                end,
                format!("has no room for {bytes} bytes of stack"),
            )),
        }
    }

    /// Waiting of one word in a bank.
    fn bank(&self, fetched: Banks, bank: usize) -> u16 {
        let (extra, others) = self.banks[bank & 31];
        let meets = self.certificate.fetches && fetched >> bank & 1 != 0;
        extra + others + u16::from(meets)
    }

    fn anywhere(&self, fetched: Banks, set: Banks) -> u16 {
        banks_in(set)
            .map(|bank| self.bank(fetched, bank))
            .max()
            .unwrap_or(0)
    }

    /// Waiting of one word of an exception's frame or of a vector.
    pub(crate) fn exception_word(&self, set: Banks) -> u64 {
        self.anywhere(self.code, set).into()
    }

    /// Banks of the table of vectors.
    pub(crate) fn section_banks(&self, address: u32) -> Result<Banks, Refusal> {
        let section = self.elf.section_at(address);
        let section = section.ok_or_else(|| Refusal::at(address, "lies in no section"))?;
        Ok(self
            .memory_of(section)?
            .banks_of(section.base, section.size))
    }

    /// Cycles that one access of somebody else makes one of ours wait.
    pub(crate) fn visit(&self) -> u64 {
        1 + u64::from(
            self.banks
                .iter()
                .map(|(extra, _)| *extra)
                .max()
                .unwrap_or(0),
        )
    }

    /// Waiting for a word of instructions.
    fn fetch(&self, word: u32) -> Result<u16, Refusal> {
        let others = |bank: usize| self.banks[bank & 31].1;
        if word == SOMEWHERE {
            return Ok(banks_in(self.code).map(others).max().unwrap_or(0));
        }
        let memory = self.memory_at(word).filter(|memory| memory.fetch == 1);
        let memory = memory.ok_or_else(|| Refusal::at(word, "is fetched in more than a cycle"))?;
        Ok(memory.bank(word).map_or(0, |bank| others(bank.into())))
    }

    /// Waiting where a branch leads: for its target alone.
    pub(crate) fn target_wait(&self, target: u32) -> Result<u16, Refusal> {
        if target & 2 == 0 {
            Ok(0)
        } else {
            self.fetch(target)
        }
    }

    /// The banks that may be fetched from while an instruction executes.
    pub fn fetched_at(&self, at: u32) -> Banks {
        if at == SOMEWHERE {
            return self.code;
        }
        let memory = self.memory_at(at);
        memory.map_or(0, |memory| memory.banks_of(at, AHEAD))
    }

    /// That code of a core is at an address.
    pub(crate) fn is_own_code(&self, at: u32) -> Result<(), Refusal> {
        let section = self
            .elf
            .section_at(at)
            .filter(|own| own.code && !own.writable);
        let owner = section.and_then(|own| owner(&own.name));
        match owner.is_some_and(|core| core == self.core || self.certificate.cores == 1) {
            true => Ok(()),
            false => Err(Refusal::at(at, format!("is no code of core {}", self.core))),
        }
    }

    /// Cycles that an instruction waits at most.
    pub(crate) fn waits(&self, access: &Access) -> Result<u16, Refusal> {
        let Access { inst, at, .. } = *access;
        let mut waits = 0_u16;
        for word in inst.fetched_words(at, access.target) {
            waits = waits.saturating_add(self.fetch(word)?);
        }
        let count = if access.skipped { 0 } else { inst.words() };
        if count == 0 {
            return Ok(waits);
        }
        if let Some([low, high]) = addresses(inst, at, access.facts) {
            for nth in 0..count {
                let more = 4 * u32::from(nth);
                let ends = [low, high].map(|end| (end as u32).wrapping_add(more));
                waits = waits.saturating_add(self.words_between(access, ends)?);
            }
            return Ok(waits);
        }
        let mut each = self.anywhere(access.fetched, self.reach(access)?);
        let base = access.facts.of(inst.n);
        if inst.is_by_register() && inst.n != reg::PC && base[1] - base[0] < RANGE {
            let near = self.words_between(access, base.map(|end| end as u32));
            // The base may be an index, to which the address is added.
            each = each.max(near.unwrap_or(0));
        }
        Ok(waits.saturating_add(each.saturating_mul(count)))
    }

    /// As [`Self::waits`], where any address may be a device's or in any memory.
    pub(crate) fn waits_anywhere(&self, access: &Access) -> Result<u16, Refusal> {
        let waits = self.waits(access)?;
        if access.section.is_some() || access.inst.n == reg::SP {
            return Ok(waits);
        }
        let buses = self.certificate.buses.iter();
        let device = buses.map(|bus| self.device(bus, bus.read.max(bus.write)));
        let device = device.max().unwrap_or(0);
        let memories = self.certificate.memories.iter();
        let banks = memories.flat_map(|memory| &memory.banks);
        let most = banks
            .map(|bank| self.bank(access.fetched, (*bank).into()))
            .fold(device, u16::max);
        Ok(waits.saturating_add(most.saturating_mul(access.inst.words())))
    }

    /// A word at any of these addresses.
    fn words_between(&self, access: &Access, [low, high]: [u32; 2]) -> Result<u16, Refusal> {
        let mut most = 0;
        for word in (low & !3..=high).step_by(4) {
            most = most.max(self.one_word(access, word)?);
        }
        Ok(most)
    }

    fn one_word(&self, access: &Access, word: u32) -> Result<u16, Refusal> {
        if let Some(memory) = self.memory_at(word).filter(|memory| memory.access > 0) {
            let bank = memory.bank(word);
            return Ok(bank.map_or(0, |bank| self.bank(access.fetched, bank.into())));
        }
        let buses = &self.certificate.buses;
        let bus = buses
            .iter()
            .find(|bus| word.wrapping_sub(bus.base) < bus.size);
        let bus = bus.ok_or_else(|| {
            Refusal::at(
                access.at,
                format!("accesses {word:#x}, where no time is known"),
            )
        })?;
        let stores = access.inst.class().is_store();
        Ok(self.device(bus, if stores { bus.write } else { bus.read }))
    }

    /// Waiting of an access behind a bridge that takes so many cycles.
    fn device(&self, bus: &Bus, cycles: u16) -> u16 {
        let dma = self.certificate.dma.filter(|dma| dma.bus == bus.base);
        let waits = dma.map_or(0, |dma| dma.wait);
        let neighbour = self.certificate.neighbour.as_ref();
        let neighbour = neighbour.filter(|other| other.bus == bus.base);
        let waits_too = neighbour.and_then(|other| other.waits.get(self.core as usize));
        cycles
            .saturating_sub(1)
            .saturating_add(waits)
            .saturating_add(waits_too.copied().unwrap_or(0))
    }

    /// Cycles that a frame waits for a DMA at memory: each access of its may hold up one of ours
    /// and a fetch at once.
    pub(crate) fn dma_cycles(&self) -> u64 {
        let accesses = self.certificate.dma.map_or(0, |dma| dma.accesses);
        2 * u64::from(accesses) * self.visit()
    }

    /// The banks of an access whose address is not known.
    fn reach(&self, access: &Access) -> Result<Banks, Refusal> {
        let Access { inst, at, .. } = *access;
        if inst.n == reg::PC {
            let memory = self.memory_at(at);
            return Ok(memory.map_or(0, |memory| memory.banks_of(memory.base, memory.size)));
        }
        let by_register = inst.is_by_register();
        match access.section.filter(|_| !by_register) {
            Some(section) => self.section_banks(section),
            None if inst.n == reg::SP && !by_register => Ok(self.stack),
            None if access.hands_stack || inst.n == reg::SP => Ok(self.data | self.stack),
            None => Ok(self.data),
        }
    }

    /// The section that an interval lies in.
    pub fn section_of(&self, value: Interval) -> Option<u32> {
        let low = value[0] as u32;
        let section = self.elf.section_at(low).filter(|_| holds(ALL, value))?;
        let rest = section.size - (low - section.base);
        (value[1] - value[0] < i64::from(rest)).then_some(section.base)
    }
}
