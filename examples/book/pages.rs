//! The files of the book: documents with links into the studio, and what they lead to.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use super::{address, parts};

/// The studio, at the root of the book.
pub const STUDIO: &str = "studio.html";

/// What mdBook reads first. A chapter that is missing is an error, not an empty page; without
/// preprocessors a README keeps the name that links tell; punctuation stays as it is written.
const SETTINGS: &str = r#"[book]
title = "Whippen"
description = "Force-feedback instruments: states, events and force terms, compiled to fixed point"
language = "en"

[build]
create-missing = false
use-default-preprocessors = false

[output.html]
smart-punctuation = false

[output.html.fold]
enable = true
"#;

/// The sources of a book.
#[derive(Debug, Default)]
pub struct Book {
    /// Bytes by path, with `/`, below the folder of the book.
    pub files: BTreeMap<String, Vec<u8>>,
    /// Documents among them.
    pub documents: usize,
    /// Links into the studio.
    pub programs: usize,
}

/// Every document of the repository, by path.
///
/// # Errors
/// A folder or a document cannot be read.
pub fn documents(root: &Path) -> Result<BTreeMap<String, String>, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let at = root.join(&folder);
        let entries = fs::read_dir(&at).map_err(|e| format!("{}: {e}", at.display()))?;
        for entry in entries {
            let name = entry.map_err(|e| e.to_string())?.file_name();
            let path = folder.join(&name);
            let name = name.to_string_lossy();
            // What Git, builds and packages of npm leave there is not ours.
            let ours = !name.starts_with('.') && !["target", "node_modules"].contains(&&*name);
            if ours && root.join(&path).is_dir() {
                folders.push(path);
            } else if ours && name.ends_with(".md") {
                let text = read(root, &slashed(&path))?;
                let text = String::from_utf8(text).map_err(|e| format!("{name}: {e}"))?;
                found.insert(slashed(&path), text);
            }
        }
    }
    Ok(found)
}

fn read(root: &Path, path: &str) -> Result<Vec<u8>, String> {
    fs::read(root.join(path)).map_err(|e| format!("{path}: {e}"))
}

fn slashed(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// Makes the book; with links into the studio where it has one.
///
/// # Errors
/// A document is in no part of the book, or a link leads nowhere, in words.
pub fn book(root: &Path, has_studio: bool) -> Result<Book, String> {
    let documents = documents(root)?;
    let mut book = Book {
        documents: documents.len(),
        ..Book::default()
    };
    let mut add = |path: &str, bytes| book.files.insert(path.to_string(), bytes);
    add("book.toml", SETTINGS.as_bytes().to_vec());
    add("src/SUMMARY.md", parts::summary(&documents)?.into_bytes());
    for (path, text) in &documents {
        let others = links(text).map(|link| leads_to(path, link));
        for other in others.filter(|other| !documents.contains_key(other)) {
            add(&format!("src/{other}"), read(root, &other)?);
        }
        let mut page = Page {
            root,
            path,
            text: String::new(),
            programs: 0,
        };
        if has_studio {
            page.write(text);
        } else {
            page.text.push_str(text);
        }
        add(&format!("src/{path}"), page.text.into_bytes());
        book.programs += page.programs;
    }
    Ok(book)
}

/// The files that `[text](file)` leads to, as they are written.
pub fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1);
    let targets = targets.filter_map(|rest| rest.split([')', '#', ' ']).next());
    targets.filter(|target| !target.is_empty() && !target.contains(':'))
}

/// Where a link of a document leads, from the root.
pub fn leads_to(document: &str, link: &str) -> String {
    let mut found = PathBuf::new();
    let folder = Path::new(document).parent().unwrap_or(Path::new(""));
    for part in folder.join(link).components() {
        match part {
            Component::ParentDir => drop(found.pop()),
            part => found.push(part),
        }
    }
    slashed(&found)
}

/// The name in backquotes that a program is saved under, in the line before it.
fn file_name(line: &str) -> Option<&str> {
    let mut quoted = line.split('`').skip(1).step_by(2);
    quoted.find(|name| name.ends_with(".whip") && !name.contains(['/', ' ']))
}

/// A document that is written with its links into the studio.
struct Page<'a> {
    root: &'a Path,
    path: &'a str,
    text: String,
    programs: usize,
}

impl Page<'_> {
    fn write(&mut self, text: &str) {
        let (mut before, mut block) = ("", None::<(bool, String)>);
        for line in text.lines() {
            let fence = line.strip_prefix("```");
            match (&mut block, fence) {
                (None, None) => self.prose(line),
                (None, Some(kind)) => {
                    block = Some((kind == "whip", String::new()));
                    self.line(line);
                }
                (Some((_, program)), None) => {
                    program.push_str(line);
                    program.push('\n');
                    self.line(line);
                }
                (Some(_), Some(_)) => {
                    self.line(line);
                    let (is_program, program) = block.take().expect("it is open");
                    self.program(is_program.then_some(&program), before);
                }
            }
            if block.is_none() && !line.is_empty() {
                before = line;
            }
        }
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// The address of a program in the studio, seen from this document; none of what does not open
    /// there.
    fn studio(&mut self, file: &str, program: &str) -> Option<String> {
        if !address::opens(file, program) {
            return None;
        }
        self.programs += 1;
        let up = "../".repeat(self.path.matches('/').count());
        Some(format!("{up}{STUDIO}#{}", address::of(file, program)))
    }

    /// What stands behind a block that is a program.
    fn program(&mut self, program: Option<&String>, before: &str) {
        let stem = self.path.rsplit('/').next().unwrap_or_default();
        let stem = format!("{}.whip", stem.trim_end_matches(".md"));
        let file = file_name(before).unwrap_or(&stem);
        if let Some(link) = program.and_then(|program| self.studio(file, program)) {
            self.line(&format!("\n[Open in the studio]({link})"));
        }
    }

    /// A line with a link behind each that leads to a program.
    fn prose(&mut self, line: &str) {
        let mut parts = line.split("](");
        let mut linked = parts.next().unwrap_or_default().to_string();
        for part in parts {
            let target = part.split(')').next().unwrap_or_default();
            let (target, rest) = part.split_at((target.len() + 1).min(part.len()));
            linked.push_str(&format!("]({target}"));
            let target = target.trim_end_matches(')');
            if target.ends_with(".whip") {
                let leads_to = leads_to(self.path, target);
                let text = fs::read_to_string(self.root.join(&leads_to)).unwrap_or_default();
                let file = leads_to.rsplit('/').next().unwrap_or_default();
                if let Some(link) = self.studio(file, &text) {
                    linked.push_str(&format!(" ([studio]({link}))"));
                }
            }
            linked.push_str(rest);
        }
        self.line(&linked);
    }
}
