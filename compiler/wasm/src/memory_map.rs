//! Where a module's memory has what, and the text that tells a host.

use serde_json::{Value, json};
use whippen_kernel::layout::{EVENT_HEAD, EVENTS_MAX};
use whippen_kernel::{Kernel, Memory, Type};

use crate::WasmError;

/// Addresses (bytes) of the parts of memory; each has the elements of the part of
/// [`Memory`] of the same name, in the same order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryMap {
    /// How many keys there are.
    pub keys: usize,
    /// Sensor words: `u16`, key after key.
    pub inputs: u32,
    /// Drive words: `i16`, key after key.
    pub outputs: u32,
    /// Live values: `i32`.
    pub lives: u32,
    /// Cells and constants of keys: words.
    pub columns: u32,
    /// Delay lines of `u16`.
    pub narrow: u32,
    /// Delay lines of `i32`.
    pub wide: u32,
    /// Ring indices: words.
    pub rings: u32,
    /// Ticks, events kept, events lost: `u64` each.
    pub clock: u32,
    /// Events: words.
    pub events: u32,
    /// Words of an event.
    pub event_words: u32,
    /// Probes: `i64`, key after key.
    pub probes: u32,
    /// Tables, one after the other: `i32`.
    pub tables: Vec<u32>,
    /// Cells: the byte of the first key's first word.
    pub cells: Vec<u32>,
    /// The end of all.
    pub end: u32,
}

/// Places of the counters within the clock (bytes).
pub(crate) const TICK: u32 = 0;
pub(crate) const EVENTS: u32 = 8;
pub(crate) const LOST: u32 = 16;

/// The most bytes of memory: more than any browser is sure to give are not asked for.
const BYTES_MAX: u64 = 1 << 31;

/// Hands out addresses.
struct Room(u64);

impl Room {
    /// So many elements of so many bytes, at an address that SIMD likes.
    fn take(&mut self, count: usize, bytes: u64) -> u32 {
        self.0 = self.0.next_multiple_of(16);
        let at = self.0;
        self.0 += count as u64 * bytes;
        at.min(BYTES_MAX) as u32
    }
}

impl MemoryMap {
    /// The map of a kernel's memory.
    ///
    /// # Errors
    /// It is too large.
    pub(crate) fn new(kernel: &Kernel, memory: &Memory) -> Result<MemoryMap, WasmError> {
        let keys = memory.keys();
        // Nothing lies at 0, where a host that forgot an offset would write.
        let mut room = Room(16);
        let mut map = MemoryMap {
            keys,
            inputs: room.take(keys * kernel.inputs.len(), 2),
            outputs: room.take(keys * kernel.outputs.len(), 2),
            lives: room.take(kernel.lives.len(), 4),
            columns: room.take(memory.columns.len(), 4),
            narrow: room.take(memory.narrow.len(), 2),
            wide: room.take(memory.wide.len(), 4),
            rings: room.take(memory.rings.len(), 4),
            clock: room.take(3, 8),
            events: room.take(EVENTS_MAX * memory.layout.event_words, 4),
            event_words: memory.layout.event_words as u32,
            probes: room.take(memory.probes.len(), 8),
            tables: Vec::new(),
            cells: Vec::new(),
            end: 0,
        };
        let tables = kernel.tables.iter();
        map.tables = tables
            .map(|table| room.take(table.values.len(), 4))
            .collect();
        let cells = memory.layout.cells.iter();
        map.cells = cells.map(|word| map.columns + 4 * *word as u32).collect();
        if room.0 > BYTES_MAX {
            return Err(WasmError::Bytes(room.0));
        }
        map.end = room.0 as u32;
        Ok(map)
    }

    /// What never changes, and live values as declared: addresses and bytes.
    pub(crate) fn constants(&self, kernel: &Kernel) -> Vec<(u32, Vec<u8>)> {
        let bytes = |words: &[i32]| words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let tables = self.tables.iter().zip(&kernel.tables);
        let tables = tables.map(|(at, table)| (*at, bytes(&table.values)));
        let lives: Vec<i32> = kernel.lives.iter().map(|live| live.init).collect();
        tables.chain([(self.lives, bytes(&lives))]).collect()
    }

    /// The map as JSON: addresses in bytes, and what the kernel declares by name.
    pub fn json(&self, kernel: &Kernel, meaning: Value) -> Value {
        let port = |port: &whippen_kernel::Port| port.name.clone();
        let live = |live: &whippen_kernel::Live| json!({ "name": live.name, "low": live.range.low, "high": live.range.high, "init": live.init });
        let cell = |(cell, at): (&whippen_kernel::Cell, &u32)| json!({ "name": cell.name, "at": at, "len": cell.len, "bytes": bytes_of(cell.ty) });
        let event =
            |event: &whippen_kernel::Event| json!({ "name": event.name, "args": event.args });
        let probe = |probe: &whippen_kernel::Probe| probe.name.clone();
        let [ticks_per, seconds] = kernel.rate_hz.fraction();
        json!({
            "name": kernel.name,
            "rate_hz": [ticks_per, seconds],
            "keys": self.keys,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "lives": self.lives,
            "columns": self.columns,
            "narrow": self.narrow,
            "wide": self.wide,
            "rings": self.rings,
            "clock": self.clock,
            "events": self.events,
            "event_words": self.event_words,
            "event_head": EVENT_HEAD,
            "probes": self.probes,
            "in": kernel.inputs.iter().map(port).collect::<Vec<_>>(),
            "out": kernel.outputs.iter().map(port).collect::<Vec<_>>(),
            "live": kernel.lives.iter().map(live).collect::<Vec<_>>(),
            "cell": kernel.cells.iter().zip(&self.cells).map(cell).collect::<Vec<_>>(),
            "event": kernel.events.iter().map(event).collect::<Vec<_>>(),
            "probe": kernel.probes.iter().map(probe).collect::<Vec<_>>(),
            "meaning": meaning,
        })
    }
}

/// Bytes of a word of this type in memory.
fn bytes_of(ty: Type) -> u32 {
    match ty {
        Type::I1 | Type::I32 => 4,
        Type::I64 => 8,
    }
}
