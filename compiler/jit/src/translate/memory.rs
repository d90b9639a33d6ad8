//! Translation of operators on memory, for one key.

use super::Translator;
use crate::loop_context::Buffer;
use crate::wave::Points;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{InstBuilder, Value};
use std::mem::offset_of;
use whippen_kernel::layout::{EVENT_HEAD, EVENTS_MAX, words};
use whippen_kernel::memory::Clock;
use whippen_kernel::{Inst, Range, Type, wave};

/// Places within the counters.
const TICK: i32 = offset_of!(Clock, tick) as i32;
const EVENTS: i32 = offset_of!(Clock, events) as i32;
const LOST: i32 = offset_of!(Clock, lost) as i32;

impl Translator<'_> {
    pub(crate) fn live(&mut self, live: u32) -> Value {
        let lives = self.base(Buffer::Lives);
        self.f
            .ins()
            .sload32(self.access.fixed, lives, 4 * live as i32)
    }

    pub(crate) fn tick(&mut self, later: u32) -> Value {
        let clock = self.base(Buffer::Clock);
        let now = self.f.ins().load(I32, self.access.leaving, clock, TICK);
        let then = self.f.ins().iadd_imm_s(now, i64::from(later));
        self.f.ins().sextend(I64, then)
    }

    pub(crate) fn keyed(&mut self, keyed: u32) -> Value {
        let at = 4 * self.layout.keyed[keyed as usize] as i32;
        self.f
            .ins()
            .sload32(self.access.columns, self.context.words[0], at)
    }

    pub(crate) fn delay(&mut self, line: u32, ticks: u32) -> Value {
        let place = self.layout.lines[line as usize];
        let at = self.element(line, ticks % place.len as u32);
        if place.narrow {
            self.f.ins().uload16(I64, self.access.rows, at, 0)
        } else {
            self.f.ins().sload32(self.access.rows, at, 0)
        }
    }

    /// Counted from the row that is written in this tick.
    pub(crate) fn delay_at(&mut self, line: u32, before: Value) -> Value {
        let place = self.layout.lines[line as usize];
        let before = self.inside(before, place.len);
        let rings = self.base(Buffer::Rings);
        let now = self
            .f
            .ins()
            .uload32(self.access.fixed, rings, 4 * place.ring as i32);
        let slot = self.f.ins().isub(now, before);
        let slot = self.f.ins().iadd_imm_s(slot, -1);
        let around = self.f.ins().iadd_imm_s(slot, place.len as i64);
        let below = self.f.ins().icmp_imm_s(IntCC::SignedLessThan, slot, 0);
        let slot = self.f.ins().select(below, around, slot);
        let (buffer, shift) = match place.narrow {
            true => (Buffer::Narrow, 1),
            false => (Buffer::Wide, 2),
        };
        let rows = self.f.ins().imul_imm_s(slot, self.layout.keys as i64);
        let element = self.f.ins().iadd(rows, self.context.key);
        let base = self.base(buffer);
        let start = self.f.ins().iadd_imm_s(base, (place.start as i64) << shift);
        let at = self.indexed(start, element, shift);
        match place.narrow {
            true => self.f.ins().uload16(I64, self.access.rows, at, 0),
            false => self.f.ins().sload32(self.access.rows, at, 0),
        }
    }

    pub(crate) fn lookup(&mut self, table: u32, column: u32, row: Value) -> Value {
        let tables = &self.kernel.tables;
        let (before, own) = (&tables[..table as usize], &tables[table as usize]);
        let before: usize = before.iter().map(|table| table.values.len()).sum();
        let row = self.inside(row, own.rows());
        let words = self.f.ins().imul_imm_s(row, i64::from(own.columns));
        let tables = self.base(Buffer::Tables);
        let at = self.indexed(tables, words, 2);
        let offset = 4 * (before as i32 + column as i32);
        self.f.ins().sload32(self.access.fixed, at, offset)
    }

    pub(crate) fn output(&mut self, port: u32, word: Value) {
        let at = self.of_key(Buffer::Outputs, 2 * self.kernel.outputs.len());
        self.f
            .ins()
            .istore16(self.access.leaving, word, at, 2 * port as i32);
    }

    pub(crate) fn push(&mut self, line: u32, value: Value) {
        let at = self.element(line, 0);
        self.put(line, at, value);
    }

    pub(crate) fn probe(&mut self, probe: u32, value: Value) {
        let boolean = self.kernel.probes[probe as usize].ty == Type::I1;
        let value = if boolean {
            self.f.ins().uextend(I64, value)
        } else {
            value
        };
        let at = self.of_key(Buffer::Probes, 8 * self.kernel.probes.len());
        self.f
            .ins()
            .store(self.access.leaving, value, at, 8 * probe as i32);
    }

    pub(crate) fn base(&self, buffer: Buffer) -> Value {
        self.context.bases[buffer as usize]
    }

    /// `base + index * 2^shift`
    pub(crate) fn indexed(&mut self, base: Value, index: Value, shift: i64) -> Value {
        let offset = self.f.ins().ishl_imm_s(index, shift);
        self.f.ins().iadd(base, offset)
    }

    /// The nearest index inside, should the proof rest on an assumption.
    pub(crate) fn inside(&mut self, index: Value, len: usize) -> Value {
        if !self.assumes {
            return index;
        }
        let [first, last] = [0, len as i64 - 1].map(|end| self.f.ins().iconst(I64, end));
        let index = self.f.ins().smax(index, first);
        self.f.ins().smin(index, last)
    }

    pub(crate) fn input(&mut self, port: u32) -> Value {
        let at = self.of_key(Buffer::Inputs, 2 * self.kernel.inputs.len());
        let word = self
            .f
            .ins()
            .uload16(I64, self.access.fixed, at, 2 * port as i32);
        let Range { low, high } = self.kernel.inputs[port as usize].range;
        let [low, high] = [
            (low > 0).then_some(low),
            (high < i64::from(u16::MAX)).then_some(high),
        ]
        .map(|bound| bound.map(|bound| self.f.ins().iconst(I64, bound)));
        let word = low.map_or(word, |low| self.f.ins().smax(word, low));
        high.map_or(word, |high| self.f.ins().smin(word, high))
    }

    /// Address and offset of a word of a cell.
    fn place(&mut self, cell: u32, index: Option<Value>) -> (Value, i32) {
        let (ty, len) = (
            self.kernel.cells[cell as usize].ty,
            self.kernel.cells[cell as usize].len as usize,
        );
        let offset = 4 * self.layout.cells[cell as usize] as i32;
        let words = words(ty);
        let own = self.context.words[words - 1];
        let Some(index) = index else {
            return (own, offset);
        };
        let index = self.inside(index, len);
        let before = self
            .f
            .ins()
            .imul_imm_s(index, (4 * words * self.layout.keys) as i64);
        (self.f.ins().iadd(own, before), offset)
    }

    pub(crate) fn get(&mut self, cell: u32, index: Option<Value>) -> Value {
        let (at, offset) = self.place(cell, index);
        let columns = self.access.columns;
        match self.kernel.cells[cell as usize].ty {
            Type::I1 => {
                let word = self.f.ins().load(I32, columns, at, offset);
                self.f.ins().ireduce(I8, word)
            }
            Type::I32 => self.f.ins().sload32(columns, at, offset),
            Type::I64 => self.f.ins().load(I64, columns, at, offset),
        }
    }

    pub(crate) fn set(&mut self, cell: u32, index: Option<Value>, value: Value) {
        let (at, offset) = self.place(cell, index);
        let columns = self.access.columns;
        match self.kernel.cells[cell as usize].ty {
            Type::I1 => {
                let word = self.f.ins().uextend(I32, value);
                self.f.ins().store(columns, word, at, offset)
            }
            Type::I32 => self.f.ins().istore32(columns, value, at, offset),
            Type::I64 => self.f.ins().store(columns, value, at, offset),
        };
    }

    /// One tick of a string.
    pub(crate) fn wave(&mut self, inst: &Inst, cells: [u32; 2]) {
        let k = std::array::from_fn(|at| {
            let k = self.value(inst.args[at]);
            self.f.ins().ireduce(I32, k)
        });
        let start = cells.map(|cell| {
            let (own, offset) = self.place(cell, None);
            self.f.ins().iadd_imm_s(own, i64::from(offset))
        });
        let points = Points {
            access: self.access,
            ty: I32,
            start,
            step: 4 * self.layout.keys as i64,
            count: self.kernel.cells[cells[1] as usize].len.into(),
            k,
            ends: wave::ends(&self.kernel.values, &inst.args),
            mask: None,
            room: self.base(Buffer::Room),
            f: &mut self.f,
        };
        points.tick();
    }

    /// Address of this key's element in a row.
    pub(crate) fn element(&mut self, line: u32, ticks: u32) -> Value {
        let row = self.context.rows[&(line, ticks)];
        let shift = if self.layout.lines[line as usize].narrow {
            1
        } else {
            2
        };
        self.indexed(row, self.context.key, shift)
    }

    /// Writes an element of a line.
    fn put(&mut self, line: u32, at: Value, value: Value) {
        let rows = self.access.rows;
        if self.layout.lines[line as usize].narrow {
            self.f.ins().istore16(rows, value, at, 0);
        } else {
            self.f.ins().istore32(rows, value, at, 0);
        }
    }

    /// Writes this key's element of every row.
    pub(crate) fn fill(&mut self, line: u32, value: Value) {
        let place = self.layout.lines[line as usize];
        let (buffer, width, shift) = if place.narrow {
            (Buffer::Narrow, 2, 1)
        } else {
            (Buffer::Wide, 4, 2)
        };
        let base = self.base(buffer);
        let start = self.f.ins().iadd_imm_s(base, width * place.start as i64);
        let first = self.indexed(start, self.context.key, shift);
        let end = self
            .f
            .ins()
            .iadd_imm_s(first, width * (place.len * self.layout.keys) as i64);
        let [slots, after] = [(); 2].map(|()| self.f.create_block());
        self.f.ins().jump(slots, &[first.into()]);
        let at = self.f.append_block_param(slots, I64);
        self.f.switch_to_block(slots);
        self.put(line, at, value);
        let next = self.f.ins().iadd_imm_s(at, width * self.layout.keys as i64);
        let more = self.f.ins().icmp(IntCC::UnsignedLessThan, next, end);
        self.f.ins().brif(more, slots, &[next.into()], after, &[]);
        self.f.switch_to_block(after);
    }

    /// Appends to the buffer of events, or counts a lost one.
    pub(crate) fn emit(&mut self, event: u32, args: &[whippen_kernel::Value]) {
        let leaving = self.access.leaving;
        let clock = self.base(Buffer::Clock);
        let [room, full, after] = [(); 3].map(|()| self.f.create_block());
        let count = self.f.ins().load(I64, leaving, clock, EVENTS);
        let fits = self
            .f
            .ins()
            .icmp_imm_s(IntCC::UnsignedLessThan, count, EVENTS_MAX as i64);
        self.f.ins().brif(fits, room, &[], full, &[]);

        self.f.switch_to_block(room);
        let offset = self
            .f
            .ins()
            .imul_imm_s(count, 4 * self.layout.event_words as i64);
        let events = self.base(Buffer::Events);
        let at = self.f.ins().iadd(events, offset);
        let tick = self.f.ins().load(I64, leaving, clock, TICK);
        self.f.ins().store(leaving, tick, at, 0);
        let event = self.f.ins().iconst(I64, i64::from(event));
        for (word, value) in [(2, self.context.key), (3, event)] {
            self.f.ins().istore32(leaving, value, at, 4 * word);
        }
        for (word, arg) in args.iter().enumerate() {
            let arg = self.value(*arg);
            self.f
                .ins()
                .istore32(leaving, arg, at, 4 * (EVENT_HEAD + word) as i32);
        }
        let more = self.f.ins().iadd_imm_s(count, 1);
        self.f.ins().store(leaving, more, clock, EVENTS);
        self.f.ins().jump(after, &[]);

        self.f.switch_to_block(full);
        self.f.set_cold_block(full);
        let lost = self.f.ins().load(I64, leaving, clock, LOST);
        let lost = self.f.ins().iadd_imm_s(lost, 1);
        self.f.ins().store(leaving, lost, clock, LOST);
        self.f.ins().jump(after, &[]);
        self.f.switch_to_block(after);
    }
}
