//! Motions as tables with titles: `t_s,x_m` in any units of time and length, or `t_s,angle_deg` for
//! a knob; and forces, `t_s,f_n`.

use std::path::Path;

use whippen_compiler::model::{Model, Moves};
use whippen_compiler::units::{Dim, Unit, unit_suffix};

use super::table::Rows;
use super::uniform::{Uniform, uniform};
use crate::files::{FileError, InputKind};
use crate::titles::{join_title, split_title};

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
    let found = |titles: &[String]| Ok(vec![find(titles, name, dim, kind)?]);
    let mut table = read_columns(path, found, limit)?;
    Ok(Titled {
        rows: table.rows,
        start_s: table.start_s,
        grid: table.grids.remove(0),
    })
}

/// Several columns of a table that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct PortColumns {
    /// Rows of the file.
    pub rows: usize,
    /// The time of the first (s).
    pub start_s: f64,
    /// The samples of each column on an even grid, the same for all.
    pub grids: Vec<Uniform>,
}

/// What a port needs a column for: its name, its dimension, and how it moves.
pub type WantedPort<'a> = (&'a str, Dim, Moves);

/// What the ports of an instrument need.
pub fn wanted_ports(model: &Model) -> Vec<WantedPort<'_>> {
    let senses = model.senses.iter();
    senses
        .map(|sense| (sense.name.as_str(), sense.dim, sense.moves))
        .collect()
}

/// Reads the columns of time and of ports.
///
/// # Errors
/// As [`read`]; ports without a column are named.
pub fn read_ports(
    path: &Path,
    ports: &[WantedPort],
    limit: usize,
) -> Result<PortColumns, FileError> {
    read_columns(path, |titles| find_ports(titles, ports), limit)
}

/// Reads the column of time, and those that are found by their titles.
///
/// # Errors
/// As [`read`]; what `find_in` says.
pub fn read_columns(
    path: &Path,
    find_in: impl FnOnce(&[String]) -> Result<Vec<(usize, Unit)>, String>,
    limit: usize,
) -> Result<PortColumns, FileError> {
    let mut rows = Rows::open(path, InputKind::RECORDING)?;
    let choice =
        find(rows.titles(), "t", Dim::TIME, "time").and_then(|t| Ok((t, find_in(rows.titles())?)));
    let ((t_column, t_unit), wanted) =
        choice.map_err(|message| FileError::new(path, message).at_line(1))?;
    let (mut times_s, mut columns) = (Vec::new(), vec![Vec::new(); wanted.len()]);
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
        for (column, (at, unit)) in columns.iter_mut().zip(&wanted) {
            column.push(unit.to_si(rows.number(*at)?));
        }
    }
    let on_grid = |samples: Vec<f64>| {
        let grid = uniform(&times_s, samples, limit);
        grid.map_err(|message| FileError::new(path, message))
    };
    Ok(PortColumns {
        rows: times_s.len(),
        start_s: times_s.first().copied().unwrap_or(0.0),
        grids: columns.into_iter().map(on_grid).collect::<Result<_, _>>()?,
    })
}

/// The column of each port: that of its name with a unit of its dimension; a plain number has none.
fn find_ports(titles: &[String], ports: &[WantedPort]) -> Result<Vec<(usize, Unit)>, String> {
    let one = |(name, dim, moves): &WantedPort| {
        let is_bare = dim.is_number() && *moves == Moves::Not;
        let fits = |title: &String| match split_title(title) {
            (found, Some(unit)) => (found == *name && unit.dim == *dim).then_some(unit),
            (found, None) => (found == *name && is_bare).then_some(Unit::ONE),
        };
        let mut all = titles.iter().enumerate();
        all.find_map(|(at, title)| Some((at, fits(title)?)))
    };
    let missing: Vec<String> = (ports.iter().filter(|port| one(port).is_none()))
        .map(|(name, dim, moves)| match moves {
            Moves::Turns => format!("`{name}_rad`"),
            _ => format!(
                "`{}`",
                join_title(name, &unit_suffix(&dim.unit_without_angle()))
            ),
        })
        .collect();
    if missing.is_empty() {
        return Ok(ports.iter().filter_map(one).collect());
    }
    let there_is = if missing.len() == 1 {
        "there is no column"
    } else {
        "there are no columns"
    };
    Err(format!(
        "each port needs a column with its name and unit, and {there_is} {}; \
         the titles here are `{}`",
        missing.join(", "),
        titles.join("`, `")
    ))
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
