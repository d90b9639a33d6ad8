//! `whippen studio`: a page with an editor and the compiler inside.

use std::path::PathBuf;

use clap::ValueHint;
use whippen_runtime::files::{InputKind, read_bytes};
use whippen_runtime::studio;

use super::file_plan::FilePlan;
use super::page;
use crate::exit::{Failure, Outcome};
use crate::say::say;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: runtime/src/studio/build-module && whippen studio --module target/module/whippen.wasm -o studio.html"
)]
pub struct Args {
    /// This command as a WebAssembly module, which `runtime/src/studio/build-module` makes of its
    /// sources (docs/studio.md)
    #[arg(long, value_name = "WHIPPEN.wasm", value_hint = ValueHint::FilePath)]
    module: PathBuf,
    /// The page
    #[arg(short, long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    output: PathBuf,
}

pub fn run(args: &Args) -> Outcome {
    FilePlan::default()
        .reads([&args.module])
        .writes("--output", &Some(args.output.clone()), &["html"])
        .check()?;
    let usage = |error: String| Failure::Usage(error);
    let module = read_bytes(&args.module, InputKind::MODULE).map_err(|e| usage(e.to_string()))?;
    let (file, text) = studio::first();
    let first = page::of_text(file, text, studio::PLAYABLE)?;
    let html = studio::page(&module, &first.html).map_err(|why| {
        usage(format!(
            "`{}` is not the command: {why}",
            args.module.display()
        ))
    })?;
    studio::save(&html, &args.output).map_err(|e| usage(e.to_string()))?;
    say!(
        "{}: {} bytes; open it in a browser",
        args.output.display(),
        html.len()
    );
    Ok(())
}
