//! Printing to stdout. A reader that has seen enough (`| head`) is no error: what is left goes
//! nowhere.

/// Prints a line to stdout.
macro_rules! say {
    ($($arg:tt)*) => {
        $crate::say::line(&format!($($arg)*))
    };
}
pub(crate) use say;

use std::io::Write;

/// Prints text and the end of the line.
pub fn line(text: &str) {
    whole(&format!("{text}\n"));
}

/// Prints text as it is.
pub fn whole(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// Columns of a terminal whose width is not known, and of what is no terminal.
const COLUMNS: usize = 80;

/// Columns of a terminal that is too narrow for anything else.
const COLUMNS_MIN: usize = 20;

/// How many columns stdout has.
pub fn columns() -> usize {
    let size = terminal_size::terminal_size_of(std::io::stdout());
    let columns = size.map_or(COLUMNS, |(width, _)| width.0.into());
    columns.max(COLUMNS_MIN)
}

/// Prints bytes as they are.
pub fn bytes(bytes: &[u8]) {
    let mut stdout = std::io::stdout().lock();
    let _ = stdout.write_all(bytes).and_then(|()| stdout.flush());
}
