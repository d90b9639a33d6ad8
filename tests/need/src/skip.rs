//! Skips as they are recorded: a line of a file, or of standard error; a panic where what is absent
//! is required.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

/// Records that the test on this thread lacks something, which belongs to a `group`.
///
/// # Panics
///
/// Where it is required, or the record cannot be written.
pub(crate) fn record(name: &str, group: &str, advice: &str) {
    let required = std::env::var("WHIPPEN_REQUIRE").unwrap_or_default();
    assert!(
        !is_required(&required, name, group),
        "{name} is required and absent: install {advice} (WHIPPEN_REQUIRE={required})"
    );
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a thread without a name");
    let package = std::env::var("CARGO_PKG_NAME").unwrap_or_default();
    let line = format!("{package}\t{}\t{test}\t{name}\t{advice}\n", binary());
    match std::env::var_os("WHIPPEN_SKIPS") {
        Some(path) => append(Path::new(&path), &line),
        None => {
            // Past the test harness, which would keep it to itself.
            let note = format!("skipped: {test} needs {name} ({advice})\n");
            std::io::stderr()
                .write_all(note.as_bytes())
                .expect("standard error takes a line");
        }
    }
}

/// Whether a list of what must be there names this, its group, or everything.
pub(crate) fn is_required(list: &str, name: &str, group: &str) -> bool {
    list.split(',')
        .map(str::trim)
        .any(|item| item == "all" || item == group || item == name)
}

/// One write for one line, so that processes at the same time do not mix theirs.
fn append(path: &Path, line: &str) {
    OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .and_then(|mut file| file.write_all(line.as_bytes()))
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// The name of the test binary, without the hash that Cargo adds.
fn binary() -> String {
    let exe = std::env::current_exe().unwrap_or_default();
    let stem = exe.file_stem().unwrap_or_default().to_string_lossy();
    stem.rsplit_once('-')
        .map_or(stem.as_ref(), |(name, _)| name)
        .to_string()
}
