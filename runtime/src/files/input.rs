//! Bounded reading: every kind of input has a size beyond which it is refused.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::{FileError, reason};

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// A kind of input, and how much of it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputKind {
    /// What it is, in a message: `a program`.
    pub what: &'static str,
    /// The most bytes it may have.
    pub bytes_max: u64,
    /// The most bytes a line of it may have.
    pub line_max: u64,
}

impl InputKind {
    /// The text of a program.
    pub const PROGRAM: InputKind = InputKind::new("a program", 4 * MIB, 4 * MIB);
    /// A description of a device or a board.
    pub const DESCRIPTION: InputKind = InputKind::new("a description", MIB, MIB);
    /// Values for parameters.
    pub const PRESET: InputKind = InputKind::new("a preset", MIB, MIB);
    /// A calibration table.
    pub const CALIBRATION: InputKind = InputKind::new("a calibration table", MIB, 64 * KIB);
    /// A table of a program, a curve to import: 4096 rows take a twentieth of it.
    pub const TABLE: InputKind = InputKind::new("a table", 4 * MIB, 64 * KIB);
    /// A recording of a motion or a force: its lines are read one by one.
    pub const RECORDING: InputKind = InputKind::new("a recording", 4 * GIB, 64 * KIB);
    /// A performance.
    pub const MIDI: InputKind = InputKind::new("a MIDI file", 16 * MIB, 16 * MIB);
    /// An image or object file that is emulated.
    pub const IMAGE: InputKind = InputKind::new("an image", 64 * MIB, 64 * MIB);
    /// A WebAssembly module.
    pub const MODULE: InputKind = InputKind::new("a module", 64 * MIB, 64 * MIB);

    /// What a participant of a study left: a gesture is one field of it.
    pub const SESSION: InputKind = InputKind::new("a session", 512 * MIB, 256 * MIB);

    /// All kinds.
    pub const ALL: [InputKind; 10] = [
        InputKind::PROGRAM,
        InputKind::DESCRIPTION,
        InputKind::PRESET,
        InputKind::CALIBRATION,
        InputKind::TABLE,
        InputKind::RECORDING,
        InputKind::MIDI,
        InputKind::IMAGE,
        InputKind::MODULE,
        InputKind::SESSION,
    ];

    const fn new(what: &'static str, bytes_max: u64, line_max: u64) -> InputKind {
        InputKind {
            what,
            bytes_max,
            line_max,
        }
    }

    /// What is wrong with a file that is longer.
    fn too_long(&self) -> io::Error {
        let size = size(self.bytes_max);
        io::Error::other(format!(
            "is longer than {size}, the most {} may have",
            self.what
        ))
    }

    /// What is wrong with a line that is longer.
    fn line_too_long(&self) -> io::Error {
        let size = size(self.line_max);
        let what = self.what;
        io::Error::other(format!(
            "a line is longer than {size}, the most a line of {what} may have"
        ))
    }
}

/// A number of bytes in words.
fn size(bytes: u64) -> String {
    match bytes {
        GIB.. => format!("{} GiB", bytes / GIB),
        MIB.. => format!("{} MiB", bytes / MIB),
        _ => format!("{} KiB", bytes / KIB),
    }
}

/// An open input, which ends with an error where it is longer than its kind may be.
#[derive(Debug)]
pub struct Input<R = File> {
    from: R,
    kind: InputKind,
    /// Bytes read so far.
    read: u64,
    /// Bytes since the last end of a line.
    line: u64,
}

impl<R> Input<R> {
    fn new(from: R, kind: InputKind) -> Input<R> {
        Input {
            from,
            kind,
            read: 0,
            line: 0,
        }
    }
}

impl<R: Read> Read for Input<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.from.read(buffer)?;
        self.read += count as u64;
        if self.read > self.kind.bytes_max {
            return Err(self.kind.too_long());
        }
        self.line = match buffer[..count].iter().rposition(|&byte| byte == b'\n') {
            Some(end) => (count - end - 1) as u64,
            None => self.line + count as u64,
        };
        if self.line > self.kind.line_max {
            return Err(self.kind.line_too_long());
        }
        Ok(count)
    }
}

/// Opens a file to read it.
///
/// # Errors
/// The file does not exist, is a directory, may not be read, or is longer than its kind may be.
pub fn open(path: &Path, kind: InputKind) -> Result<Input, FileError> {
    let error = |e: io::Error| FileError::new(path, reason(&e));
    let file = File::open(path).map_err(error)?;
    match file.metadata() {
        Ok(m) if m.is_dir() => return Err(FileError::new(path, "is a directory")),
        Ok(m) if m.len() > kind.bytes_max => return Err(error(kind.too_long())),
        _ => {}
    }
    Ok(Input::new(file, kind))
}

/// Reads a file as text.
///
/// # Errors
/// As [`open`]; the file is not UTF-8.
pub fn read_text(path: &Path, kind: InputKind) -> Result<String, FileError> {
    let bytes = read_bytes(path, kind)?;
    String::from_utf8(bytes).map_err(|_| FileError::new(path, "is not text (UTF-8)"))
}

/// Reads the standard input as text.
///
/// # Errors
/// It is longer than its kind may be, or not UTF-8, in words.
pub fn read_stdin(kind: InputKind) -> Result<String, String> {
    let mut text = String::new();
    let mut input = Input::new(io::stdin(), kind);
    let read = input.read_to_string(&mut text);
    read.map_err(|e| reason(&e)).map(|_| text)
}

/// Reads a file as bytes.
///
/// # Errors
/// As [`open`].
pub fn read_bytes(path: &Path, kind: InputKind) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    open(path, kind)?
        .read_to_end(&mut bytes)
        .map_err(|e| FileError::new(path, reason(&e)))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_is_longer_than_its_kind_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.whip");
        let kind = InputKind::new("a word", 8 * KIB, 4 * KIB);
        fs::write(&path, "abc\n".repeat(2048)).unwrap();
        assert_eq!(read_text(&path, kind).unwrap().len(), 8192);
        fs::write(&path, "abc\n".repeat(2049)).unwrap();
        assert_eq!(
            read_text(&path, kind).unwrap_err().message,
            "is longer than 8 KiB, the most a word may have"
        );
        fs::write(&path, "a".repeat(4097)).unwrap();
        assert_eq!(
            read_text(&path, kind).unwrap_err().message,
            "a line is longer than 4 KiB, the most a line of a word may have"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_device_without_end_is_refused() {
        for kind in InputKind::ALL
            .into_iter()
            .filter(|k| k.bytes_max < GIB || k.line_max < GIB)
        {
            let error = read_bytes(Path::new("/dev/zero"), kind).unwrap_err();
            assert!(error.message.contains(" longer than "), "{error}");
            assert!(error.message.ends_with(" may have"), "{error}");
        }
    }

    #[test]
    fn what_cannot_be_opened_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let open = |path: &Path| open(path, InputKind::PROGRAM).unwrap_err().message;
        assert_eq!(open(dir.path()), "is a directory");
        assert_eq!(
            open(&dir.path().join("no")),
            "there is no such file or folder"
        );
    }
}
