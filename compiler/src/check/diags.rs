//! The messages collected so far.

use std::collections::HashSet;

use crate::diag::{Code, Diagnostic, Severity};
use crate::source::Span;

/// Messages, each once: a term that is called twice is checked twice, but its mistakes are told once.
#[derive(Default)]
pub struct Diags {
    list: Vec<Diagnostic>,
    seen: HashSet<(Code, Span, String)>,
    errors: usize,
}

impl Diags {
    /// Adds a message unless the same has been said about the same place.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.errors += usize::from(diagnostic.severity() == Severity::Error);
        if self.seen.insert((diagnostic.code, diagnostic.span, diagnostic.message.clone())) {
            self.list.push(diagnostic);
        }
    }

    /// How many errors were found, repeated ones counted again.
    pub fn errors(&self) -> usize {
        self.errors
    }

    /// Whether there is an error.
    pub fn any_error(&self) -> bool {
        self.errors > 0
    }

    /// All messages in the order of the text.
    pub fn sorted(mut self) -> Vec<Diagnostic> {
        self.list.sort_by_key(|d| (d.span, d.code));
        self.list
    }
}
