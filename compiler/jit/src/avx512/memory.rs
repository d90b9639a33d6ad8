//! Operators on memory, for sixteen keys.

use super::encoder::{Address, Gpr, Mask, MaskOp, Operand, Zmm, forms, opcodes};
use super::registers::{Bank, Node, SLOT_BYTES};
use super::{WORD_BYTES, Writer, ZERO, at};
use crate::loop_context::Buffer;
use std::mem::offset_of;
use whippen_kernel::layout::EVENT_HEAD;
use whippen_kernel::memory::Clock;
use whippen_kernel::{Inst, Op, Range, Type, Value};

impl Writer<'_> {
    /// Writes an operator on memory.
    pub(super) fn memory(&mut self, inst: &Inst, to: Node, a: Node) {
        match inst.op {
            Op::In(port) => self.input(port, to),
            Op::Live(live) => self.live(live, to),
            Op::Tick(later) => self.tick(later, to),
            Op::Keyed(keyed) => {
                let at = self.layout.keyed[keyed as usize];
                self.load(to, self.column(at));
            }
            Op::Get(cell) => self.get(cell, to),
            Op::Set(cell) => self.set(cell, a),
            Op::Delay(line, ticks) => self.delay(line, ticks, to),
            Op::Push(line) => self.push(line, a),
            Op::Lookup(table, column) => self.lookup(table, column, to, a),
            Op::Out(_) => self.output(a),
            Op::Emit(event) => self.emit(event, &inst.args),
            Op::Const(_) | Op::Assume(..) => {}
            // `supports` says that there is no other.
            _ => self.r.has_failed = true,
        }
    }

    /// Where a column stands that begins so many words after the first.
    fn column(&self, words: usize) -> Operand {
        at(Gpr::R8, 4 * words as i32)
    }

    /// Words of the keys there are.
    fn load(&mut self, to: Node, from: Operand) {
        let (to, readable) = (self.r.define(to), self.readable());
        self.r.e.masked(forms::MOVDQU32, to, 0, from, readable);
    }

    /// Half words of the keys there are.
    fn load_halves(&mut self, to: Node, from: Operand) -> Zmm {
        let (to, lanes) = (self.r.define(to), self.readable());
        self.r.e.masked(forms::PMOVZXWD, to, 0, from, lanes);
        Zmm(to)
    }

    /// The base of a buffer in a register.
    fn address(&mut self, buffer: Buffer) -> Gpr {
        let base = self.base(buffer);
        self.r.e.wide(opcodes::LOAD, Gpr::Rax as u8, base);
        Gpr::Rax
    }

    fn input(&mut self, port: u32, to: Node) {
        let base = self.address(Buffer::Inputs);
        let from = Operand::Memory(Address::new(base, 0).indexed(Gpr::Rsi, 1));
        let word = self.load_halves(to, from);
        let Range { low, high } = self.kernel.inputs[port as usize].range;
        if low > 0 {
            let low = Operand::Broadcast(self.r.constant(low as i32));
            self.r.e.vector(forms::PMAXSD, word, word, low);
        }
        if high < u16::MAX.into() {
            let high = Operand::Broadcast(self.r.constant(high as i32));
            self.r.e.vector(forms::PMINSD, word, word, high);
        }
    }

    fn live(&mut self, live: u32, to: Node) {
        let base = self.address(Buffer::Lives);
        let to = Zmm(self.r.define(to));
        self.r
            .e
            .vector_of(forms::PBROADCASTD, to, at(base, 4 * live as i32));
    }

    fn tick(&mut self, later: u32, to: Node) {
        let base = self.address(Buffer::Clock);
        let to = Zmm(self.r.define(to));
        let (e, rax) = (&mut self.r.e, Operand::Gpr(Gpr::Rax));
        let now = at(base, offset_of!(Clock, tick) as i32);
        e.narrow(opcodes::LOAD, Gpr::Rax as u8, now);
        e.narrow(opcodes::ADD_NUMBER, 0, rax);
        e.number(later as i32);
        e.vector_of(forms::PBROADCASTD_GPR, to, rax);
    }

    fn get(&mut self, cell: u32, to: Node) {
        let from = self.column(self.layout.cells[cell as usize]);
        if self.kernel.cells[cell as usize].ty != Type::I1 {
            return self.load(to, from);
        }
        let (to, (readable, _)) = (self.r.define(to), self.readable());
        self.r
            .e
            .masked(forms::PCMPD, to, ZERO.0, from, (readable, true));
        // Where 0 is less.
        self.r.e.bytes.push(1);
    }

    fn set(&mut self, cell: u32, value: Node) {
        let to = self.column(self.layout.cells[cell as usize]);
        let is_bool = self.kernel.cells[cell as usize].ty == Type::I1;
        let word = match (is_bool, self.r.facts[value].known) {
            (true, None) => {
                let mask = self.r.mask(value);
                let one = Operand::Memory(self.r.constant(1));
                let word = self.r.temporary(Bank::Words);
                self.r
                    .e
                    .masked(forms::PBROADCASTD, word, 0, one, (mask, false));
                Zmm(word)
            }
            (true, Some(bit)) => self.spread(bit as i32),
            (false, _) => self.r.word(value),
        };
        let lanes = self.lanes();
        self.r
            .e
            .masked(forms::MOVDQU32_STORE, word.0, 0, to, (lanes, true));
    }

    /// A number in all lanes.
    fn spread(&mut self, number: i32) -> Zmm {
        let to = Zmm(self.r.temporary(Bank::Words));
        let from = Operand::Memory(self.r.constant(number));
        self.r.e.vector_of(forms::PBROADCASTD, to, from);
        to
    }

    /// Where the elements of a row stand, and how many bytes they have.
    fn row(&mut self, line: u32, ticks: u32) -> (Operand, bool) {
        let place = self.layout.lines[line as usize];
        let row = self.rows[&(line, ticks % place.len as u32)];
        self.r
            .e
            .wide(opcodes::LOAD, Gpr::Rax as u8, at(Gpr::Rbp, row));
        let shift = if place.narrow { 1 } else { 2 };
        let own = Address::new(Gpr::Rax, 0).indexed(Gpr::Rsi, shift);
        (Operand::Memory(own), place.narrow)
    }

    fn delay(&mut self, line: u32, ticks: u32, to: Node) {
        match self.row(line, ticks) {
            (from, true) => {
                self.load_halves(to, from);
            }
            (from, false) => self.load(to, from),
        }
    }

    fn push(&mut self, line: u32, value: Node) {
        let word = self.r.word(value);
        let lanes = self.lanes();
        let (to, is_narrow) = self.row(line, 0);
        let form = if is_narrow {
            forms::PMOVDW_STORE
        } else {
            forms::MOVDQU32_STORE
        };
        self.r.e.masked(form, word.0, 0, to, (lanes, true));
    }

    fn output(&mut self, value: Node) {
        let word = self.r.word(value);
        let lanes = self.lanes();
        let base = self.address(Buffer::Outputs);
        let to = Operand::Memory(Address::new(base, 0).indexed(Gpr::Rsi, 1));
        self.r
            .e
            .masked(forms::PMOVDW_STORE, word.0, 0, to, (lanes, true));
    }

    /// Entries of a table, each lane its own; the nearest inside, should the proof rest on an
    /// assumption.
    fn lookup(&mut self, table: u32, column: u32, to: Node, row: Node) {
        let (before, from) = self.kernel.tables.split_at(table as usize);
        let (columns, rows) = (from[0].columns as i32, from[0].rows() as i32);
        let before: usize = before.iter().map(|table| table.values.len()).sum();
        let row = self.r.word(row);
        let index = Zmm(self.r.temporary(Bank::Words));
        let lanes = Mask(self.r.temporary(Bank::Masks));
        let to = Zmm(self.r.define(to));
        let numbers = [rows - 1, columns].map(|number| self.r.constant(number));
        let [last, columns] = numbers.map(Operand::Broadcast);
        let tables = self.address(Buffer::Tables);
        let (readable, _) = self.readable();
        let e = &mut self.r.e;
        e.vector(forms::PMAXSD, index, ZERO, Operand::Zmm(row));
        e.vector(forms::PMINSD, index, index, last);
        e.vector(forms::PMULLD, index, index, columns);
        // The mask of what is still to be read.
        match readable {
            Mask(0) => e.mask(MaskOp::Equal, lanes.0, lanes, Operand::Mask(lanes)),
            tail => e.mask(MaskOp::Move, lanes.0, tail, Operand::Mask(tail)),
        }
        e.vector(forms::PXORD, to, to, Operand::Zmm(to));
        let offset = 4 * (before as i32 + column as i32);
        let entries = Operand::Memory(Address::new(tables, offset).lanes(index));
        e.masked(forms::PGATHERDD, to.0, 0, entries, (lanes, true));
    }

    /// Appends the events of all lanes that want it; there is room for all of a tick.
    fn emit(&mut self, event: u32, args: &[Value]) {
        let lanes = self.lanes();
        for (place, arg) in args.iter().enumerate() {
            let node = self.node(*arg);
            let word = self.r.word(node);
            let to = at(Gpr::Rbp, self.events_at + SLOT_BYTES * place as i32);
            self.r.e.vector_of(forms::MOVDQU32_STORE, word, to);
        }
        let (clock, events) = (self.base(Buffer::Clock), self.base(Buffer::Events));
        let [rax, r10, r11] = [Gpr::Rax, Gpr::R10, Gpr::R11].map(|gpr| gpr as u8);
        let e = &mut self.r.e;
        match lanes {
            Mask(0) => {
                e.narrow(opcodes::MOVE_NUMBER, 0, Operand::Gpr(Gpr::Rax));
                e.number(0xFFFF);
            }
            lanes => e.mask(MaskOp::ToGpr, rax, lanes, Operand::Mask(lanes)),
        }
        e.wide(opcodes::LOAD, r10, clock);
        e.wide(opcodes::LOAD, r11, events);
        e.narrow(opcodes::TEST, rax, Operand::Gpr(Gpr::Rax));
        let none = e.jump(opcodes::JZ);
        let next = e.bytes.len();
        self.emit_one(event, args.len());
        let e = &mut self.r.e;
        // The lane is done.
        e.narrow(opcodes::BTR, Gpr::Rcx as u8, Operand::Gpr(Gpr::Rax));
        e.narrow(opcodes::TEST, rax, Operand::Gpr(Gpr::Rax));
        let more = e.jump(opcodes::JNZ);
        e.land(more, next);
        let done = e.bytes.len();
        e.land(none, done);
    }

    /// Appends the event of the lowest lane in `rax`.
    fn emit_one(&mut self, event: u32, args: usize) {
        let [rcx, rdx, rbx] = [Gpr::Rcx, Gpr::Rdx, Gpr::Rbx].map(|gpr| gpr as u8);
        let counter = at(Gpr::R10, offset_of!(Clock, events) as i32);
        let bytes = 4 * self.layout.event_words as i32;
        let e = &mut self.r.e;
        e.narrow(opcodes::BSF, rcx, Operand::Gpr(Gpr::Rax));
        e.wide(opcodes::LOAD, rdx, counter);
        e.wide(opcodes::LEA, rbx, at(Gpr::Rdx, 1));
        e.wide(opcodes::STORE, rbx, counter);
        e.wide(opcodes::IMUL_NUMBER, rdx, Operand::Gpr(Gpr::Rdx));
        e.number(bytes);
        let record = Address::new(Gpr::R11, 0).indexed(Gpr::Rdx, 0);
        e.wide(opcodes::LEA, rdx, Operand::Memory(record));
        for place in 0..args {
            let own = Address::new(Gpr::Rbp, self.events_at + SLOT_BYTES * place as i32);
            let own = Operand::Memory(own.indexed(Gpr::Rcx, 2));
            e.narrow(opcodes::LOAD, rbx, own);
            let to = at(Gpr::Rdx, 4 * (EVENT_HEAD + place) as i32);
            e.narrow(opcodes::STORE, rbx, to);
        }
        let key = Operand::Memory(Address::new(Gpr::Rsi, 0).indexed(Gpr::Rcx, 0));
        e.narrow(opcodes::LEA, rbx, key);
        e.narrow(opcodes::STORE, rbx, at(Gpr::Rdx, WORD_BYTES));
        e.narrow(opcodes::MOVE_NUMBER, 0, at(Gpr::Rdx, WORD_BYTES + 4));
        e.number(event as i32);
    }
}
