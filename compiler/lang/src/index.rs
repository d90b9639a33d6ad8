//! Who is meant: the names of a program's text, and what each of them stands for. For editors.
//!
//! The index is made from trees alone, so it is there for programs that are not right yet: what
//! cannot be resolved is left out. Rule 9 of the manual says who sees whom.
//!
//! Not here: types and values (`check`), which only right programs have.

mod declared;
mod resolve;

use crate::syntax::ast::File;
use whippen_source::{SourceMap, Span};

/// What a name stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NameKind {
    /// An instrument.
    Instrument,
    /// A term.
    Term,
    /// A keyboard.
    Keyboard,
    /// A keyboard's program of several instruments.
    Zones,
    /// A sensed value.
    Sense,
    /// A constant.
    Param,
    /// A parameter that may change while playing.
    Live,
    /// A named value.
    Let,
    /// A remembered value.
    State,
    /// A pulse.
    Pulse,
    /// Noise.
    Noise,
    /// A delay line.
    Delay,
    /// A table.
    Table,
    /// The coordinate of a body, or the displacement of a string.
    Coordinate,
    /// The tension that a string is tuned by.
    Tension,
    /// The force of a friction.
    Friction,
    /// The slip in the law of a friction.
    Slip,
    /// What a term is given.
    Parameter,
    /// What a term gives back.
    Result,
    /// A machine.
    Machine,
    /// A state of a machine.
    MachineState,
    /// A body.
    Body,
    /// A string.
    String,
    /// A bank.
    Bank,
    /// The number of a member of a bank.
    Number,
    /// A named event.
    Event,
    /// The label of a force term.
    Force,
    /// The label of a term of the sound.
    Sound,
}

impl NameKind {
    /// Whether it stands in the name space of values.
    pub fn is_value(self) -> bool {
        use NameKind::*;
        matches!(
            self,
            Sense
                | Param
                | Live
                | Let
                | State
                | Pulse
                | Noise
                | Delay
                | Table
                | Coordinate
                | Tension
                | Friction
                | Bank
                | Number
                | Parameter
                | Result
        )
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            NameKind::Instrument => "instrument",
            NameKind::Term => "term",
            NameKind::Keyboard => "keyboard",
            NameKind::Zones => "program of zones",
            NameKind::Sense => "sensed value",
            NameKind::Param => "constant",
            NameKind::Live => "live parameter",
            NameKind::Let => "value",
            NameKind::State => "remembered value",
            NameKind::Pulse => "pulse",
            NameKind::Noise => "noise",
            NameKind::Delay => "delay line",
            NameKind::Table => "table",
            NameKind::Coordinate => "coordinate",
            NameKind::Tension => "tension of a string",
            NameKind::Friction => "friction",
            NameKind::Slip => "slip of a friction",
            NameKind::Parameter => "parameter of the term",
            NameKind::Result => "result of the term",
            NameKind::Machine => "machine",
            NameKind::MachineState => "state",
            NameKind::Body => "body",
            NameKind::String => "string",
            NameKind::Bank => "bank",
            NameKind::Number => "number of a member",
            NameKind::Event => "event",
            NameKind::Force => "force term",
            NameKind::Sound => "sound",
        }
    }
}

/// Something with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    /// What it is.
    pub kind: NameKind,
    /// Its name.
    pub name: String,
    /// Where its name is declared.
    pub span: Span,
    /// Its declaration.
    pub whole: Span,
    /// The instrument, term or keyboard that it belongs to, or is: its place in [`Index::items`].
    pub item: usize,
    /// Its type as written, where one is.
    pub ty: Option<String>,
    /// The documentation of an instrument, a term or a keyboard.
    pub doc: String,
    /// The term that a `let` calls.
    pub calls: Option<String>,
    /// The machine of a state, by its place in [`Index::definitions`].
    pub machine: Option<usize>,
}

/// A name in the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Occurrence {
    /// Where it stands.
    pub span: Span,
    /// What it stands for: its place in [`Index::definitions`].
    pub definition: usize,
}

/// The names of a program.
#[derive(Debug, Clone, Default)]
pub struct Index {
    /// Everything with a name, in the order of the text.
    pub definitions: Vec<Definition>,
    /// Every name that is understood, in the order of the text.
    pub occurrences: Vec<Occurrence>,
    /// The whole of every instrument, term and keyboard.
    pub items: Vec<Span>,
}

impl Index {
    /// The index of the files of `map`, which are these trees in this order; of terms with one name
    /// the first counts.
    pub fn new(map: &SourceMap, files: &[File]) -> Index {
        let mut index = declared::collect(files);
        resolve::resolve(&mut index, map, files);
        index.occurrences.sort_by_key(|o| (o.span, o.definition));
        index.occurrences.dedup();
        index
    }

    /// The name that a place touches, at its end too.
    pub fn at(&self, file: u32, byte: u32) -> Option<Occurrence> {
        let touches =
            |o: &&Occurrence| o.span.file == file && o.span.start <= byte && byte <= o.span.end;
        self.occurrences
            .iter()
            .filter(touches)
            .max_by_key(|o| o.span.start)
            .copied()
    }

    /// The instrument, term or keyboard around a place: its place in [`Index::items`].
    pub fn item_at(&self, file: u32, byte: u32) -> Option<usize> {
        self.items
            .iter()
            .position(|s| s.file == file && s.start <= byte && byte <= s.end)
    }

    /// What an item declares.
    pub fn inside(&self, item: usize) -> impl Iterator<Item = (usize, &Definition)> {
        self.definitions
            .iter()
            .enumerate()
            .filter(move |(_, d)| d.item == item)
    }

    /// The first definition in an item that has this name and is of such a kind.
    pub fn find(&self, item: usize, name: &str, is: impl Fn(NameKind) -> bool) -> Option<usize> {
        self.inside(item)
            .find(|(_, d)| d.name == name && is(d.kind))
            .map(|(n, _)| n)
    }

    /// The first instrument or term of this name.
    pub fn item_named(&self, name: &str, kind: NameKind) -> Option<usize> {
        self.definitions
            .iter()
            .position(|d| d.kind == kind && d.name == name)
    }

    /// The states of a machine.
    pub fn states(&self, machine: usize) -> impl Iterator<Item = &Definition> {
        self.definitions
            .iter()
            .filter(move |d| d.machine == Some(machine))
    }
}

#[cfg(test)]
mod tests;
