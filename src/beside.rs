//! Which files make a program: those that are given, and those beside them that declare what they
//! use. Command line and editor follow this one rule.
//!
//! ```text
//!   given files ─ what they use and do not declare ─> files of their folders that declare it ─> and so on
//! ```
//!
//! A file beside is taken only if it declares something that is missing, nothing that is declared
//! already, and no keyboard, which would be another program. Where several declare what is missing
//! all of them are taken, and the checker says that it is declared twice, and where.
//!
//! Not here: what is wrong with what was found (the checker).

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use whippen_compiler::bundled::STD;
use whippen_compiler::check::function_names;
use whippen_compiler::syntax::ast::{File, Item, Keyboard, Name, Setting, Spanned};
use whippen_compiler::syntax::parse;
use whippen_compiler::syntax::token::{Token, lex};

/// So many files of a folder are looked at.
const FILES_MAX: usize = 200;

/// A file of a program.
#[derive(Debug, Clone)]
pub struct Source {
    /// How it is called: a URI in an editor, a path on the command line.
    pub name: String,
    pub text: String,
}

/// Adds to the given files of a program those beside them that it needs, in the order in which they
/// are asked for.
pub fn complete(mut program: Vec<Source>, beside: impl FnOnce() -> Vec<Source>) -> Vec<Source> {
    let mut wanted = Wanted::default();
    program.iter().for_each(|source| wanted.read(&source.text));
    if wanted.missing().next().is_none() {
        return program;
    }
    let with = |source: Source| (Wanted::of(&source.text), source);
    let mut others: Vec<(Wanted, Source)> = beside().into_iter().map(with).collect();
    others.retain(|(other, _)| !other.has_keyboard && other.declared.is_disjoint(&wanted.declared));
    loop {
        let gives = |name: &String| {
            others
                .iter()
                .any(|(other, _)| other.declared.contains(name))
        };
        let Some(name) = wanted.missing().find(|name| gives(name)).cloned() else {
            return program;
        };
        let (found, rest): (Vec<_>, Vec<_>) = others
            .into_iter()
            .partition(|(other, _)| other.declared.contains(&name));
        for (other, source) in found {
            program.push(source);
            wanted.declared.extend(other.declared);
            wanted.used.extend(other.used);
        }
        others = rest;
        others.retain(|(other, _)| other.declared.is_disjoint(&wanted.declared));
    }
}

/// The programs in a folder, by name, without those that are given.
pub fn programs_in(folder: &Path, given: &[PathBuf]) -> Vec<PathBuf> {
    // The folder of a name alone is here.
    let here = folder.as_os_str().is_empty();
    let listed = if here { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(listed).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| folder.join(entry.file_name()))
        .collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "whip") && !given.contains(p));
    paths.sort();
    paths.truncate(FILES_MAX);
    paths
}

/// What files declare, and what they use: terms and instruments.
#[derive(Debug, Default)]
struct Wanted {
    declared: HashSet<String>,
    used: Vec<String>,
    has_keyboard: bool,
}

impl Wanted {
    fn of(text: &str) -> Wanted {
        let mut wanted = Wanted::default();
        wanted.read(text);
        wanted
    }

    fn read(&mut self, text: &str) {
        self.items(&parse(0, text, &mut Vec::new()));
        // Whatever stands before a bracket may be a term, unless it is told or declared.
        let tokens = lex(0, text, &mut Vec::new()).tokens;
        let calls = tokens.windows(3).filter(|three| {
            three[2].node == Token::LeftParen && !matches!(three[0].node, Token::Emit | Token::Term)
        });
        let names = calls.filter_map(|three| three[1].node.name());
        let terms = names.filter(|name| function_names().all(|function| function != *name));
        self.used.extend(terms.map(str::to_string));
    }

    fn items(&mut self, tree: &File) {
        for item in &tree.items {
            match item {
                Item::Instrument(i) => drop(self.declared.insert(i.name.node.clone())),
                Item::Term(t) => drop(self.declared.insert(t.name.node.clone())),
                Item::Keyboard(k) => self.keyboard(k),
            }
        }
    }

    fn keyboard(&mut self, keyboard: &Keyboard) {
        self.has_keyboard = true;
        let settings = &keyboard.settings;
        let own = |name: &Name| {
            settings
                .iter()
                .any(|s| matches!(s, Setting::Zones { name: zones, .. } if zones.node == name.node))
        };
        let used = settings.iter().flat_map(|setting| match setting {
            Setting::Programs(names) => names.iter().filter(|name| !own(name)).collect(),
            Setting::Zones { zones, .. } => zones.iter().map(|zone| &zone.instrument).collect(),
            Setting::PerKey { instrument, .. } => vec![instrument],
            _ => Vec::new(),
        });
        self.used.extend(used.map(|name| name.node.clone()));
    }

    /// What is used and not declared.
    fn missing(&self) -> impl Iterator<Item = &String> {
        self.used
            .iter()
            .filter(move |name| !self.declared.contains(*name) && !std_terms().contains(*name))
    }
}

/// The instruments that a text declares, in their order.
pub fn instruments(text: &str) -> Vec<String> {
    let items = parse(0, text, &mut Vec::new()).items.into_iter();
    let name = |item| match item {
        Item::Instrument(instrument) => Some(instrument.name.node),
        _ => None,
    };
    items.filter_map(name).collect()
}

/// The files that a text names: of devices and of tables.
pub fn named_files(text: &str) -> Vec<String> {
    let tokens = lex(0, text, &mut Vec::new()).tokens;
    let file = |token: &Spanned<Token>| match token.node {
        Token::Text(file) => Some(file.trim_matches('"').to_string()),
        _ => None,
    };
    tokens.iter().filter_map(file).collect()
}

/// The terms of the standard library.
fn std_terms() -> &'static HashSet<String> {
    static TERMS: OnceLock<HashSet<String>> = OnceLock::new();
    TERMS.get_or_init(|| {
        let mut std = Wanted::default();
        STD.iter()
            .for_each(|(_, text)| std.items(&parse(0, text, &mut Vec::new())));
        std.declared
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(name: &str, text: &str) -> Source {
        let (name, text) = (name.to_string(), text.to_string());
        Source { name, text }
    }

    fn names(given: &str, beside: &[(&str, &str)]) -> Vec<String> {
        let beside = || beside.iter().map(|(n, t)| source(n, t)).collect();
        let program = complete(vec![source("given", given)], beside);
        program.into_iter().map(|source| source.name).collect()
    }

    const USES_A: &str = "instrument i { sense x: length in 0 mm .. 1 mm force f = a(x) }";
    const A: &str = "term a(x: length) -> y: force { y = b(x) }";
    const B: &str = "term b(x: length) -> y: force { y = 1 N/m * x }";

    #[test]
    fn what_is_found_may_need_more_files() {
        let beside = [
            ("a", A),
            ("b", B),
            ("c", "term c(x: length) -> y: length { y = x }"),
        ];
        assert_eq!(names(USES_A, &beside), ["given", "a", "b"]);
        assert_eq!(names(B, &beside), ["given"]);
    }

    #[test]
    fn a_circle_of_files_ends() {
        let a = "term a(x: length) -> y: force { y = b(x) }";
        let b = "term b(x: length) -> y: force { y = a(x) }";
        assert_eq!(names(USES_A, &[("a", a), ("b", b)]), ["given", "a", "b"]);
    }

    #[test]
    fn all_files_that_declare_it_are_taken_and_no_keyboards_and_no_copies() {
        let keyboard = format!("{A} keyboard k {{ }}");
        let copy = format!("{A} {USES_A}");
        let beside = [("a", A), ("again", A), ("k", &*keyboard), ("copy", &*copy)];
        assert_eq!(names(USES_A, &beside), ["given", "a", "again"]);
    }
}
