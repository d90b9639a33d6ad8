//! How a command ends.

use crate::say::{self, tell};

/// The exit code of a command that was interrupted, as shells count a Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// Why a command did not do what it was asked to.
#[derive(Debug)]
pub enum Failure {
    /// The program under test is wrong; what is wrong has been printed.
    Program,
    /// The program under test does not fit its board.
    Full(String),
    /// The command line, or a file it names, is wrong.
    Usage(String),
    /// Somebody ended it early; what was done is kept, and has been told.
    Interrupted,
    /// Whippen is wrong.
    Defect(String),
}

/// The result of a command.
pub type Outcome = Result<(), Failure>;

/// Prints what there is to say and gives the exit code: 0 done, 1 program, 2 command line, 3
/// defect, 130 interrupted.
pub fn code(outcome: Outcome) -> u8 {
    let outcome = outcome.and_then(|()| match say::lost() {
        None => Ok(()),
        Some(why) => Err(Failure::Usage(format!("cannot write to stdout: {why}"))),
    });
    match outcome {
        Ok(()) => 0,
        Err(Failure::Program) => 1,
        Err(Failure::Full(message)) => {
            tell!("error: {message}");
            1
        }
        Err(Failure::Usage(message)) => {
            tell!("error: {message}");
            2
        }
        Err(Failure::Interrupted) => INTERRUPTED,
        Err(Failure::Defect(message)) => {
            tell!("defect in Whippen, please report it: {message}");
            3
        }
    }
}
