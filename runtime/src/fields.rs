//! Fields of a TOML table: texts and lists of texts, with the lines they stand in.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use whippen_compiler::diag::nearest;
use whippen_compiler::units::{Dim, Quantity, parse_quantity};

use crate::files::FileError;

/// A text of a file, and its line.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    pub text: String,
    pub line: u64,
}

/// The text of a file, for the lines of what is wrong.
#[derive(Clone, Copy)]
pub struct FileText<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl FileText<'_> {
    pub fn line(&self, at: usize) -> u64 {
        let before = &self.text.as_bytes()[..at.min(self.text.len())];
        before.iter().filter(|byte| **byte == b'\n').count() as u64 + 1
    }

    pub fn error(&self, line: u64, message: impl Into<String>) -> FileError {
        FileError::new(self.path, message).at_line(line)
    }
}

/// A table with the keys that it may have.
pub struct Fields<'a> {
    pub source: FileText<'a>,
    table: &'a DeTable<'a>,
    /// The line of the table.
    pub line: u64,
    /// What it is called in messages: `[[assert]]`.
    name: &'static str,
}

impl<'a> Fields<'a> {
    /// # Errors
    /// There is a key that is not known.
    pub fn new(
        source: FileText<'a>,
        table: &'a DeTable<'a>,
        line: u64,
        name: &'static str,
        known: &[&str],
    ) -> Result<Fields<'a>, FileError> {
        let unknown = |key: &&Spanned<_>| {
            let key: &std::borrow::Cow<str> = key.get_ref();
            !known.contains(&&**key)
        };
        if let Some(key) = table.keys().find(unknown) {
            let near = nearest(key.get_ref(), known.iter().copied());
            let hint = match near {
                Some(near) => format!("; did you mean `{near}`?"),
                None => format!("; there are {}", known.join(", ")),
            };
            let what = format!("{name} has no `{}`{hint}", key.get_ref());
            return Err(source.error(source.line(key.span().start), what));
        }
        Ok(Fields {
            source,
            table,
            line,
            name,
        })
    }

    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    fn value(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.table.get(key)
    }

    fn line_of(&self, key: &str) -> u64 {
        self.value(key)
            .map_or(self.line, |value| self.source.line(value.span().start))
    }

    /// An error at a key.
    pub fn error(&self, key: &str, message: &str) -> FileError {
        self.source
            .error(self.line_of(key), format!("`{key}` {message}"))
    }

    fn written(&self, key: &str, value: &Spanned<DeValue>) -> Result<Written, FileError> {
        let line = self.source.line(value.span().start);
        let text = value.get_ref().as_str().ok_or_else(|| {
            let what = format!("`{key}` is made of strings, such as \"10 mm\" or \"t1\"");
            self.source.error(line, what)
        })?;
        Ok(Written {
            text: text.to_string(),
            line,
        })
    }

    /// The text of a key, if it is there.
    pub fn find(&self, key: &str) -> Result<Option<Written>, FileError> {
        self.value(key)
            .map(|value| self.written(key, value))
            .transpose()
    }

    /// The text of a key.
    pub fn text(&self, key: &str, example: &str) -> Result<Written, FileError> {
        self.find(key)?.ok_or_else(|| {
            let what = format!("{} needs `{key} = \"{example}\"`", self.name);
            self.source.error(self.line, what)
        })
    }

    /// The whole number of a key, at least 1, if it is there.
    pub fn count(&self, key: &str) -> Result<Option<usize>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let digits = value.get_ref().as_integer().map(|number| number.as_str());
        let count = digits.and_then(|digits| digits.parse().ok());
        let count = count.filter(|count| *count > 0);
        count
            .map(Some)
            .ok_or_else(|| self.error(key, "is a whole number, 1 or more"))
    }

    /// The quantity of a key in whatever dimension (SI), if it is there.
    pub fn any_quantity(&self, key: &str) -> Result<Option<f64>, FileError> {
        let found = self
            .find(key)?
            .map(|written| match quantity(&written.text) {
                Ok((value, _)) => Ok(value),
                Err(why) => Err(self.source.error(written.line, why)),
            });
        found.transpose()
    }

    /// The quantity of a key in a dimension (SI), if it is there.
    pub fn quantity(&self, key: &str, dim: Dim, example: &str) -> Result<Option<f64>, FileError> {
        let Some(written) = self.find(key)? else {
            return Ok(None);
        };
        match quantity(&written.text) {
            Ok((value, found)) if found == dim => Ok(Some(value)),
            Err(why) => Err(self.source.error(written.line, why)),
            Ok(_) => {
                let what = format!("`{}` is of another kind than {example}", written.text);
                Err(self.source.error(written.line, what))
            }
        }
    }

    /// The texts of a key: a list, or one alone; none where it is not there.
    pub fn list(&self, key: &str) -> Result<Vec<Written>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(Vec::new());
        };
        match value.get_ref() {
            DeValue::Array(values) => values.iter().map(|one| self.written(key, one)).collect(),
            _ => Ok(vec![self.written(key, value)?]),
        }
    }

    /// A table inside.
    pub fn table(
        &self,
        key: &str,
        name: &'static str,
        known: &[&str],
    ) -> Result<Option<Fields<'a>>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(None);
        };
        let Some(table) = value.get_ref().as_table() else {
            return Err(self.error(key, &format!("is a table, {name}")));
        };
        Fields::new(self.source, table, self.line_of(key), name, known).map(Some)
    }

    /// The names and texts of a table inside, in the order of their lines.
    pub fn pairs(&self, key: &str, name: &str) -> Result<Vec<(String, Written)>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(Vec::new());
        };
        let Some(table) = value.get_ref().as_table() else {
            return Err(self.error(key, &format!("is a table, {name}")));
        };
        let pair = |(name, value): (&Spanned<_>, &_)| {
            let name: &std::borrow::Cow<str> = name.get_ref();
            Ok((name.to_string(), self.written(name, value)?))
        };
        let mut pairs: Vec<(String, Written)> =
            table.iter().map(pair).collect::<Result<_, FileError>>()?;
        pairs.sort_by_key(|(_, written)| written.line);
        Ok(pairs)
    }

    /// The tables of a table of tables, `[key.name]`, in the order of their lines.
    pub fn named_tables(
        &self,
        key: &str,
        name: &'static str,
        known: &[&str],
    ) -> Result<Vec<(String, Fields<'a>)>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(Vec::new());
        };
        let wrong = || self.error(key, &format!("is a table of tables, {name}"));
        let table = value.get_ref().as_table().ok_or_else(wrong)?;
        let one = |(own, value): (&'a Spanned<_>, &'a Spanned<DeValue<'a>>)| {
            let own: &std::borrow::Cow<str> = own.get_ref();
            let table = value.get_ref().as_table().ok_or_else(wrong)?;
            let line = self.source.line(value.span().start);
            let fields = Fields::new(self.source, table, line, name, known)?;
            Ok((own.to_string(), fields))
        };
        let mut all: Vec<_> = table.iter().map(one).collect::<Result<_, FileError>>()?;
        all.sort_by_key(|(_, fields): &(String, Fields)| fields.line);
        Ok(all)
    }

    /// The tables of a list, `[[key]]`.
    pub fn tables(
        &self,
        key: &str,
        name: &'static str,
        known: &[&str],
    ) -> Result<Vec<Fields<'a>>, FileError> {
        let Some(value) = self.value(key) else {
            return Ok(Vec::new());
        };
        let wrong = || self.error(key, &format!("is a list of tables, {name}"));
        let list = value.get_ref().as_array().ok_or_else(wrong)?;
        let one = |value: &'a Spanned<DeValue<'a>>| {
            let table = value.get_ref().as_table().ok_or_else(wrong)?;
            let line = self.source.line(value.span().start);
            Fields::new(self.source, table, line, name, known)
        };
        list.iter().map(one).collect()
    }
}

/// A quantity of whatever dimension.
///
/// # Errors
/// In words.
pub fn quantity(text: &str) -> Result<(f64, Dim), String> {
    match parse_quantity(text) {
        Ok(Quantity::Real { value, dim }) if value.is_finite() => Ok((value, dim)),
        Ok(_) => Err(format!("`{text}` is no quantity, such as 10 mm")),
        Err(error) => Err(format!("`{text}` is no quantity: {error}")),
    }
}

/// A time (s).
///
/// # Errors
/// In words.
pub fn seconds(text: &str) -> Result<f64, String> {
    match quantity(text)? {
        (value, Dim::TIME) => Ok(value),
        _ => Err(format!("`{text}` is no time, such as 20 ms")),
    }
}
