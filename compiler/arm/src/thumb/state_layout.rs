//! Memory layout of the state that all code of a core shares.
//!
//! ```text
//!   STATE -> | next event, read, lost, tick | ring indices | row of line 0, pointers | live_params | events | literals |
//!        | records, sentinel | rows of words | histories |
//!
//!   RECORD -> record of this key: | code | gain | number | cells | keyed constants | probes |
//!   SAMPLES -> its words in the rows (`u16` in, then, one row on, `i16` out)
//!   HISTORY -> its slot in the current row of the first line's history
//! ```
//!
//! Everything is one piece of memory, its *state*, so all distances are constants and one address
//! finds all. In a firmware's frame the ring of events and the histories lie apart: a key uses them
//! a few times a tick and the rest at every turn, so the rest can have memory that nobody else is
//! at. A key's code leaves SAMPLES, HISTORY and RECORD at the next key's.

mod offsets;

pub use offsets::{EVENT_MARK, EventRing, LineSlots};

use super::promote::Promotions;
use super::{Options, TickAbi};
use crate::features::Features;
use whippen_kernel::layout::words;
use whippen_kernel::{Inst, Kernel, Op, Range};

/// Bytes that the ring of events has at least.
const RING_BYTES_MIN: u32 = 1024;
/// Offset in STATE: bytes of events ever written.
pub(super) const EVENT_HEAD: u32 = 0;
/// Offset in STATE: bytes of events ever read, written by the reader.
pub(super) const EVENT_TAIL: u32 = 4;
/// Offset in STATE: events that found the ring full.
pub(super) const EVENT_LOST: u32 = 8;
/// Offset in STATE: ticks since the start.
pub(super) const TICK: u32 = 12;
/// Offset in STATE: this tick's row of the first line.
pub(super) const ROW: u32 = 16;
/// Offset in STATE: where this tick's next event goes.
pub(super) const EVENT_NEXT: u32 = 20;
/// Offset in STATE: the first ring index.
const RINGS: u32 = 24;
/// How many literals STATE holds.
pub(super) const LITERALS_MAX: usize = 256;

/// A delay line in the state.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Line {
    /// Whether its slots are `u16` (else `i32`).
    pub narrow: bool,
    /// Slots of each key.
    pub len: u32,
    /// Offset of the first row in the state, or in the histories where they lie apart.
    pub at: u32,
    /// Bytes of a row.
    pub row: u32,
    /// Offset in STATE of its ring index.
    pub ring: u32,
}

impl Line {
    /// Bytes of a slot, as a power of two.
    pub(super) fn log2(&self) -> u8 {
        if self.narrow { 1 } else { 2 }
    }
}

/// A pointer in STATE: where HISTORY plus it is the slot that was written so many ticks ago.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Pointer {
    pub line: u32,
    pub ticks: u32,
    /// Offset in STATE.
    pub at: u32,
}

/// Where everything lies.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct StateLayout {
    pub(super) keys: u32,
    /// Offset in STATE of this tick's row of words in, where rows are the caller's: where the tick
    /// is part of a firmware's frame.
    pub(super) caller: Option<u32>,
    /// Offset in STATE of the address of the histories, and behind it that of the ring of events,
    /// where they lie apart.
    pub(super) apart: Option<u32>,
    /// Bytes of a key in a row of words.
    pub(super) stride: u32,
    /// Offset in the record of the gain, if there is one.
    pub(super) gain: Option<u32>,
    /// Offset in the record of the key's number, where keys have events.
    pub(super) number: Option<u32>,
    /// Offset in the record of each cell.
    pub(super) cells: Vec<u32>,
    /// Offset in the record of each keyed constant.
    pub(super) keyed: Vec<u32>,
    /// Offset in the record of each probe, where they are kept.
    pub(super) probes: Option<Vec<u32>>,
    /// Bytes of a record.
    pub(super) record: u32,
    pub(super) lines: Vec<Line>,
    /// The line that HISTORY walks.
    pub(super) first_line: Option<u32>,
    pub(super) pointers: Vec<Pointer>,
    /// Offset in STATE of each distinct ring index, and its length.
    pub(super) rings: Vec<(u32, u32)>,
    /// Offset in STATE of each live parameter, those that the entry of a tick computes behind the
    /// kernel's own.
    pub(super) live_params: Vec<u32>,
    pub(super) literals: u32,
    /// Events, where keys have any.
    pub(super) ring: Option<Ring>,
    pub(super) inputs: u32,
    pub(super) outputs: u32,
    pub(super) records: u32,
    /// What stays in registers from key to key, once the modes are made.
    pub(super) promoted: Promotions,
    pub(super) size: u32,
    /// Bytes of the histories, where they lie apart.
    pub(super) size_apart: u32,
}

/// The ring of events.
///
/// Its room is looked after once a tick: a tick begins where the most events of a tick fit in one
/// piece, or, where they do not fit at all, in the spare behind the ring, from which they are
/// counted as lost. So an event is stored and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Ring {
    /// Offset in the state; 0 where it lies apart.
    pub at: u32,
    /// Its size, a power of two, at least twice that of the events of a tick.
    pub bytes: u32,
    /// Bytes of an event; a power of two.
    pub event: u32,
    /// Bytes of all events that a tick can have.
    pub tick_bytes_max: u32,
}

impl Ring {
    fn new(kernel: &Kernel, keys: u32) -> Option<Ring> {
        let args = kernel.events.iter().map(|event| event.args).max()?;
        let event = 4 * (2 + args).next_power_of_two();
        let tick_bytes_max = keys
            .saturating_mul(kernel.tick.events_max())
            .max(1)
            .saturating_mul(event);
        let bytes = tick_bytes_max
            .saturating_mul(2)
            .max(RING_BYTES_MIN)
            .checked_next_power_of_two()?;
        Some(Ring {
            at: 0,
            bytes,
            event,
            tick_bytes_max,
        })
    }

    /// From the ring's beginning to that of the spare: a ring that is full to its end is none of
    /// it.
    pub fn spare(&self) -> u32 {
        self.bytes + self.event
    }

    /// Bytes of both.
    pub fn size(&self) -> u32 {
        self.spare() + self.tick_bytes_max
    }
}

/// The ring of so many keys by itself, and the bytes of the most events of a tick.
pub(super) fn event_ring(kernel: &Kernel, keys: u32) -> Option<(EventRing, u32)> {
    Ring::new(kernel, keys).map(|ring| (EventRing::of(&ring), ring.tick_bytes_max))
}

impl StateLayout {
    /// The state of so many keys of a kernel, to be closed; within a firmware, the rows of
    /// words are the caller's. The entry of a tick computes so many live parameters more.
    pub(super) fn new(
        kernel: &Kernel,
        options: &Options,
        abi: Option<&TickAbi>,
        shared: usize,
    ) -> StateLayout {
        let (keys, gain) = (options.keys, options.gain);
        let mut layout = StateLayout {
            keys,
            caller: None,
            apart: None,
            stride: 2 * kernel.inputs.len().max(kernel.outputs.len()).max(1) as u32,
            gain: gain.then_some(4),
            number: None,
            cells: Vec::new(),
            keyed: Vec::new(),
            probes: None,
            record: if gain { 8 } else { 4 },
            lines: Vec::new(),
            first_line: None,
            pointers: Vec::new(),
            rings: Vec::new(),
            live_params: Vec::new(),
            literals: 0,
            ring: Ring::new(kernel, keys),
            inputs: 0,
            outputs: 0,
            records: 0,
            promoted: Promotions::default(),
            size: RINGS,
            size_apart: 0,
        };
        layout.caller = abi.map(|_| layout.take(4));
        layout.apart = abi.map(|_| layout.take(8));
        layout.place_record(kernel, options.probes);
        layout.record = layout.record.max(abi.map_or(0, |abi| abi.record_bytes_min));
        layout.place_table(kernel, shared);
        if layout.apart.is_none() {
            layout.place_records(LITERALS_MAX);
        }
        layout.place_rows(abi);
        layout.place_histories(kernel);
        layout
    }

    fn place_record(&mut self, kernel: &Kernel, probes: bool) {
        let mut take = |bytes: usize| {
            let at = self.record;
            self.record += bytes as u32;
            at
        };
        self.number = (!kernel.events.is_empty()).then(|| take(4));
        self.cells = kernel
            .cells
            .iter()
            .map(|cell| take(4 * words(cell.ty) * cell.len as usize))
            .collect();
        self.keyed = kernel.keyed.iter().map(|_| take(4)).collect();
        self.probes = probes.then(|| kernel.probes.iter().map(|_| take(8)).collect());
    }

    fn take(&mut self, bytes: u32) -> u32 {
        let at = self.size;
        self.size += bytes.next_multiple_of(4);
        at
    }

    /// As [`Frame::take`], but of histories.
    fn take_apart(&mut self, bytes: u32) -> u32 {
        if self.apart.is_none() {
            return self.take(bytes);
        }
        let at = self.size_apart;
        self.size_apart += bytes.next_multiple_of(4);
        at
    }

    fn place_table(&mut self, kernel: &Kernel, shared: usize) {
        for line in &kernel.lines {
            if !self.rings.iter().any(|(_, len)| *len == line.len) {
                let at = self.take(4);
                self.rings.push((at, line.len));
            }
        }
        self.live_params = (0..kernel.lives.len() + shared)
            .map(|_| self.take(4))
            .collect();
        let delays = delays(kernel);
        let narrow = |line: &u32| is_narrow(kernel.lines[*line as usize].range);
        let lines = 0..kernel.lines.len() as u32;
        self.first_line = lines.clone().find(narrow).or(lines.clone().next());
        let pushes = lines.map(|line| (line, 0));
        for (line, ticks) in pushes.chain(delays) {
            // The oldest slot is the one that is written now.
            let ticks = if kernel.lines[line as usize].len == ticks {
                0
            } else {
                ticks
            };
            let here = self.first_line == Some(line) && ticks == 0;
            if !here && self.pointer(line, ticks).is_none() {
                let at = self.take(4);
                self.pointers.push(Pointer { line, ticks, at });
            }
        }
        if let Some(ring) = self.ring.filter(|_| self.apart.is_none()) {
            self.ring = Some(Ring {
                at: self.take(ring.size()),
                ..ring
            });
        }
        self.literals = self.size;
    }

    /// The same as selection of modes knows it, and by how much the distance from words in to words
    /// out is short there. It knows neither how many keys there are nor how large the ring of their
    /// events is; nor how long rows of delay lines are, unless something is read at an index; nor
    /// that distance, where every one is a part of the instruction that stores.
    pub(super) fn for_any_keys(&self, kernel: &Kernel, features: &Features) -> (StateLayout, u32) {
        let mut any = StateLayout {
            keys: 0,
            ..self.clone()
        };
        if let Some(ring) = &mut any.ring {
            (ring.bytes, ring.tick_bytes_max) = (0, 0);
        }
        let mut all = kernel.all_insts();
        if !all.any(|inst| matches!(inst.op, Op::DelayAt(_))) {
            any.size_apart = 0;
            for line in &mut any.lines {
                (line.at, line.row) = (0, 0);
            }
        }
        let (nearest, max) = (self.inputs + self.stride, features.load_offset_max);
        let short = self.outputs.saturating_sub(nearest);
        if !features.legal_as_selected || short + self.stride > max {
            return (any, 0);
        }
        any.outputs = self.outputs - short;
        (any, short)
    }

    fn place_rows(&mut self, abi: Option<&TickAbi>) {
        let row = self.keys * self.stride;
        match abi {
            Some(abi) => self.outputs = abi.drive_offset,
            None => {
                self.inputs = self.take(row);
                self.outputs = self.take(row);
            }
        }
    }

    /// Literals, so many, and records behind them: no key's code knows how far they are.
    fn place_records(&mut self, literals: usize) {
        self.take(4 * literals as u32);
        // The sentinel is a record of one word.
        self.records = self.take(self.keys * self.record + 4);
    }

    /// Everything is known once it is known how many literals there are.
    pub(super) fn close(&mut self, literals: usize) {
        if self.apart.is_some() {
            self.place_records(literals);
        }
    }

    fn place_histories(&mut self, kernel: &Kernel) {
        for line in &kernel.lines {
            let narrow = is_narrow(line.range);
            let row = (self.keys * if narrow { 2 } else { 4 }).next_multiple_of(4);
            let at = self.take_apart(row * line.len);
            let ring = self
                .rings
                .iter()
                .find(|(_, len)| *len == line.len)
                .map_or(RINGS, |(at, _)| *at);
            self.lines.push(Line {
                narrow,
                len: line.len,
                at,
                row,
                ring,
            });
        }
    }

    /// The pointer in STATE to a slot, by offset; none for the slot that HISTORY is at.
    pub(super) fn pointer(&self, line: u32, ticks: u32) -> Option<u32> {
        self.pointers
            .iter()
            .find(|p| p.line == line && p.ticks == ticks)
            .map(|p| p.at)
    }

    /// How often HISTORY is to be added to a pointer to a line: 1 for slots as wide as those of the
    /// first line.
    pub(super) fn scale(&self, line: u32) -> u8 {
        let log2 = |line: u32| self.lines[line as usize].log2();
        self.first_line.map_or(0, |first| log2(line) - log2(first))
    }
}

fn is_narrow(range: Range) -> bool {
    Range::new(0, u16::MAX.into()).contains(range)
}

/// Every line and delay that the kernel asks for.
fn delays(kernel: &Kernel) -> Vec<(u32, u32)> {
    let delay = |inst: &Inst| match inst.op {
        Op::Delay(line, ticks) => Some((line, ticks)),
        _ => None,
    };
    kernel.all_insts().filter_map(delay).collect()
}
