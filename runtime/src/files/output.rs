//! Atomic replacement: an output appears whole or not at all.
//!
//! ```text
//!   create -> temporary file beside the target -> write .. -> finish: sync, rename
//!                 '- dropped, or the process is interrupted: removed
//! ```
//!
//! A full disk, an interrupt or an error half way leaves what was there before. A symbolic link
//! stays one: the file it leads to is replaced, beside which the temporary one lies. A file that is
//! replaced keeps its permissions and, where that is allowed, its owner; one that may not be
//! written is not replaced either. What exists and is no regular file (a pipe, a terminal,
//! `/dev/null`) cannot be replaced by a rename and is written in place. Other hard links of a file
//! keep the old contents.
//!
//! Not here: who listens for signals; it calls [`abandon_unfinished`].

use std::collections::BTreeSet;
use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use super::FileError;
use super::identity::link_target;

/// Bytes that are collected before they are written.
const BUFFER_BYTES: usize = 1 << 16;

/// Temporary files that are there now.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// A file that is being written. It has its name when it is [finished](OutputFile::finish); dropped
/// before that, it leaves nothing.
#[derive(Debug)]
pub struct OutputFile {
    /// As it was named.
    path: PathBuf,
    writer: BufWriter<File>,
    /// What becomes of it; none where it is written in place.
    replacement: Option<Replacement>,
}

/// A temporary file that is to take the place of another.
#[derive(Debug)]
struct Replacement {
    /// Removes the file when it is dropped.
    temporary: Option<TempPath>,
    /// Its name in [`UNFINISHED`].
    name: PathBuf,
    target: PathBuf,
}

impl OutputFile {
    /// Begins a file of this name.
    ///
    /// # Errors
    /// The folder does not exist or may not be written; there is such a file, and it may not be
    /// written.
    pub fn create(path: &Path) -> Result<OutputFile, FileError> {
        let created = OutputFile::open(path);
        created.map_err(|error| FileError::not_written(path, &error))
    }

    fn open(path: &Path) -> io::Result<OutputFile> {
        let target = link_target(path);
        let there = fs::metadata(&target).ok();
        let (file, replacement) = match &there {
            Some(found) if found.is_dir() => return Err(io::Error::other("it is a directory")),
            Some(found) if !found.is_file() => (File::options().write(true).open(&target)?, None),
            _ => {
                let (file, replacement) = Replacement::beside(&target, there.as_ref())?;
                (file, Some(replacement))
            }
        };
        Ok(OutputFile {
            path: path.to_path_buf(),
            writer: BufWriter::with_capacity(BUFFER_BYTES, file),
            replacement,
        })
    }

    /// Ends the file and gives it its name.
    ///
    /// # Errors
    /// The disk is full, or the file cannot be renamed; what was there before is there still.
    pub fn finish(self) -> Result<(), FileError> {
        let OutputFile {
            path,
            writer,
            replacement,
        } = self;
        let replace = || {
            let file = writer
                .into_inner()
                .map_err(io::IntoInnerError::into_error)?;
            let Some(replacement) = replacement else {
                return Ok(());
            };
            file.sync_all()?;
            replacement.take_place()
        };
        replace().map_err(|error| FileError::not_written(&path, &error))
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

impl Seek for OutputFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

impl Replacement {
    /// A temporary file beside the target, with its permissions if it is there.
    fn beside(target: &Path, there: Option<&Metadata>) -> io::Result<(File, Replacement)> {
        if let Some(there) = there {
            // Files in memory (WASI) have no permissions.
            if cfg!(not(target_os = "wasi")) && there.permissions().readonly() {
                return Err(io::Error::other("it is read-only"));
            }
            // Whoever may not write a file may not replace it either.
            File::options().write(true).open(target)?;
        }
        let folder = target
            .parent()
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        // Made and entered in one step, as far as an interrupt is concerned.
        let mut unfinished = lock();
        let (file, temporary) = new_beside(folder)?.into_parts();
        let name = temporary.to_path_buf();
        unfinished.insert(name.clone());
        drop(unfinished);
        let replacement = Replacement {
            temporary: Some(temporary),
            name,
            target: target.to_path_buf(),
        };
        if let Some(there) = there {
            keep_permissions(&file, there)?;
        }
        Ok((file, replacement))
    }

    fn take_place(mut self) -> io::Result<()> {
        let _unfinished = lock();
        match self.temporary.take() {
            Some(temporary) => temporary.persist(&self.target).map_err(|e| e.error),
            None => Ok(()),
        }
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        let mut unfinished = lock();
        drop(self.temporary.take());
        unfinished.remove(&self.name);
    }
}

/// Writes a file whole or not at all: `contents` is given a buffered writer.
///
/// # Errors
/// As [`OutputFile::create`] and [`OutputFile::finish`], or `contents` failed; the file is then as
/// before.
pub fn write_whole(
    path: &Path,
    contents: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let mut file = OutputFile::create(path)?;
    contents(&mut file).map_err(|error| FileError::not_written(path, &error))?;
    file.finish()
}

/// Removes all files that are not finished, and keeps any from being begun or finished: for who
/// ends the process at once, such as a handler of signals.
pub fn abandon_unfinished() {
    let unfinished = lock();
    for name in unfinished.iter() {
        // What cannot be removed stays: nobody is left to tell.
        let _ = fs::remove_file(name);
    }
    std::mem::forget(unfinished);
}

fn lock() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file with the permissions of an ordinary one.
fn new_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".whippen-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Gives a new file the owner and the permissions of the one that it replaces.
#[cfg(unix)]
fn keep_permissions(file: &File, there: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let own = file.metadata()?;
    if (own.uid(), own.gid()) != (there.uid(), there.gid()) {
        // Only root may give a file away; anybody else keeps it as their own.
        let _ = fchown(file, Some(there.uid()), Some(there.gid()));
    }
    if own.mode() != there.mode() {
        file.set_permissions(there.permissions())?;
    }
    Ok(())
}

#[cfg(not(unix))]
fn keep_permissions(file: &File, there: &Metadata) -> io::Result<()> {
    file.set_permissions(there.permissions())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().display().to_string())
            .collect();
        names.sort();
        names
    }

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
        assert_eq!(names(dir.path()), ["out.csv"]);
    }

    #[test]
    fn a_file_has_its_name_when_it_is_finished() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out.csv");
        let mut file = OutputFile::create(&path).unwrap();
        file.write_all(b"whole").unwrap();
        file.flush().unwrap();
        assert_eq!(names(dir.path()).len(), 1);
        assert!(!path.exists());
        file.finish().unwrap();
        assert_eq!(names(dir.path()), ["out.csv"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "whole");
        drop(OutputFile::create(&path).unwrap());
        assert_eq!(names(dir.path()), ["out.csv"]);
        assert!(lock().iter().all(|name| !name.starts_with(dir.path())));
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
        use std::os::unix::fs::{FileTypeExt, symlink};
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("folder")).unwrap();
        write_whole(&at("folder/real.csv"), |w| w.write_all(b"old")).unwrap();
        symlink("folder/real.csv", at("link.csv")).unwrap();
        let mut file = OutputFile::create(&at("link.csv")).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(names(&at("folder")).len(), 2, "beside the target");
        file.finish().unwrap();
        assert_eq!(fs::read_to_string(at("folder/real.csv")).unwrap(), "new");
        symlink("folder/later.csv", at("hanging.csv")).unwrap();
        write_whole(&at("hanging.csv"), |w| w.write_all(b"made")).unwrap();
        assert_eq!(fs::read_to_string(at("folder/later.csv")).unwrap(), "made");
        for link in ["link.csv", "hanging.csv"] {
            assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink());
        }
        let null = Path::new("/dev/null");
        write_whole(null, |w| w.write_all(b"gone")).unwrap();
        assert!(fs::metadata(null).unwrap().file_type().is_char_device());
    }

    #[cfg(unix)]
    #[test]
    fn permissions_stay_what_they_are() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out.csv");
        let mode = || fs::metadata(&path).unwrap().permissions().mode() & 0o777;
        write_whole(&path, |w| w.write_all(b"first")).unwrap();
        for wanted in [0o600, 0o640, 0o755] {
            fs::set_permissions(&path, PermissionsExt::from_mode(wanted)).unwrap();
            write_whole(&path, |w| w.write_all(b"again")).unwrap();
            assert_eq!(mode(), wanted);
        }
        fs::set_permissions(&path, PermissionsExt::from_mode(0o444)).unwrap();
        let refused = write_whole(&path, |w| w.write_all(b"third")).unwrap_err();
        assert_eq!(refused.message, "cannot be written: it is read-only");
        assert_eq!(fs::read_to_string(&path).unwrap(), "again");
        assert_eq!(names(dir.path()), ["out.csv"]);
    }
}
