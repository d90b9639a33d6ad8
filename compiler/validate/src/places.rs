//! What is asked: the modes, the bytes, and where the state keeps what.

use std::collections::BTreeMap;

use whippen_ids::IdMap;
use whippen_isa::Arch;
use whippen_kernel::{Inst, Value, ValueInfo};
use whippen_modes::Modes;

/// A delay line in the state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinePlace {
    /// Whether slots are `u16` (else `i32`).
    pub narrow: bool,
    /// How far HISTORY is shifted left in the address of a slot.
    pub scale: u8,
    /// By how many ticks ago: the offset in the state of the pointer to which HISTORY is added;
    /// where there is none, HISTORY is the address.
    pub pointers: BTreeMap<u32, u32>,
    /// How many ticks it remembers: what was pushed so long ago is where the next is pushed.
    pub len: u32,
    /// Bytes from one tick's slot to the next tick's.
    pub row: u32,
    /// In the state: the number of the slot that is written in this tick.
    pub ring: u32,
    /// From where histories are counted: the first row.
    pub at: u32,
}

impl LinePlace {
    /// Of a slot.
    pub fn bytes(&self) -> u8 {
        if self.narrow { 2 } else { 4 }
    }
}

/// The ring of events, in bytes from the beginning of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RingPlace {
    /// Word: bytes ever written.
    pub head: u32,
    /// Word: bytes ever read; the reader's.
    pub tail: u32,
    /// Word: events that found the ring full.
    pub lost: u32,
    /// The ring itself; where it lies apart, from where that begins.
    pub start: u32,
    /// Its size, a power of two.
    pub bytes: u32,
    /// From its beginning to what events go to that have no room.
    pub spare: u32,
    /// Bytes of the most events of a tick.
    pub tick_bytes: u32,
}

/// Where the state of a core's keys keeps what, in bytes. Offsets in a record count from its first
/// word, which is the address of the code of the key's mode.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Places {
    /// How many keys there are.
    pub keys: u32,
    /// In the record: each cell.
    pub cells: Vec<u32>,
    /// In the record: each constant of the key.
    pub keyed: Vec<u32>,
    /// In the record: the number of the key, where there are events.
    pub number: Option<u32>,
    /// In the record: the gain of drive words, if there is one.
    pub gain: Option<u32>,
    /// Of a record.
    pub record_bytes: u32,
    /// In the state: the first record.
    pub records: u32,
    /// In the state: where constants of the code begin; they end where records begin.
    pub literals: u32,
    /// In the state: each live value, then what the tick's entry computes.
    pub lives: Vec<u32>,
    /// In the state: the number of the tick.
    pub tick: u32,
    /// In the state: this tick's row of the first line.
    pub row: u32,
    /// In the state: the address of the next event.
    pub next_event: u32,
    /// Of an event, a power of two.
    pub event_bytes: u32,
    /// Where events go, where keys have any.
    pub events: Option<RingPlace>,
    /// In the state: where histories lie, and behind it where the ring of events does; none where
    /// both lie in the state.
    pub apart: Option<u32>,
    /// In the state: where the words of this tick lie, if that is the caller's.
    pub words: Option<u32>,
    /// The line that HISTORY walks.
    pub first_line: Option<u32>,
    /// From a key's words to the next one's.
    pub stride: u32,
    /// From a word in to the word out.
    pub drive: u32,
    /// Of a key's slot in the first line; 0 where there is no line.
    pub history_bytes: u32,
    /// Delay lines.
    pub lines: Vec<LinePlace>,
}

/// What the tick's entry computes for all keys.
#[derive(Debug, Clone, Default)]
pub struct Shared {
    /// Its values.
    pub values: IdMap<Value, ValueInfo>,
    /// How.
    pub insts: Vec<Inst>,
    /// What is stored behind the live values, in order.
    pub results: Vec<Value>,
}

/// Bytes of an image with their addresses; pieces do not overlap.
#[derive(Debug, Clone, Default)]
pub struct Code {
    /// Pieces that nobody stores to: code and constants.
    pub pieces: Vec<(u32, Vec<u8>)>,
    /// What other memory holds at first.
    pub data: Vec<(u32, Vec<u8>)>,
}

/// So many bytes at an address.
fn bytes<const N: usize>(pieces: &[(u32, Vec<u8>)], address: u32) -> Option<[u8; N]> {
    pieces.iter().find_map(|(from, bytes)| {
        let at = address.checked_sub(*from)? as usize;
        bytes.get(at..at.checked_add(N)?)?.try_into().ok()
    })
}

impl Code {
    /// Puts another halfword there, where there is code or a constant.
    pub fn put(&mut self, address: u32, half: u16) {
        let within = |from: u32| address.checked_sub(from).map(|at| at as usize);
        let own = self.pieces.iter_mut().find_map(|(from, bytes)| {
            let at = within(*from)?;
            bytes.get_mut(at..at + 2)
        });
        if let Some(bytes) = own {
            bytes.copy_from_slice(&half.to_le_bytes());
        }
    }

    /// The halfword of code there.
    pub fn half(&self, address: u32) -> Option<u16> {
        bytes(&self.pieces, address).map(u16::from_le_bytes)
    }

    /// The word of code or constants there.
    pub fn word(&self, address: u32) -> Option<u32> {
        bytes(&self.pieces, address).map(u32::from_le_bytes)
    }

    /// What other memory holds there at first, as 2 or 4 bytes.
    pub fn first_bytes(&self, address: u32, count: u8) -> Option<u32> {
        match count {
            2 => bytes(&self.data, address).map(|half| u16::from_le_bytes(half).into()),
            _ => self.first_word(address),
        }
    }

    /// The word that other memory holds there at first.
    pub fn first_word(&self, address: u32) -> Option<u32> {
        bytes(&self.data, address).map(u32::from_le_bytes)
    }
}

/// A routine that code calls where a core has no instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Called {
    /// The top word of a product with signs, rounded half up.
    TopRounded,
    /// The same, rounded down.
    Top,
    /// The same without signs.
    TopUnsigned,
    /// A quotient without signs.
    Quotient,
    /// How many zeros a word begins with.
    LeadingZeros,
    /// A sum, or the word nearest to it.
    SumSaturated,
    /// A difference alike.
    DifferenceSaturated,
}

impl Called {
    /// All.
    pub const ALL: [Called; 7] = [
        Called::TopRounded,
        Called::Top,
        Called::TopUnsigned,
        Called::Quotient,
        Called::LeadingZeros,
        Called::SumSaturated,
        Called::DifferenceSaturated,
    ];

    /// Its name, as symbols end in it.
    pub fn name(self) -> &'static str {
        match self {
            Called::TopRounded => "mul_top",
            Called::Top => "mul_high",
            Called::TopUnsigned => "umul_high",
            Called::Quotient => "divide",
            Called::LeadingZeros => "leading_zeros",
            Called::SumSaturated => "add_sat",
            Called::DifferenceSaturated => "sub_sat",
        }
    }
}

/// The names of what is looked at, as addresses with bit 0 clear.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Symbols {
    /// The entry of the tick.
    pub tick: u32,
    /// The code of each mode.
    pub modes: Vec<u32>,
    /// What comes behind the last key.
    pub end: u32,
    /// What prepares all keys.
    pub init: u32,
    /// What prepares one key.
    pub begin: u32,
    /// Routines that code calls.
    pub called: Vec<(Called, u32)>,
    /// Each table.
    pub tables: Vec<u32>,
    /// The state.
    pub state: u32,
}

/// What is to be validated: whether the bytes do what the modes say.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// The modes, as they are before anything of them becomes the tick's entry's.
    pub modes: &'a Modes,
    /// What the tick's entry computes.
    pub shared: &'a Shared,
    /// The bytes.
    pub code: &'a Code,
    /// Where what begins.
    pub symbols: &'a Symbols,
    /// Where the state keeps what.
    pub places: &'a Places,
    /// What the bytes are.
    pub arch: Arch,
}
