//! Translation of operators on memory, for keys in lanes.

use super::{Lane, Lanes, WIDTH};
use crate::loop_context::Buffer;
use crate::wave::Points;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I32X4, I64, I64X2};
use cranelift_codegen::ir::{InstBuilder, Value};
use std::mem::offset_of;
use whippen_kernel::layout::{EVENT_HEAD, words};
use whippen_kernel::memory::Clock;
use whippen_kernel::{Inst, Range, Type, Value as KernelValue, wave};

impl Lanes<'_> {
    pub(super) fn live(&mut self, live: u32) -> Lane {
        let (access, lives) = (self.t.access.fixed, self.t.base(Buffer::Lives));
        let value = self.ins().load(I32, access, lives, 4 * live as i32);
        Lane::Word(self.ins().splat(I32X4, value))
    }

    pub(super) fn tick(&mut self, later: u32) -> Lane {
        let (access, clock) = (self.t.access.leaving, self.t.base(Buffer::Clock));
        let now = self
            .ins()
            .load(I32, access, clock, offset_of!(Clock, tick) as i32);
        let then = self.ins().iadd_imm_s(now, i64::from(later));
        Lane::Word(self.ins().splat(I32X4, then))
    }

    pub(super) fn keyed(&mut self, keyed: u32) -> Lane {
        let (at, own) = (
            4 * self.t.layout.keyed[keyed as usize] as i32,
            self.t.context.words[0],
        );
        let access = self.t.access.columns;
        Lane::Word(self.ins().load(I32X4, access, own, at))
    }

    pub(super) fn input(&mut self, port: u32) -> Lane {
        let ports = self.t.kernel.inputs.len();
        if ports > 1 {
            return self.each(Type::I32, |lanes, lane| {
                lanes.for_key(lane, |t| t.input(port))
            });
        }
        let (at, access) = (self.t.of_key(Buffer::Inputs, 2), self.t.access.fixed);
        let mut word = self.ins().uload16x4(access, at, 0);
        let Range { low, high } = self.t.kernel.inputs[port as usize].range;
        if low > 0 {
            let low = self.splat(low);
            word = self.ins().smax(word, low);
        }
        if high < u16::MAX.into() {
            let high = self.splat(high);
            word = self.ins().smin(word, high);
        }
        Lane::Word(word)
    }

    pub(super) fn output(&mut self, port: u32, value: KernelValue) {
        let (ports, access) = (self.t.kernel.outputs.len(), self.t.access.leaving);
        if ports == 1 {
            let at = self.t.of_key(Buffer::Outputs, 2);
            let words = self.word(value);
            let words = self.ins().snarrow(words, words);
            return self.store_low(words, access, at);
        }
        for lane in 0..WIDTH {
            let word = self.one(value, lane);
            self.for_key(lane, |t| t.output(port, word));
        }
    }

    pub(super) fn delay(&mut self, line: u32, ticks: u32) -> Lane {
        let (place, access) = (self.t.layout.lines[line as usize], self.t.access.rows);
        let at = self.t.element(line, ticks % place.len as u32);
        Lane::Word(match place.narrow {
            true => self.ins().uload16x4(access, at, 0),
            false => self.ins().load(I32X4, access, at, 0),
        })
    }

    pub(super) fn delay_at(&mut self, line: u32, before: KernelValue) -> Lane {
        self.each(Type::I32, |lanes, lane| {
            let before = lanes.one(before, lane);
            lanes.for_key(lane, |t| t.delay_at(line, before))
        })
    }

    pub(super) fn push(&mut self, line: u32, value: KernelValue) {
        let (at, access) = (self.t.element(line, 0), self.t.access.rows);
        let words = self.word(value);
        if self.t.layout.lines[line as usize].narrow {
            let words = self.ins().unarrow(words, words);
            self.store_low(words, access, at);
        } else {
            self.ins().store(access, words, at, 0);
        }
    }

    pub(super) fn get(&mut self, cell: u32) -> Lane {
        let (at, access) = (self.column(cell), self.t.access.columns);
        let [words, wides] = self.t.context.words;
        match self.t.kernel.cells[cell as usize].ty {
            Type::I32 => Lane::Word(self.ins().load(I32X4, access, words, at)),
            Type::I64 => {
                Lane::Wide([0, 16].map(|half| self.ins().load(I64X2, access, wides, at + half)))
            }
            Type::I1 => {
                let (bits, zero) = (
                    self.ins().load(I32X4, access, words, at),
                    self.constant(I32X4, 0),
                );
                Lane::Mask(self.ins().icmp(IntCC::SignedGreaterThan, bits, zero))
            }
        }
    }

    pub(super) fn set(&mut self, cell: u32, value: KernelValue) {
        let (at, access) = (self.column(cell), self.t.access.columns);
        let [words, wides] = self.t.context.words;
        if self.t.kernel.cells[cell as usize].ty == Type::I64 {
            let mut pair = self.wide(value);
            if let Some(mask) = self.mask {
                let old = [0, 16].map(|half| self.ins().load(I64X2, access, wides, at + half));
                pair = self.chosen_wide(mask, pair, old);
            }
            for (half, vector) in [0, 16].into_iter().zip(pair) {
                self.ins().store(access, vector, wides, at + half);
            }
            return;
        }
        let mut vector = self.stored(value);
        if let Some(mask) = self.mask {
            let old = self.ins().load(I32X4, access, words, at);
            vector = self.ins().bitselect(mask, vector, old);
        }
        self.ins().store(access, vector, words, at);
    }

    /// What memory holds of a value: 0 or 1 for a bool.
    fn stored(&mut self, value: KernelValue) -> Value {
        match self.lane(value) {
            Lane::Known(Type::I1, bit) => self.splat(bit),
            Lane::Mask(mask) => self.ins().ushr_imm_u(mask, 31),
            _ => self.word(value),
        }
    }

    pub(super) fn get_at(&mut self, cell: u32, index: KernelValue) -> Lane {
        self.each(self.t.kernel.cells[cell as usize].ty, |lanes, lane| {
            let index = lanes.one(index, lane);
            let value = lanes.for_key(lane, |t| t.get(cell, Some(index)));
            lanes.in_64_bits(value)
        })
    }

    pub(super) fn set_at(&mut self, cell: u32, index: KernelValue, value: KernelValue) {
        for lane in 0..WIDTH {
            let (index, mut value) = (self.one(index, lane), self.one(value, lane));
            if let Some(wanted) = self.wants(lane) {
                let old = self.for_key(lane, |t| t.get(cell, Some(index)));
                let old = self.in_64_bits(old);
                value = self.ins().select(wanted, value, old);
            }
            if self.t.kernel.cells[cell as usize].ty == Type::I1 {
                value = self.ins().ireduce(I8, value);
            }
            self.for_key(lane, |t| t.set(cell, Some(index), value));
        }
    }

    /// One tick of a string.
    pub(super) fn wave(&mut self, inst: &Inst, cells: [u32; 2]) {
        let k = std::array::from_fn(|at| self.word(inst.args[at]));
        let own = self.t.context.words[0];
        let start = cells.map(|cell| {
            let offset = i64::from(self.column(cell));
            self.ins().iadd_imm_s(own, offset)
        });
        let points = Points {
            access: self.t.access,
            ty: I32X4,
            start,
            step: 4 * self.t.layout.keys as i64,
            count: self.t.kernel.cells[cells[1] as usize].len.into(),
            k,
            ends: wave::ends(&self.t.kernel.values, &inst.args),
            mask: self.mask,
            room: self.t.base(Buffer::Room),
            f: &mut self.t.f,
        };
        points.tick();
    }

    pub(super) fn lookup(&mut self, table: u32, column: u32, index: KernelValue) -> Lane {
        self.each(Type::I32, |lanes, lane| {
            let index = lanes.one(index, lane);
            lanes.t.lookup(table, column, index)
        })
    }

    pub(super) fn probe(&mut self, probe: u32, value: KernelValue) {
        let (count, access) = (self.t.kernel.probes.len(), self.t.access.leaving);
        let at = self.t.of_key(Buffer::Probes, 8 * count);
        for lane in 0..WIDTH {
            let offset = 8 * (lane * count + probe as usize) as i32;
            let mut value = self.one(value, lane);
            if let Some(wanted) = self.wants(lane) {
                let old = self.ins().load(I64, access, at, offset);
                value = self.ins().select(wanted, value, old);
            }
            self.ins().store(access, value, at, offset);
        }
    }

    /// Appends the events of all lanes that want it; there is room for all of a tick.
    pub(super) fn emit(&mut self, event: u32, args: &[KernelValue]) {
        for lane in 0..WIDTH {
            let [raised, after] = [(); 2].map(|()| self.t.f.create_block());
            match self.wants(lane) {
                Some(wanted) => self.ins().brif(wanted, raised, &[], after, &[]),
                None => self.ins().jump(raised, &[]),
            };
            self.t.f.switch_to_block(raised);
            self.emit_one(lane, event, args);
            self.ins().jump(after, &[]);
            self.t.f.switch_to_block(after);
        }
    }

    fn emit_one(&mut self, lane: usize, event: u32, args: &[KernelValue]) {
        let (access, clock) = (self.t.access.leaving, self.t.base(Buffer::Clock));
        let counter = offset_of!(Clock, events) as i32;
        let count = self.ins().load(I64, access, clock, counter);
        let bytes = 4 * self.t.layout.event_words as i64;
        let (offset, events) = (
            self.ins().imul_imm_s(count, bytes),
            self.t.base(Buffer::Events),
        );
        let at = self.ins().iadd(events, offset);
        let key = self.t.context.key;
        let key = self.ins().iadd_imm_s(key, lane as i64);
        let event = self.ins().iconst(I64, i64::from(event));
        for (word, value) in [(2, key), (3, event)] {
            self.ins().istore32(access, value, at, 4 * word);
        }
        for (word, arg) in args.iter().enumerate() {
            let arg = self.one(*arg, lane);
            self.ins()
                .istore32(access, arg, at, 4 * (EVENT_HEAD + word) as i32);
        }
        let more = self.ins().iadd_imm_s(count, 1);
        self.ins().store(access, more, clock, counter);
    }

    /// Whether a lane wants what is being computed; none: all do.
    fn wants(&mut self, lane: usize) -> Option<Value> {
        let mask = self.mask?;
        Some(self.ins().extractlane(mask, lane as u8))
    }

    /// Stores the low half of a vector.
    fn store_low(&mut self, vector: Value, access: cranelift_codegen::ir::MemFlagsData, at: Value) {
        let halves = self.reinterpreted(I64X2, vector);
        let low = self.ins().extractlane(halves, 0);
        self.ins().store(access, low, at, 0);
    }

    /// Where the columns of a cell begin, in bytes.
    fn column(&self, cell: u32) -> i32 {
        4 * self.t.layout.cells[cell as usize] as i32
    }

    /// Does something as single keys do it, for the key of a lane.
    fn for_key<T>(
        &mut self,
        lane: usize,
        work: impl FnOnce(&mut crate::translate::Translator) -> T,
    ) -> T {
        let (key, own) = (self.t.context.key, self.t.context.words);
        self.t.context.key = self.ins().iadd_imm_s(key, lane as i64);
        self.t.context.words = [Type::I32, Type::I64].map(|ty| {
            let bytes = 4 * words(ty);
            self.ins()
                .iadd_imm_s(own[words(ty) - 1], (lane * bytes) as i64)
        });
        let done = work(&mut self.t);
        (self.t.context.key, self.t.context.words) = (key, own);
        done
    }

    /// A value as `one` gives it, where single keys hold bools in 8 bits.
    fn in_64_bits(&mut self, value: Value) -> Value {
        let wide = self.t.f.func.dfg.value_type(value) == I64;
        if wide {
            value
        } else {
            self.ins().uextend(I64, value)
        }
    }
}
