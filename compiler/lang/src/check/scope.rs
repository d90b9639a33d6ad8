//! Scopes: the names of an instrument, or of one call of a term.

use std::collections::{BTreeMap, HashMap};

use super::bank::{BankId, Member};
use super::friction::RubbedBy;
use super::items::TermItem;
use super::slot::SlotId;
use super::table::TableId;
use super::types::Value;
use crate::model::{CellId, DelayId, MachineId, PulseId, StrandId};
use crate::syntax::ast::{Decl, Name};
use whippen_source::Span;

/// Index of a [`Scope`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScopeId(pub usize);

/// What a name stands for.
#[derive(Debug, Clone, Copy)]
pub enum Thing {
    /// Something whose declaration is in error: using it is silent.
    Broken,
    /// A sensed value.
    Sense(Value),
    /// A parameter of the instrument.
    Param(SlotId),
    /// A `let`; if it names a call of a term, the scope of that call.
    Let(SlotId, Option<ScopeId>),
    /// A `state`.
    State(CellId, Value),
    /// A coordinate: its cell, the cell of its rate.
    Coordinate(CellId, CellId, Value),
    /// A pulse.
    Pulse(PulseId, Value),
    /// A noise.
    Noise(Value),
    /// A delay line, which is no value by itself.
    Delay(DelayId),
    /// A table, which is no value by itself.
    Table(TableId),
    /// A displacement all along a string, which is no value by itself.
    Displacement(StrandId),
    /// The tension of a string that is tuned.
    Tension(SlotId),
    /// A friction: its force, and what it rubs.
    Friction(SlotId, RubbedBy),
    /// A bank, which is no value by itself.
    Bank(BankId),
    /// The number of a member of a bank.
    Number(Value),
    /// A parameter of the term.
    Argument(SlotId),
    /// A result of the term.
    Result(SlotId),
}

impl Thing {
    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Thing::Broken => "something in error",
            Thing::Sense(_) => "a sensed value",
            Thing::Param(_) => "a param",
            Thing::Let(..) => "a let",
            Thing::State(..) => "a state",
            Thing::Coordinate(..) => "a coordinate",
            Thing::Pulse(..) => "a pulse",
            Thing::Noise(..) => "noise",
            Thing::Delay(..) => "a delay line",
            Thing::Table(..) => "a table",
            Thing::Displacement(_) => "the displacement of a string",
            Thing::Tension(_) => "the tension of a string",
            Thing::Friction(..) => "a friction",
            Thing::Bank(_) => "a bank",
            Thing::Number(_) => "the number of a member",
            Thing::Argument(_) => "a parameter of the term",
            Thing::Result(_) => "a result",
        }
    }
}

/// A name's meaning and the place of its declaration.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// What it stands for.
    pub thing: Thing,
    /// Where it is declared.
    pub span: Span,
}

/// What a declaration has made.
#[derive(Debug, Clone, Copy)]
pub enum Made {
    /// Nothing, or something in error that is not looked at again.
    Nothing,
    /// A sensed value: index into the Model's.
    Sense(usize),
    /// A `param`, `let` or result.
    Slot(SlotId),
    /// A `state`.
    Cell(CellId),
    /// A machine.
    Machine(MachineId),
    /// A body: index into the Model's.
    Body(usize),
    /// A pulse.
    Pulse(PulseId),
    /// A delay line.
    Delay(DelayId),
    /// A table.
    Table(TableId),
    /// A bank.
    Bank(BankId),
    /// A string.
    Strand(StrandId),
    /// Something of which the declaration itself says everything (`next`, `force`, `event`,
    /// `hold`, `noise`, `feed`, `sound`).
    Itself,
}

/// The call that made a scope.
#[derive(Debug, Clone, Copy)]
pub struct Caller {
    /// Where it stands.
    pub scope: ScopeId,
    /// The call.
    pub span: Span,
    /// Whether a `let` gives its name to the only result.
    pub is_let: bool,
}

/// A label of a kind of its own: machine, body, event, force.
#[derive(Debug, Clone, Copy)]
pub struct NameEntry<T> {
    /// What it stands for.
    pub id: T,
    /// Where it is declared.
    pub span: Span,
}

/// One name space.
pub struct Scope<'a> {
    /// What stands before its names in the Model: empty for an instrument, `jack.` for a call.
    pub path: String,
    /// Its declarations.
    pub decls: &'a [Decl],
    /// The term, unless it is an instrument.
    pub term: Option<TermItem<'a>>,
    /// The call, unless it is an instrument or a term by itself.
    pub caller: Option<Caller>,
    /// What makes it a member of a bank.
    pub member: Option<Member>,
    /// The same call as the Model knows it.
    pub call: Option<u32>,
    /// Values by name.
    pub values: BTreeMap<&'a str, Entry>,
    /// Where the laws of frictions stand, with the name and value of the slip in each.
    pub laws: Vec<(Span, &'a Name, SlotId)>,
    /// Machines by name.
    pub machines: BTreeMap<&'a str, NameEntry<MachineId>>,
    /// Bodies by name; without index if in error.
    pub bodies: BTreeMap<&'a str, NameEntry<Option<usize>>>,
    /// Strings by name.
    pub strands: BTreeMap<&'a str, NameEntry<StrandId>>,
    /// Events by name.
    pub events: BTreeMap<&'a str, NameEntry<()>>,
    /// Terms of the sound by name and by side.
    pub sounds: BTreeMap<(&'a str, Option<&'a str>), NameEntry<()>>,
    /// Force terms by name and by what they push.
    pub forces: BTreeMap<(&'a str, &'a str), NameEntry<()>>,
    /// What each declaration has made.
    pub made: Vec<Made>,
    /// The parameters of the term.
    pub args: Vec<SlotId>,
    /// The results of the term: name and value.
    pub results: Vec<(&'a str, SlotId)>,
    /// The scopes of the calls in it, by the place of the call.
    pub calls: HashMap<Span, ScopeId>,
    /// How many calls of each term go without a name of their own.
    pub unnamed: BTreeMap<&'a str, usize>,
    /// The same as `calls`, per declaration, in the order of the text.
    pub children: Vec<Vec<ScopeId>>,
}

impl<'a> Scope<'a> {
    /// A scope without names.
    pub fn new(
        path: String,
        decls: &'a [Decl],
        term: Option<TermItem<'a>>,
        caller: Option<Caller>,
    ) -> Scope<'a> {
        Scope {
            path,
            decls,
            term,
            caller,
            member: None,
            call: None,
            values: BTreeMap::new(),
            laws: Vec::new(),
            machines: BTreeMap::new(),
            bodies: BTreeMap::new(),
            strands: BTreeMap::new(),
            events: BTreeMap::new(),
            sounds: BTreeMap::new(),
            forces: BTreeMap::new(),
            made: Vec::new(),
            args: Vec::new(),
            results: Vec::new(),
            calls: HashMap::new(),
            unnamed: BTreeMap::new(),
            children: Vec::new(),
        }
    }

    /// A name of this scope as the Model knows it.
    pub fn full(&self, name: &str) -> String {
        format!("{}{name}", self.path)
    }

    /// The value of the result of that name.
    pub fn result(&self, name: &str) -> Option<SlotId> {
        self.results
            .iter()
            .find(|(n, _)| *n == name)
            .map(|(_, slot)| *slot)
    }

    /// Whether it belongs to the standard library.
    pub fn in_std(&self) -> bool {
        self.term.is_some_and(|t| t.std)
    }
}
