//! Files at the edge: how inputs are read and complained about, and how outputs are written.
//!
//! ```text
//!   input  -> as much of it as its kind may have -> text, bytes or lines
//!   output -> temporary file beside the target -> sync -> rename
//! ```
//!
//! An input is read up to the limit of its kind ([`InputKind`]): what is longer is refused and not
//! held. An output appears whole or not at all: a full disk, an interrupt or an error half way
//! leaves what was there before. It may be written at once ([`write_whole`]) or as it comes
//! ([`OutputFile`]). What exists and is no regular file (a pipe, a terminal, `/dev/null`) cannot be
//! replaced by a rename and is written in place.
//!
//! Not here: what is in the files.

mod identity;
mod input;
mod output;

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

pub use identity::same_file;
pub use input::{Input, InputKind, open, read_bytes, read_stdin, read_text};
pub use output::{OutputFile, abandon_unfinished, write_whole};

/// What is wrong with a file, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// Line, counted from 1.
    pub line: Option<u64>,
    /// Column of a table, counted from 1.
    pub column: Option<usize>,
    /// What is wrong, in one sentence.
    pub message: String,
}

impl FileError {
    /// Something about the file as a whole.
    pub fn new(path: &Path, message: impl Into<String>) -> FileError {
        FileError {
            path: path.to_path_buf(),
            line: None,
            column: None,
            message: message.into(),
        }
    }

    /// The file could not be written.
    pub fn not_written(path: &Path, error: &io::Error) -> FileError {
        FileError::new(path, format!("cannot be written: {}", reason(error)))
    }

    /// The same, in a line (counted from 1).
    #[must_use]
    pub fn at_line(mut self, line: u64) -> FileError {
        self.line = Some(line);
        self
    }

    /// The same, in a column of a table (counted from 1).
    #[must_use]
    pub fn at_column(mut self, column: usize) -> FileError {
        self.column = Some(column);
        self
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ", column {column}")?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for FileError {}

/// The reason without the operating system's error number.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => {
            let told = error.to_string();
            let words = told.split_once(" (os error");
            words.map_or(told.clone(), |(words, _)| words.to_lowercase())
        }
    }
}
