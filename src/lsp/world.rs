//! Open documents, the files beside them, and which of them make a program.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use whippen_compiler::bundled::STD;
use whippen_runtime::files::{InputKind, read_text, write_whole};

use super::uri;
use crate::beside::{self, Source};

/// An open document.
#[derive(Debug)]
pub struct Document {
    pub text: String,
    pub version: i32,
}

/// What the editor has open, by URI.
#[derive(Debug, Default)]
pub struct World {
    pub open: BTreeMap<String, Document>,
}

impl World {
    /// The program of an open document, itself first. What is open counts as it is in the editor.
    pub fn program(&self, of: &str) -> Vec<Source> {
        let Some(document) = self.open.get(of) else {
            return Vec::new();
        };
        let given = Source {
            name: of.to_string(),
            text: document.text.clone(),
        };
        beside::complete(vec![given], || self.beside(of))
    }

    /// The other programs in the folder of a document.
    fn beside(&self, of: &str) -> Vec<Source> {
        let Some(path) = uri::path(of) else {
            return Vec::new();
        };
        let folder = path.parent().unwrap_or(&path);
        let paths = beside::programs_in(folder, std::slice::from_ref(&path));
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
                name: (*uri).clone(),
                text: self.open[*uri].text.clone(),
            }),
            None => Some(Source {
                name: uri::of(path),
                text: read_text(path, InputKind::PROGRAM).ok()?,
            }),
        }
    }
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
