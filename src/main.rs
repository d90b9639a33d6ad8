//! `whippen`: the command line. One file per subcommand in `cmd/`; how a command ends is in `exit`.

// A reader that has seen enough is no defect: everything is printed by `say`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod beside;
mod cmd;
mod device;
mod exit;
mod hardware;
mod interrupt;
mod lsp;
mod say;
mod table_text;

use std::process::ExitCode;

use clap::Parser;

/// Compiling allocates much, on all threads.
#[cfg(not(target_family = "wasm"))]
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    interrupt::listen();
    // A panic is a defect: exit code 3, told apart from a wrong program.
    let outcome = std::panic::catch_unwind(|| cmd::dispatch(cmd::Cli::parse()));
    exit::code(outcome.unwrap_or_else(|_| {
        Err(exit::Failure::Defect(
            "the message above tells where".to_string(),
        ))
    }))
}
