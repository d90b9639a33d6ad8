//! Atomic replacement: an output is a temporary file beside its target until it is complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use super::FileError;

/// A file that is being written. It has its name when it is [finished](OutputFile::finish); what is
/// dropped before leaves what was there.
#[derive(Debug)]
pub struct OutputFile {
    /// As it was named.
    path: PathBuf,
    /// What is replaced: a link stays a link.
    target: PathBuf,
    /// What is filled; none where the target is written in place.
    temporary: Option<TempPath>,
    writer: BufWriter<File>,
}

impl OutputFile {
    /// Begins a file.
    ///
    /// # Errors
    /// The folder does not exist or may not be written, or the path is a directory.
    pub fn create(path: &Path) -> Result<OutputFile, FileError> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let (file, temporary) = begin(&target).map_err(|e| FileError::not_written(path, &e))?;
        Ok(OutputFile {
            path: path.to_path_buf(),
            target,
            temporary,
            writer: BufWriter::with_capacity(1 << 16, file),
        })
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    /// The disk is full, or the target cannot be replaced; it is then as before.
    pub fn finish(self) -> Result<(), FileError> {
        let path = self.path.clone();
        self.replace().map_err(|e| FileError::not_written(&path, &e))
    }

    fn replace(self) -> io::Result<()> {
        let file = self
            .writer
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?;
        let Some(temporary) = self.temporary else {
            return Ok(());
        };
        file.sync_all()?;
        temporary.persist(&self.target).map_err(|e| e.error)
    }

    /// The file, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
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
    let mut file = OutputFile::create(path)?;
    contents(&mut file).map_err(|e| FileError::not_written(path, &e))?;
    file.finish()
}

/// What is filled for a target: a temporary file beside it, or the target itself where it is no
/// regular file.
fn begin(target: &Path) -> io::Result<(File, Option<TempPath>)> {
    match fs::metadata(target) {
        Ok(m) if m.is_dir() => return Err(io::Error::other("it is a directory")),
        Ok(m) if !m.is_file() => {
            return Ok((File::options().write(true).open(target)?, None));
        }
        _ => {}
    }
    let folder = target
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let (file, temporary) = new_beside(folder)?.into_parts();
    Ok((file, Some(temporary)))
}

/// A temporary file with the rights of an ordinary one.
fn new_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".whippen-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
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
    fn a_file_has_its_name_when_it_is_finished() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out.csv");
        fs::write(&path, "before").unwrap();
        let mut file = OutputFile::create(&path).unwrap();
        file.write_all(&[b'x'; 1 << 20]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
        let mut file = OutputFile::create(&path).unwrap();
        file.write_all(b"after").unwrap();
        file.finish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "after");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
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
