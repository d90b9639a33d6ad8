//! `whippen`: the command line, as a library for the binary and for other doors to the same
//! command, such as Python's. One file per subcommand in `cmd/`; how a command ends is in `exit`.

// A reader that has seen enough is no defect: everything is printed by `say`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod beside;
mod cmd;
pub mod device;
mod exit;
mod hardware;
mod interrupt;
mod lsp;
mod say;
pub mod table_text;

use std::ffi::OsString;

use clap::Parser;

/// Runs a command line whose first word is the command's own name, prints what there is to say, and
/// gives the exit code: 0 done, 1 the program under test is wrong, 2 the command line is wrong, 3 a
/// defect, 130 interrupted.
///
/// From here on the process answers to Ctrl-C as the command does.
pub fn command(words: impl IntoIterator<Item = OsString>) -> u8 {
    interrupt::listen();
    let cli = match cmd::Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => {
            say::keep(error.print());
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    // A panic is a defect: exit code 3, told apart from a wrong program.
    let outcome = std::panic::catch_unwind(|| cmd::dispatch(cli));
    exit::code(outcome.unwrap_or_else(|_| {
        Err(exit::Failure::Defect(
            "the message above tells where".to_string(),
        ))
    }))
}
