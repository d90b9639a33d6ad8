//! One key in one tick: what the operators on memory mean.
//!
//! The kernel is verified, so every index is inside, unless it rests on an `assume` that is wrong:
//! then the nearest counts.

use super::Memory;
use crate::layout::EVENT_HEAD;
use crate::{Kernel, wave};

/// One key, in one tick or in `init`.
#[derive(Debug)]
pub struct Key<'a> {
    /// The kernel.
    pub kernel: &'a Kernel,
    /// Memory of all keys.
    pub memory: &'a mut Memory,
    /// Which one.
    pub key: usize,
    /// Words of all keys, key after key.
    pub inputs: &'a [u16],
    /// Words of all keys, key after key.
    pub outputs: &'a mut [i16],
}

impl Key<'_> {
    /// The sensor word of a port, within its range.
    pub fn input(&self, port: usize) -> i64 {
        let range = self.kernel.inputs[port].range;
        let word = self.inputs[self.key * self.kernel.inputs.len() + port];
        i64::from(word).clamp(range.low, range.high)
    }

    /// Drives a port with a word.
    pub fn output(&mut self, port: usize, word: i64) {
        self.outputs[self.key * self.kernel.outputs.len() + port] = word as i16;
    }

    /// The number of the tick that comes so many later, as 32 bits.
    pub fn tick(&self, later: usize) -> i64 {
        i64::from(self.memory.clock.tick.wrapping_add(later as u64) as i32)
    }

    /// A live value.
    pub fn live(&self, live: usize) -> i64 {
        self.memory.lives[live].into()
    }

    /// A value of this key.
    pub fn keyed(&self, keyed: usize) -> i64 {
        let layout = &self.memory.layout;
        let word = self.memory.columns[layout.keyed[keyed] + self.key];
        i64::from(word as i32)
    }

    /// A word of a cell.
    pub fn get(&self, cell: usize, word: i64) -> i64 {
        let found = &self.kernel.cells[cell];
        self.memory
            .load(found.ty, self.key, cell, nearest(word, found.len as usize))
    }

    /// Writes a word of a cell.
    pub fn set(&mut self, cell: usize, word: i64, value: i64) {
        let found = &self.kernel.cells[cell];
        self.memory.store(
            found.ty,
            self.key,
            cell,
            nearest(word, found.len as usize),
            value,
        );
    }

    /// One tick of the string that two cells hold, by its coefficients and ends.
    pub fn wave(&mut self, e: usize, v: usize, args: &[i64]) {
        let mut args = args.iter().map(|arg| *arg as i32);
        let [k0, k1, k2, k3, left, right] =
            std::array::from_fn(|_| args.next().unwrap_or_default());
        let count = self.kernel.cells[v].len as usize;
        let mut points = StringCells { key: self, e, v };
        wave::tick(&mut points, count, [k0, k1, k2, k3], [left, right]);
    }

    /// What went into a line so many ticks ago.
    pub fn delay(&self, line: usize, ticks: usize) -> i64 {
        let place = self.memory.layout.lines[line];
        let now = self.memory.rings[place.ring] as usize;
        let at = self.element(line, (now + place.len - ticks) % place.len);
        if place.narrow {
            self.memory.narrow[at].into()
        } else {
            self.memory.wide[at].into()
        }
    }

    /// What went into a line one tick more than that ago.
    pub fn delay_at(&self, line: usize, before: i64) -> i64 {
        let len = self.memory.layout.lines[line].len;
        self.delay(line, nearest(before, len) + 1)
    }

    /// Puts the value of this tick into a line.
    pub fn push(&mut self, line: usize, value: i64) {
        let place = self.memory.layout.lines[line];
        let slot = self.memory.rings[place.ring] as usize;
        self.write(line, slot, value);
    }

    /// Fills a line with one value.
    pub fn fill(&mut self, line: usize, value: i64) {
        (0..self.memory.layout.lines[line].len).for_each(|slot| self.write(line, slot, value));
    }

    /// A word of a table.
    pub fn lookup(&self, table: usize, column: usize, row: i64) -> i64 {
        let table = &self.kernel.tables[table];
        let row = nearest(row, table.rows());
        table.entry(row, column).unwrap_or_default().into()
    }

    /// Tells an event, or counts it as lost where there is no room.
    pub fn emit(&mut self, event: usize, args: &[i64]) {
        let memory = &mut *self.memory;
        let Some(record) = memory.event_room() else {
            return;
        };
        record[2] = self.key as u32;
        record[3] = event as u32;
        for (slot, arg) in record[EVENT_HEAD..].iter_mut().zip(args) {
            *slot = *arg as u32;
        }
    }

    /// Writes a probe.
    pub fn probe(&mut self, probe: usize, value: i64) {
        self.memory.probes[self.key * self.kernel.probes.len() + probe] = value;
    }

    fn write(&mut self, line: usize, slot: usize, value: i64) {
        let at = self.element(line, slot);
        let narrow = self.memory.layout.lines[line].narrow;
        if narrow {
            self.memory.narrow[at] = value as u16
        } else {
            self.memory.wide[at] = value as i32
        }
    }

    fn element(&self, line: usize, slot: usize) -> usize {
        self.memory.layout.lines[line].start + slot * self.memory.layout.keys + self.key
    }
}

/// The two cells of a string.
struct StringCells<'a, 'k> {
    key: &'a mut Key<'k>,
    e: usize,
    v: usize,
}

impl wave::Points for StringCells<'_, '_> {
    fn slope(&self, part: usize) -> i32 {
        self.key.get(self.e, part as i64) as i32
    }

    fn rate(&self, point: usize) -> i32 {
        self.key.get(self.v, point as i64) as i32
    }

    fn set_slope(&mut self, part: usize, slope: i32) {
        self.key.set(self.e, part as i64, slope.into());
    }

    fn set_rate(&mut self, point: usize, rate: i32) {
        self.key.set(self.v, point as i64, rate.into());
    }
}

/// The index nearest to this one; there is at least one word.
fn nearest(index: i64, len: usize) -> usize {
    index.clamp(0, len as i64 - 1) as usize
}
