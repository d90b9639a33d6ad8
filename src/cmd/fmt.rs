//! `whippen fmt`

use std::path::{Path, PathBuf};

use clap::ValueHint;
use similar::TextDiff;
use whippen_compiler::diag::Severity;
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::layout;
use whippen_runtime::files::{InputKind, read_stdin, write_whole};

use super::load;
use crate::exit::{Failure, Outcome};
use crate::say;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen fmt --check instruments/*.whip")]
pub struct Args {
    /// The files to lay out anew, in place; - reads the text from stdin and writes it to stdout
    #[arg(required = true, value_name = "FILE", value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,
    /// Write nothing: print what would change, and exit with 1 if anything would
    #[arg(long)]
    check: bool,
}

/// What stands for stdin and stdout.
const STDIN: &str = "-";

pub fn run(args: &Args) -> Outcome {
    let texts = args.files.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let mut outcome = Ok(());
    // A file that cannot be read as a program keeps none of the others from being laid out.
    for (path, text) in args.files.iter().zip(texts) {
        match one(path, &text, args.check) {
            Err(Failure::Program) => outcome = Err(Failure::Program),
            other => other?,
        }
    }
    outcome
}

fn read(path: &PathBuf) -> Result<String, Failure> {
    if path.as_os_str() != STDIN {
        return load::read(std::slice::from_ref(path)).map(|mut texts| texts.remove(0).1);
    }
    read_stdin(InputKind::PROGRAM)
        .map_err(|why| Failure::Usage(format!("cannot read stdin: {why}")))
}

fn one(path: &Path, text: &str, check: bool) -> Outcome {
    let stdin = path.as_os_str() == STDIN;
    let name = if stdin {
        "<stdin>".to_string()
    } else {
        path.display().to_string()
    };
    let laid = layout(0, text).map_err(|diagnostics| {
        let mut map = SourceMap::default();
        map.add(&name, text);
        load::print(&map, &diagnostics, Severity::Note);
        Failure::Program
    })?;
    match (check, stdin) {
        (true, _) if laid == text => {}
        (true, _) => {
            let diff = TextDiff::from_lines(text, &laid);
            say::whole(
                &diff
                    .unified_diff()
                    .header(&name, "as laid out by whippen fmt")
                    .to_string(),
            );
            return Err(Failure::Program);
        }
        (false, true) => say::whole(&laid),
        (false, false) if laid == text => {}
        (false, false) => {
            write_whole(path, |file| file.write_all(laid.as_bytes()))
                .map_err(|e| Failure::Usage(e.to_string()))?;
        }
    }
    Ok(())
}
