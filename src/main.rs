//! The binary `whippen`.

use std::process::ExitCode;

/// Compiling allocates much, on all threads.
#[cfg(not(target_family = "wasm"))]
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ExitCode::from(whippen_command::command(std::env::args_os()))
}
