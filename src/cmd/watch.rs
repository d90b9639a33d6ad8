//! `--watch`: does something again whenever one of its files is saved.
//!
//! Many editors save by writing another file and renaming it, so folders are watched, not files;
//! and a save is several events, so it counts once things have been quiet for a moment.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use notify::{Event, EventKind, RecursiveMode, Watcher};

use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::tell;

/// A save is over when nothing has happened for so long.
const QUIET: Duration = Duration::from_millis(60);

/// What wakes the loop.
enum Wake {
    /// Something happened to these files.
    Paths(Vec<PathBuf>),
    /// Ctrl-C.
    Stop,
}

/// Does the job, and again after every save of one of the files, until Ctrl-C. A program that is
/// wrong is waited for; a command line that is wrong from the start is not.
pub fn watch(files: &[PathBuf], mut job: impl FnMut() -> Outcome) -> Outcome {
    let (sender, receiver) = channel();
    let stop = sender.clone();
    // Nobody listens any more only at the end.
    interrupt::take_first(move || drop(stop.send(Wake::Stop)));
    // Before the first run, lest a save during it is missed.
    let _watcher = watcher(files, sender)?;
    let names = watched(files);
    let shown = files
        .iter()
        .map(|f| f.display().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    let mut first = true;
    loop {
        let begin = Instant::now();
        match job() {
            Err(Failure::Usage(message)) if !first => tell!("error: {message}"),
            Ok(()) | Err(Failure::Program) => {}
            Err(other) => return Err(other),
        }
        first = false;
        let now = chrono::Local::now().format("%H:%M:%S");
        let seconds = begin.elapsed().as_secs_f64();
        tell!("[{now}] done in {seconds:.2} s; watching {shown} (Ctrl-C ends)\n");
        if !saved(&receiver, &names) {
            return Ok(());
        }
    }
}

/// Folder and name of every file, the folder in one spelling.
fn watched(files: &[PathBuf]) -> BTreeSet<PathBuf> {
    files.iter().filter_map(|file| spelled(file).ok()).collect()
}

/// The file may be missing for a moment; its folder is not.
fn spelled(file: &Path) -> io::Result<PathBuf> {
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    Ok(folder
        .canonicalize()?
        .join(file.file_name().unwrap_or_default()))
}

fn watcher(files: &[PathBuf], sender: Sender<Wake>) -> Result<impl Watcher + use<>, Failure> {
    let cannot = |e: &dyn std::fmt::Display| Failure::Usage(format!("cannot watch the files: {e}"));
    let tell = move |event: notify::Result<Event>| {
        if let Ok(event) = event
            && !matches!(event.kind, EventKind::Access(_))
        {
            // Nobody listens any more only at the end.
            let _ = sender.send(Wake::Paths(event.paths));
        }
    };
    let mut watcher = notify::recommended_watcher(tell).map_err(|e| cannot(&e))?;
    // A file may be a link: what it leads to may lie in another folder.
    let ends = files.iter().filter_map(|file| file.canonicalize().ok());
    let all = files.iter().cloned().chain(ends);
    let folders: BTreeSet<PathBuf> = all
        .filter_map(|f| spelled(&f).ok())
        .filter_map(|f| f.parent().map(Path::to_path_buf))
        .collect();
    for folder in &folders {
        watcher
            .watch(folder, RecursiveMode::NonRecursive)
            .map_err(|e| cannot(&e))?;
    }
    Ok(watcher)
}

/// Waits for a save; `false` if Ctrl-C comes first.
fn saved(receiver: &Receiver<Wake>, names: &BTreeSet<PathBuf>) -> bool {
    let ends: BTreeSet<PathBuf> = names
        .iter()
        .filter_map(|name| name.canonicalize().ok())
        .collect();
    let ours = |paths: &[PathBuf]| {
        paths
            .iter()
            .any(|path| names.contains(path) || ends.contains(path))
    };
    let mut pending = false;
    loop {
        let wake = match pending {
            false => receiver.recv().map_err(|_| RecvTimeoutError::Disconnected),
            true => receiver.recv_timeout(QUIET),
        };
        match wake {
            Ok(Wake::Stop) | Err(RecvTimeoutError::Disconnected) => return false,
            Ok(Wake::Paths(paths)) => pending |= ours(&paths),
            Err(RecvTimeoutError::Timeout) => return true,
        }
    }
}
