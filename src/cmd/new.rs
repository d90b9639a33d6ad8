//! `whippen new`: a program to begin with, the commented starter or a bundled one.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS};
use whippen_compiler::syntax::ast::{DeclKind, File, Item};
use whippen_compiler::syntax::parse;
use whippen_compiler::syntax::token::HARD_KEYWORDS;
use whippen_runtime::files::write_whole;

use crate::beside::{self, Source};
use crate::exit::{Failure, Outcome};
use crate::say::say;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen new clavichord\n\
                  Example: whippen new my_knob --like knob")]
pub struct Args {
    /// Name of the instrument; its file is NAME.whip, here
    name: String,
    /// Begin with a copy of a bundled program, with all that it uses
    #[arg(long, value_name = "BUNDLED", value_parser = bundled_names())]
    like: Option<String>,
}

/// Names of bundled instruments and keyboards, as their files have them.
fn bundled_names() -> PossibleValuesParser {
    let all = INSTRUMENTS.iter().chain(KEYBOARDS);
    PossibleValuesParser::new(all.map(|(file, _)| stem(file)))
}

/// A file's name without its ending.
fn stem(file: &'static str) -> &'static str {
    file.trim_end_matches(".whip")
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
    let Copy {
        text,
        plays,
        sounds,
    } = match &args.like {
        Some(bundled) => copy(bundled, name),
        None => Copy {
            text: STARTER.replace(PLACEHOLDER, name),
            plays: None,
            sounds: false,
        },
    };
    write_whole(&path, |file| file.write_all(text.as_bytes()))
        .map_err(|e| Failure::Usage(e.to_string()))?;
    say!("wrote {file}; next:");
    say!("  whippen check {file} --numbers");
    let plays = plays.map_or(String::new(), |instrument| format!(" {instrument}"));
    let out = if sounds {
        format!(" --out {name}.wav")
    } else {
        String::new()
    };
    say!("  whippen run {file}{plays}{out} --plot {name}.png --watch");
    Ok(())
}

/// A program to be written.
struct Copy {
    text: String,
    /// The instrument to run, where there are several.
    plays: Option<String>,
    /// Whether there is something to be heard.
    sounds: bool,
}

/// A bundled program, whose instrument or keyboard gets the name. A keyboard has the instruments
/// that it plays behind it.
fn copy(bundled: &str, name: &str) -> Copy {
    let source = |(file, text): &(&'static str, &str)| Source {
        name: stem(file).to_string(),
        text: (*text).to_string(),
    };
    let all = INSTRUMENTS.iter().chain(KEYBOARDS);
    let wanted = all.map(source).filter(|source| source.name == bundled);
    let program = beside::complete(wanted.collect(), || {
        INSTRUMENTS.iter().map(source).collect()
    });
    let trees = program
        .iter()
        .map(|source| parse(0, &source.text, &mut Vec::new()));
    let trees: Vec<File> = trees.collect();
    let mut texts: Vec<String> = program.into_iter().map(|source| source.text).collect();
    if let (Some(tree), Some(text)) = (trees.first(), texts.first_mut()) {
        rename(text, tree, name);
    }
    let instrument = |item: &Item| match item {
        Item::Instrument(instrument) => Some(instrument.name.node.clone()),
        Item::Term(_) | Item::Keyboard(_) => None,
    };
    let mut instruments = trees[1..]
        .iter()
        .flat_map(|tree| &tree.items)
        .filter_map(instrument);
    Copy {
        text: format!(
            "// Begun as a copy of Whippen's {bundled}.whip; instruments/{bundled}.md says where its numbers come from.\n\n{}",
            texts.join("\n")
        ),
        plays: instruments.next(),
        sounds: trees.first().is_some_and(sounds),
    }
}

/// Whether an instrument of a file has a `sound`.
fn sounds(tree: &File) -> bool {
    tree.items.iter().any(|item| match item {
        Item::Instrument(instrument) => {
            let mut declared = instrument.decls.iter();
            declared.any(|declaration| matches!(declaration.kind, DeclKind::Sound { .. }))
        }
        Item::Term(_) | Item::Keyboard(_) => false,
    })
}

/// Gives the instrument or keyboard that a file is about, its last item, another name.
fn rename(text: &mut String, tree: &File, name: &str) {
    let place = tree.items.last().map(|item| match item {
        Item::Instrument(item) => item.name.span,
        Item::Keyboard(item) => item.name.span,
        Item::Term(item) => item.name.span,
    });
    if let Some(place) = place {
        text.replace_range(place.start as usize..place.end as usize, name);
    }
}

pub fn is_name(text: &str) -> bool {
    let letters = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    letters
        && !text.is_empty()
        && !text.starts_with(|c: char| c.is_ascii_digit())
        && !HARD_KEYWORDS.contains(&text)
}

/// The name that was probably meant: the last part of a path, without its ending, in letters that
/// may be used.
pub fn suggestion(text: &str) -> Option<String> {
    let last = text.rsplit(['/', '\\']).find(|part| !part.is_empty())?;
    let stem = last.strip_suffix(".whip").unwrap_or(last);
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let plain: String = stem.chars().map(allowed).collect();
    let plain = plain.trim_matches('_');
    [plain.to_string(), format!("my_{plain}")]
        .into_iter()
        .find(|name| !plain.is_empty() && is_name(name))
}
