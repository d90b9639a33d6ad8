//! Semihosting: how a program speaks to its host through BKPT 0xAB.
//!
//! The crate does no input or output: what a program prints is gathered here for the caller, and what it may read is put here
//! before. Only the console (`:tt`) can be opened; files answer as if they did not exist.

/// The host's side of the conversation.
#[derive(Clone, Default)]
pub struct Semihosting {
    /// Whether BKPT 0xAB is answered; else it is a breakpoint.
    pub enabled: bool,
    /// What the program wrote to standard output. Take it whenever you like.
    pub output: Vec<u8>,
    /// What it wrote to standard error.
    pub errors: Vec<u8>,
    /// What it has not read yet of standard input.
    pub input: std::collections::VecDeque<u8>,
    /// What SYS_GET_CMDLINE gives.
    pub command_line: String,
}
