//! How a command ends.

use std::any::Any;
use std::process::ExitCode;

/// Why a command did not do what it was asked to.
#[derive(Debug)]
pub enum Failure {
    /// The program under test is wrong; what is wrong has been printed.
    Program,
    /// The command line, or a file it names, is wrong.
    Usage(String),
    /// Whippen is wrong.
    Defect(String),
}

/// The result of a command.
pub type Outcome = Result<(), Failure>;

/// Prints what there is to say and gives the exit code: 0 done, 1 program, 2 command line, 3 defect.
pub fn code(outcome: Outcome) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Program) => ExitCode::from(1),
        Err(Failure::Usage(message)) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
        Err(Failure::Defect(message)) => {
            eprintln!("defect in Whippen, please report it: {message}");
            ExitCode::from(3)
        }
    }
}

/// Whether a panic is the one of `print!` whose reader has gone, as in `whippen dump .. | head`: not a defect.
fn nobody_reads(panic: &(dyn Any + Send)) -> bool {
    panic.downcast_ref::<String>().is_some_and(|m| m.starts_with("failed printing to stdout: Broken pipe"))
}

/// Keeps the message of that panic away from the terminal.
pub fn quiet_when_nobody_reads() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !nobody_reads(info.payload()) {
            usual(info);
        }
    }));
}

/// What a panic makes of a command.
pub fn panicked(panic: &(dyn Any + Send)) -> Outcome {
    if nobody_reads(panic) { Ok(()) } else { Err(Failure::Defect("the message above tells where".to_string())) }
}
