//! Memory of all keys, and what the host may do with it between ticks.
//!
//! Every engine works on a `Memory` of its own; after the same calls they are equal byte for byte
//! (`==`). Whatever comes in from outside is held to the declared ranges here, so that what
//! `verify` proved stays true.

mod key;

pub use key::Key;

use super::layout::{EVENT_HEAD, EVENTS_MAX, Layout, LayoutError};
use super::{Kernel, Range, Type, VerifyError, verify};
use std::fmt;

/// Why an engine cannot be built, or not be told so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EngineError {
    /// The kernel does not verify.
    Kernel(Vec<VerifyError>),
    /// No memory can be laid out.
    Layout(LayoutError),
    /// No such live value, cell or key.
    Unknown,
    /// A value outside the declared range.
    Outside {
        /// The value.
        value: i64,
        /// Where it should lie.
        range: Range,
    },
    /// No machine code for this host.
    Host(String),
}

impl fmt::Display for EngineError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            EngineError::Kernel(errors) => {
                let lines: Vec<String> = errors.iter().map(VerifyError::to_string).collect();
                f.write_str(&lines.join("\n"))
            }
            EngineError::Layout(error) => error.fmt(f),
            EngineError::Unknown => f.write_str("no such live value, cell or key"),
            EngineError::Outside { value, range } => write!(f, "{value} is not in {range}"),
            EngineError::Host(message) => write!(f, "no machine code: {message}"),
        }
    }
}

impl std::error::Error for EngineError {}

/// An event that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Happened {
    /// In which tick after `init`, from 0.
    pub tick: u64,
    /// To which key.
    pub key: u32,
    /// Which event of the kernel.
    pub event: u32,
    /// Its arguments.
    pub args: Vec<i32>,
}

/// Memory of all keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// Where everything lies.
    pub layout: Layout,
    /// Cells and values per key, a column each.
    pub columns: Vec<u32>,
    /// Delay lines of 16-bit elements.
    pub narrow: Vec<u16>,
    /// Delay lines of 32-bit elements.
    pub wide: Vec<i32>,
    /// The present slot of each ring of delay lines.
    pub rings: Vec<u32>,
    /// Live values.
    pub lives: Vec<i32>,
    /// Records of events of this tick.
    pub events: Vec<u32>,
    /// Probes, key after key.
    pub probes: Vec<i64>,
    /// Ticks and events counted.
    pub clock: Clock,
}

/// What is counted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[repr(C)]
pub struct Clock {
    /// Ticks since `init`.
    pub tick: u64,
    /// Events in the buffer.
    pub events: u64,
    /// Events that found the buffer full.
    pub lost: u64,
}

impl Memory {
    /// Memory of so many keys, as before `init`.
    ///
    /// # Errors
    /// The kernel does not verify; too many keys or too much memory.
    pub fn new(kernel: &Kernel, keys: usize) -> Result<Memory, EngineError> {
        let verified = verify(kernel).map_err(EngineError::Kernel)?;
        let layout = Layout::new(verified, keys).map_err(EngineError::Layout)?;
        let mut memory = Memory {
            columns: vec![0; layout.column_words],
            narrow: vec![0; layout.narrow_len],
            wide: vec![0; layout.wide_len],
            rings: vec![0; layout.rings.len()],
            lives: kernel.lives.iter().map(|live| live.init).collect(),
            events: vec![0; EVENTS_MAX * layout.event_words],
            probes: vec![0; kernel.probes.len() * keys],
            clock: Clock::default(),
            layout,
        };
        memory.reset(kernel);
        Ok(memory)
    }

    /// Puts back everything but the live values and events not drained.
    pub fn reset(&mut self, kernel: &Kernel) {
        self.columns.fill(0);
        self.probes.fill(0);
        self.rings.fill(0);
        self.clock.tick = 0;
        for key in 0..self.layout.keys {
            for (index, cell) in kernel.cells.iter().enumerate() {
                (0..cell.len as usize)
                    .for_each(|word| self.store(cell.ty, key, index, word, cell.init));
            }
            for (at, keyed) in self.layout.keyed.iter().zip(&kernel.keyed) {
                let value = keyed
                    .values
                    .get(key)
                    .or(keyed.values.last())
                    .copied()
                    .unwrap_or_default();
                self.columns[at + key] = value as u32;
            }
        }
        for (line, place) in kernel.lines.iter().zip(self.layout.lines.clone()) {
            let value = line.first_value();
            let all = place.start..place.start + place.len * self.layout.keys;
            if place.narrow {
                self.narrow[all].fill(value as u16)
            } else {
                self.wide[all].fill(value as i32)
            }
        }
    }

    /// Goes to the next tick.
    pub fn advance(&mut self) {
        self.clock.tick += 1;
        for (at, len) in self.rings.iter_mut().zip(&self.layout.rings) {
            *at = if *at as usize + 1 == *len { 0 } else { *at + 1 };
        }
    }

    /// How many keys there are.
    pub fn keys(&self) -> usize {
        self.layout.keys
    }

    /// Ticks since `init`.
    pub fn tick(&self) -> u64 {
        self.clock.tick
    }

    /// What was exported in the last tick: key after key, probe after probe.
    pub fn probes(&self) -> &[i64] {
        &self.probes
    }

    /// How many events found the buffer full, ever.
    pub fn lost_events(&self) -> u64 {
        self.clock.lost
    }

    /// The events since the last call, in the order of ticks, then keys.
    pub fn drain_events(&mut self, kernel: &Kernel) -> Vec<Happened> {
        let count = std::mem::take(&mut self.clock.events) as usize;
        let happened = |words: &[u32]| {
            let args = kernel
                .events
                .get(words[3] as usize)
                .map_or(0, |event| event.args as usize);
            Happened {
                tick: u64::from(words[0]) | u64::from(words[1]) << 32,
                key: words[2],
                event: words[3],
                args: words[EVENT_HEAD..EVENT_HEAD + args]
                    .iter()
                    .map(|word| *word as i32)
                    .collect(),
            }
        };
        self.events
            .chunks_exact(self.layout.event_words)
            .take(count)
            .map(happened)
            .collect()
    }

    /// Room for one more event, with the tick filled in; where there is none, an event is counted
    /// as lost.
    pub fn event_room(&mut self) -> Option<&mut [u32]> {
        if self.clock.events == EVENTS_MAX as u64 {
            self.clock.lost += 1;
            return None;
        }
        let at = self.clock.events as usize * self.layout.event_words;
        self.clock.events += 1;
        let record = &mut self.events[at..at + self.layout.event_words];
        record[..2].copy_from_slice(&[self.clock.tick as u32, (self.clock.tick >> 32) as u32]);
        Some(record)
    }

    /// Changes a live value.
    ///
    /// # Errors
    /// There is none with this index; the value is outside its range.
    pub fn set_live(
        &mut self,
        kernel: &Kernel,
        live: usize,
        value: i32,
    ) -> Result<(), EngineError> {
        let range = kernel.lives.get(live).ok_or(EngineError::Unknown)?.range;
        self.lives[live] = held(range, value.into())? as i32;
        Ok(())
    }

    /// A word of a cell; none if there is no such key, cell or word.
    pub fn cell(&self, kernel: &Kernel, key: usize, cell: usize, word: usize) -> Option<i64> {
        let found = kernel
            .cells
            .get(cell)
            .filter(|found| key < self.keys() && word < found.len as usize)?;
        Some(self.load(found.ty, key, cell, word))
    }

    /// Changes a word of a cell.
    ///
    /// # Errors
    /// No such key, cell or word; the value is outside the cell's range.
    pub fn set_cell(
        &mut self,
        kernel: &Kernel,
        key: usize,
        cell: usize,
        word: usize,
        value: i64,
    ) -> Result<(), EngineError> {
        self.cell(kernel, key, cell, word)
            .ok_or(EngineError::Unknown)?;
        let found = &kernel.cells[cell];
        self.store(found.ty, key, cell, word, held(found.range, value)?);
        Ok(())
    }

    fn load(&self, ty: Type, key: usize, cell: usize, word: usize) -> i64 {
        let at = self.layout.place(ty, key, cell, word);
        match ty {
            Type::I1 | Type::I32 => i64::from(self.columns[at] as i32),
            Type::I64 => i64::from(self.columns[at]) | i64::from(self.columns[at + 1]) << 32,
        }
    }

    fn store(&mut self, ty: Type, key: usize, cell: usize, word: usize, value: i64) {
        let at = self.layout.place(ty, key, cell, word);
        self.columns[at] = value as u32;
        if ty == Type::I64 {
            self.columns[at + 1] = (value >> 32) as u32;
        }
    }
}

fn held(range: Range, value: i64) -> Result<i64, EngineError> {
    if range.has(value) {
        Ok(value)
    } else {
        Err(EngineError::Outside { value, range })
    }
}
