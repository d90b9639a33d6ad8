//! A trace as a file of numpy's arrays (`.npz`), written row by row while a run goes on.
//!
//! ```text
//!   trace     one array of records, a field a column: np.load(file)["trace"]["x_m"]
//!   meaning   what the columns are, as a text of JSON: names, units, names of states
//! ```
//!
//! The file is a ZIP archive without compression; how many rows there are, and the checksums, are
//! written into its heads when the last row is known.
//!
//! Not here: tables of text (`tables`).

use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use crc32fast::Hasher;
use serde_json::json;

use super::{Form, Heading};
use crate::archive::{Entry, directory};

/// The most bytes of an entry: beyond them a ZIP archive has another form.
const BYTES_MAX: u64 = 0xffff_0000;
/// The longest name of a field in characters, with all that the head of an array says besides.
const HEAD_ROOM: usize = 96;

/// A file of arrays.
pub struct ArrayFile<W: Write + Seek> {
    to: W,
    form: Form,
    /// Fields of a record, as numpy describes them.
    fields: String,
    meaning: String,
    /// Bytes of the head of the array.
    head: usize,
    rows: u64,
    hasher: Hasher,
    row: Vec<u8>,
}

const TRACE: &str = "trace.npy";

/// The head of an array, so long.
fn array_head(kind: &str, shape: &str, room: usize) -> Vec<u8> {
    let text = format!("{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}");
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((room as u32 - 12).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.resize(room - 1, b' ');
    bytes.push(b'\n');
    bytes
}

impl<W: Write + Seek> ArrayFile<W> {
    /// Begins a file of these columns, after the time.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new<'h>(
        mut to: W,
        headings: impl Iterator<Item = &'h Heading>,
        form: Form,
    ) -> io::Result<ArrayFile<W>> {
        let headings: Vec<&Heading> = headings.collect();
        let titles = headings.iter().map(|heading| heading.title());
        let titles = std::iter::once("t_s".to_string()).chain(titles);
        let fields: Vec<String> = titles.map(|title| format!("('{title}', '<f8')")).collect();
        let fields = format!("[{}]", fields.join(", "));
        let column = |heading: &&Heading| {
            json!({
                "title": heading.title(), "name": heading.name, "unit": heading.unit,
                "labels": heading.labels, "step": heading.step,
            })
        };
        let columns: Vec<_> = headings.iter().map(column).collect();
        let head = (fields.len() + HEAD_ROOM).next_multiple_of(64);
        let begun = Entry {
            name: TRACE.to_string(),
            crc: 0,
            bytes: 0,
            at: 0,
        };
        to.write_all(&begun.head())?;
        to.write_all(&vec![b' '; head])?;
        Ok(ArrayFile {
            to,
            form,
            fields,
            meaning: json!({ "columns": columns }).to_string(),
            head,
            rows: 0,
            hasher: Hasher::new(),
            row: Vec::new(),
        })
    }

    /// Whether a tick has a row.
    pub fn wants(&self, tick: usize) -> bool {
        tick.is_multiple_of(self.form.every.max(1))
    }

    /// The row of a tick at a time (s), if it has one.
    ///
    /// # Errors
    /// Those of the writer; the file would be longer than 4 GB.
    pub fn row(&mut self, tick: usize, t_s: f64, values: &[f64]) -> io::Result<()> {
        if !self.wants(tick) {
            return Ok(());
        }
        self.row.clear();
        for value in std::iter::once(&t_s).chain(values) {
            self.row.extend(value.to_le_bytes());
        }
        if (self.rows + 1) * self.row.len() as u64 + self.head as u64 > BYTES_MAX {
            let what = "such a file has at most 4 GB: fewer --columns, or --every 10";
            return Err(io::Error::other(what));
        }
        self.rows += 1;
        self.hasher.update(&self.row);
        self.to.write_all(&self.row)
    }

    /// Ends it; what was written to.
    ///
    /// # Errors
    /// Those of the writer, which must be able to go back.
    pub fn finish(mut self) -> io::Result<W> {
        let head = array_head(&self.fields, &format!("({},)", self.rows), self.head);
        let mut hasher = Hasher::new();
        hasher.update(&head);
        hasher.combine(&self.hasher);
        let end = self.to.stream_position()?;
        let begun = Entry::HEAD + TRACE.len() as u64;
        let trace = Entry {
            name: TRACE.to_string(),
            crc: hasher.finalize(),
            bytes: (end - begun) as u32,
            at: 0,
        };
        self.to.seek(SeekFrom::Start(0))?;
        self.to.write_all(&trace.head())?;
        self.to.write_all(&head)?;
        self.to.seek(SeekFrom::Start(end))?;
        let letters = self.meaning.chars().count();
        let mut text = array_head(&format!("'<U{letters}'"), "()", 128);
        text.extend(
            self.meaning
                .chars()
                .flat_map(|letter| u32::from(letter).to_le_bytes()),
        );
        let meaning = Entry {
            name: "meaning.npy".to_string(),
            crc: crc32fast::hash(&text),
            bytes: text.len() as u32,
            at: end as u32,
        };
        self.to.write_all(&meaning.head())?;
        self.to.write_all(&text)?;
        let at = self.to.stream_position()?;
        self.to
            .write_all(&directory(&[trace, meaning], at as u32))?;
        Ok(self.to)
    }
}

/// The file of a trace, of either kind.
pub enum TraceFile<W: Write + Seek> {
    /// Text.
    Table(Box<super::TickTable<W>>),
    /// Arrays.
    Arrays(ArrayFile<W>),
}

impl<W: Write + Seek> TraceFile<W> {
    /// A file of these columns, of the kind that its name asks for.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new<'h>(
        path: &Path,
        to: W,
        headings: impl Iterator<Item = &'h Heading>,
        form: Form,
    ) -> io::Result<TraceFile<W>> {
        match path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("npz"))
        {
            true => ArrayFile::new(to, headings, form).map(TraceFile::Arrays),
            false => {
                super::TickTable::new(to, headings, form).map(|t| TraceFile::Table(Box::new(t)))
            }
        }
    }

    /// Whether a tick has a row.
    pub fn wants(&self, tick: usize) -> bool {
        match self {
            TraceFile::Table(table) => table.wants(tick),
            TraceFile::Arrays(arrays) => arrays.wants(tick),
        }
    }

    /// The row of a tick at a time (s), if it has one.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn row(&mut self, tick: usize, t_s: f64, values: &[f64]) -> io::Result<()> {
        match self {
            TraceFile::Table(table) => table.row(tick, t_s, values),
            TraceFile::Arrays(arrays) => arrays.row(tick, t_s, values),
        }
    }

    /// What was written to, with all rows.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn into_inner(self) -> io::Result<W> {
        match self {
            TraceFile::Table(table) => table.into_inner(),
            TraceFile::Arrays(arrays) => arrays.finish(),
        }
    }
}
