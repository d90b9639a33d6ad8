//! `whippen lsp`

use crate::exit::Outcome;
use crate::lsp;

#[derive(Debug, clap::Args)]
#[command(after_help = "Editors start it themselves: see docs/tools.md")]
pub struct Args {
    /// Speak over stdin and stdout; there is no other way, and editors may say so
    #[arg(long)]
    stdio: bool,
}

pub fn run(_args: &Args) -> Outcome {
    lsp::serve()
}
