//! Operators on memory: a key's words, delay lines, tables, events, probes.

use wasm_encoder::{BlockType, Instruction as I, ValType};
use whippen_kernel::layout::{EVENT_HEAD, EVENTS_MAX, LinePlace, words};
use whippen_kernel::{Type, Value, wave};

use crate::body::{Local, at};
use crate::helpers::Helper;
use crate::memory_map::{EVENTS, LOST, TICK};
use crate::translate::Translator;

impl Translator<'_> {
    /// The word of an input port, clamped to the port's range.
    pub(crate) fn input(&mut self, port: u32) {
        let (ports, range) = (
            self.kernel.inputs.len(),
            self.kernel.inputs[port as usize].range,
        );
        self.of_key(2 * ports as u32);
        self.body
            .op(I::I32Load16U(at(self.map.inputs + 2 * port, 1)));
        let all = [
            (range.low, false, range.low > 0),
            (range.high, true, range.high < 65_535),
        ];
        for (end, smaller, is_needed) in all {
            if is_needed {
                self.held(end as i32, smaller);
            }
        }
    }

    /// Of what is on the stack and an end, the smaller one or the larger one.
    fn held(&mut self, end: i32, smaller: bool) {
        let [value, limit] = [(); 2].map(|()| self.body.local(ValType::I32));
        self.body.set(value);
        self.body.word(end);
        self.body.set(limit);
        self.body.extreme(ValType::I32, smaller, [value, limit]);
    }

    pub(crate) fn output(&mut self, port: u32, value: Value) {
        let ports = self.kernel.outputs.len() as u32;
        self.of_key(2 * ports);
        self.get(value);
        self.body
            .op(I::I32Store16(at(self.map.outputs + 2 * port, 1)));
    }

    pub(crate) fn live(&mut self, live: u32) {
        self.body.word(0);
        self.body.op(I::I32Load(at(self.map.lives + 4 * live, 2)));
    }

    pub(crate) fn tick(&mut self, later: u32) {
        self.body.word(0);
        self.body.op(I::I32Load(at(self.map.clock + TICK, 2)));
        self.body.code([I::I32Const(later as i32), I::I32Add]);
    }

    pub(crate) fn keyed(&mut self, keyed: u32) {
        let column = self.layout.keyed[keyed as usize] as u32;
        self.body.get(self.words[0]);
        self.body
            .op(I::I32Load(at(self.map.columns + 4 * column, 2)));
    }

    /// A word of a cell, the first one if none is named.
    pub(crate) fn load_cell(&mut self, cell: u32, word: Option<Value>) {
        let ty = self.kernel.cells[cell as usize].ty;
        let offset = self.cell_address(cell, word);
        self.body.op(match ty {
            Type::I64 => I::I64Load(at(offset, 3)),
            _ => I::I32Load(at(offset, 2)),
        });
    }

    pub(crate) fn store_cell(&mut self, cell: u32, word: Option<Value>, value: Value) {
        let ty = self.kernel.cells[cell as usize].ty;
        let offset = self.cell_address(cell, word);
        self.get(value);
        self.body.op(match ty {
            Type::I64 => I::I64Store(at(offset, 3)),
            _ => I::I32Store(at(offset, 2)),
        });
    }

    /// Puts an address on the stack; gives how far behind it the word is.
    fn cell_address(&mut self, cell: u32, word: Option<Value>) -> u32 {
        let found = &self.kernel.cells[cell as usize];
        let (wide, len) = (found.ty == Type::I64, found.len);
        let of_key = self.words[usize::from(wide)];
        self.body.get(of_key);
        if let Some(word) = word {
            self.index(word, len as usize);
            let stride = 4 * (words(found.ty) * self.layout.keys) as i32;
            self.body.code([I::I32Const(stride), I::I32Mul, I::I32Add]);
        }
        self.map.cells[cell as usize]
    }

    /// An index; the nearest one inside, should the proof rest on an assumption.
    fn index(&mut self, value: Value, len: usize) {
        self.get(value);
        if self.assumes {
            self.held(0, false);
            self.held(len as i32 - 1, true);
        }
    }

    /// One tick of a string: where its words begin, and how far they are apart.
    pub(crate) fn wave(&mut self, [slopes, rates]: [u32; 2], args: &[Value]) {
        for cell in [slopes, rates] {
            self.body.get(self.words[0]);
            self.body.word(self.map.cells[cell as usize] as i32);
            self.body.op(I::I32Add);
        }
        self.body.word(4 * self.layout.keys as i32);
        self.body.word(self.kernel.cells[rates as usize].len as i32);
        args.iter().take(4).for_each(|k| self.get(*k));
        for end in wave::ends(&self.kernel.values, args) {
            self.body.word(end as i32);
        }
        self.body.op(I::Call(Helper::Wave as u32));
    }

    pub(crate) fn delay(&mut self, line: u32, ticks: u32) {
        let place = self.layout.lines[line as usize];
        let row = self.row(place, ticks);
        self.body.get(row);
        self.element(place);
        self.load_element(place);
    }

    /// Counted from the row that is written in this tick.
    pub(crate) fn delay_at(&mut self, line: u32, before: Value) {
        let place = self.layout.lines[line as usize];
        self.present_slot(place);
        self.index(before, place.len);
        self.body.code([I::I32Sub, I::I32Const(1), I::I32Sub]);
        self.wrapped_row(place);
        self.element(place);
        self.load_element(place);
    }

    pub(crate) fn push(&mut self, line: u32, value: Value) {
        let place = self.layout.lines[line as usize];
        let row = self.row(place, 0);
        self.body.get(row);
        self.element(place);
        self.get(value);
        self.store_element(place);
    }

    pub(crate) fn fill(&mut self, line: u32, value: Value) {
        let place = self.layout.lines[line as usize];
        let row = self.body.local(ValType::I32);
        self.body.word((place.len * self.layout.keys) as i32);
        self.body.set(row);
        self.body.op(I::Loop(BlockType::Empty));
        self.body.get(row);
        self.body
            .code([I::I32Const(self.layout.keys as i32), I::I32Sub]);
        self.body.tee(row);
        self.element(place);
        self.get(value);
        self.store_element(place);
        self.body.get(row);
        self.body.code([I::BrIf(0), I::End]);
    }

    /// The first element of the row that was written so many ticks ago.
    fn row(&self, place: LinePlace, ticks: u32) -> Local {
        let known = self.rows.get(&(place.ring, ticks % place.len as u32));
        known.copied().unwrap_or_default()
    }

    /// From a row to the address of the key's element.
    fn element(&mut self, place: LinePlace) {
        self.body.get(self.key);
        let shift = if place.narrow { 1 } else { 2 };
        self.body.code([I::I32Add, I::I32Const(shift), I::I32Shl]);
    }

    fn load_element(&mut self, place: LinePlace) {
        self.body.op(match place.narrow {
            true => I::I32Load16U(at(self.map.narrow + 2 * place.start as u32, 1)),
            false => I::I32Load(at(self.map.wide + 4 * place.start as u32, 2)),
        });
    }

    fn store_element(&mut self, place: LinePlace) {
        self.body.op(match place.narrow {
            true => I::I32Store16(at(self.map.narrow + 2 * place.start as u32, 1)),
            false => I::I32Store(at(self.map.wide + 4 * place.start as u32, 2)),
        });
    }

    pub(crate) fn lookup(&mut self, table: u32, column: u32, row: Value) {
        let found = &self.kernel.tables[table as usize];
        self.index(row, found.rows());
        self.body
            .code([I::I32Const(4 * found.columns as i32), I::I32Mul]);
        self.body.op(I::I32Load(at(
            self.map.tables[table as usize] + 4 * column,
            2,
        )));
    }

    /// Tells an event, or counts it as lost where there is no room.
    pub(crate) fn emit(&mut self, event: u32, args: &[Value]) {
        let record = self.body.local(ValType::I32);
        let (clock, events) = (self.map.clock, self.map.events);
        self.body.word(0);
        self.body.op(I::I32Load(at(clock + EVENTS, 2)));
        self.body.tee(record);
        self.body.code([
            I::I32Const(EVENTS_MAX as i32),
            I::I32LtU,
            I::If(BlockType::Empty),
        ]);
        self.body.word(0);
        self.body.get(record);
        self.body.code([
            I::I32Const(1),
            I::I32Add,
            I::I32Store(at(clock + EVENTS, 2)),
        ]);
        self.body.get(record);
        self.body
            .code([I::I32Const(4 * self.map.event_words as i32), I::I32Mul]);
        self.body.tee(record);
        self.body.word(0);
        self.body.op(I::I64Load(at(clock + TICK, 3)));
        self.body.op(I::I64Store(at(events, 2)));
        self.body.get(record);
        self.body.get(self.key);
        self.body.op(I::I32Store(at(events + 8, 2)));
        self.body.get(record);
        self.body.word(event as i32);
        self.body.op(I::I32Store(at(events + 12, 2)));
        for (place, arg) in args.iter().enumerate() {
            self.body.get(record);
            self.get(*arg);
            self.body
                .op(I::I32Store(at(events + 4 * (EVENT_HEAD + place) as u32, 2)));
        }
        self.body.op(I::Else);
        self.body.code([
            I::I32Const(0),
            I::I32Const(0),
            I::I64Load(at(clock + LOST, 3)),
            I::I64Const(1),
            I::I64Add,
            I::I64Store(at(clock + LOST, 3)),
            I::End,
        ]);
    }

    pub(crate) fn probe(&mut self, probe: u32, value: Value) {
        let probes = self.kernel.probes.len() as u32;
        self.of_key(8 * probes);
        self.get(value);
        match self.ty(value) {
            Type::I1 => self.body.op(I::I64ExtendI32U),
            Type::I32 => self.body.op(I::I64ExtendI32S),
            Type::I64 => {}
        }
        self.body
            .op(I::I64Store(at(self.map.probes + 8 * probe, 3)));
    }

    /// Where this key's words begin that take so many bytes for each key.
    fn of_key(&mut self, bytes: u32) {
        self.body.get(self.key);
        self.body.code([I::I32Const(bytes as i32), I::I32Mul]);
    }
}
