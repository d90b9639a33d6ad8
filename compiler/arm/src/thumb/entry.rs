//! Prologue and epilogue: entry and end of a tick, `init` of all keys, `begin` of one.
//!
//! ```text
//!   NAME_tick: save, what all keys share, STATE RECORD SAMPLES HISTORY, to the first key's code ... end: rings go on, pointers, tick + 1, restore
//!   NAME_init: save, STATE RECORD SAMPLES HISTORY, pointers, [init of a key]*, restore
//!   NAME_begin: STATE RECORD SAMPLES HISTORY of one key, its cells, [init of a key], restore
//! ```
//!
//! As part of a firmware's frame all take the first key's word in R1 and keep no register but SP.
//! `NAME_begin` is there for it alone.

mod arithmetic;
mod events;
mod pointers;

use super::emit::{Item, Label};
use super::minst::template;
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use super::state_layout::{StateLayout, TICK};
use super::{minst::Relocation, names};
use crate::features::Features;
use whippen_isa::reg::{LR, PC, SP};
use whippen_isa::{Cond, Inst, Op, ShiftType};
use whippen_kernel::{Kernel, Type};

/// R4 to R11 and LR.
const SAVED: u32 = 0x0ff0;
/// R4 and R5, which carry SAMPLES and HISTORY to and from the stack where PUSH takes low registers
/// alone.
const HIGH: u32 = 0x0030;

/// Labels that this code needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Labels {
    pub init_key: Label,
    pub init_next: Label,
    /// Three, then two more.
    pub events: Label,
}

/// How many labels there are.
pub(super) const LABELS: Label = 7;

/// A list of instructions being written.
struct EntryWriter<'a> {
    layout: &'a StateLayout,
    features: &'static Features,
    items: Vec<Item>,
}

/// Entry and end of a tick, with labels from `events` on; `slots` words of the stack are for the
/// keys' code, and for what is computed for all of them before.
pub(super) fn tick(
    layout: &StateLayout,
    features: &'static Features,
    name: &str,
    slots: usize,
    shared: Vec<Item>,
    modes: &[String],
    events: Label,
) -> Vec<Item> {
    let mut w = EntryWriter::new(layout, features);
    w.items.push(Item::Function {
        name: names::tick(name),
        global: true,
    });
    w.enter(slots);
    w.items.extend(shared);
    w.open_events(events);
    w.registers();
    w.load_promoted();
    let next = features.next_key_register;
    w.op(Inst {
        t: next,
        n: RECORD,
        ..template(Op::LDR_immediate)
    });
    w.items.push(Item::Indirect {
        inst: Inst {
            m: next,
            ..template(Op::BX)
        },
        to: modes.to_vec(),
    });
    w.items.push(Item::Function {
        name: names::end(name),
        global: false,
    });
    w.close_events(events + 3);
    w.rings();
    w.pointers();
    w.load(0, TICK);
    w.plus_one(0);
    w.store(0, TICK);
    w.leave(slots);
    w.items
}

/// `init` of all keys; the code of one key follows at `init_key` and comes back to `init_next`.
pub(super) fn init(
    layout: &StateLayout,
    features: &'static Features,
    name: &str,
    slots: usize,
    labels: Labels,
) -> Vec<Item> {
    let mut w = EntryWriter::new(layout, features);
    w.items.push(Item::Function {
        name: names::init(name),
        global: true,
    });
    w.enter(slots);
    w.pointers();
    w.registers();
    w.items.push(Item::Loop {
        rounds: layout.keys,
    });
    w.items.push(Item::Branch {
        cond: None,
        to: labels.init_key,
    });
    w.items.push(Item::Label(labels.init_next));
    w.offset(0, layout.records + layout.keys * layout.record);
    w.add(0, STATE);
    w.op(Inst {
        n: RECORD,
        m: 0,
        ..template(Op::CMP_register)
    });
    w.items.push(Item::Branch {
        cond: Some(Cond::NE),
        to: labels.init_key,
    });
    w.leave(slots);
    w.items.push(Item::Label(labels.init_key));
    w.items
}

/// One key of those that `init` prepares all: state in R0, its word in R1, its number in R2. Before
/// the code of a key's `init` and behind it.
pub(super) fn begin(
    layout: &StateLayout,
    features: &'static Features,
    kernel: &Kernel,
    name: &str,
    slots: usize,
) -> [Vec<Item>; 2] {
    let mut w = EntryWriter::new(layout, features);
    w.begin(kernel, name, slots);
    let before = std::mem::take(&mut w.items);
    w.leave(slots);
    [before, w.items]
}

impl<'a> EntryWriter<'a> {
    fn new(layout: &'a StateLayout, features: &'static Features) -> EntryWriter<'a> {
        EntryWriter {
            layout,
            features,
            items: Vec::new(),
        }
    }

    fn op(&mut self, inst: Inst) {
        self.items.push(Item::Inst {
            inst,
            origin: None,
            address: None::<Relocation>,
        });
    }

    fn enter(&mut self, slots: usize) {
        self.op(Inst {
            imm: self.saved() | 1 << LR,
            ..template(Op::PUSH)
        });
        if !self.features.high_registers && self.saved() != 0 {
            self.mov(4, SAMPLES);
            self.mov(5, HISTORY);
            self.op(Inst {
                imm: HIGH,
                ..template(Op::PUSH)
            });
        }
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst {
            d: STATE,
            m: 0,
            ..template(Op::MOV_register)
        });
        if let Some(caller) = self.layout.caller {
            self.op(Inst {
                d: SAMPLES,
                m: 1,
                ..template(Op::MOV_register)
            });
            self.store(1, caller);
        }
    }

    fn begin(&mut self, kernel: &Kernel, name: &str, slots: usize) {
        let layout = self.layout;
        self.items.push(Item::Function {
            name: names::begin(name),
            global: true,
        });
        self.op(Inst {
            imm: 1 << LR,
            ..template(Op::PUSH)
        });
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst {
            d: STATE,
            m: 0,
            ..template(Op::MOV_register)
        });
        self.op(Inst {
            d: SAMPLES,
            m: 1,
            ..template(Op::MOV_register)
        });
        self.offset(0, layout.records);
        self.add(0, STATE);
        self.offset(1, layout.record);
        self.multiply_add(RECORD, 2, 1, 0);
        if let Some(first) = layout.first_line {
            // `init` fills lines from their first row on.
            let (line, shift) = (&layout.lines[first as usize], ShiftType::LSL);
            let amount = line.log2();
            let base = self.apart();
            self.offset(HISTORY, line.at);
            self.add(HISTORY, base);
            if self.features.shifted_operands {
                self.op(Inst {
                    d: HISTORY,
                    n: HISTORY,
                    m: 2,
                    shift,
                    amount,
                    ..template(Op::ADD_register)
                });
            } else {
                self.op(Inst {
                    d: 4,
                    m: 2,
                    amount,
                    s: true,
                    ..template(Op::LSL_immediate)
                });
                self.add(HISTORY, 4);
            }
        }
        self.cells(kernel);
    }

    /// The cells of the key at RECORD as they are before `init`, which writes some of them.
    fn cells(&mut self, kernel: &Kernel) {
        let words = kernel
            .cells
            .iter()
            .zip(&self.layout.cells)
            .flat_map(|(cell, &at)| {
                let words = if cell.ty == Type::I64 { 2 } else { 1 };
                let word = move |nth: u32| (cell.init >> (32 * (nth % words))) as u32;
                (0..words * cell.len).map(move |nth| (word(nth), at + 4 * nth))
            });
        let mut words: Vec<(u32, u32)> = words.collect();
        words.sort_unstable();
        let mut held = None;
        for (word, at) in words {
            if held.replace(word) != Some(word) {
                self.offset(0, word);
            }
            self.access(Op::STR_immediate, 0, RECORD, at);
        }
    }

    fn leave(&mut self, slots: usize) {
        self.stack(Op::ADD_SP_plus_immediate, slots);
        if !self.features.high_registers && self.saved() != 0 {
            self.op(Inst {
                imm: HIGH,
                ..template(Op::POP)
            });
            self.mov(SAMPLES, 4);
            self.mov(HISTORY, 5);
        }
        self.op(Inst {
            imm: self.saved() | 1 << PC,
            ..template(Op::POP)
        });
    }

    /// A firmware's frame keeps what it needs itself.
    fn saved(&self) -> u32 {
        match (self.layout.caller, self.features.high_registers) {
            (Some(_), _) => 0,
            (None, true) => SAVED,
            (None, false) => SAVED & 0xff,
        }
    }

    fn stack(&mut self, op: Op, slots: usize) {
        let most = self.features.stack_words_max;
        for from in (0..slots).step_by(most) {
            let imm = 4 * (slots - from).min(most) as u32;
            self.op(Inst {
                d: SP,
                n: SP,
                imm,
                ..template(op)
            });
        }
    }
}
