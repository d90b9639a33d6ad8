//! What may be wrong with objects and a board.

use std::fmt;

use crate::image::fixup::FixupError;

/// Why there is no image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkError {
    /// Nobody defines a name.
    Undefined {
        /// The name.
        symbol: String,
        /// The section that wants it.
        section: String,
    },
    /// A name is defined twice.
    Twice {
        /// The name.
        symbol: String,
    },
    /// The board has no place for a section.
    Nowhere {
        /// The section.
        section: String,
        /// The board.
        board: String,
    },
    /// A memory is too small.
    Full {
        /// The memory.
        memory: String,
        /// Bytes that are wanted.
        wanted: u64,
        /// Bytes there are.
        size: u32,
    },
    /// An address cannot be put where it is wanted.
    Fixup {
        /// The name.
        symbol: String,
        /// The section that wants it.
        section: String,
        /// Why.
        error: FixupError,
    },
    /// The second stage is missing or longer than 252 bytes.
    Boot2,
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Undefined { symbol, section } => {
                write!(f, "`{symbol}`, used in {section}, is defined nowhere")
            }
            LinkError::Twice { symbol } => write!(f, "`{symbol}` is defined twice"),
            LinkError::Nowhere { section, board } => {
                write!(
                    f,
                    "the board {board} has no place for {section}: add a pattern for it under [place]"
                )
            }
            LinkError::Full {
                memory,
                wanted,
                size,
            } => {
                write!(
                    f,
                    "{memory} is full: {wanted} bytes are wanted and there are {size}"
                )
            }
            LinkError::Fixup {
                symbol,
                section,
                error,
            } => write!(f, "`{symbol}`, used in {section}, {error}"),
            LinkError::Boot2 => {
                f.write_str("the board wants a section .boot2 of at most 252 bytes")
            }
        }
    }
}

impl std::error::Error for LinkError {}
