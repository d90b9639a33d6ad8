//! Words that the state holds for the code: constants and addresses of modes.

use super::state_layout::LITERALS_MAX;
use whippen_modes::ModeId;

/// A word of the state that no code changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Literal {
    Word(u32),
    /// Where the code of a mode begins.
    Mode(ModeId),
    /// Where a table begins.
    Table(u32),
}

/// All of them, each once.
#[derive(Debug, Clone)]
pub(super) struct Literals {
    all: Vec<Literal>,
    /// How many may be words: for every address there is room.
    words_left: usize,
}

impl Literals {
    /// None yet, and room for so many addresses.
    pub(super) fn new(addresses: usize) -> Literals {
        Literals {
            all: Vec::new(),
            words_left: LITERALS_MAX.saturating_sub(addresses),
        }
    }

    /// The place of a literal; none where there is no more room for words.
    pub(super) fn place(&mut self, literal: Literal) -> Option<u32> {
        if let Some(at) = self.all.iter().position(|l| *l == literal) {
            return Some(at as u32);
        }
        if matches!(literal, Literal::Word(_)) {
            self.words_left = self.words_left.checked_sub(1)?;
        }
        self.all.push(literal);
        Some(self.all.len() as u32 - 1)
    }

    pub(super) fn all(&self) -> &[Literal] {
        &self.all
    }
}
