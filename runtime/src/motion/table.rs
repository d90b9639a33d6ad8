//! Rows of a table with titles, one at a time, with lines and columns for messages.

use std::path::{Path, PathBuf};

use crate::files::{FileError, Input, InputKind, open};

/// A CSV file with a header, read row by row.
pub struct Rows {
    path: PathBuf,
    reader: csv::Reader<Input>,
    titles: Vec<String>,
    record: csv::StringRecord,
    line: u64,
}

impl Rows {
    /// Opens a table and reads its titles.
    ///
    /// # Errors
    /// The file cannot be read, is empty, or begins with numbers.
    pub fn open(path: &Path, kind: InputKind) -> Result<Rows, FileError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .buffer_capacity(1 << 16)
            .from_reader(open(path, kind)?);
        let header = reader.headers().map_err(|e| csv_error(path, &e))?;
        let titles: Vec<String> = header.iter().map(str::to_string).collect();
        if titles.iter().all(String::is_empty) {
            return Err(FileError::new(path, "is empty"));
        }
        if titles.iter().all(|t| t.parse::<f64>().is_ok()) {
            let message = "the first line must hold titles with units, such as `t_s,x_mm`; a file of bare numbers needs its rate";
            return Err(FileError::new(path, message).at_line(1));
        }
        Ok(Rows {
            path: path.to_path_buf(),
            reader,
            titles,
            record: csv::StringRecord::new(),
            line: 1,
        })
    }

    /// The titles of the columns.
    pub fn titles(&self) -> &[String] {
        &self.titles
    }

    /// Reads the next row and gives its line; `None` at the end of the file.
    ///
    /// # Errors
    /// The row has another number of columns than the titles, or is no text.
    pub fn next_row(&mut self) -> Result<Option<u64>, FileError> {
        let more = self
            .reader
            .read_record(&mut self.record)
            .map_err(|e| csv_error(&self.path, &e))?;
        self.line = self
            .record
            .position()
            .map_or(self.line, csv::Position::line);
        Ok(more.then_some(self.line))
    }

    /// What stands in a column (counted from 0) of the present row.
    pub fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    /// The number in a column (counted from 0) of the present row.
    ///
    /// # Errors
    /// The cell is empty or holds something else than a finite number.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        finite(self.record.get(column).unwrap_or("")).map_err(|message| {
            FileError::new(&self.path, message)
                .at_line(self.line)
                .at_column(column + 1)
        })
    }
}

/// A finite number, or what is wrong with the text.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(format!("`{text}` is not a finite number")),
        Err(_) if text.is_empty() => Err("a number is missing".into()),
        Err(_) => Err(format!("`{text}` is not a number")),
    }
}

fn csv_error(path: &Path, error: &csv::Error) -> FileError {
    let line = error.position().map(csv::Position::line);
    let message = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => {
            format!("this row has {len} cells for {expected_len} titles")
        }
        csv::ErrorKind::Utf8 { .. } => "this is not text".into(),
        csv::ErrorKind::Io(e) => e.to_string(),
        _ => error.to_string(),
    };
    FileError {
        line,
        ..FileError::new(path, message)
    }
}
