//! Tests that are texts: each file in these directories begins with commands in comments, and ends
//! with what they print.
//!
//! ```text
//! ; test verify                    leading comments: the commands, in the order of the sections
//! ; test run keys=2 x=1,2
//! kernel k @44100 { .. }           the text under test
//! ==== verify                      one section for each command
//! ok
//! ==== run keys=2 x=1,2
//! tick 0 key 0: x=1 -> f=3
//! ```
//!
//! A line of comment below a command that is indented further has more of its words.
//!
//! `WHIPPEN_BLESS=1 cargo test --test filetests` writes the sections anew. A new command is a line
//! of [`COMMANDS`], a new directory one of `directories!`.

mod case;
mod code;
mod kernel;
mod run;
mod table;
mod whip;

use case::Case;
use std::path::{Path, PathBuf};

/// A command: the text under test and the command's words give what is printed. An error fails the
/// test even when blessing.
type Command = fn(&str, &[&str]) -> Result<String, String>;

/// Every command: ending of the file, name, what it does.
const COMMANDS: &[(&str, &str, Command)] = &[
    ("kernel", "print", kernel::print),
    ("kernel", "verify", kernel::verify),
    ("kernel", "strip", kernel::strip),
    ("kernel", "run", run::run),
    ("kernel", "table", table::table),
    ("kernel", "modes", kernel::modes),
    ("kernel", "select", code::select),
    ("kernel", "promote", code::promote),
    ("kernel", "schedule", code::schedule),
    ("kernel", "allocate", code::allocate),
    ("kernel", "reorder", code::reorder),
    ("kernel", "code", code::code),
    ("kernel", "budget", code::budget),
    ("whip", "parse", whip::parse),
    ("whip", "check", whip::check),
    ("whip", "mistake", whip::mistake),
    ("whip", "budget", whip::budget),
    ("whip", "simplify", whip::simplify),
    ("whip", "lower", whip::lower),
];

macro_rules! directories {
    ($( $name:ident $path:literal )*) => {
        const DIRECTORIES: &[&str] = &[ $( $path ),* ];

        $( #[test] fn $name() { directory($path) } )*
    };
}

directories! {
    kernel_text         "kernel/text"
    kernel_verifier     "kernel/verify"
    kernel_operators    "kernel/operators"
    kernel_memory       "kernel/memory"
    kernel_control      "kernel/control"
    kernel_modes        "kernel/modes"
    kernel_select       "kernel/select"
    kernel_promote      "kernel/promote"
    kernel_v6m          "kernel/v6m"
    kernel_schedule     "kernel/schedule"
    kernel_allocate     "kernel/allocate"
    kernel_reorder      "kernel/reorder"
    kernel_code         "kernel/code"
    kernel_budget       "kernel/budget"
    whip_parse          "whip/parse"
    whip_check          "whip/check"
    whip_mistakes       "whip/mistakes"
    whip_simplify       "whip/simplify"
    whip_lower          "whip/lower"
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/filetests")
}

/// Runs all files of a directory and fails with everything that is wrong.
fn directory(path: &str) {
    let mut files: Vec<PathBuf> = entries(&root().join(path))
        .into_iter()
        .filter(|file| file.is_file())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{path} has no files");
    let bless = std::env::var_os("WHIPPEN_BLESS").is_some();
    let failures: Vec<String> = files
        .iter()
        .filter_map(|file| {
            let failure = file_passes(file, bless).err()?;
            Some(format!(
                "{}\n{failure}",
                file.strip_prefix(root()).unwrap_or(file).display()
            ))
        })
        .collect();
    assert!(
        failures.is_empty(),
        "{} of {} files fail\n\n{}",
        failures.len(),
        files.len(),
        failures.join("\n\n")
    );
}

fn file_passes(file: &Path, bless: bool) -> Result<(), String> {
    let ending = file
        .extension()
        .and_then(|ending| ending.to_str())
        .unwrap_or_default();
    let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    let case = Case::read(&text, ending)?;
    let mut sections = Vec::new();
    for line in &case.commands {
        let words: Vec<&str> = line.split_whitespace().collect();
        let found = COMMANDS
            .iter()
            .find(|(of, name, _)| *of == ending && words.first() == Some(name));
        let (.., command) =
            found.ok_or_else(|| format!("no command `{line}` for .{ending} files"))?;
        let printed =
            command(case.body, &words[1..]).map_err(|error| format!("{line}: {error}"))?;
        let title = line.lines().next().unwrap_or_default();
        sections.push((title.to_string(), printed));
    }
    let actual = case.with(&sections);
    if actual == text {
        return Ok(());
    }
    if bless {
        return std::fs::write(file, actual).map_err(|error| error.to_string());
    }
    let diff = similar::TextDiff::from_lines(&text, &actual);
    Err(diff
        .unified_diff()
        .context_radius(3)
        .header("in the file", "printed now")
        .to_string())
}

fn entries(path: &Path) -> Vec<PathBuf> {
    let list =
        std::fs::read_dir(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    list.map(|entry| entry.expect("an entry").path()).collect()
}

#[test]
fn every_directory_is_listed() {
    let kinds = entries(&root()).into_iter().filter(|path| path.is_dir());
    let mut found: Vec<String> = kinds
        .flat_map(|kind| entries(&kind))
        .map(|path| {
            path.strip_prefix(root())
                .expect("inside")
                .to_string_lossy()
                .replace('\\', "/")
        })
        .collect();
    found.sort();
    let mut listed = DIRECTORIES.to_vec();
    listed.sort_unstable();
    assert_eq!(found, listed);
}
