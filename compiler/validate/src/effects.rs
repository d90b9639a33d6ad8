//! What operators of the Kernel do with memory, where the state keeps it.

use whippen_kernel::{Inst, Op, Range, Type, Value};

use crate::around::histories;
use crate::bounds::Interval;
use crate::kernel::{KernelRun, Number};
use crate::stop::{Told, unproven};
use crate::term::{Base, Kind, Term, Terms};
use crate::truth::Truth;

impl KernelRun<'_> {
    pub(crate) fn on_memory(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Number>> {
        let declared = inst.results.first().map(|result| {
            let Range { low, high } = self.values[*result].range;
            (low.into(), high.into())
        });
        terms.declare(declared);
        let read = self.read_or_write(terms, inst, declared);
        terms.declare(None);
        read
    }

    fn read_or_write(
        &mut self,
        terms: &mut Terms,
        inst: &Inst,
        declared: Option<Interval>,
    ) -> Told<Option<Number>> {
        let t = terms;
        let places = self.question.places;
        let args = &inst.args;
        let read = match inst.op {
            Op::In(port) => self.input(t, port)?,
            Op::Live(live) => self.in_state(t, places.lives[live as usize])?,
            Op::Tick(later) => {
                let now = self.in_state(t, places.tick)?;
                let then = t.plus(now, later.into())?;
                t.word(then)?
            }
            Op::Keyed(keyed) => self.in_record(t, places.keyed[keyed as usize])?,
            Op::Get(cell) => {
                let zero = t.constant(0);
                return self.get(t, inst, cell, zero).map(Some);
            }
            Op::GetAt(cell) => {
                let index = self.whole(t, args[0])?;
                return self.get(t, inst, cell, index).map(Some);
            }
            Op::Delay(line, ticks) => {
                let (address, bytes) = self.slot(t, line, ticks)?;
                self.memory.load(t, address, bytes)?
            }
            Op::DelayAt(line) => {
                let before = self.whole(t, args[0])?;
                let (address, bytes) = self.slot_before(t, line, before)?;
                t.declare(declared);
                self.memory.load(t, address, bytes)?
            }
            Op::Lookup(table, column) => {
                let row = self.whole(t, args[0])?;
                self.lookup(t, table, column, row)?
            }
            _ => {
                self.write(t, inst)?;
                return Ok(None);
            }
        };
        Ok(Some(Number::Whole(read)))
    }

    fn write(&mut self, terms: &mut Terms, inst: &Inst) -> Told<()> {
        let t = terms;
        match inst.op {
            Op::Out(port) => {
                let value = self.whole(t, inst.args[0])?;
                self.output(t, port, value)
            }
            Op::Set(cell) => {
                let (zero, value) = (t.constant(0), self.whole(t, inst.args[0])?);
                self.set(t, cell, zero, value)
            }
            Op::SetAt(cell) => {
                let index = self.whole(t, inst.args[0])?;
                let value = self.whole(t, inst.args[1])?;
                self.set(t, cell, index, value)
            }
            Op::Push(line) => {
                let value = self.whole(t, inst.args[0])?;
                let (address, bytes) = self.slot(t, line, 0)?;
                self.memory.store(t, address, bytes, value, Truth::YES)
            }
            Op::Fill(line) => {
                let value = self.whole(t, inst.args[0])?;
                self.fill(t, line, value)
            }
            Op::Emit(event) => self.emit(t, event, &inst.args),
            Op::Wave(slopes, rates) => self.wave(t, inst, [slopes, rates]),
            _ => {
                let name = inst.op.row().name;
                unproven(format!("the operator `{name}` is not followed"))
            }
        }
    }

    fn in_state(&mut self, terms: &mut Terms, at: u32) -> Told<Term> {
        let base = terms.of(Kind::Base(Base::State));
        let address = terms.plus(base, at.into())?;
        self.memory.load(terms, address, 4)
    }

    fn in_record(&mut self, terms: &mut Terms, at: u32) -> Told<Term> {
        let address = terms.plus(self.at.record, at.into())?;
        self.memory.load(terms, address, 4)
    }

    fn input(&mut self, terms: &mut Terms, port: u32) -> Told<Term> {
        let address = terms.plus(self.at.samples, 2 * i128::from(port))?;
        let word = self.memory.load(terms, address, 2)?;
        let Range { low, high } = self.question.modes.kernel.inputs[port as usize].range;
        terms.clamp(word, (low.into(), high.into()))
    }

    fn output(&mut self, terms: &mut Terms, port: u32, value: Term) -> Told<()> {
        let places = self.question.places;
        let value = match places.gain {
            None => value,
            Some(at) => {
                let gain = self.in_record(terms, at)?;
                let half = terms.wrap(value, 16)?;
                let product = terms.mul(gain, half)?;
                terms.floor(product, 16)?
            }
        };
        let at = i128::from(places.drive) + 2 * i128::from(port);
        let address = terms.plus(self.at.samples, at)?;
        self.memory.store(terms, address, 2, value, Truth::YES)
    }

    /// The address of a word of a cell.
    pub(crate) fn place(&mut self, terms: &mut Terms, cell: u32, index: Term) -> Told<Term> {
        let size = match self.question.modes.kernel.cells[cell as usize].ty {
            Type::I64 => 8,
            _ => 4,
        };
        let address = terms.add_scaled(self.at.record, index, size)?;
        terms.plus(address, self.question.places.cells[cell as usize].into())
    }

    fn get(&mut self, terms: &mut Terms, inst: &Inst, cell: u32, index: Term) -> Told<Number> {
        let address = self.place(terms, cell, index)?;
        if self.values[inst.results[0]].ty == Type::I64 && terms.is_sampling() {
            // Both words at once, so that they make a number of the interval.
            terms.unread(address, 8);
        }
        let low = self.memory.load(terms, address, 4)?;
        match self.values[inst.results[0]].ty {
            Type::I32 => Ok(Number::Whole(low)),
            Type::I1 => {
                terms.learn(low, (0, 1))?;
                terms.at_least(low, 1).map(Number::Truth)
            }
            Type::I64 => {
                let behind = terms.plus(address, 4)?;
                let high = self.memory.load(terms, behind, 4)?;
                let low = terms.unsigned(low)?;
                terms.add_scaled(low, high, 1 << 32).map(Number::Whole)
            }
        }
    }

    fn set(&mut self, terms: &mut Terms, cell: u32, index: Term, value: Term) -> Told<()> {
        let address = self.place(terms, cell, index)?;
        if self.question.modes.kernel.cells[cell as usize].ty == Type::I64 {
            let high = terms.floor(value, 32)?;
            let behind = terms.plus(address, 4)?;
            self.memory.store(terms, behind, 4, high, Truth::YES)?;
        }
        self.memory.store(terms, address, 4, value, Truth::YES)
    }

    /// Address and bytes of the slot of a line that was written so many ticks ago.
    fn slot(&mut self, terms: &mut Terms, line: u32, ticks: u32) -> Told<(Term, u8)> {
        let place = &self.question.places.lines[line as usize];
        let ticks = if ticks == place.len { 0 } else { ticks };
        let (base, bytes) = (self.at.history, place.bytes());
        let Some(pointer) = place.pointers.get(&ticks) else {
            return match ticks {
                0 => Ok((base, bytes)),
                _ => unproven("a delay without a pointer"),
            };
        };
        let pointer = self.in_state(terms, *pointer)?;
        let address = terms.add_scaled(pointer, base, 1 << place.scale)?;
        Ok((address, bytes))
    }

    /// Fills all slots of a line: the key's is as far from the first key's as in the first line, in
    /// slots, from the first row on.
    fn fill(&mut self, terms: &mut Terms, line: u32, value: Term) -> Told<()> {
        let places = self.question.places;
        let place = &places.lines[line as usize];
        let Some(first) = places.first_line else {
            return unproven("a line where there is no first one");
        };
        let from = histories(self.question, terms)?;
        let first = terms.plus(from, places.lines[first as usize].at.into())?;
        let apart = terms.sub(self.at.history, first)?;
        let slot = terms.plus(from, place.at.into())?;
        let slot = terms.add_scaled(slot, apart, 1 << place.scale)?;
        for row in 0..place.len {
            let address = terms.plus(slot, i128::from(row) * i128::from(place.row))?;
            let bytes = place.bytes();
            self.memory
                .store(terms, address, bytes, value, Truth::YES)?;
        }
        Ok(())
    }

    /// Address and bytes of the slot of a line that was written so many ticks and one more ago:
    /// slots of a key lie a row apart, and before the first comes the last.
    fn slot_before(&mut self, terms: &mut Terms, line: u32, before: Term) -> Told<(Term, u8)> {
        let (here, bytes) = self.slot(terms, line, 0)?;
        let place = &self.question.places.lines[line as usize];
        let len = i128::from(place.len);
        let before = terms.clamp(before, (0, len - 1))?;
        let slots = (0, len - 1);
        terms.declare(Some(slots));
        let now = self.in_state(terms, place.ring)?;
        terms.learn(now, slots)?;
        let back = terms.plus(before, 1)?;
        let slot = terms.sub(now, back)?;
        let (is_there, zero) = (terms.at_least(slot, 0)?, terms.constant(0));
        let all = terms.constant(len);
        let around = terms.select(is_there, zero, all)?;
        let rows = terms.sub(around, back)?;
        let address = terms.add_scaled(here, rows, place.row.into())?;
        Ok((address, bytes))
    }

    fn lookup(&mut self, terms: &mut Terms, table: u32, column: u32, row: Term) -> Told<Term> {
        let found = &self.question.modes.kernel.tables[table as usize];
        if let Some(row) = terms.number(row) {
            let entry = found.entry(usize::try_from(row).unwrap_or(usize::MAX), column as usize);
            return match entry {
                Some(entry) => Ok(terms.constant(entry.into())),
                None => unproven("a row that a table does not have"),
            };
        }
        let columns = i128::from(found.columns);
        let at = i128::from(self.question.symbols.tables[table as usize]);
        let at = terms.constant(at + 4 * i128::from(column));
        let address = terms.add_scaled(at, row, 4 * columns)?;
        self.memory.load(terms, address, 4)
    }

    /// An event: tick, key and number, arguments; the next one goes behind it.
    fn emit(&mut self, terms: &mut Terms, event: u32, args: &[Value]) -> Told<()> {
        let places = self.question.places;
        let Some(number) = places.number else {
            return unproven("an event of keys without numbers");
        };
        let next = self.in_state(terms, places.next_event)?;
        let tick = self.in_state(terms, places.tick)?;
        let key = self.in_record(terms, number)?;
        let about = terms.plus(key, i128::from(event) << 16)?;
        let mut words = vec![tick, about];
        for arg in args {
            words.push(self.whole(terms, *arg)?);
        }
        for (word, at) in words.into_iter().zip((0..).step_by(4)) {
            let address = terms.plus(next, at)?;
            self.memory.store(terms, address, 4, word, Truth::YES)?;
        }
        let behind = terms.plus(next, places.event_bytes.into())?;
        let state = terms.of(Kind::Base(Base::State));
        let address = terms.plus(state, places.next_event.into())?;
        self.memory.store(terms, address, 4, behind, Truth::YES)
    }
}
