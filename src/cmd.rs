//! The subcommands.

mod audit;
mod budget;
mod build;
mod calibration;
mod check;
mod command;
mod completions;
mod count;
mod dump;
mod emulate;
mod errors;
mod experiment;
mod explain;
mod file_plan;
mod fit;
mod fmt;
mod hand;
mod import;
mod json;
mod keys;
mod live;
mod load;
mod lsp;
mod man;
mod measure;
mod monitor;
mod monitor_image;
mod motion;
mod new;
mod numbers;
mod on_board;
mod opened;
mod option;
mod own_firmware;
mod page;
mod point;
mod progress;
pub mod proof;
mod run;
mod settings;
pub mod setup;
mod strings;
#[cfg(not(target_family = "wasm"))]
mod studio;
#[cfg(not(target_family = "wasm"))]
mod study;
mod sweep;
mod tour;
mod tune;
#[cfg(target_family = "wasm")]
mod unseen;
#[cfg(target_family = "wasm")]
mod unwatched;
mod validated;
#[cfg(not(target_family = "wasm"))]
mod watch;

use clap::{Parser, Subcommand};

use crate::exit::Outcome;
#[cfg(target_family = "wasm")]
use unwatched as watch;

/// Touch profiles for force-feedback instruments: written as states, events and force terms, run in
/// fixed point.
#[derive(Debug, Parser)]
#[command(
    name = "whippen",
    version,
    about,
    after_help = "Without a command: the tour. Plays the bundled gesture on every bundled instrument and writes whippen-tour/report.html."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented program to begin with
    New(new::Args),
    /// Read and check a program, and say what is wrong with it
    Check(check::Args),
    /// Move the key of an instrument and record what it does
    Run(Box<run::Args>),
    /// Repeat an experiment: play it, draw its figure, and say whether what it asserts holds
    Experiment(experiment::Args),
    /// Measure a key as a piano technician does: weights, let-off, repetition
    Measure(Box<measure::Args>),
    /// Make a page that plays: one file for any browser
    Page(page::Args),
    /// Make a page to write in: an editor with this compiler inside, one file for any browser
    #[cfg(not(target_family = "wasm"))]
    Studio(studio::Args),
    /// Make the page of a study from its plan, play its sessions again, sum them up
    #[cfg(not(target_family = "wasm"))]
    Study(study::Args),
    /// Measure numbers over a grid of parameters, or over Sobol points
    Sweep(Box<sweep::Args>),
    /// Find values of parameters that fit recordings, and say how well they are known
    Fit(Box<fit::Args>),
    /// Make an instrument of a recording of force over travel
    Import(import::Args),
    /// Tune a sensor's calibration table to readings of a key that went to both ends
    Tune(tune::Args),
    /// Compile an instrument for a microcontroller: files to link, and their bindings
    Build(Box<build::Args>),
    /// Prove that every key's tick is in time, and show where the cycles go
    Budget(Box<budget::Args>),
    /// Check the proof of an image again, from the file alone
    Audit(audit::Args),
    /// Lay out programs in the canonical way; comments stay
    Fmt(fmt::Args),
    /// Show the page of a diagnostic: what it means, the mistake, and its mend
    Explain(explain::Args),
    /// Print an intermediate form of a program
    Dump(dump::Args),
    /// Run a bare-metal image for a Cortex-M, or one function of it, and count its cycles
    Emulate(Box<emulate::Args>),
    /// Watch a board that plays, set its live values, and capture what its keys do in every tick
    Monitor(Box<monitor::Args>),
    /// Serve an editor: diagnostics, hover, completion, definitions, layout
    Lsp(lsp::Args),
    /// Print a script with which a shell completes commands, options and files
    Completions(completions::Args),
    /// Print a manual page, or write all of them
    Man(man::Args),
}

/// Runs what the command line asks for.
pub fn dispatch(cli: Cli) -> Outcome {
    match cli.command {
        None => tour::run(),
        Some(Command::New(args)) => new::run(&args),
        Some(Command::Check(args)) => check::run(&args),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::Experiment(args)) => experiment::run(&args),
        Some(Command::Measure(args)) => measure::run(&args),
        Some(Command::Page(args)) => page::run(&args),
        #[cfg(not(target_family = "wasm"))]
        Some(Command::Studio(args)) => studio::run(&args),
        #[cfg(not(target_family = "wasm"))]
        Some(Command::Study(args)) => study::run(&args),
        Some(Command::Sweep(args)) => sweep::run(&args),
        Some(Command::Fit(args)) => fit::run(&args),
        Some(Command::Import(args)) => import::run(&args),
        Some(Command::Tune(args)) => tune::run(&args),
        Some(Command::Build(args)) => build::run(&args),
        Some(Command::Budget(args)) => budget::run(&args),
        Some(Command::Audit(args)) => audit::run(&args),
        Some(Command::Fmt(args)) => fmt::run(&args),
        Some(Command::Explain(args)) => explain::run(&args),
        Some(Command::Dump(args)) => dump::run(&args),
        Some(Command::Emulate(args)) => emulate::run(&args),
        Some(Command::Monitor(args)) => monitor::run(*args),
        Some(Command::Lsp(args)) => lsp::run(&args),
        Some(Command::Completions(args)) => completions::run(&args),
        Some(Command::Man(args)) => man::run(&args),
    }
}
