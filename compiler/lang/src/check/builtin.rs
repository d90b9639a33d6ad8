//! What is built in: constants, functions, events.

use std::f64::consts::PI;

use crate::model;
use crate::units::Dim;

/// A constant that is always in scope.
pub struct Constant {
    /// Its name.
    pub name: &'static str,
    /// Its value (SI).
    pub value: f64,
    /// Its dimension.
    pub dim: Dim,
}

/// The constants: standard gravity (CGPM 1901) and the circle's number.
pub const CONSTANTS: &[Constant] = &[
    Constant {
        name: "gravity",
        value: 9.80665,
        dim: Dim::ACCELERATION,
    },
    Constant {
        name: "pi",
        value: PI,
        dim: Dim::NUMBER,
    },
];

/// Name of the length of a tick, a time. A program may give the name to something else.
pub const TICK: &str = "tick";

/// The constant of that name.
pub fn constant(name: &str) -> Option<&'static Constant> {
    CONSTANTS.iter().find(|c| c.name == name)
}

/// Functions of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Builtin {
    /// The smaller of two.
    Min,
    /// The larger of two.
    Max,
    /// A value, not below the low and not above the high; if these are crossed, the high.
    Clamp,
    /// The size without the sign.
    Abs,
    /// The square root.
    Sqrt,
    /// The own one of a member of a bank.
    Each,
    /// A value of all members of a bank, added.
    Sum,
    /// A delay line, a time ago, without loss.
    Tuned,
    /// A function of a plain number.
    Of(model::Function),
}

/// A function's name and how it is called.
pub struct Signature {
    /// Its name.
    pub name: &'static str,
    /// Which.
    pub function: Builtin,
    /// What its arguments are, in order.
    pub args: &'static [&'static str],
}

impl Signature {
    /// Whether a term may have its name, and is called then: programs had such terms before there
    /// was the function.
    pub fn can_be_hidden(&self) -> bool {
        matches!(
            self.function,
            Builtin::Sqrt | Builtin::Tuned | Builtin::Each | Builtin::Sum | Builtin::Of(_)
        )
    }
}

const fn signature(
    name: &'static str,
    function: Builtin,
    args: &'static [&'static str],
) -> Signature {
    Signature {
        name,
        function,
        args,
    }
}

/// The functions.
pub const FUNCTIONS: &[Signature] = &[
    signature("min", Builtin::Min, &["a", "b"]),
    signature("max", Builtin::Max, &["a", "b"]),
    signature("clamp", Builtin::Clamp, &["value", "low", "high"]),
    signature("abs", Builtin::Abs, &["value"]),
    signature("sqrt", Builtin::Sqrt, &["value"]),
    signature("each", Builtin::Each, &["a", "b", ".."]),
    signature("sum", Builtin::Sum, &["bank.value"]),
    signature("tuned", Builtin::Tuned, &["delay", "time"]),
    signature("exp", Builtin::Of(model::Function::Exp), &["value"]),
    signature("log", Builtin::Of(model::Function::Log), &["value"]),
    signature("sin", Builtin::Of(model::Function::Sin), &["angle"]),
    signature("cos", Builtin::Of(model::Function::Cos), &["angle"]),
    signature("tanh", Builtin::Of(model::Function::Tanh), &["value"]),
];

/// The names of the functions.
pub fn function_names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|f| f.name)
}

/// The function of that name.
pub fn function(name: &str) -> Option<&'static Signature> {
    FUNCTIONS.iter().find(|f| f.name == name)
}

/// An event that every host understands.
pub struct Event {
    /// Its name.
    pub name: &'static str,
    /// Its arguments: name and dimension.
    pub args: &'static [(&'static str, Dim)],
}

/// The events: a string is struck or plucked, the damper is back.
pub const EVENTS: &[Event] = &[
    Event {
        name: "note",
        args: &[("speed", Dim::SPEED)],
    },
    Event {
        name: "release",
        args: &[],
    },
];

/// The event of that name.
pub fn event(name: &str) -> Option<&'static Event> {
    EVENTS.iter().find(|e| e.name == name)
}
