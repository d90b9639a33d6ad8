//! The messages collected so far.

use std::collections::HashMap;

use crate::diag::{Code, Diagnostic, Severity};
use whippen_source::Span;

/// Messages, each once: a term that is called twice is checked twice, but its mistakes are told
/// once.
#[derive(Default)]
pub struct Diags {
    list: Vec<Diagnostic>,
    seen: HashMap<(Code, Span, String), usize>,
    errors: usize,
}

impl Diags {
    /// Adds a message. Of two that say the same about the same place the one that points at fewer
    /// others is kept.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.errors += usize::from(diagnostic.severity() == Severity::Error);
        let key = (diagnostic.code, diagnostic.span, diagnostic.message.clone());
        match self.seen.get(&key) {
            None => {
                self.seen.insert(key, self.list.len());
                self.list.push(diagnostic);
            }
            Some(&known) if diagnostic.others.len() < self.list[known].others.len() => {
                self.list[known] = diagnostic;
            }
            Some(_) => {}
        }
    }

    /// Adds a message about a further member of a bank, unless one like it tells of the same place.
    pub fn push_again(&mut self, diagnostic: Diagnostic) {
        let told =
            |known: &Diagnostic| known.code == diagnostic.code && known.span == diagnostic.span;
        if self.list.iter().any(told) {
            self.errors += usize::from(diagnostic.severity() == Severity::Error);
        } else {
            self.push(diagnostic);
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
