//! `whippen new`: a program to begin with.

use std::path::PathBuf;

use whippen_compiler::syntax::token::HARD_KEYWORDS;
use whippen_runtime::files::write_whole;

use crate::exit::{Failure, Outcome};
use crate::say::say;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen new clavichord")]
pub struct Args {
    /// Name of the instrument; its file is NAME.whip, here
    name: String,
}

/// The program, which calls itself [`PLACEHOLDER`].
const STARTER: &str = include_str!("new/starter.whip");
const PLACEHOLDER: &str = "starter";

pub fn run(args: &Args) -> Outcome {
    let name = &args.name;
    if !is_name(name) {
        let so = suggestion(name).map_or(String::new(), |s| format!("; try `whippen new {s}`"));
        let rule = "a name is made of the letters `A` to `Z`, digits and `_`, begins with no digit, and is no keyword";
        return Err(Failure::Usage(format!(
            "`{name}` cannot be the name of an instrument: {rule}{so}"
        )));
    }
    let file = format!("{name}.whip");
    let path = PathBuf::from(&file);
    if path.symlink_metadata().is_ok() {
        return Err(Failure::Usage(format!(
            "`{file}` exists already; choose another name, or move it away"
        )));
    }
    let text = STARTER.replace(PLACEHOLDER, name);
    write_whole(&path, |file| file.write_all(text.as_bytes()))
        .map_err(|e| Failure::Usage(e.to_string()))?;
    say!("wrote {file}; next:");
    say!("  whippen check {file} --numbers");
    say!("  whippen run {file} --plot {name}.png --watch");
    Ok(())
}

fn is_name(text: &str) -> bool {
    let letters = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    letters
        && !text.is_empty()
        && !text.starts_with(|c: char| c.is_ascii_digit())
        && !HARD_KEYWORDS.contains(&text)
}

/// The name that was probably meant: the last part of a path, without its ending, in letters that
/// may be used.
fn suggestion(text: &str) -> Option<String> {
    let last = text.rsplit(['/', '\\']).find(|part| !part.is_empty())?;
    let stem = last.strip_suffix(".whip").unwrap_or(last);
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let plain: String = stem.chars().map(allowed).collect();
    let plain = plain.trim_matches('_');
    [plain.to_string(), format!("my_{plain}")]
        .into_iter()
        .find(|name| !plain.is_empty() && is_name(name))
}
