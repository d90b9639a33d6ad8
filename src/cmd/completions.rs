//! `whippen completions`

use clap::CommandFactory;
use clap_complete::Shell;

use super::Cli;
use crate::exit::Outcome;
use crate::say;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen completions bash > ~/.local/share/bash-completion/completions/whippen"
)]
pub struct Args {
    /// The shell that is to complete commands, options and files
    shell: Shell,
}

pub fn run(args: &Args) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "whippen", &mut script);
    say::whole(&String::from_utf8_lossy(&script));
    Ok(())
}
