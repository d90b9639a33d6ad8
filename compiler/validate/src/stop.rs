//! Why a symbolic run ends before its end.

use std::fmt;

use crate::truth::Variable;

/// Why something could not be shown, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Reason {
    /// A value that differs has a quotient or a root in it, which two ways of dividing give.
    Divisions,
    /// Two values that could not be shown to be one.
    Values,
    /// Places in memory of which it is not known whether they are one.
    Places,
    /// An instruction, an operator or a path that is not followed.
    Code,
    /// More cases than are looked at.
    Cases,
    /// The tick's entry, or a word that it computes for all keys, is not validated.
    Entry,
}

impl Reason {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Divisions => "divisions",
            Reason::Values => "values",
            Reason::Places => "places",
            Reason::Code => "code",
            Reason::Cases => "cases",
            Reason::Entry => "entry",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why something could not be shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Doubt {
    pub reason: Reason,
    pub why: String,
    /// Whether there are numbers for which it is otherwise.
    pub is_certain: bool,
}

/// Why a run ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Stop {
    /// It must be known whether this holds: there is a run for either case.
    Split(Variable),
    /// Nothing can come here.
    Impossible,
    /// It cannot be shown.
    Unproven(Doubt),
}

/// What is told, or why it cannot be.
pub(crate) type Told<T> = Result<T, Stop>;

impl Doubt {
    pub fn new(reason: Reason, why: impl Into<String>) -> Doubt {
        Doubt {
            reason,
            why: why.into(),
            is_certain: false,
        }
    }
}

/// Code that is not followed.
pub(crate) fn unproven<T>(why: impl Into<String>) -> Told<T> {
    unproven_as(Reason::Code, why)
}

/// It cannot be shown, for such a reason.
pub(crate) fn unproven_as<T>(reason: Reason, why: impl Into<String>) -> Told<T> {
    Err(Stop::Unproven(Doubt::new(reason, why)))
}
