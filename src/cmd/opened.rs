//! The files of one program on the command line, read once: those that are given, and those beside
//! them that it needs.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use whippen_runtime::files::same_file;

use super::load;
use crate::beside::{self, Source};
use crate::device;
use crate::exit::Failure;
use crate::say::tell;

/// A program's files, and the name of an instrument if one was given.
pub struct Opened<'w> {
    /// Names and texts, those that were given first.
    pub sources: Vec<(String, String)>,
    pub name: Option<&'w str>,
    /// The files themselves, and the files of devices and tables that they name.
    paths: Vec<PathBuf>,
}

impl<'w> Opened<'w> {
    /// Reads `FILE.. [INSTRUMENT]`.
    ///
    /// # Errors
    /// A file cannot be read, or is given twice.
    pub fn words(words: &'w [OsString]) -> Result<Opened<'w>, Failure> {
        let (files, name) = load::split(words)?;
        Ok(Opened {
            name,
            ..Opened::files(&files)?
        })
    }

    /// Reads files.
    ///
    /// # Errors
    /// As [`Opened::words`].
    pub fn files(given: &[PathBuf]) -> Result<Opened<'w>, Failure> {
        given_once(given)?;
        let source = |(name, text)| Source { name, text };
        let read: Vec<Source> = load::read(given)?.into_iter().map(source).collect();
        let others = || {
            let found = folders(given).into_iter().flat_map(|folder| {
                let mut found = beside::programs_in(&folder, &[]);
                found.retain(|path| given.iter().all(|own| !same_file(own, path)));
                found
            });
            // What cannot be read declares nothing.
            let texts = found.filter_map(|path| load::read(&[path]).ok());
            texts.flatten().map(source).collect()
        };
        let program = beside::complete(read, others);
        let found = program[given.len()..]
            .iter()
            .map(|source| PathBuf::from(&source.name));
        let found: Vec<PathBuf> = found.collect();
        if !found.is_empty() {
            let names: Vec<String> = found
                .iter()
                .map(|path| path.display().to_string())
                .collect();
            tell!(
                "note: with {}, which declare what is used",
                names.join(", ")
            );
        }
        let named = program.iter().flat_map(|source| {
            let folder = device::folder_of(&source.name).unwrap_or_default();
            let files = beside::named_files(&source.text);
            files.into_iter().map(move |file| folder.join(file))
        });
        let paths = given.iter().cloned().chain(found).chain(named).collect();
        let sources = program.into_iter().map(|source| (source.name, source.text));
        Ok(Opened {
            paths,
            name: None,
            sources: sources.collect(),
        })
    }

    /// All files that are read.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.paths.iter()
    }
}

/// That no file is given twice, under whatever names.
fn given_once(files: &[PathBuf]) -> Result<(), Failure> {
    for (number, file) in files.iter().enumerate() {
        let earlier = files[..number]
            .iter()
            .find(|earlier| same_file(earlier, file));
        if let Some(earlier) = earlier {
            let other_name = if earlier == file {
                String::new()
            } else {
                format!(" (as `{}`)", earlier.display())
            };
            return Err(Failure::Usage(format!(
                "`{}` is given twice{other_name}; give each file of the program once",
                file.display()
            )));
        }
    }
    Ok(())
}

/// The folders of files, each once.
fn folders(files: &[PathBuf]) -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = Vec::new();
    for file in files {
        let folder = file.parent().unwrap_or(Path::new(""));
        // What is no plain file, such as a pipe, stands beside nothing.
        if file.is_file() && !folders.iter().any(|known| known == folder) {
            folders.push(folder.to_path_buf());
        }
    }
    folders
}
