//! Motions as tables with titles: `t_s,x_m` in any units of time and length, or `t_s,angle_deg` for
//! a knob; and forces, `t_s,f_n`.

use std::path::Path;

use whippen_compiler::units::{Dim, Unit};

use super::table::Rows;
use super::uniform::{Uniform, uniform};
use crate::files::{FileError, InputKind};
use crate::titles::split_title;

/// What a column may hold: its usual name, its dimension, and what that is called.
pub type Wanted = (&'static str, Dim, &'static str);

/// Positions, of what slides and of what turns.
pub const POSITION: [Wanted; 2] = [
    ("x", Dim::LENGTH, "length"),
    ("angle", Dim::NUMBER, "angle"),
];
/// Forces and torques.
pub const FORCE: [Wanted; 2] = [
    ("f", Dim::FORCE, "force"),
    ("torque", Dim::TORQUE, "torque"),
];

/// What was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Titled {
    /// Rows of the file.
    pub rows: usize,
    /// The time of the first (s).
    pub start_s: f64,
    /// The samples on an even grid.
    pub grid: Uniform,
}

/// Reads the columns of time and of what is wanted (SI) and puts them onto an even grid of at most
/// `limit` samples.
///
/// # Errors
/// A column is missing or ambiguous, a cell is no finite number, time does not increase, or there
/// are more rows than `limit`.
pub fn read(path: &Path, (name, dim, kind): Wanted, limit: usize) -> Result<Titled, FileError> {
    let mut rows = Rows::open(path, InputKind::RECORDING)?;
    let choice = find(rows.titles(), "t", Dim::TIME, "time")
        .and_then(|t| Ok((t, find(rows.titles(), name, dim, kind)?)));
    let ((t_column, t_unit), (x_column, x_unit)) =
        choice.map_err(|message| FileError::new(path, message).at_line(1))?;
    let (mut times_s, mut positions_m) = (Vec::new(), Vec::new());
    while let Some(line) = rows.next_row()? {
        let t_s = t_unit.to_si(rows.number(t_column)?);
        if let Some(before) = times_s.last().filter(|before| **before >= t_s) {
            let message = format!("time must increase, but {t_s} s follows {before} s");
            return Err(FileError::new(path, message)
                .at_line(line)
                .at_column(t_column + 1));
        }
        if times_s.len() == limit {
            return Err(too_many_rows(path, limit));
        }
        times_s.push(t_s);
        positions_m.push(x_unit.to_si(rows.number(x_column)?));
    }
    let grid =
        uniform(&times_s, positions_m, limit).map_err(|message| FileError::new(path, message))?;
    Ok(Titled {
        rows: times_s.len(),
        start_s: times_s.first().copied().unwrap_or(0.0),
        grid,
    })
}

/// What is wrong with a recording that has more rows than may be read.
pub fn too_many_rows(path: &Path, limit: usize) -> FileError {
    FileError::new(
        path,
        format!("has more than {limit} rows, the most a recording may have"),
    )
}

/// `a length`, `an angle`.
fn article(kind: &str) -> String {
    if kind.starts_with('a') {
        format!("an {kind}")
    } else {
        format!("a {kind}")
    }
}

/// The unit of a title in an example.
fn shown(dim: Dim) -> String {
    if dim.is_number() {
        "rad".to_string()
    } else {
        dim.unit()
    }
}

/// The column of that name with a unit of that dimension, else the only column with such a unit.
fn find(titles: &[String], name: &str, dim: Dim, kind: &str) -> Result<(usize, Unit), String> {
    let fitting: Vec<(usize, &str, Unit)> = titles
        .iter()
        .enumerate()
        .filter_map(|(i, title)| {
            let (name, unit) = split_title(title);
            unit.filter(|u| u.dim == dim).map(|u| (i, name, u))
        })
        .collect();
    match (fitting.iter().find(|c| c.1 == name), &fitting[..]) {
        (Some(column), _) | (None, [column]) => Ok((column.0, column.2)),
        (None, several) => {
            let problem = match several {
                [] => format!(
                    "a title must name {} with its unit, such as `{name}_{}`",
                    article(kind),
                    shown(dim)
                ),
                _ => format!(
                    "several columns have a unit of {kind}; call one of them `{name}_` and its unit"
                ),
            };
            if let [only] = titles
                && only.contains([';', '\t'])
            {
                return Err(format!(
                    "cells are separated by commas, and `{only}` is one cell; the decimal point is `.`"
                ));
            }
            Err(format!(
                "{problem}; the titles here are `{}`",
                titles.join("`, `")
            ))
        }
    }
}
