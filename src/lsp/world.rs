//! Open documents, the files beside them, and which of them make a program.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use whippen_compiler::bundled::STD;
use whippen_compiler::syntax::ast::{File, Item, Keyboard, Name, Setting};
use whippen_compiler::syntax::parse;
use whippen_compiler::syntax::token::{Token, lex};
use whippen_runtime::files::{InputKind, read_text, write_whole};

use super::uri;

/// So many files of a folder are looked at.
const FILES_MAX: usize = 200;

/// An open document.
#[derive(Debug)]
pub struct Document {
    pub text: String,
    pub version: i32,
}

/// A file of a program.
#[derive(Debug, Clone)]
pub struct Source {
    pub uri: String,
    pub text: String,
}

/// What the editor has open, by URI.
#[derive(Debug, Default)]
pub struct World {
    pub open: BTreeMap<String, Document>,
}

impl World {
    /// The program of an open document: itself first, then the files of its folder that declare
    /// what it uses and does not declare. What is open counts as it is in the editor.
    pub fn program(&self, of: &str) -> Vec<Source> {
        let Some(document) = self.open.get(of) else {
            return Vec::new();
        };
        let mut program = vec![Source {
            uri: of.to_string(),
            text: document.text.clone(),
        }];
        let mut wanted = Wanted::of(&document.text);
        if wanted.missing().next().is_none() {
            return program;
        }
        let with = |source: Source| (Wanted::of(&source.text), source);
        let mut beside: Vec<(Wanted, Source)> = self.beside(of).into_iter().map(with).collect();
        loop {
            let gives = |other: &Wanted| wanted.missing().any(|name| other.declared.contains(name));
            let clashes = |other: &Wanted| {
                other
                    .declared
                    .iter()
                    .any(|name| wanted.declared.contains(name))
            };
            let Some(at) = beside
                .iter()
                .position(|(other, _)| gives(other) && !clashes(other))
            else {
                return program;
            };
            let (other, source) = beside.remove(at);
            program.push(source);
            wanted.declared.extend(other.declared);
            wanted.used.extend(other.used);
        }
    }

    /// The other programs in the folder of a document.
    fn beside(&self, of: &str) -> Vec<Source> {
        let Some(path) = uri::path(of) else {
            return Vec::new();
        };
        let entries = path
            .parent()
            .and_then(|folder| std::fs::read_dir(folder).ok());
        let mut paths: Vec<PathBuf> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .collect();
        paths.retain(|p| p.extension().is_some_and(|e| e == "whip") && *p != path);
        paths.sort();
        paths.truncate(FILES_MAX);
        paths.iter().filter_map(|path| self.source(path)).collect()
    }

    /// A file as the editor has it, or else as it is on the disk.
    fn source(&self, path: &Path) -> Option<Source> {
        let open: HashMap<PathBuf, &String> = self
            .open
            .keys()
            .filter_map(|u| Some((uri::path(u)?, u)))
            .collect();
        match open.get(path) {
            Some(uri) => Some(Source {
                uri: (*uri).clone(),
                text: self.open[*uri].text.clone(),
            }),
            None => Some(Source {
                uri: uri::of(path),
                text: read_text(path, InputKind::PROGRAM).ok()?,
            }),
        }
    }
}

/// What a file declares, and what it uses: terms and instruments.
#[derive(Debug, Default)]
struct Wanted {
    declared: HashSet<String>,
    used: Vec<String>,
}

impl Wanted {
    fn of(text: &str) -> Wanted {
        let tree = parse(0, text, &mut Vec::new());
        let mut wanted = Wanted::default();
        wanted.items(&tree);
        // Whatever stands before a bracket may be a term.
        let tokens = lex(0, text, &mut Vec::new()).tokens;
        let calls = tokens
            .windows(2)
            .filter(|pair| pair[1].node == Token::LeftParen);
        wanted.used.extend(
            calls
                .filter_map(|pair| pair[0].node.name())
                .map(str::to_string),
        );
        wanted
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

/// Whether a text has nothing but a term of the standard library in it, unchanged.
pub fn is_std(text: &str) -> bool {
    STD.iter().any(|(_, std)| *std == text)
}

/// A file of the standard library on the disk, for editors to open: in the user's own cache,
/// written once per version, not to be changed. There is none where that cache is not known.
pub fn std_file(name: &str) -> Option<String> {
    let (_, text) = STD.iter().find(|(file, _)| *file == name)?;
    let version = format!("std-{}", env!("CARGO_PKG_VERSION"));
    let folder = user_cache()?.join("whippen").join(version);
    let path = folder.join(name.trim_matches(['<', '>']).rsplit('/').next()?);
    if read_text(&path, InputKind::PROGRAM).ok().as_deref() != Some(*text) {
        std::fs::create_dir_all(&folder).ok()?;
        // One of another build is read-only, and is not written over.
        let _ = std::fs::remove_file(&path);
        write_whole(&path, |file| file.write_all(text.as_bytes())).ok()?;
        let mut permissions = std::fs::metadata(&path).ok()?.permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).ok()?;
    }
    Some(uri::of(&path))
}

/// The folder for what can be made again, which is the user's alone.
fn user_cache() -> Option<PathBuf> {
    let folder = |name: &str| {
        let path = PathBuf::from(std::env::var_os(name)?);
        path.is_absolute().then_some(path)
    };
    folder("XDG_CACHE_HOME")
        .or_else(|| folder("LOCALAPPDATA"))
        .or_else(|| folder("HOME").map(|home| home.join(".cache")))
}
