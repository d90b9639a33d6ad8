//! Waiting for memory: what an access may lose to others, and to the core's own fetching. Which
//! banks there are is the chip's ([`Chip`]).
//!
//! RP2350 has a port for each bank of SRAM; two who want one in the same cycle take turns, and the
//! phase of the turns is not documented. So an access is charged a cycle for each other manager
//! that may use its bank, and one where data may lie in a bank that the code is being fetched from.
//! Both are upper bounds, by rules; see `isa::timing::sram`. Devices of the peripheral bus make
//! everybody wait (`isa::timing::apb`); an address that is not known is memory's.

use whippen_isa::timing::sram::Chip;
use whippen_isa::timing::{Outcome, apb, sram};
use whippen_isa::{Class, Inst, Op, reg};

use std::collections::BTreeMap;

use super::facts::{Facts, Interval};
use super::graph::Graph;

/// A set of banks, bit n for bank n of [`Chip::bank`].
pub type Banks = u16;

/// Who else uses memory; by default nobody.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Surroundings {
    /// Whose memory it is.
    pub chip: Chip,
    /// The banks that the code's data may lie in, where the analysis does not know an address.
    pub data: Banks,
    /// Whether data in a bank that is being fetched from costs a cycle: "can sometimes", says the
    /// datasheet.
    pub prefetch: bool,
    /// For each other manager of the bus, of the same priority, the banks that it may use.
    pub others: Vec<Banks>,
    /// How many accesses of others come in a frame besides: each makes one of ours wait a cycle at
    /// most.
    pub visits: u32,
}

impl Surroundings {
    /// The banks of a range of addresses.
    pub fn banks(chip: Chip, from: u32, bytes: u32) -> Banks {
        let words = (from & !3..from.saturating_add(bytes)).step_by(4);
        words
            .take(16)
            .chain([from.saturating_add(bytes.saturating_sub(1))])
            .filter_map(|at| chip.bank(at))
            .fold(0, with)
    }

    /// Cycles that an instruction may wait for its data and for what is fetched behind it.
    pub fn waits(
        &self,
        inst: &Inst,
        at: u32,
        facts: &Facts,
        bases: &Bases,
        outcome: &Outcome,
    ) -> u16 {
        let fetches = fetched(inst, at, outcome.target.map(|target| target.address))
            .filter_map(|at| self.chip.bank(at));
        let fetching: u16 = fetches.map(|bank| self.rivals(bank)).sum();
        let words = if outcome.skipped { 0 } else { accesses(inst) };
        let first = if words == 0 {
            None
        } else {
            addresses(inst, at, facts)
        };
        let known = first.and_then(|first| {
            (0..words)
                .map(|word| self.word(inst, at, first, word))
                .sum()
        });
        let anywhere =
            || words.saturating_mul(self.anywhere(at, bases.banks(inst).unwrap_or(self.data)));
        fetching.saturating_add(known.unwrap_or_else(anywhere))
    }

    /// As [`Self::waits`] where nothing is known but the bases, and any other address may be a
    /// device's.
    pub fn waits_max(&self, inst: &Inst, at: u32, bases: &Bases) -> u16 {
        let device = if bases.banks(inst).is_some() {
            0
        } else {
            apb::WRITE.cycles.max(apb::READ.cycles)
        };
        let devices = accesses(inst).saturating_mul(u16::from(device));
        self.waits(inst, at, &Facts::nothing(), bases, &Outcome::NEXT)
            .saturating_add(devices)
    }

    /// The word that stands so many behind one of these; nothing is known of it where it may lie
    /// outside of SRAM.
    fn word(&self, inst: &Inst, at: u32, first: Interval, nth: u16) -> Option<u16> {
        let address = |first: i64| (first as u32).wrapping_add(4 * u32::from(nth));
        let (low, high) = (address(first.low), address(first.high));
        if low == high {
            let stores = matches!(inst.class(), Class::Store | Class::StoreDual);
            return Some(match self.chip.bank(low) {
                Some(bank) => self.bank(at, bank),
                None if apb::holds(low) => {
                    u16::from(if stores { apb::WRITE } else { apb::READ }.cycles)
                }
                None => 0,
            });
        }
        let mut words = (low & !3..=high).step_by(4);
        let banks = words.try_fold(0, |set, at| self.chip.bank(at).map(|bank| with(set, bank)))?;
        Some(self.anywhere(at, banks))
    }

    /// One word anywhere in a set of banks.
    fn anywhere(&self, at: u32, banks: Banks) -> u16 {
        (0..sram::BANKS)
            .filter(|bank| banks >> bank & 1 != 0)
            .map(|bank| self.bank(at, bank))
            .max()
            .unwrap_or(0)
    }

    /// One word of an exception's frame or a vector: nothing is fetched meanwhile.
    pub fn elsewhere(&self) -> u16 {
        (0..sram::BANKS)
            .filter(|bank| self.data >> bank & 1 != 0)
            .map(|bank| self.rivals(bank))
            .max()
            .unwrap_or(0)
    }

    /// One word of a bank.
    pub(super) fn bank(&self, at: u32, bank: u8) -> u16 {
        let ahead = [4, 8, 12].map(|words| (at & !3).wrapping_add(words));
        let meets = self.prefetch
            && ahead
                .into_iter()
                .any(|word| self.chip.bank(word) == Some(bank));
        self.rivals(bank)
            + if meets {
                u16::from(sram::PREFETCH.cycles)
            } else {
                0
            }
    }

    /// How many others may use a bank.
    pub(super) fn rivals(&self, bank: u8) -> u16 {
        self.others
            .iter()
            .filter(|other| **other >> bank & 1 != 0)
            .count() as u16
    }
}

/// The banks that accesses through a register are in.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Bases(BTreeMap<u8, Banks>);

impl Bases {
    /// Of the registers that are said to point into known memory, those that nothing in a graph
    /// moves but by constants.
    pub fn of(said: &BTreeMap<u8, Banks>, graph: &Graph) -> Self {
        let mut bases = said.clone();
        for item in graph.blocks.iter().flat_map(|block| &block.items) {
            let written = item.inst.defs().core_bits();
            bases
                .retain(|register, _| written >> register & 1 == 0 || steps(&item.inst, *register));
        }
        Self(bases)
    }

    /// The banks of an access by a register and a constant.
    fn banks(&self, inst: &Inst) -> Option<Banks> {
        let by_constant = !inst.op().identifier().ends_with("_register")
            && !inst.op().identifier().ends_with("_literal");
        by_constant.then(|| self.0.get(&inst.n).copied()).flatten()
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

fn with(set: Banks, bank: u8) -> Banks {
    set | 1 << bank
}

/// The words that are fetched for an instruction, and for the one that a branch leads to. A 16-bit
/// instruction at the upper half of a word came with the one before it, unless a branch led there.
fn fetched(inst: &Inst, at: u32, taken: Option<u32>) -> impl Iterator<Item = u32> {
    let starts = (at & 2 == 0).then_some(at);
    let ends = (at & 2 != 0 && inst.size() == 4).then_some(at.wrapping_add(2));
    let target = taken.filter(|target| target & 2 != 0);
    [starts, ends, target].into_iter().flatten()
}

/// How many words an instruction reads or writes.
fn accesses(inst: &Inst) -> u16 {
    use Class::*;
    match inst.class() {
        Load | Store | LoadOrdered | StoreOrdered | TableBranch => 1,
        LoadDual | StoreDual => 2,
        LoadMultiple | StoreMultiple => (inst.imm as u16).count_ones() as u16,
        FloatLoad | FloatStore | FloatLoadMultiple | FloatStoreMultiple => {
            inst.uses().union(inst.defs()).single_bits().count_ones() as u16
        }
        _ => 0,
    }
}

/// Addresses that are looked at one by one, at most.
const RANGE_BYTES_MAX: i64 = 4096;

/// The first address that an instruction accesses, where it is known or one of a few.
fn addresses(inst: &Inst, at: u32, facts: &Facts) -> Option<Interval> {
    let simple = matches!(
        inst.class(),
        Class::Load | Class::Store | Class::LoadDual | Class::StoreDual
    ) && !inst.op().identifier().ends_with("_register");
    let literal = simple && inst.op().identifier().ends_with("_literal");
    let base = match literal {
        true => Interval::point((at.wrapping_add(4) & !3) as i32),
        false if inst.n == reg::PC => return None,
        false => facts.interval(inst.n),
    };
    let offset = if inst.add {
        i64::from(inst.imm)
    } else {
        -i64::from(inst.imm)
    };
    let moved = if inst.index {
        Interval::of(base.low + offset, base.high + offset)
    } else {
        base
    };
    (simple && moved.high - moved.low < RANGE_BYTES_MAX).then_some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::{Arch, ItState, decode};

    /// Of a load from 0x20000000 by R0, on core 0, while core 1 uses its own banks.
    fn waits(from: u32, to: u32) -> u16 {
        let inst = decode(0x6801, 0, Arch::V8M, ItState::OUTSIDE).expect("ldr r1, [r0]");
        let around = Surroundings {
            data: 0b1111,
            prefetch: true,
            others: vec![0b10_1111_0000],
            ..Surroundings::default()
        };
        let facts = Facts::of_registers(&BTreeMap::from([(0, [from, to])]));
        around.waits(
            &inst,
            0x2000_0000,
            &facts,
            &Bases::default(),
            &Outcome::NEXT,
        )
    }

    #[test]
    fn an_address_of_a_few_waits_as_the_dearest_of_them() {
        assert_eq!(
            waits(0x2008_0000, 0x2008_0800),
            0,
            "near core 0, where nobody fetches"
        );
        assert_eq!(
            waits(0x2008_0ff0, 0x2008_1000),
            1,
            "the last is near core 1"
        );
        assert_eq!(
            waits(0x2000_0000, 0x2000_0000),
            0,
            "the bank of the instruction, not of those behind it"
        );
        assert_eq!(waits(0x2000_0000, 0x2000_0010), 1, "any bank of the code");
        assert_eq!(
            waits(0x2000_0100, 0x2004_0100),
            1,
            "too many to be looked at"
        );
        assert_eq!(
            waits(0x2008_1ff0, 0x2008_2010),
            1,
            "nothing is known where there is no memory"
        );
    }
}
