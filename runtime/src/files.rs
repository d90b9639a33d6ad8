//! Files at the edge: how inputs are complained about (here), how outputs are written (`output`),
//! and which names mean one file (`identity`).
//!
//! Not here: what is in the files.

mod identity;
mod output;

use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

pub use identity::same_file;
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

/// Opens a file to read it.
///
/// # Errors
/// The file does not exist, is a directory or may not be read.
pub fn open(path: &Path) -> Result<File, FileError> {
    let file = File::open(path).map_err(|e| FileError::new(path, reason(&e)))?;
    match file.metadata() {
        Ok(m) if m.is_dir() => Err(FileError::new(path, "is a directory")),
        _ => Ok(file),
    }
}

/// Reads a file as text.
///
/// # Errors
/// As [`open`]; the file is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    io::read_to_string(open(path)?).map_err(|e| match e.kind() {
        io::ErrorKind::InvalidData => FileError::new(path, "is not text (UTF-8)"),
        _ => FileError::new(path, reason(&e)),
    })
}

/// The reason without the operating system's error number.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_path_and_reason() {
        let dir = tempfile::tempdir().unwrap();
        let missing = dir.path().join("nowhere/out.csv");
        let error = write_whole(&missing, |_| Ok(())).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "{}: cannot be written: there is no such file or folder",
                missing.display()
            )
        );
        assert_eq!(
            write_whole(dir.path(), |_| Ok(())).unwrap_err().message,
            "cannot be written: it is a directory"
        );
        assert_eq!(open(dir.path()).unwrap_err().message, "is a directory");
        assert_eq!(
            open(&missing).unwrap_err().message,
            "there is no such file or folder"
        );
        let place = FileError::new(Path::new("key.csv"), "`abc` is not a number")
            .at_line(7)
            .at_column(2);
        assert_eq!(
            place.to_string(),
            "key.csv, line 7, column 2: `abc` is not a number"
        );
    }
}
