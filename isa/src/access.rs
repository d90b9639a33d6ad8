//! What an instruction accesses in memory: how many words, from where on, and what is fetched for
//! it.
//!
//! An address is a base register and a constant, or another register: [`Inst::first_offset`] says
//! the constant. Bytes and halfwords count as a word each: a bus moves a word at a time.

use crate::class::Class;
use crate::inst::Inst;
use crate::reg::{self, RegSet};
use crate::table::Op;

impl Class {
    /// Whether it reads memory into registers.
    pub fn is_load(self) -> bool {
        use Class::*;
        matches!(
            self,
            Load | LoadDual | LoadMultiple | LoadOrdered | FloatLoad | FloatLoadMultiple
        )
    }

    /// Whether it writes to memory.
    pub fn is_store(self) -> bool {
        use Class::*;
        matches!(
            self,
            Store | StoreDual | StoreMultiple | StoreOrdered | FloatStore | FloatStoreMultiple
        )
    }
}

impl Inst {
    /// How many words it reads or writes. Not counted: what a coprocessor's does
    /// ([`Inst::is_of_coprocessor_memory`]).
    pub fn words(&self) -> u16 {
        use Class::*;
        match self.class() {
            Load | Store | LoadOrdered | StoreOrdered | TableBranch => 1,
            LoadDual | StoreDual => 2,
            LoadMultiple | StoreMultiple => (self.imm as u16).count_ones() as u16,
            FloatLoad | FloatStore | FloatLoadMultiple | FloatStoreMultiple => {
                self.uses().union(self.defs()).single_bits().count_ones() as u16
            }
            _ => 0,
        }
    }

    /// Whether it loads or stores for a coprocessor, which alone knows how many words: LDC, STC.
    pub fn is_of_coprocessor_memory(&self) -> bool {
        let name = self.op().identifier();
        self.class() == Class::Coprocessor && (name.starts_with("LDC") || name.starts_with("STC"))
    }

    /// The register that the rest of an address is added to: PC where a literal is loaded, whose
    /// encodings have no `n`.
    pub fn base(&self) -> u8 {
        let pc = RegSet::core(reg::PC);
        match self.class().is_load() && self.uses().contains(pc) {
            true => reg::PC,
            false => self.n,
        }
    }

    /// Whether it accesses memory at its base and another register.
    pub fn is_by_register(&self) -> bool {
        let named = || self.op().identifier().ends_with("_register");
        self.class() == Class::TableBranch || self.words() > 0 && named()
    }

    /// The constant that a load or store of one register or two adds to its base, in the address or
    /// behind it (bytes).
    pub fn displacement(&self) -> i32 {
        let bytes = self.imm as i32;
        if self.add { bytes } else { -bytes }
    }

    /// How far behind its base register the first of its words begins (bytes), the one with the
    /// lowest address; behind PC it is counted from `Align(PC, 4)`. None for what accesses no
    /// memory, or adds a register.
    pub fn first_offset(&self) -> Option<i32> {
        use Class::*;
        if self.words() == 0 || self.is_by_register() {
            return None;
        }
        Some(match self.class() {
            LoadMultiple | StoreMultiple | FloatLoadMultiple | FloatStoreMultiple => {
                -(self.bytes_down() as i32)
            }
            _ if self.index => self.displacement(),
            _ => 0,
        })
    }

    /// How far a list begins before its base (bytes): FLDMDBX and FSTMDBX leave a word behind their
    /// registers.
    fn bytes_down(&self) -> u32 {
        let bytes = 4 * u32::from(self.words());
        match self.op() {
            Op::LDMDB | Op::STMDB | Op::PUSH | Op::VPUSH | Op::VPUSH_single => bytes,
            Op::VLDMDB | Op::VLDMDB_single | Op::VSTMDB | Op::VSTMDB_single => bytes,
            Op::FLDMDBX | Op::FSTMDBX => bytes + 4,
            _ => 0,
        }
    }

    /// The words that are fetched for it at an address, and for the one that it branches to: a
    /// 16-bit instruction in the upper half of a word came with the one before it, unless a branch
    /// led there.
    pub fn fetched_words(&self, at: u32, target: Option<u32>) -> impl Iterator<Item = u32> {
        let starts = (at & 2 == 0).then_some(at);
        let ends = (at & 2 != 0 && self.size() == 4).then_some(at.wrapping_add(2));
        let target = target.filter(|target| target & 2 != 0);
        [starts, ends, target].into_iter().flatten()
    }
}
