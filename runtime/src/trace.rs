//! Traces: what a run leaves behind, and its two tables.
//!
//! A [`Trace`] has columns over time (ports, force terms, coordinates, states) and a list of
//! events. Columns are [records](Record): of every tick, or bounded. The tables are written while a
//! run goes on ([`TickTable`], [`EventTable`]); they are CSV:
//!
//! ```text
//!   t_s,x_m,f_n,contact_n,phi_rad,repetition      t_s,key,event,speed_m_per_s
//!   0,0,0.49,0.49,0,disengaged                    1.0703,0,note,2.25
//!   0.000022676,...                               1.312,0,release,
//! ```
//!
//! Titles are names and units, as Python and MATLAB take them; numbers have the digits that mean
//! something ([`Decimal`](crate::decimal::Decimal)).
//!
//! Not here: what fills a trace (`session`), and its pictures (`plot`).

mod arrays;
mod tables;

pub use arrays::{ArrayFile, TraceFile};
pub use tables::{Argument, EventTable, Form, TickTable};

use crate::record::Record;
use crate::spectrogram::Spectrogram;
use crate::titles::{identifier, join_title};
use crate::vibration::Vibration;
use whippen_compiler::rate::Rate;

/// What a column is called and what its values are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Heading {
    /// Its name in the program (`x`, `contact`, `jack.resistance`).
    pub name: String,
    /// Its unit as titles write it (`m`, `n`, `rad_per_s`); empty for states and plain numbers.
    pub unit: String,
    /// For a state machine the names of its states; the values are then indices into them. Else
    /// empty.
    pub labels: Vec<String>,
    /// The distance of neighbouring values (SI), where they are words of fixed point.
    pub step: Option<f64>,
}

impl Heading {
    /// The title in the table: name and unit (`x_m`, `phi_dot_rad_per_s`).
    pub fn title(&self) -> String {
        identifier(&join_title(&self.name, &self.unit))
    }

    /// The label a value stands for, if it stands for one.
    pub fn label(&self, value: f64) -> Option<&str> {
        self.labels
            .get(value as usize)
            .filter(|_| value >= 0.0 && value.fract() == 0.0)
            .map(String::as_str)
    }
}

/// A quantity or a machine over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// What it is.
    pub heading: Heading,
    /// Its values, in SI units.
    pub record: Record,
}

impl Column {
    /// The title in the table: name and unit (`x_m`).
    pub fn title(&self) -> String {
        self.heading.title()
    }

    /// The first ticks one by one: all of them in a record of every tick.
    pub fn values(&self) -> &[f64] {
        self.record.head()
    }
}

/// Something that happened at an instant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventRow {
    /// When (s).
    pub t_s: f64,
    /// Which key, counted from 0 at the lowest.
    pub key: u32,
    /// Its name (`note`, `release`, `string`, `check: free -> caught`).
    pub event: String,
    /// Its arguments: title with unit (`speed_m_per_s`) and value (SI).
    pub args: Vec<(String, f64)>,
}

/// What a run leaves behind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Ticks per second.
    pub rate_hz: Rate,
    /// When the first tick was (s): a recording keeps its own times.
    pub start_s: f64,
    /// The columns after `t_s`, all of one length.
    pub columns: Vec<Column>,
    /// What happened, in the order of time.
    pub events: Vec<EventRow>,
    /// What the channels of the sound are made of.
    pub spectrograms: Vec<Spectrogram>,
    /// How the strings vibrated.
    pub vibrations: Vec<Vibration>,
}

impl Trace {
    /// The number of ticks: the length of the shortest column.
    pub fn ticks(&self) -> usize {
        let lengths = self.columns.iter().map(|c| c.record.ticks());
        lengths.min().unwrap_or(0)
    }

    /// The time of a tick (s).
    pub fn time_s(&self, tick: usize) -> f64 {
        self.start_s + tick as f64 / f64::from(self.rate_hz)
    }

    /// The column of a title (`x_m`). Names need not be unique: a force term and a state machine
    /// may share one.
    pub fn column(&self, title: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.title() == title)
    }
}
