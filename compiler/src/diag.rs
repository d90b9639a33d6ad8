//! Diagnostics: what the compiler says about the user's program.
//!
//! A diagnostic has a code from the table in [`codes`], a place, a label for that place, further places, and hints that
//! say what to do. Rendering is done by `ariadne`. Phases collect them in a list and go on.

pub mod codes;
mod nearest;
pub mod render;

pub use codes::{Code, Severity};
pub use nearest::nearest;
pub use render::{render, summary};

use crate::source::Span;

/// A further place, with what is to be seen there.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is to be seen there.
    pub text: String,
}

/// One message about the user's program.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Which.
    pub code: Code,
    /// What is wrong, in one sentence, naming the names involved.
    pub message: String,
    /// The place.
    pub span: Span,
    /// What is to be seen at the place, in a few words.
    pub label: String,
    /// Further places.
    pub others: Vec<Label>,
    /// What to do about it.
    pub hints: Vec<String>,
}

impl Diagnostic {
    /// A diagnostic without further places and hints.
    pub fn new(code: Code, span: Span, message: impl Into<String>, label: impl Into<String>) -> Diagnostic {
        Diagnostic { code, message: message.into(), span, label: label.into(), others: Vec::new(), hints: Vec::new() }
    }

    /// Adds a further place.
    #[must_use]
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.others.push(Label { span, text: text.into() });
        self
    }

    /// Adds what to do.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Diagnostic {
        self.hints.push(text.into());
        self
    }

    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}
