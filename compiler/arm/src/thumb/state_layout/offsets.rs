//! Offsets of what is read and written from outside, in bytes from the symbol `NAME_state`.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{EVENT_HEAD, EVENT_LOST, EVENT_NEXT, EVENT_TAIL, ROW, Ring, StateLayout, TICK};

/// The slots of a delay line, as code of keys finds them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSlots {
    /// Whether they are `u16` (else `i32`).
    pub narrow: bool,
    /// How many there are of a key.
    pub len: u32,
    /// How far HISTORY is shifted left before a pointer is added to it.
    pub scale: u8,
    /// By how many ticks ago: the offset in the state of the pointer. Where there is none, HISTORY
    /// is the address.
    pub pointers: BTreeMap<u32, u32>,
    /// Bytes from one tick's slot of a key to the next tick's.
    pub row: u32,
    /// Offset in the state of the number of the slot that is written in this tick.
    pub ring: u32,
    /// Offset of the first row in the state, or in the histories where they lie apart.
    pub at: u32,
}

impl StateLayout {
    /// Bytes of the state.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// How many keys it has.
    pub fn keys(&self) -> u32 {
        self.keys
    }

    /// Whether words and events lie in the state, and not in a firmware's frame.
    pub fn has_rows(&self) -> bool {
        self.caller.is_none()
    }

    /// The word that comes in of a key and port.
    pub fn input(&self, key: u32, port: u32) -> u32 {
        self.inputs + key * self.stride + 2 * port
    }

    /// The word that goes out of a key and port.
    pub fn output(&self, key: u32, port: u32) -> u32 {
        self.outputs + key * self.stride + 2 * port
    }

    /// A live parameter.
    pub fn live_param(&self, param: usize) -> Option<u32> {
        self.live_params.get(param).copied()
    }

    /// The gain of a key, if keys have one.
    pub fn gain(&self, key: u32) -> Option<u32> {
        self.gain.map(|at| self.record(key) + at)
    }

    /// Word 0 of a cell of a key; a mode that knows the cell may leave another value there.
    pub fn cell(&self, key: u32, cell: usize) -> Option<u32> {
        self.cells.get(cell).map(|at| self.record(key) + at)
    }

    /// A value per key, in the record of a key.
    pub fn keyed(&self, key: u32, keyed: usize) -> Option<u32> {
        self.keyed.get(keyed).map(|at| self.record(key) + at)
    }

    /// The number by which events know a key, where keys have events.
    pub fn number(&self, key: u32) -> Option<u32> {
        self.number.map(|at| self.record(key) + at)
    }

    /// A probe of a key, 8 bytes, if probes are kept.
    pub fn probe(&self, key: u32, probe: usize) -> Option<u32> {
        self.probes
            .as_ref()?
            .get(probe)
            .map(|at| self.record(key) + at)
    }

    /// The record of a key: its first word is the address of the code of its mode.
    pub fn record(&self, key: u32) -> u32 {
        self.records + key * self.record
    }

    /// Bytes of a record.
    pub fn record_bytes(&self) -> u32 {
        self.record
    }

    /// Bytes of a key in a row of words.
    pub fn stride(&self) -> u32 {
        self.stride
    }

    /// The number of the tick.
    pub fn tick(&self) -> u32 {
        TICK
    }

    /// The address of this tick's row of the line that HISTORY walks.
    pub fn row(&self) -> u32 {
        ROW
    }

    /// The address of the next event of this tick.
    pub fn next_event(&self) -> u32 {
        EVENT_NEXT
    }

    /// Words that no code changes: constants, addresses of modes.
    pub fn constants(&self) -> Range<u32> {
        self.literals..self.records
    }

    /// Bytes of a slot of the line that HISTORY walks; 0 where there is none.
    pub fn history_bytes(&self) -> u32 {
        let first = self.first_line.map(|line| &self.lines[line as usize]);
        first.map_or(0, |line| 1 << line.log2())
    }

    /// The line that HISTORY walks.
    pub fn first_line(&self) -> Option<u32> {
        self.first_line
    }

    /// Offset in the state of the address of the histories, and behind it that of the ring of
    /// events, where they lie apart.
    pub fn apart(&self) -> Option<u32> {
        self.apart
    }

    /// Offset in the state of the address of this tick's row of words in, where that is the
    /// caller's.
    pub fn words(&self) -> Option<u32> {
        self.caller
    }

    /// The delay lines.
    pub fn lines(&self) -> Vec<LineSlots> {
        let of = |number: u32| {
            let line = &self.lines[number as usize];
            let own = self.pointers.iter().filter(|p| p.line == number);
            LineSlots {
                narrow: line.narrow,
                len: line.len,
                row: line.row,
                ring: line.ring,
                at: line.at,
                scale: self.scale(number),
                pointers: own.map(|p| (p.ticks, p.at)).collect(),
            }
        };
        (0..self.lines.len() as u32).map(of).collect()
    }

    /// The ring of events, if keys have any.
    pub fn events(&self) -> Option<EventRing> {
        self.ring.as_ref().map(EventRing::of)
    }
}

/// The ring of events, in bytes from the start of the state. An event is a word with the tick,
/// `u16` key, `u16` event, and the arguments as words; one whose second word is [`EVENT_MARK`] is
/// none, but says that the ring goes on at its beginning. Where the ring lies apart
/// (`NAME_events`), `start` is in bytes from there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventRing {
    /// Word: bytes ever written.
    pub head: u32,
    /// Word: bytes ever read; the reader's.
    pub tail: u32,
    /// Word: events that found the ring full.
    pub lost: u32,
    /// Where the ring begins.
    pub start: u32,
    /// Its size, a power of two.
    pub bytes: u32,
    /// Bytes of one event.
    pub event: u32,
    /// From the ring's beginning to the spare behind it, where events go that have no room.
    pub spare: u32,
    /// Bytes of all events that a tick can have.
    pub tick_bytes_max: u32,
}

/// The second word of what is no event: it says that the ring goes on at its beginning.
pub const EVENT_MARK: u32 = !0;

impl EventRing {
    pub(super) fn of(ring: &Ring) -> EventRing {
        EventRing {
            head: EVENT_HEAD,
            tail: EVENT_TAIL,
            lost: EVENT_LOST,
            start: ring.at,
            bytes: ring.bytes,
            event: ring.event,
            spare: ring.spare(),
            tick_bytes_max: ring.tick_bytes_max,
        }
    }

    /// Where what was written first and not read yet goes on, if a mark stands at `tail`.
    pub fn behind_mark(&self, tail: u32) -> u32 {
        (tail | (self.bytes - 1)).wrapping_add(1)
    }
}
