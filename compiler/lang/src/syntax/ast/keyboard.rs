//! Keyboards.

use super::{Expr, Name};
use whippen_source::Span;

/// `keyboard name { .. }`: instruments on a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyboard {
    /// The `///` lines before it.
    pub doc: String,
    /// Its name.
    pub name: Name,
    /// Its settings in the order of the text.
    pub settings: Vec<Setting>,
    /// From the keyword to the closing brace.
    pub span: Span,
}

/// One line of a keyboard.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// `board rp2350`, `board rp2350 * 2`
    Board {
        /// The board.
        name: Name,
        /// How many of it, as it is written.
        chips: Option<Name>,
    },
    /// `device mikey`
    Device(Name),
    /// `device "file"`, without the quotes.
    DeviceFile(Name),
    /// `rate 44100 Hz`
    Rate(Expr),
    /// `keys A0 .. C8`, by note names.
    Keys(Name, Name),
    /// `programs a, b`
    Programs(Vec<Name>),
    /// `zones split = { A0 .. B3: a, C4 .. C8: b }`: a program whose keys play different
    /// instruments.
    Zones {
        /// The program.
        name: Name,
        /// Its zones in the order of the text.
        zones: Vec<Zone>,
        /// From the keyword to the closing brace.
        span: Span,
    },
    /// `instrument.param = { A0: v, C8: v }`, linear between the given notes.
    PerKey {
        /// The instrument.
        instrument: Name,
        /// Its parameter.
        param: Name,
        /// Note name and value, in the order of the text.
        points: Vec<(Name, Expr)>,
    },
}

/// `A0 .. B3: hammond`
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its lowest key, by note name.
    pub low: Name,
    /// Its highest key.
    pub high: Name,
    /// What its keys play.
    pub instrument: Name,
}
