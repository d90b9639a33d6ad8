//! Hardware files: TOML whose values are strings, numbers among them with their units.
//!
//! An unknown key is an error that names the nearest known one; every error names file, line and
//! key. Not here: which keys there are, what they mean.

use std::path::Path;

use toml::de::{DeTable, DeValue};
use whippen_compiler::diag::nearest;

use crate::files::FileError;

/// A key that a file may have, and an example of its value. A `*` stands for any name.
pub(crate) type Known = (&'static str, &'static str);

/// The entries of a file: dotted key, value and line.
pub(crate) struct Entries<'a> {
    path: &'a Path,
    known: &'a [Known],
    list: Vec<(String, String, u64)>,
}

impl<'a> Entries<'a> {
    pub(crate) fn parse(
        path: &'a Path,
        text: &str,
        known: &'a [Known],
    ) -> Result<Entries<'a>, FileError> {
        let line = |at: usize| {
            text.as_bytes()[..at.min(text.len())]
                .iter()
                .filter(|b| **b == b'\n')
                .count() as u64
                + 1
        };
        let table = DeTable::parse(text).map_err(|e| {
            let error = FileError::new(path, e.message());
            e.span()
                .map_or(error.clone(), |span| error.at_line(line(span.start)))
        })?;
        let mut list = Vec::new();
        collect("", table.get_ref(), &mut |key, at, value| {
            let error = |message| Err(FileError::new(path, message).at_line(line(at)));
            let Some((_, example)) = known.iter().find(|(pattern, _)| fits(pattern, &key)) else {
                let hint = nearest(&key, known.iter().map(|k| k.0))
                    .map(|near| format!("; did you mean `{near}`?"));
                return error(format!("unknown key `{key}`{}", hint.unwrap_or_default()));
            };
            let Some(value) = value.as_str() else {
                return error(format!("`{key}` must be a string, such as `\"{example}\"`"));
            };
            list.push((key, value.to_string(), line(at)));
            Ok(())
        })?;
        // Tables come by name.
        list.sort_by_key(|(_, _, line)| *line);
        Ok(Entries { path, known, list })
    }

    /// Every key with its value.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&str, &str)> {
        self.list
            .iter()
            .map(|(key, value, _)| (key.as_str(), value.as_str()))
    }

    /// The value of a key, if it is there.
    pub(crate) fn find(&self, key: &str) -> Option<&str> {
        self.list
            .iter()
            .find(|entry| entry.0 == key)
            .map(|(_, value, _)| value.as_str())
    }

    /// The value of a key.
    pub(crate) fn text(&self, key: &str) -> Result<&str, FileError> {
        self.find(key).ok_or_else(|| {
            let example = self
                .known
                .iter()
                .find(|(pattern, _)| fits(pattern, key))
                .map_or("", |k| k.1);
            FileError::new(
                self.path,
                format!("`{key}` is missing, as in `{key} = \"{example}\"`"),
            )
        })
    }

    /// An error at a key.
    pub(crate) fn error(&self, key: &str, what: &str) -> FileError {
        let error = FileError::new(self.path, format!("`{key}` {what}"));
        let line = self
            .list
            .iter()
            .find(|entry| entry.0 == key)
            .map(|entry| entry.2);
        line.map_or(error.clone(), |line| error.at_line(line))
    }
}

/// Whether a key is one of a pattern.
fn fits(pattern: &str, key: &str) -> bool {
    match pattern.split_once('*') {
        Some((start, end)) => {
            key.len() > start.len() + end.len() && key.starts_with(start) && key.ends_with(end)
        }
        None => pattern == key,
    }
}

/// Visits the values of a table with their dotted keys and places.
fn collect(
    prefix: &str,
    table: &DeTable,
    visit: &mut impl FnMut(String, usize, &DeValue) -> Result<(), FileError>,
) -> Result<(), FileError> {
    for (key, value) in table {
        let name = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => collect(&format!("{name}."), inner, visit)?,
            value => visit(name, key.span().start, value)?,
        }
    }
    Ok(())
}
