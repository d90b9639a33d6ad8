//! Words that the state holds for the code: constants and addresses of modes.

use super::frame::LITERALS_MAX;

/// A word of the state that no code changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Literal {
    Word(u32),
    /// Where the code of a mode begins.
    Mode(usize),
}

/// All of them, each once.
#[derive(Debug, Default)]
pub(super) struct Literals(Vec<Literal>);

impl Literals {
    /// The place of a word among the literals; none where there is no more room.
    pub(super) fn place(&mut self, literal: Literal) -> Option<u32> {
        let known = self.0.iter().position(|l| *l == literal);
        let free = || (self.0.len() < LITERALS_MAX).then_some(self.0.len());
        let at = known.or_else(free)?;
        if at == self.0.len() {
            self.0.push(literal);
        }
        Some(at as u32)
    }

    pub(super) fn all(&self) -> &[Literal] {
        &self.0
    }
}
