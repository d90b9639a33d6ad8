//! Captures: words of chosen keys in every tick, around a trigger, in memory that the board spares.
//!
//! ```text
//!   Capture --setting of each core--> board --ring of rows--> rows_of --> CapturedRows
//! ```
//!
//! A core has the rows of its own keys. Rows of two cores belong together by the numbers of their
//! ticks, which both count alike.

use std::ops::Range;

use whippen_compiler::firmware::{CAPTURED_MAX, Fact, captured};

use super::client::{Facts, MonitorError};
use super::status::BoardMemory;

/// What a capture waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// Nothing.
    Now,
    /// An event: its number, of a key of the core, or of any.
    Event(u32, Option<u32>),
    /// The sensor word of a captured key (its index among them) comes to this or more.
    Sensor(usize, u16),
    /// The drive word of one does.
    Drive(usize, i16),
    /// A captured word of memory (its index among them) does.
    Cell(usize, i32),
}

/// A capture of one core.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Capture {
    /// Keys, four at most.
    pub keys: Vec<u32>,
    /// Addresses of words, four at most.
    pub cells: Vec<u32>,
    /// Ticks that are kept.
    pub ticks: u32,
    /// How many of them follow the trigger.
    pub after: u32,
    /// What it waits for; none: for the capture of the other core with the same group.
    pub trigger: Option<Trigger>,
    /// Captures with one trigger have the same number.
    pub group: u32,
}

/// A row: what was in a tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CapturedRow {
    /// The number of the tick.
    pub tick: u32,
    /// Sensor word and drive word of each key.
    pub keys: Vec<(u16, i16)>,
    /// Words of memory.
    pub cells: Vec<i32>,
}

/// What was captured of a core: rows by rising tick, and the tick of the trigger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CapturedRows {
    /// Rows.
    pub rows: Vec<CapturedRow>,
    /// The tick in which the trigger was seen.
    pub trigger_tick: u32,
    /// Whether it has come to its end: where not, nothing is here yet.
    pub is_over: bool,
}

/// The memory that a core has for rows.
pub fn capture_room(facts: &Facts, core: usize) -> Range<u32> {
    let [begin, end] = match core {
        0 => [Fact::Room0, Fact::Room0End],
        _ => [Fact::Room1, Fact::Room1End],
    };
    facts.word(begin)..facts.word(end)
}

impl Capture {
    /// Bytes of a row.
    fn stride(&self) -> u32 {
        4 * (1 + self.keys.len() + self.cells.len()) as u32
    }

    /// The oldest rows of a ring that is full, over which the newest one has written: a row is
    /// written in all its places, also in those that are not kept.
    fn spoiled(&self) -> u32 {
        let places = CAPTURED_MAX as u32;
        let written = 4 * (1 + self.keys.len() as u32 + places).max(1 + places);
        written
            .saturating_sub(self.stride())
            .div_ceil(self.stride())
    }

    /// Rows of its ring.
    fn ring_rows(&self) -> u32 {
        self.ticks + self.spoiled()
    }

    /// How many ticks at most have room in so many bytes.
    pub fn ticks_max(&self, room_bytes: u32) -> u32 {
        let behind = 4 * (1 + 3 * CAPTURED_MAX as u32);
        let rows = room_bytes.saturating_sub(behind) / self.stride();
        rows.saturating_sub(self.spoiled())
    }

    /// The words of a request; a word at `spare` is read in place of cells that are not wanted. It
    /// and all cells must be in the memory of the core itself, which is what a tick is charged for.
    ///
    /// # Errors
    /// More is wanted than is captured at once, in words.
    pub fn setting(&self, spare: u32) -> Result<Vec<u32>, MonitorError> {
        let most = CAPTURED_MAX;
        if self.keys.len() > most || self.cells.len() > most {
            return Err(MonitorError::Refused(format!(
                "{} keys and {} cells of one core: a capture has at most {most} of each of a core",
                self.keys.len(),
                self.cells.len()
            )));
        }
        let key = |at: usize| self.keys.get(at).map_or(0, |key| 2 * key);
        let cell = |at: usize| self.cells.get(at).copied().unwrap_or(spare);
        let mut words = vec![
            self.stride(),
            4 * (1 + self.keys.len()) as u32,
            self.stride() * self.ring_rows(),
        ];
        words.extend((0..most).map(key));
        words.extend((0..most).map(cell));
        let sensor = |at: usize| 4 * (1 + at) as u32;
        let signed = 0x8000_0000_u32;
        // Mode; word of the row, shift, flip and level; the event.
        let none = u32::MAX;
        let [mode, word, shift, flip, level, event] = match self.trigger {
            None => [0, 0, 0, 0, 0, none],
            Some(Trigger::Now) => [3, 0, 0, 0, 0, none],
            Some(Trigger::Event(event, key)) => {
                [0, 0, 0, 0, 0, event << 16 | key.unwrap_or(0xffff)]
            }
            Some(Trigger::Sensor(at, level)) => {
                [1, sensor(at), 16, 0, u32::from(level) << 16, none]
            }
            Some(Trigger::Drive(at, level)) => {
                let level = (i32::from(level) as u32) << 16 ^ signed;
                [1, sensor(at), 0, signed, level, none]
            }
            Some(Trigger::Cell(at, level)) => {
                let word = sensor(self.keys.len() + at);
                [1, word, 0, signed, level as u32 ^ signed, none]
            }
        };
        words.extend([
            mode, word, shift, flip, level, self.after, event, self.group,
        ]);
        Ok(words)
    }
}

/// The rows of a capture that is over, whose block is at this address.
///
/// # Errors
/// They cannot be read.
pub fn rows_of(
    memory: &mut (impl BoardMemory + ?Sized),
    capture: &Capture,
    block: u32,
) -> Result<CapturedRows, MonitorError> {
    let words = memory.read(block, captured::SETTING as usize / 4)?;
    let word = |offset: u32| words[offset as usize / 4];
    if word(captured::NEXT) != 0 {
        return Ok(CapturedRows {
            rows: Vec::new(),
            trigger_tick: 0,
            is_over: false,
        });
    }
    let stride = capture.stride() as usize / 4;
    let ring = memory.read(word(captured::START), stride * capture.ring_rows() as usize)?;
    let last = word(captured::LAST).wrapping_sub(word(captured::START)) as usize / 4;
    let (newest, oldest) = ring.split_at(last.min(ring.len()));
    let spoiled = stride * capture.spoiled() as usize;
    let oldest = &oldest[spoiled.min(oldest.len())..];
    let in_order = oldest
        .chunks_exact(stride)
        .chain(newest.chunks_exact(stride));
    let row = |words: &[u32]| {
        let (keys, cells) = words[1..].split_at(capture.keys.len());
        CapturedRow {
            tick: words[0],
            keys: keys
                .iter()
                .map(|word| (*word as u16, (*word >> 16) as i16))
                .collect(),
            cells: cells.iter().map(|word| *word as i32).collect(),
        }
    };
    let all: Vec<CapturedRow> = in_order.map(row).collect();
    // Where the ring has not been filled, what was there before is none of it.
    let armed = word(captured::HALT);
    let is_own = |row: &CapturedRow| row.tick.wrapping_sub(armed).wrapping_sub(1) < u32::MAX / 2;
    let mut rows: Vec<CapturedRow> = Vec::new();
    for row in all.into_iter().rev().filter(is_own) {
        if rows
            .last()
            .is_some_and(|newer| newer.tick.wrapping_sub(row.tick) > u32::MAX / 2)
        {
            break;
        }
        rows.push(row);
    }
    rows.truncate(capture.ticks as usize);
    rows.reverse();
    Ok(CapturedRows {
        rows,
        trigger_tick: word(captured::AT),
        is_over: true,
    })
}
