//! Stack unwinding: at every instruction, where the caller's stack and registers are.
//!
//! ```text
//!   code, functions, targets of indirect branches --data flow--> Entry values of registers and stack slots --> Row..
//! ```
//!
//! Found by following the code itself, so what is generated and what is written by hand need no
//! directives and cannot disagree with their bytes. A register or a stack slot holds the value that
//! some register had at the entry of the function, or something else; where paths meet, what they
//! agree on. The canonical frame address (CFA) is the stack pointer at the entry.
//!
//! A function that never returns has no caller: its return address is undefined. What a call keeps
//! is what the callee keeps, where its code is here; one in another object keeps what the procedure
//! call standard says, and one that nobody names keeps nothing.
//!
//! Not here: how the rows are written (`dwarf`).

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};

use super::flow::{Flow, state_at};
use crate::control::Control;
use whippen_isa::{Inst, ItState, reg};

/// Registers that a caller may want back: R4 to R11 and LR.
pub(super) const KEPT: [u8; 9] = [4, 5, 6, 7, 8, 9, 10, 11, reg::LR];

/// Where the value is that a register had at the entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    /// Where it was.
    Same,
    /// So many bytes from the CFA.
    Slot(i32),
    /// In another register.
    Register(u8),
    /// Nowhere.
    Lost,
}

/// From an address on: the CFA in bytes above the stack pointer, and the rules of [`KEPT`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Row {
    pub at: u32,
    pub cfa: i32,
    pub rules: [Rule; KEPT.len()],
}

impl Row {
    /// What holds at the entry of a function.
    pub(super) fn entry(at: u32) -> Row {
        Row {
            at,
            cfa: 0,
            rules: [Rule::Same; KEPT.len()],
        }
    }
}

/// The rows of all code that is reached from functions, by address.
pub(super) fn rows(flow: &Flow) -> Vec<Row> {
    let mut unwind = Unwind {
        flow,
        frames: FxHashMap::with_capacity_and_hasher(flow.instructions(), FxBuildHasher),
        entries: BTreeMap::new(),
        changed: FxHashMap::default(),
    };
    unwind.find_entries();
    let (order, is_settled) = unwind.callees_first();
    // Where callees cannot all come first, what they change is found with what they were found to
    // change so far, until it is all.
    while unwind.follow_all(&order) && !is_settled {}
    let frames = unwind.frames.into_iter();
    let mut rows: Vec<Row> = frames.map(|(at, (frame, _))| frame.row(at)).collect();
    rows.sort_unstable_by_key(|row| row.at);
    rows
}

/// What holds before an instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Frame {
    /// The entry of the function.
    function: u32,
    /// The register whose value at the entry each register has.
    registers: [Option<u8>; 15],
    /// The same of the words below the CFA, the first right below it.
    slots: Vec<Option<u8>>,
}

impl Frame {
    fn entry(function: u32, returns: bool) -> Frame {
        let mut registers = std::array::from_fn(|register| Some(register as u8));
        if !returns {
            registers[usize::from(reg::LR)] = None;
        }
        Frame {
            function,
            registers,
            slots: Vec::new(),
        }
    }

    fn depth(&self) -> i32 {
        4 * self.slots.len() as i32
    }

    fn row(&self, at: u32) -> Row {
        let rule = |register: u8| {
            let holds = |held: &Option<u8>| *held == Some(register);
            if let Some(slot) = self.slots.iter().position(holds) {
                Rule::Slot(-4 * (slot as i32 + 1))
            } else if holds(&self.registers[usize::from(register)]) {
                Rule::Same
            } else {
                let other = self.registers.iter().position(holds);
                other.map_or(Rule::Lost, |other| Rule::Register(other as u8))
            }
        };
        Row {
            at,
            cfa: self.depth(),
            rules: KEPT.map(rule),
        }
    }

    /// What both agree on; whether that is less than this one knew.
    fn meet(&mut self, other: &Frame) -> bool {
        let mut less = self.slots.len() > other.slots.len();
        self.slots.truncate(other.slots.len());
        let slots = self.slots.iter_mut().zip(&other.slots);
        let all = self.registers.iter_mut().zip(&other.registers).chain(slots);
        for (own, other) in all {
            if own != other {
                less |= own.take().is_some();
            }
        }
        less
    }

    /// The index of the word at a distance from the CFA.
    fn slot(&self, at: i32) -> Option<usize> {
        let index = usize::try_from(-at / 4 - 1).ok()?;
        (at % 4 == 0 && index < self.slots.len()).then_some(index)
    }

    /// An instruction, apart from where it leads.
    fn execute(&mut self, inst: &Inst) {
        let (sp, before) = (-self.depth(), self.registers);
        let copied = |register: u8| before[usize::from(register)];
        let defs = inst.defs().core_bits();
        let value = |register: u8| match inst.op() {
            whippen_isa::Op::MOV_register if inst.amount == 0 => copied(inst.m),
            _ => {
                let loaded = inst.loaded_slot(sp, register).and_then(|at| self.slot(at));
                loaded.and_then(|slot| self.slots[slot])
            }
        };
        let defined = |register: &u8| defs >> register & 1 != 0;
        let mut registers = before;
        for register in (0..15).filter(defined) {
            registers[usize::from(register)] = value(register).filter(|_| !inst.is_conditional());
        }
        if defined(&reg::SP) {
            let down = -(sp + inst.sp_change_bytes().unwrap_or(0)) / 4;
            self.slots.resize(down.max(0) as usize, None);
        }
        // What has another base stores to no slot.
        for register in (0..15).filter(|_| inst.n == reg::SP) {
            if let Some(slot) = inst.stored_slot(sp, register).and_then(|at| self.slot(at)) {
                self.slots[slot] = copied(register).filter(|_| !inst.is_conditional());
            }
        }
        self.registers = registers;
    }

    /// A call that changes these of the registers that calls keep.
    fn call(&mut self, changed: u16) {
        for register in [0, 1, 2, 3, 12, reg::LR] {
            self.registers[usize::from(register)] = None;
        }
        for register in (0..15).filter(|register| changed >> register & 1 != 0) {
            self.registers[register] = None;
        }
    }
}

struct Unwind<'a> {
    flow: &'a Flow<'a>,
    /// What holds before each instruction, and its place in an IT block.
    frames: FxHashMap<u32, (Frame, ItState)>,
    /// Addresses that are called, or named as functions and not branched to from inside another.
    entries: BTreeMap<u32, Entered>,
    /// The registers that each function does not keep, as bits.
    changed: FxHashMap<u32, u16>,
}

/// A function as it is entered.
struct Entered {
    returns: bool,
    /// What it calls and where it branches to.
    leads_to: BTreeSet<u32>,
}

impl Unwind<'_> {
    /// Named functions that nobody branches to from inside another, and what is called.
    fn find_entries(&mut self) {
        let mut inside = BTreeSet::new();
        for (at, to) in &self.flow.targets {
            let inst = self.flow.inst(*at, ItState::OUTSIDE);
            if inst.is_some_and(|inst| Control::of(&inst, *at) != Control::CallIndirect) {
                inside.extend(to.iter().copied());
            }
        }
        let functions = self.flow.functions.iter().copied();
        let mut open: Vec<u32> = functions.filter(|at| !inside.contains(at)).collect();
        while let Some(entry) = open.pop() {
            let is_code = self.flow.inst(entry, ItState::OUTSIDE).is_some();
            if is_code && !self.entries.contains_key(&entry) {
                let found = self.entry(entry, &mut open);
                self.entries.insert(entry, found);
            }
        }
    }

    /// A function, from every instruction that is reached without leaving it; what it calls is
    /// added to `called`.
    fn entry(&self, entry: u32, called: &mut Vec<u32>) -> Entered {
        let (mut open, mut done) = (vec![(entry, ItState::OUTSIDE)], FxHashSet::default());
        let mut found = Entered {
            returns: false,
            leads_to: BTreeSet::new(),
        };
        while let Some((at, it)) = open.pop() {
            if !done.insert(at) {
                continue;
            }
            let Some(inst) = self.flow.inst(at, it) else {
                continue;
            };
            let leads = self.flow.leads(&inst, at);
            found.returns |= leads.returns;
            called.extend(leads.calls.iter().flatten());
            found.leads_to.extend(leads.calls.iter().flatten());
            for to in leads.to {
                open.push((to, state_at(to, at, &inst, it)));
                if to != entry && to != at + inst.size() {
                    found.leads_to.insert(to);
                }
            }
        }
        found
    }

    /// All functions, each behind those that it calls or goes on to, and whether that can be: not
    /// where one leads to itself.
    fn callees_first(&self) -> (Vec<u32>, bool) {
        let (mut order, mut places) = (Vec::new(), FxHashMap::default());
        let mut is_settled = true;
        for first in self.entries.keys() {
            let mut open = vec![(*first, false)];
            while let Some((at, is_done)) = open.pop() {
                if is_done {
                    places.insert(at, true);
                    order.push(at);
                } else if let Some(is_done) = places.get(&at) {
                    is_settled &= is_done;
                } else if let Some(entry) = self.entries.get(&at) {
                    places.insert(at, false);
                    open.push((at, true));
                    open.extend(entry.leads_to.iter().map(|to| (*to, false)));
                }
            }
        }
        (order, is_settled)
    }

    /// Follows all functions in this order; whether one was found to change more than was known.
    fn follow_all(&mut self, order: &[u32]) -> bool {
        self.frames.clear();
        let mut more = false;
        for entry in order {
            let frame = Frame::entry(*entry, self.entries[entry].returns);
            self.frames.insert(*entry, (frame, ItState::OUTSIDE));
        }
        for entry in order {
            let mut open = vec![*entry];
            while let Some(at) = open.pop() {
                more |= self.follow(at, &mut open);
            }
        }
        more
    }

    /// Follows the instruction at an address; whether its function was found to change more.
    fn follow(&mut self, at: u32, open: &mut Vec<u32>) -> bool {
        let Some((frame, it)) = self.frames.get(&at).cloned() else {
            return false;
        };
        let Some(inst) = self.flow.inst(at, it) else {
            self.frames.remove(&at);
            return false;
        };
        let leads = self.flow.leads(&inst, at);
        let mut behind = frame;
        behind.execute(&inst);
        let changes = |changed: &FxHashMap<u32, u16>, function: u32| {
            changed.get(&function).copied().unwrap_or(0)
        };
        for called in &leads.calls {
            behind.call(called.map_or(0, |called| changes(&self.changed, called)));
        }
        if leads.calls_anybody {
            behind.call(0xff0);
        }
        let mut changed = 0;
        if leads.returns {
            let lost = (4..12).filter(|r| behind.registers[usize::from(*r)] != Some(*r));
            changed |= lost.fold(0, |bits, r| bits | 1 << r);
        }
        for to in leads.to {
            if self.entries.contains_key(&to) && to != behind.function {
                // It goes on as if it had been called by our caller.
                changed |= changes(&self.changed, to);
                continue;
            }
            let it = state_at(to, at, &inst, it);
            self.arrive(to, &behind, it, open);
        }
        let known = self.changed.entry(behind.function).or_default();
        std::mem::replace(known, *known | changed) != *known | changed
    }

    fn arrive(&mut self, at: u32, frame: &Frame, it: ItState, open: &mut Vec<u32>) {
        let less = match self.frames.get_mut(&at) {
            Some((known, _)) => known.meet(frame),
            None => {
                self.frames.insert(at, (frame.clone(), it));
                true
            }
        };
        if less {
            open.push(at);
        }
    }
}
