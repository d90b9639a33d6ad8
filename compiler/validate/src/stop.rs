//! Why a symbolic run ends before its end.

use crate::truth::Variable;

/// Why a run ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Stop {
    /// It must be known whether this holds: there is a run for either case.
    Split(Variable),
    /// Nothing can come here.
    Impossible,
    /// It cannot be shown.
    Unproven(String),
}

/// What is told, or why it cannot be.
pub(crate) type Told<T> = Result<T, Stop>;

/// It cannot be shown.
pub(crate) fn unproven<T>(why: impl Into<String>) -> Told<T> {
    Err(Stop::Unproven(why.into()))
}
