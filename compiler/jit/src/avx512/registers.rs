//! Register allocation while code is written: whoever is needed the latest makes room.
//!
//! ```text
//!   word   a vector of 16 words      zmm0 .. zmm29, or a place in the room
//!   mask   a bit for each of 16      k1 .. k6, or a place in the room
//! ```
//!
//! Values seldom change, so what was stored once need not be stored again. Where an arm may be
//! skipped, all that was in a register before stands in the same one behind it
//! ([`Registers::restore`]).

use super::encoder::{ALL, Address, Encoder, Gpr, Mask, MaskOp, Operand, Zmm, forms};
use std::collections::{BTreeSet, HashMap};

/// How many vectors nodes may be in; the others hold the same throughout.
const WORDS: usize = 30;

/// Bytes of a place in the room, for a vector, or for a mask.
pub(super) const SLOT_BYTES: i32 = 64;

/// What is kept in a register: a value of the kernel or one of the code's own.
pub(super) type Node = usize;

/// Which registers hold it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bank {
    Words,
    Masks,
}

/// What is known of a node beforehand.
#[derive(Debug, Clone)]
pub(super) struct Facts {
    pub bank: Bank,
    /// The same for all keys, and known.
    pub known: Option<i64>,
    /// Where it is read, in order.
    pub uses: Vec<usize>,
}

/// Where a node is.
#[derive(Debug, Clone, Copy, Default)]
struct Home {
    register: Option<u8>,
    slot: Option<i32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Holder {
    Free,
    /// Not for nodes.
    Reserved,
    /// Until the instruction is done.
    Temporary,
    Node(Node),
}

/// Words that code reads, each once.
#[derive(Debug, Default)]
pub(super) struct Constants {
    words: Vec<i32>,
    offsets: HashMap<i32, i32>,
}

impl Constants {
    /// Where a word stands, in bytes.
    fn offset(&mut self, number: i32) -> i32 {
        let next = 4 * self.words.len() as i32;
        let at = *self.offsets.entry(number).or_insert(next);
        if at == next {
            self.words.push(number);
        }
        at
    }

    /// The words as they are read, four in each. A product reads eight bytes, so there is one more.
    pub fn finish(mut self) -> Vec<u128> {
        self.words.extend([0; 4]);
        let word = |four: &[i32], at: usize| u128::from(four[at] as u32) << (32 * at);
        let all = self.words.chunks_exact(4);
        all.map(|four| (0..4).fold(0, |whole, at| whole | word(four, at)))
            .collect()
    }
}

/// What registers held before an arm.
pub(super) struct Snapshot {
    homes: Vec<Home>,
    holders: [[Holder; 32]; 2],
}

/// All registers, and the code that is written.
pub(super) struct Registers {
    pub e: Encoder,
    pub facts: Vec<Facts>,
    homes: Vec<Home>,
    holders: [[Holder; 32]; 2],
    /// Registers that the instruction at hand reads or writes, a bit for each.
    busy: [u32; 2],
    /// The place of the instruction at hand.
    pub position: usize,
    /// Where places in the room begin, and how many bytes of it are used.
    slots: i32,
    pub room: i32,
    pub constants: Constants,
    /// There were too few registers for what must be in one.
    pub has_failed: bool,
}

impl Registers {
    /// Registers of which none holds anything; these masks are not given away.
    pub fn new(facts: Vec<Facts>, room: i32, masks: &[Mask], constants: Constants) -> Registers {
        let mut holders = [[Holder::Free; 32], [Holder::Reserved; 32]];
        holders[1][1..8].fill(Holder::Free);
        holders[0][WORDS..].fill(Holder::Reserved);
        for Mask(n) in masks {
            holders[1][*n as usize] = Holder::Reserved;
        }
        Registers {
            e: Encoder::default(),
            homes: vec![Home::default(); facts.len()],
            facts,
            holders,
            busy: [0; 2],
            position: 0,
            slots: room,
            room,
            constants,
            has_failed: false,
        }
    }

    /// A node that is no value of the kernel and may be read until it is let go.
    pub fn held(&mut self, bank: Bank) -> Node {
        self.facts.push(Facts {
            bank,
            known: None,
            uses: vec![usize::MAX],
        });
        self.homes.push(Home::default());
        self.facts.len() - 1
    }

    /// A node is not read any longer.
    pub fn let_go(&mut self, node: Node) {
        self.facts[node].uses.clear();
        self.settle();
    }

    /// The place of the next instruction.
    pub fn step(&mut self) {
        self.position += 1;
    }

    /// A register for a node that is being made.
    pub fn define(&mut self, node: Node) -> u8 {
        let bank = self.facts[node].bank;
        let register = self.take(bank);
        self.give(bank, register, node);
        register
    }

    /// A register until the instruction is done.
    pub fn temporary(&mut self, bank: Bank) -> u8 {
        let register = self.take(bank);
        self.holders[bank as usize][register as usize] = Holder::Temporary;
        register
    }

    /// Part of the instruction is done, and needs no temporary registers any longer.
    pub fn release(&mut self) {
        self.busy = [0; 2];
        for holder in self.holders.iter_mut().flatten() {
            if *holder == Holder::Temporary {
                *holder = Holder::Free;
            }
        }
    }

    /// The instruction is done: what is not read again makes room.
    pub fn settle(&mut self) {
        self.release();
        for bank in [Bank::Words, Bank::Masks] {
            for register in 0..32 {
                match self.holders[bank as usize][register] {
                    Holder::Node(node) if !self.is_alive(node) => {
                        self.holders[bank as usize][register] = Holder::Free;
                        self.homes[node].register = None;
                    }
                    _ => {}
                }
            }
        }
    }

    /// A node as last operand: in a register where it is in one or there is room, else where it
    /// stands.
    pub fn operand(&mut self, node: Node) -> Operand {
        if let Some(number) = self.facts[node].known {
            return Operand::Broadcast(self.constant(number as i32));
        }
        let has_room = self.holders[0].contains(&Holder::Free);
        match self.homes[node] {
            Home {
                register: None,
                slot: Some(slot),
            } if !has_room => Operand::Memory(Address::new(Gpr::Rbp, slot)),
            _ => Operand::Zmm(self.word(node)),
        }
    }

    /// A node of words in a register.
    pub fn word(&mut self, node: Node) -> Zmm {
        if let Some(number) = self.facts[node].known {
            let to = Zmm(self.temporary(Bank::Words));
            let at = self.constant(number as i32);
            let last = Operand::Memory(at);
            self.e.vector_of(forms::PBROADCASTD, to, last);
            return to;
        }
        Zmm(self.present(node))
    }

    /// A mask in a register.
    pub fn mask(&mut self, node: Node) -> Mask {
        if let Some(bit) = self.facts[node].known {
            let to = self.temporary(Bank::Masks);
            let op = if bit == 0 {
                MaskOp::Differ
            } else {
                MaskOp::Equal
            };
            self.e.mask(op, to, Mask(to), Operand::Mask(Mask(to)));
            return Mask(to);
        }
        Mask(self.present(node))
    }

    /// Where a word stands that is the same for all keys.
    pub fn constant(&mut self, number: i32) -> Address {
        Address::new(Gpr::R9, self.constants.offset(number))
    }

    /// What a register holds of a node has changed: so does what the room has of it.
    pub fn changed(&mut self, node: Node) {
        if let Home {
            register: Some(register),
            slot: Some(slot),
        } = self.homes[node]
        {
            self.keep(self.facts[node].bank, register, slot);
        }
    }

    /// Where everything is.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            homes: self.homes.clone(),
            holders: self.holders,
        }
    }

    /// Puts back into its register all that was in one, and forgets what has come to be since.
    pub fn restore(&mut self, snapshot: Snapshot) {
        for bank in [Bank::Words, Bank::Masks] {
            for register in 0..32 {
                let Holder::Node(node) = snapshot.holders[bank as usize][register as usize] else {
                    continue;
                };
                if !self.is_alive(node) || self.homes[node].register == Some(register) {
                    continue;
                }
                match self.homes[node].slot {
                    Some(slot) => self.load(bank, register, slot),
                    None => self.has_failed = true,
                }
            }
        }
        self.homes = snapshot.homes;
        self.homes.resize(self.facts.len(), Home::default());
        self.holders = snapshot.holders;
        self.settle();
    }

    /// A node in a register; it has been made.
    fn present(&mut self, node: Node) -> u8 {
        let bank = self.facts[node].bank;
        let register = match self.homes[node] {
            Home {
                register: Some(register),
                ..
            } => register,
            Home { slot, .. } => {
                let register = self.take(bank);
                match slot {
                    Some(slot) => self.load(bank, register, slot),
                    None => self.has_failed = true,
                }
                self.give(bank, register, node);
                register
            }
        };
        self.busy[bank as usize] |= 1 << register;
        register
    }

    fn is_alive(&self, node: Node) -> bool {
        self.next_use(node).is_some()
    }

    fn next_use(&self, node: Node) -> Option<usize> {
        let uses = &self.facts[node].uses;
        let next = uses.partition_point(|at| *at <= self.position);
        uses.get(next).copied()
    }

    fn give(&mut self, bank: Bank, register: u8, node: Node) {
        self.holders[bank as usize][register as usize] = Holder::Node(node);
        self.homes[node].register = Some(register);
    }

    /// A register that nothing needs, or whose node is needed the latest.
    fn take(&mut self, bank: Bank) -> u8 {
        let holders = self.holders[bank as usize];
        let free = holders.iter().position(|holder| *holder == Holder::Free);
        let latest = || {
            let nodes = holders.iter().enumerate().filter_map(|(register, holder)| {
                let is_busy = self.busy[bank as usize] >> register & 1 == 1;
                match holder {
                    Holder::Node(node) if !is_busy => {
                        Some((self.next_use(*node).unwrap_or(usize::MAX), register))
                    }
                    _ => None,
                }
            });
            nodes.max().map(|(_, register)| register)
        };
        let Some(register) = free.or_else(latest) else {
            self.has_failed = true;
            return 1;
        };
        if let Holder::Node(node) = holders[register] {
            self.store(bank, register as u8, node);
        }
        self.busy[bank as usize] |= 1 << register;
        register as u8
    }

    /// Takes a node out of its register.
    fn store(&mut self, bank: Bank, register: u8, node: Node) {
        self.homes[node].register = None;
        if self.homes[node].slot.is_some() || !self.is_needed(node) {
            return;
        }
        let slot = self.free_slot();
        self.homes[node].slot = Some(slot);
        self.keep(bank, register, slot);
    }

    fn keep(&mut self, bank: Bank, register: u8, slot: i32) {
        let last = Operand::Memory(Address::new(Gpr::Rbp, slot));
        match bank {
            Bank::Words => self.e.vector_of(forms::MOVDQU32_STORE, Zmm(register), last),
            Bank::Masks => self.e.mask(MaskOp::Store, register, ALL, last),
        }
    }

    /// The first place in the room that holds nothing which is still read.
    fn free_slot(&mut self) -> i32 {
        let needed = |node: &Node| self.is_needed(*node);
        let nodes = (0..self.homes.len()).filter(needed);
        let taken: BTreeSet<i32> = nodes.filter_map(|node| self.homes[node].slot).collect();
        let mut all = (self.slots..).step_by(SLOT_BYTES as usize);
        let slot = all.find(|slot| !taken.contains(slot)).unwrap_or(self.slots);
        self.room = self.room.max(slot + SLOT_BYTES);
        slot
    }

    /// Whether the instruction at hand or a later one reads it.
    fn is_needed(&self, node: Node) -> bool {
        self.facts[node]
            .uses
            .last()
            .is_some_and(|last| *last >= self.position)
    }

    fn load(&mut self, bank: Bank, register: u8, slot: i32) {
        let last = Operand::Memory(Address::new(Gpr::Rbp, slot));
        match bank {
            Bank::Words => self.e.vector_of(forms::MOVDQU32, Zmm(register), last),
            Bank::Masks => self.e.mask(MaskOp::Move, register, ALL, last),
        }
    }
}
