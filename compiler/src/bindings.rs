//! What who links a relocatable file, or compiles C text, must know, as a header for C and C++ and
//! as a module for Rust.
//!
//! ```text
//!   Interface (what lies where in the state, what its integers mean) -> c_header, rust_module
//!                                                     + the kernel in C -> c_source
//! ```
//!
//! A relocatable file and C text have one interface: the same names, types and order of calls.
//! Behind what is public the state holds what the code keeps, which only the code knows.
//!
//! Both show the state as a structure whose fields lie where the code expects them (checked at
//! compile time), and functions around it: live values are set within their ranges only, events are
//! taken out of their ring.
//!
//! Not here: the code; how a program is made of it.

mod c;
mod c_source;
mod interface;
mod rust;
mod safety;

use whippen_c99::Component;
use whippen_isa::Arch;
use whippen_rate::Rate;

pub use c::c_header;
pub use c_source::c_source;
pub use rust::rust_module;
pub use safety::SafetyInterface;

/// A word of each key that enters or leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct PortInterface {
    /// Its name.
    pub name: String,
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value of word 0 (SI).
    pub zero: f64,
    /// Unit of both.
    pub unit: String,
}

/// A live value.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveInterface {
    /// Its name.
    pub name: String,
    /// Offset in the state.
    pub at: u32,
    /// Smallest and largest integer.
    pub range: (i32, i32),
    /// Integer at the start.
    pub init: i32,
    /// Fraction bits of the integer.
    pub fraction_bits: i32,
    /// Unit of the value, `1` for a plain number; none for a bool.
    pub unit: Option<String>,
}

/// An argument of an event.
#[derive(Debug, Clone, PartialEq)]
pub struct Argument {
    /// Its name.
    pub name: String,
    /// Fraction bits of the integer.
    pub fraction_bits: i32,
    /// Unit of the value, `1` for a plain number.
    pub unit: String,
}

/// A kind of event; its number is its place in the list.
#[derive(Debug, Clone, PartialEq)]
pub struct EventInterface {
    /// Its name.
    pub name: String,
    /// What it carries.
    pub args: Vec<Argument>,
}

/// The ring of events: records of a tick, a key and an event (16 bits each), arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ring {
    /// Offset in the state.
    pub at: u32,
    /// Its size: a power of two.
    pub bytes: u32,
    /// Bytes of a record: a power of two.
    pub record_bytes: u32,
    /// Bytes of the most events of a tick.
    pub tick_bytes_max: u32,
}

/// What lies where in the state, and what it means. The state begins with four words: bytes of
/// events ever written, ever read, events lost, ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Prefix of all names.
    pub name: String,
    /// Keys.
    pub keys: u32,
    /// The number of the first key, from which events count.
    pub first_key: u32,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// Bytes of the state.
    pub state_bytes: u32,
    /// Words that enter, and the offset of their row.
    pub inputs: (u32, Vec<PortInterface>),
    /// Words that leave, and the offset of their row.
    pub outputs: (u32, Vec<PortInterface>),
    /// Words of a key in both rows.
    pub row_words: u32,
    /// Live values.
    pub lives: Vec<LiveInterface>,
    /// Kinds of events.
    pub events: Vec<EventInterface>,
    /// Where they collect, if there are any.
    pub ring: Option<Ring>,
    /// What the machine code was made for; none for C text.
    pub arch: Option<Arch>,
    /// The kernel, where the code is C text; its state lies behind everything.
    pub component: Option<Component>,
    /// The safety of the keys, where it is part of the file.
    pub safety: Option<SafetyInterface>,
}

/// What a field of the state holds.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Holds {
    /// An unsigned word that the code or the reader changes.
    Counter,
    /// A live value.
    Live,
    /// Words of the ring.
    Ring(u32),
    /// Rows of words of the keys.
    Inputs,
    Outputs,
    /// Bytes that are nobody's business.
    Private(u32),
    /// The state of the kernel in C.
    Kernel,
}

/// A field of the state.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Field {
    at: u32,
    name: String,
    holds: Holds,
}

impl Interface {
    /// The same with the safety of its keys.
    #[must_use]
    pub fn with_safety(self, safety: Option<SafetyInterface>) -> Interface {
        Interface { safety, ..self }
    }

    /// The same for keys that are numbered from there on.
    #[must_use]
    pub fn with_first_key(self, first_key: u32) -> Interface {
        Interface { first_key, ..self }
    }

    /// All fields, in order and without gaps.
    fn fields(&self) -> Vec<Field> {
        let counters = ["event_head", "event_tail", "events_lost", "tick"];
        let counters = counters
            .iter()
            .zip(0..)
            .map(|(name, n)| (4 * n, (*name).to_string(), Holds::Counter, 4));
        let lives = self
            .lives
            .iter()
            .map(|live| (live.at, format!("live_{}", live.name), Holds::Live, 4));
        let ring = self.ring.map(|ring| {
            (
                ring.at,
                "events".to_string(),
                Holds::Ring(ring.bytes / 4),
                ring.bytes,
            )
        });
        let row = 2 * self.row_words * self.keys;
        let rows = [
            (self.inputs.0, "inputs", Holds::Inputs),
            (self.outputs.0, "outputs", Holds::Outputs),
        ];
        let rows = rows
            .into_iter()
            .map(|(at, name, holds)| (at, name.to_string(), holds, row));
        let mut known: Vec<(u32, String, Holds, u32)> =
            counters.chain(lives).chain(ring).chain(rows).collect();
        known.sort_by_key(|field| field.0);
        let mut fields = Vec::new();
        let mut next = 0;
        for (at, name, holds, bytes) in known {
            gap(&mut fields, next, at);
            fields.push(Field { at, name, holds });
            next = at + bytes;
        }
        if self.component.is_some() {
            fields.push(Field {
                at: next,
                name: "kernel".to_string(),
                holds: Holds::Kernel,
            });
            return fields;
        }
        gap(&mut fields, next, self.state_bytes);
        fields
    }

    /// Fields that others than the code may use.
    fn public_fields(&self) -> Vec<Field> {
        let public = |field: &Field| !matches!(field.holds, Holds::Private(_) | Holds::Kernel);
        self.fields().into_iter().filter(public).collect()
    }

    /// Arguments of the event that has most.
    fn args_max(&self) -> usize {
        self.events
            .iter()
            .map(|event| event.args.len())
            .max()
            .unwrap_or(0)
    }
}

fn gap(fields: &mut Vec<Field>, from: u32, to: u32) {
    if from < to {
        fields.push(Field {
            at: from,
            name: format!("private_{from}"),
            holds: Holds::Private(to - from),
        });
    }
}

/// A number that reads back the same, in C as in Rust.
fn number(value: f64) -> String {
    format!("{value:e}")
}

/// A unit as part of a name: `N*s/m` is `n_s_per_m`.
fn unit_name(unit: &str) -> String {
    let spelled = unit
        .replace('/', "_per_")
        .replace('*', "_")
        .replace('^', "");
    spelled.to_lowercase()
}
