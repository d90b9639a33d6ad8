//! Files at the edge: how inputs are complained about and how outputs are written.
//!
//! ```text
//!   contents -> temporary file beside the target -> sync -> rename
//! ```
//!
//! An output appears whole or not at all: a full disk, an interrupt or an error half way leaves
//! what was there before. What exists and is no regular file (a pipe, a terminal, `/dev/null`)
//! cannot be replaced by a rename and is written in place.
//!
//! Not here: what is in the files.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

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

/// Writes a file whole or not at all: `contents` is given a buffered writer.
///
/// # Errors
/// The folder does not exist or may not be written, the disk is full, or `contents` failed; the
/// file is then as before.
pub fn write_whole(
    path: &Path,
    contents: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    replace(path, contents)
        .map_err(|e| FileError::new(path, format!("cannot be written: {}", reason(&e))))
}

fn replace(path: &Path, contents: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    // A link stays a link: what it points to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    match fs::metadata(&target) {
        Ok(m) if m.is_dir() => return Err(io::Error::other("it is a directory")),
        Ok(m) if !m.is_file() => {
            return fill(File::options().write(true).open(&target)?, contents).map(drop);
        }
        _ => {}
    }
    let folder = target
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let (file, temporary) = new_beside(folder)?.into_parts();
    fill(file, contents)?.sync_all()?;
    temporary.persist(&target).map_err(|e| e.error)
}

/// A temporary file with the rights of an ordinary one.
fn new_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".whippen-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn fill(file: File, contents: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<File> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    contents(&mut writer)?;
    writer.into_inner().map_err(io::IntoInnerError::into_error)
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
    fn a_failing_write_leaves_what_was_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out.csv");
        write_whole(&path, |w| w.write_all(b"first")).unwrap();
        let error = write_whole(&path, |w| {
            w.write_all(b"second, half way")?;
            Err(io::Error::other("no space left"))
        });
        assert_eq!(
            error.unwrap_err().message,
            "cannot be written: no space left"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            1,
            "no temporary file stays behind"
        );
    }

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

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt};
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real.csv"), dir.path().join("link.csv"));
        write_whole(&real, |w| w.write_all(b"old")).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_whole(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(
            fs::metadata(&real).unwrap().permissions().mode() & 0o600,
            0o600
        );
        write_whole(Path::new("/dev/null"), |w| w.write_all(b"gone")).unwrap();
        assert!(
            fs::metadata("/dev/null")
                .unwrap()
                .file_type()
                .is_char_device()
        );
    }
}
