//! What a participant left: a table of answers, errors and gestures.
//!
//! ```text
//!   participant,order,condition,kind,item,answer,time_s,data
//!   7,1,FV,answer,realism,6,,
//!   7,1,FV,error,marked,2,14.203,4                     played 2 where 4 was marked
//!   7,1,FV,gesture,marked,882000,,(base64, deflated)   so many ticks
//!   7,1,FV,words,marked,,,(digests, one a second)
//! ```

use std::path::Path;

use crate::files::{FileError, InputKind, read_text};

/// The columns, in their order.
pub const TITLES: [&str; 8] = [
    "participant",
    "order",
    "condition",
    "kind",
    "item",
    "answer",
    "time_s",
    "data",
];

/// A row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SessionRow {
    /// Who, counted from 1.
    pub participant: u32,
    /// The name of the condition; empty for what is asked at the end.
    pub condition: String,
    /// `answer`, `hit`, `error`, `gesture`, `words`, `preferred`, `comment`.
    pub kind: String,
    /// The item or the task.
    pub item: String,
    /// What was said or played.
    pub answer: String,
    /// What was marked, or what was kept.
    pub data: String,
    /// Where it stands.
    pub line: u64,
}

/// Reads the table of a session.
///
/// # Errors
/// It is no such table, in which line.
pub fn read(path: &Path) -> Result<Vec<SessionRow>, FileError> {
    let text = read_text(path, InputKind::SESSION)?;
    let mut reader = csv::ReaderBuilder::new().from_reader(text.as_bytes());
    let broken = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        FileError::new(path, format!("is no session: {error}")).at_line(line)
    };
    let titles = reader.headers().map_err(broken)?;
    if titles.iter().ne(TITLES) {
        let what = format!("a session of a study begins with {}", TITLES.join(","));
        return Err(FileError::new(path, what).at_line(1));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(1, csv::Position::line);
        let field = |at: usize| record[at].to_string();
        let participant = record[0].parse().map_err(|_| {
            let what = format!("`{}` is no number of a participant", &record[0]);
            FileError::new(path, what).at_line(line)
        })?;
        rows.push(SessionRow {
            participant,
            condition: field(2),
            kind: field(3),
            item: field(4),
            answer: field(5),
            data: field(7),
            line,
        });
    }
    Ok(rows)
}
