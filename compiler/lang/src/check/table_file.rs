//! Files that tables are read from: columns with their units in their titles, such as
//! `x_mm,force_gf`.
//!
//! A table takes the only column in units of what it is over and the only column in units of its
//! values; other columns may stand beside them.
//!
//! Not here: the disk ([`FileReader`] is the caller's), and whether knots rise (`table`).

use std::collections::HashMap;
use std::fmt;

use super::titled_text::TitledText;
use crate::model::table::Table;
use crate::syntax::ast::{Decl, DeclKind, File, Item, Knots};
use crate::units::{Dim, Unit, split_title};

/// How the caller reads the file that a program names: from the program's name and the file's.
#[derive(Clone, Copy)]
pub struct FileReader(pub fn(&str, &str) -> Result<String, String>);

impl Default for FileReader {
    fn default() -> FileReader {
        FileReader(|_, _| Err("there are no files here".to_string()))
    }
}

impl fmt::Debug for FileReader {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("FileReader")
    }
}

/// The text of each file by the program's number and the file's name, or why there is none.
pub type TableFiles = HashMap<(u32, String), Result<String, String>>;

/// Reads what the tables of a program name.
pub fn read<'a>(files: &[File], reader: &FileReader, name: impl Fn(u32) -> &'a str) -> TableFiles {
    let mut found = TableFiles::new();
    let mut open: Vec<&Decl> = Vec::new();
    for item in files.iter().flat_map(|file| &file.items) {
        match item {
            Item::Instrument(instrument) => open.extend(&instrument.decls),
            Item::Term(term) => open.extend(&term.decls),
            Item::Keyboard(_) => {}
        }
    }
    while let Some(decl) = open.pop() {
        match &decl.kind {
            DeclKind::Bank { decls, .. } => open.extend(decls),
            DeclKind::Table {
                knots: Knots::File(file),
                ..
            } => {
                let key = (file.span.file, file.node.clone());
                let text = || (reader.0)(name(file.span.file), &file.node);
                found.entry(key).or_insert_with(text);
            }
            _ => {}
        }
    }
    found
}

/// A row: its line, where, what.
pub type FileRow = (usize, f64, f64);

/// The rows of a file in SI, in its order.
///
/// # Errors
/// What is wrong with it, in words that go on from its name.
pub fn rows(text: &str, over: Dim, dim: Dim) -> Result<Vec<FileRow>, String> {
    let text = TitledText::of(text)?;
    let (x, y) = (column(&text, over, None)?, column(&text, dim, Some(over))?);
    if x.0 == y.0 {
        return Err(format!("has only one column, `{}`", text.titles[x.0]));
    }
    let mut rows = Vec::new();
    for (line, cells) in text.rows() {
        let number = |(column, unit): (usize, Unit)| match cells.get(column) {
            None => Err(format!("line {line} has {} cells only", cells.len())),
            Some(text) => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(unit.to_si(number)),
                _ => Err(format!("line {line}: `{text}` is no number")),
            },
        };
        rows.push((line, number(x)?, number(y)?));
        if rows.len() > Table::KNOTS_MAX {
            return Err(format!("has more than {} rows", Table::KNOTS_MAX));
        }
    }
    Ok(rows)
}

/// The only column with a unit of a dimension, and its unit. Of two that are
/// alike the first is what the table is over.
fn column(text: &TitledText, dim: Dim, over: Option<Dim>) -> Result<(usize, Unit), String> {
    let fits = |title: &str| match split_title(title).1 {
        Some(unit) if unit.dim == dim => Some(unit),
        None if dim.is_number() => Some(Unit::ONE),
        _ => None,
    };
    let titles = &text.titles;
    let all = titles.iter().enumerate();
    let mut found = all.filter_map(|(at, title)| Some((at, fits(title)?)));
    let first = found.next();
    let second = found.next();
    let wanted = match dim.is_number() {
        true => "a plain number".to_string(),
        false => format!(
            "a unit such as `{}`",
            crate::units::unit_suffix(&dim.unit())
        ),
    };
    let shown = text.shown_titles();
    match (first, second) {
        // Of two columns alike the table is over the first.
        (Some(first), Some(_)) if titles.len() == 2 && over != Some(dim) => Ok(first),
        (Some(_), Some(second)) if titles.len() == 2 => Ok(second),
        (Some(_), Some(_)) => Err(format!(
            "has several columns with {wanted}: {shown}; leave one"
        )),
        (Some(only), None) => Ok(only),
        (None, _) => Err(format!(
            "has no column with {wanted}: its titles are {shown}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::rows;
    use crate::units::Dim;

    #[test]
    fn columns_are_found_by_their_units() {
        let read = |text| rows(text, Dim::LENGTH, Dim::FORCE);
        let found = read("x_um,force_gf,actuated\r\n0,-0.5,0\n\n5,1e1,1\n").expect("a table");
        assert_eq!(found.len(), 2);
        assert_eq!((found[1].0, found[1].1), (4, 5e-6));
        assert!((found[1].2 - 0.0980665).abs() < 1e-12);
        assert!(read("\u{feff}\"f_mN\";\"x_mm\"\n1;2\n").is_ok());
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let wrong = |text| rows(text, Dim::LENGTH, Dim::FORCE).expect_err("wrong");
        assert_eq!(wrong(""), "is empty");
        assert_eq!(wrong("x_mm,f_N\0"), "is no text");
        assert_eq!(
            wrong("x,force\n1,2\n"),
            "has no column with a unit such as `m`: its titles are `x`, `force`"
        );
        assert_eq!(
            wrong("x_mm,up_N,down_N\n"),
            "has several columns with a unit such as `n`: `x_mm`, `up_N`, `down_N`; leave one"
        );
        assert_eq!(wrong("x_mm,f_N\n1,2\n3\n"), "line 3 has 1 cells only");
        assert_eq!(wrong("x_mm,f_N\n1,nan\n"), "line 2: `nan` is no number");
        assert_eq!(wrong("x_mm;f_N\n1;2,5\n"), "line 2: `2,5` is no number");
    }
}
