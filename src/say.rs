//! Printing to stdout, and telling on stderr. A reader that has seen enough (`| head`) is no error:
//! what is left goes nowhere. What else is lost of stdout, on a disk that is full, is an error of
//! the command ([`lost`]); where stderr is lost there is nobody to tell.

/// Prints a line to stdout.
macro_rules! say {
    ($($arg:tt)*) => {
        $crate::say::line(&format!($($arg)*))
    };
}
pub(crate) use say;

/// Prints a line to stderr.
macro_rules! tell {
    ($($arg:tt)*) => {
        $crate::say::to_stderr(&format!($($arg)*))
    };
}
pub(crate) use tell;

use std::io::{self, ErrorKind, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use whippen_runtime::files::reason;

/// Why something of stdout was lost, first.
static LOST: OnceLock<String> = OnceLock::new();

/// Why something of what was printed is lost, if it is.
pub fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// Remembers what is lost.
pub fn keep(printed: io::Result<()>) {
    if let Err(error) = printed
        && error.kind() != ErrorKind::BrokenPipe
    {
        // The first reason is told.
        let _ = LOST.set(reason(&error));
    }
}

/// Prints text and the end of the line to stderr.
pub fn to_stderr(text: &str) {
    let _ = io::stderr()
        .lock()
        .write_all(format!("{text}\n").as_bytes());
}

/// Whether lines are for nobody.
static HUSHED: AtomicBool = AtomicBool::new(false);

/// From now on nothing is said in lines: stdout is for what a program reads.
pub fn hush() {
    HUSHED.store(true, Ordering::Relaxed);
}

/// Prints text and the end of the line.
pub fn line(text: &str) {
    if !HUSHED.load(Ordering::Relaxed) {
        whole(&format!("{text}\n"));
    }
}

/// Prints text as it is.
pub fn whole(text: &str) {
    bytes(text.as_bytes());
}

/// Columns of a terminal whose width is not known, and of what is no terminal.
const COLUMNS: usize = 80;

/// Columns of a terminal that is too narrow for anything else.
const COLUMNS_MIN: usize = 20;

/// How many columns stdout has.
pub fn columns() -> usize {
    terminal_columns().unwrap_or(COLUMNS).max(COLUMNS_MIN)
}

#[cfg(not(target_family = "wasm"))]
fn terminal_columns() -> Option<usize> {
    let size = terminal_size::terminal_size_of(std::io::stdout());
    size.map(|(width, _)| width.0.into())
}

/// A module has no terminal.
#[cfg(target_family = "wasm")]
fn terminal_columns() -> Option<usize> {
    None
}

/// Prints bytes as they are.
pub fn bytes(bytes: &[u8]) {
    let mut stdout = io::stdout().lock();
    keep(stdout.write_all(bytes).and_then(|()| stdout.flush()));
}
