//! The binary `whippen`.

use std::process::ExitCode;

/// Compiling allocates much, on all threads.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ExitCode::from(whippen_command::command(std::env::args_os()))
}
