//! Diagnostics: what the compiler says about the user's program.
//!
//! A diagnostic has a code from the table in [`codes`], a place, a label for that place, further
//! places, and hints that say what to do, with changes of the text where they can be given exactly.
//! Rendering is done by `ariadne`. Phases collect them in a list and go on.

pub mod codes;
mod excerpt;
pub mod explain;
mod nearest;
pub mod render;
mod wrap;

pub use codes::{Code, Severity};
pub use nearest::nearest;
pub use render::{render, summary};

use whippen_source::Span;

/// A further place, with what is to be seen there.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is to be seen there.
    pub text: String,
}

/// A change of the text that does what a hint says; editors can apply it.
#[derive(Debug, Clone, PartialEq)]
pub struct Suggestion {
    /// What is replaced; empty where something is inserted.
    pub span: Span,
    /// By what.
    pub replacement: String,
}

/// What to do, in words; and what would stand in the place that the diagnostic points at.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    text: String,
    instead: Option<String>,
}

impl Advice {
    /// Words, and what would stand there instead.
    pub fn instead(text: impl Into<String>, replacement: impl Into<String>) -> Advice {
        Advice {
            text: text.into(),
            instead: Some(replacement.into()),
        }
    }

    /// The nearest known word instead.
    pub fn did_you_mean(near: &str) -> Advice {
        Advice::instead(format!("did you mean `{near}`?"), near)
    }
}

impl From<String> for Advice {
    fn from(text: String) -> Advice {
        Advice {
            text,
            instead: None,
        }
    }
}

impl From<&str> for Advice {
    fn from(text: &str) -> Advice {
        text.to_string().into()
    }
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
    /// Changes of the text that would mend it, all of them together.
    pub suggestions: Vec<Suggestion>,
}

impl Diagnostic {
    /// A diagnostic without further places and hints.
    pub fn new(
        code: Code,
        span: Span,
        message: impl Into<String>,
        label: impl Into<String>,
    ) -> Diagnostic {
        Diagnostic {
            code,
            message: message.into(),
            span,
            label: label.into(),
            others: Vec::new(),
            hints: Vec::new(),
            suggestions: Vec::new(),
        }
    }

    /// Adds a further place.
    #[must_use]
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.others.push(Label {
            span,
            text: text.into(),
        });
        self
    }

    /// Adds what to do. What it puts in the place of the diagnostic's own becomes a suggestion.
    #[must_use]
    pub fn hint(mut self, advice: impl Into<Advice>) -> Diagnostic {
        let Advice { text, instead } = advice.into();
        self.hints.push(text);
        let span = self.span;
        self.suggestions
            .extend(instead.map(|replacement| Suggestion { span, replacement }));
        self
    }

    /// Adds a change of the text that does what the hints say.
    #[must_use]
    pub fn replace(mut self, span: Span, replacement: impl Into<String>) -> Diagnostic {
        self.suggestions.push(Suggestion {
            span,
            replacement: replacement.into(),
        });
        self
    }

    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}
