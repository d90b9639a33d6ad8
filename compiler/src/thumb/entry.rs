//! Code around the keys: entry, end of the frame, `init`. It runs once a tick, or once.
//!
//! ```text
//!   NAME_tick: save, T K I H, to the first key's code ... end: rings go on, pointers, tick + 1, restore
//!   NAME_init: save, T K I H, pointers, [init of a key]*, restore
//!   NAME_begin: T K I H of one key, its cells, [init of a key], restore
//! ```
//!
//! As part of a firmware's frame all take the first key's word in R1 and keep no register but SP. `NAME_begin` is there
//! for it alone.

mod events;

use super::emit::{Item, Label};
use super::frame::{Frame, H, I, K, Pointer, ROW, T, TICK};
use super::vcode::template;
use super::{names, vcode::Half};
use crate::kernel::{Kernel, Type};
use whippen_isa::reg::{LR, PC, SP};
use whippen_isa::{Cond, Encoding, Form, Inst, Op, ShiftType};

/// R4 to R11 and LR.
const SAVED: u32 = 0x0ff0;

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
struct Writer<'a> {
    frame: &'a Frame,
    items: Vec<Item>,
}

/// Entry and end of a tick, with labels from `events` on; `slots` words of the stack are for the keys' code.
pub(super) fn tick(frame: &Frame, name: &str, slots: usize, modes: &[String], events: Label) -> Vec<Item> {
    let mut w = Writer { frame, items: Vec::new() };
    w.items.push(Item::Function { name: names::tick(name), global: true });
    w.enter(slots);
    w.open_events(events);
    w.registers();
    w.op(Inst { t: LR, n: K, ..template(Op::LDR_immediate) });
    w.items.push(Item::Indirect { inst: Inst { m: LR, ..template(Op::BX) }, to: modes.to_vec() });
    w.items.push(Item::Function { name: names::end(name), global: false });
    w.close_events(events + 3);
    w.rings();
    w.pointers();
    w.op(Inst { t: 0, n: T, imm: TICK, ..template(Op::LDR_immediate) });
    w.op(Inst { d: 0, n: 0, imm: 1, ..template(Op::ADD_immediate) });
    w.op(Inst { t: 0, n: T, imm: TICK, ..template(Op::STR_immediate) });
    w.leave(slots);
    w.items
}

/// `init` of all keys; the code of one key follows at `init_key` and comes back to `init_next`.
pub(super) fn init(frame: &Frame, name: &str, slots: usize, labels: Labels) -> Vec<Item> {
    let mut w = Writer { frame, items: Vec::new() };
    w.items.push(Item::Function { name: names::init(name), global: true });
    w.enter(slots);
    w.pointers();
    w.registers();
    w.items.push(Item::Loop { rounds: frame.keys });
    w.items.push(Item::Branch { cond: None, to: labels.init_key });
    w.items.push(Item::Label(labels.init_next));
    w.offset(0, frame.records + frame.keys * frame.record);
    w.op(Inst { d: 0, n: 0, m: T, ..template(Op::ADD_register) });
    w.op(Inst { n: K, m: 0, ..template(Op::CMP_register) });
    w.items.push(Item::Branch { cond: Some(Cond::NE), to: labels.init_key });
    w.leave(slots);
    w.items.push(Item::Label(labels.init_key));
    w.items
}

/// One key of those that `init` prepares all: state in R0, its word in R1, its number in R2. Before the code of a key's `init`
/// and behind it.
pub(super) fn begin(frame: &Frame, kernel: &Kernel, name: &str, slots: usize, done: Label) -> [Vec<Item>; 2] {
    let mut w = Writer { frame, items: Vec::new() };
    w.begin(kernel, name, slots);
    let before = std::mem::take(&mut w.items);
    w.items.push(Item::Label(done));
    w.leave(slots);
    [before, w.items]
}

impl Writer<'_> {
    fn op(&mut self, inst: Inst) {
        self.items.push(Item::Inst { inst, origin: None, address: None::<Half> });
    }

    fn enter(&mut self, slots: usize) {
        self.op(Inst { imm: self.saved() | 1 << LR, ..template(Op::PUSH) });
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst { d: T, m: 0, ..template(Op::MOV_register) });
        if let Some(caller) = self.frame.caller {
            self.op(Inst { d: I, m: 1, ..template(Op::MOV_register) });
            self.store(1, caller.at);
        }
    }

    fn begin(&mut self, kernel: &Kernel, name: &str, slots: usize) {
        let frame = self.frame;
        self.items.push(Item::Function { name: names::begin(name), global: true });
        self.op(Inst { imm: 1 << LR, ..template(Op::PUSH) });
        self.stack(Op::SUB_SP_minus_immediate, slots);
        self.op(Inst { d: T, m: 0, ..template(Op::MOV_register) });
        self.op(Inst { d: I, m: 1, ..template(Op::MOV_register) });
        self.offset(0, frame.records);
        self.op(Inst { d: 0, n: 0, m: T, ..template(Op::ADD_register) });
        self.offset(1, frame.record);
        self.op(Inst { d: K, n: 2, m: 1, a: 0, ..template(Op::MLA) });
        if let Some(first) = frame.first_line {
            // `init` fills lines from their first row on.
            let (line, shift) = (&frame.lines[first as usize], ShiftType::LSL);
            let amount = line.log2();
            let base = self.apart();
            self.offset(H, line.at);
            self.op(Inst { d: H, n: H, m: base, ..template(Op::ADD_register) });
            self.op(Inst { d: H, n: H, m: 2, shift, amount, ..template(Op::ADD_register) });
        }
        self.cells(kernel);
    }

    /// The cells of the key at K as they are before `init`, which writes some of them.
    fn cells(&mut self, kernel: &Kernel) {
        let words = kernel.cells.iter().zip(&self.frame.cells).flat_map(|(cell, &at)| {
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
            self.op(Inst { t: 0, n: K, imm: at, ..template(Op::STR_immediate) });
        }
    }

    fn leave(&mut self, slots: usize) {
        self.stack(Op::ADD_SP_plus_immediate, slots);
        self.op(Inst { imm: self.saved() | 1 << PC, ..template(Op::POP) });
    }

    /// A firmware's frame keeps what it needs itself.
    fn saved(&self) -> u32 {
        if self.frame.caller.is_some() { 0 } else { SAVED }
    }

    fn stack(&mut self, op: Op, slots: usize) {
        if slots != 0 {
            self.op(Inst { d: SP, n: SP, imm: 4 * slots as u32, ..template(op) });
        }
    }

    /// An offset in a register.
    fn offset(&mut self, d: u8, offset: u32) {
        let low = Encoding::new(Op::MOV_immediate, Form::T3).map_or_else(|| template(Op::MOV_immediate), Inst::new);
        self.op(Inst { d, imm: offset & 0xffff, ..low });
        if offset >> 16 != 0 {
            self.op(Inst { d, imm: offset >> 16, ..template(Op::MOVT) });
        }
    }

    /// K, I and H at the first key.
    fn registers(&mut self) {
        let words = self.frame.caller.is_none().then_some((I, self.frame.inputs));
        for (register, offset) in [Some((K, self.frame.records)), words].into_iter().flatten() {
            self.offset(register, offset);
            self.op(Inst { d: register, n: register, m: T, ..template(Op::ADD_register) });
        }
        if self.frame.first_line.is_some() {
            self.op(Inst { t: H, n: T, imm: ROW, ..template(Op::LDR_immediate) });
        }
    }

    /// Every ring index goes on.
    fn rings(&mut self) {
        for (at, len) in &self.frame.rings {
            self.load(0, *at);
            self.op(Inst { d: 0, n: 0, imm: 1, ..template(Op::ADD_immediate) });
            self.offset(1, *len);
            self.op(Inst { n: 0, m: 1, ..template(Op::CMP_register) });
            self.op(it(Cond::EQ));
            self.op(Inst { d: 0, imm: 0, cond: Some(Cond::EQ), ..template(Op::MOV_immediate) });
            self.store(0, *at);
        }
    }

    fn load(&mut self, t: u8, at: u32) {
        self.op(Inst { t, n: T, imm: at, ..template(Op::LDR_immediate) });
    }

    fn store(&mut self, t: u8, at: u32) {
        self.op(Inst { t, n: T, imm: at, ..template(Op::STR_immediate) });
    }

    /// The row of the first line, and all pointers relative to it. R3 keeps the row.
    fn pointers(&mut self) {
        let frame = self.frame;
        let Some(first) = frame.first_line else { return };
        let base = self.apart();
        self.row(base, 3, first, 0);
        self.store(3, ROW);
        for Pointer { line, ticks, at } in &frame.pointers {
            self.row(base, 0, *line, *ticks);
            let (scale, shift) = (frame.scale(*line), ShiftType::LSL);
            self.op(Inst { d: 0, n: 0, m: 3, shift, amount: scale, ..template(Op::SUB_register) });
            self.store(0, *at);
        }
    }

    /// The register from which histories are counted; R12 where they lie apart.
    fn apart(&mut self) -> u8 {
        let Some(at) = self.frame.apart else { return T };
        self.load(12, at);
        12
    }

    /// The address of the row of a line that was written so many ticks ago, or is written now. Uses R1 and R2.
    fn row(&mut self, base: u8, d: u8, line: u32, ticks: u32) {
        let line = &self.frame.lines[line as usize];
        self.load(d, line.ring);
        if ticks != 0 {
            self.offset(1, ticks);
            self.op(Inst { d, n: d, m: 1, s: true, ..template(Op::SUB_register) });
            self.offset(1, line.len);
            self.op(it(Cond::MI));
            self.op(Inst { d, n: d, m: 1, cond: Some(Cond::MI), ..template(Op::ADD_register) });
        }
        self.offset(1, line.row);
        self.offset(2, line.at);
        self.op(Inst { d: 2, n: 2, m: base, ..template(Op::ADD_register) });
        self.op(Inst { d, n: d, m: 1, a: 2, ..template(Op::MLA) });
    }
}

fn it(cond: Cond) -> Inst {
    Inst { imm: u32::from(cond.bits()) << 4 | 8, ..template(Op::IT) }
}
