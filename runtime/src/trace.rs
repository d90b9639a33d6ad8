//! Traces: what a run leaves behind, and its two tables.
//!
//! A [`Trace`] has one row per tick (ports, force terms, coordinates, states) and a list of events.
//! The tables are CSV:
//!
//! ```text
//!   t_s,x_m,f_n,contact_n,phi_rad,repetition      t_s,key,event,speed_m_per_s
//!   0.0,0.0,0.49,0.49,0.0,disengaged              1.0703,0,note,2.25
//!   0.000022675736961451248,...                   1.3120,0,release,
//! ```
//!
//! Numbers are printed with the fewest digits that read back to the same `f64`.
//!
//! Not here: what fills a trace (`session`), and its pictures (`plot`).

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use crate::files::{FileError, write_whole};
use crate::titles::join_title;

/// One value per tick, under a name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// Its name in the program (`x`, `contact`, `jack.resistance`).
    pub name: String,
    /// Its unit as titles write it (`m`, `n`, `rad_per_s`); empty for states and plain numbers.
    pub unit: String,
    /// For a state machine the names of its states; the values are then indices into them. Else
    /// empty.
    pub labels: Vec<String>,
    /// One value per tick, in SI units.
    pub values: Vec<f64>,
}

impl Column {
    /// The title in the table: name and unit (`x_m`).
    pub fn title(&self) -> String {
        join_title(&self.name, &self.unit)
    }

    /// The label a value stands for, if it stands for one.
    pub fn label(&self, value: f64) -> Option<&str> {
        self.labels
            .get(value as usize)
            .filter(|_| value >= 0.0 && value.fract() == 0.0)
            .map(String::as_str)
    }
}

/// Something that happened at an instant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventRow {
    /// When (s).
    pub t_s: f64,
    /// Which key, counted from 0 at the lowest.
    pub key: u32,
    /// Its name (`note`, `release`, `string`, `check: free -> caught`).
    pub event: String,
    /// Its arguments: title with unit (`speed_m_per_s`) and value (SI).
    pub args: Vec<(String, f64)>,
}

/// What a run leaves behind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Ticks per second.
    pub rate_hz: u32,
    /// The columns after `t_s`, all of one length.
    pub columns: Vec<Column>,
    /// What happened, in the order of time.
    pub events: Vec<EventRow>,
}

impl Trace {
    /// The number of ticks: the length of the shortest column.
    pub fn ticks(&self) -> usize {
        self.columns
            .iter()
            .map(|c| c.values.len())
            .min()
            .unwrap_or(0)
    }

    /// The time of a tick (s).
    pub fn time_s(&self, tick: usize) -> f64 {
        tick as f64 / f64::from(self.rate_hz)
    }

    /// The column of a title (`x_m`). Names need not be unique: a force term and a state machine
    /// may share one.
    pub fn column(&self, title: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.title() == title)
    }

    /// Writes the table of ticks to a file: every `every`-th row (0 counts as 1), beginning with
    /// the first.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save_ticks(&self, path: &Path, every: usize) -> Result<(), FileError> {
        write_whole(path, |w| self.write_ticks(w, every))
    }

    /// Writes the table of events to a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save_events(&self, path: &Path) -> Result<(), FileError> {
        write_whole(path, |w| self.write_events(w))
    }

    /// The same with the names of keys in a column `name` behind `key`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save_named_events(
        &self,
        path: &Path,
        name: &dyn Fn(u32) -> String,
    ) -> Result<(), FileError> {
        write_whole(path, |w| self.write_event_rows(w, Some(name)))
    }

    /// The table of ticks, as [`Trace::save_ticks`] writes it.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_ticks(&self, to: impl Write, every: usize) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(to);
        table.write_field("t_s")?;
        for column in &self.columns {
            table.write_field(column.title())?;
        }
        end_row(&mut table)?;
        let mut number = ryu::Buffer::new();
        for tick in (0..self.ticks()).step_by(every.max(1)) {
            table.write_field(number.format(self.time_s(tick)))?;
            for column in &self.columns {
                let value = column.values[tick];
                table.write_field(column.label(value).unwrap_or_else(|| number.format(value)))?;
            }
            end_row(&mut table)?;
        }
        table.flush()
    }

    /// The table of events, as [`Trace::save_events`] writes it: one column per argument title over
    /// all events, in the order in which they first occur, blank where an event has no such
    /// argument.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_events(&self, to: impl Write) -> io::Result<()> {
        self.write_event_rows(to, None)
    }

    fn write_event_rows(
        &self,
        to: impl Write,
        name: Option<&dyn Fn(u32) -> String>,
    ) -> io::Result<()> {
        let mut place: HashMap<&str, usize> = HashMap::new();
        let mut titles: Vec<&str> = Vec::new();
        for (title, _) in self.events.iter().flat_map(|e| &e.args) {
            place.entry(title).or_insert_with(|| {
                titles.push(title);
                titles.len() - 1
            });
        }
        let mut table = csv::Writer::from_writer(to);
        let fixed = if name.is_some() {
            &["t_s", "key", "name", "event"][..]
        } else {
            &["t_s", "key", "event"]
        };
        table.write_record(fixed.iter().chain(&titles))?;
        let mut number = ryu::Buffer::new();
        for event in &self.events {
            let mut cells = vec![None; titles.len()];
            for (title, value) in &event.args {
                cells[place[title.as_str()]] = Some(*value);
            }
            table.write_field(number.format(event.t_s))?;
            table.write_field(event.key.to_string())?;
            if let Some(name) = name {
                table.write_field(name(event.key))?;
            }
            table.write_field(&event.event)?;
            for cell in cells {
                table.write_field(cell.map_or("", |v| number.format(v)))?;
            }
            end_row(&mut table)?;
        }
        table.flush()
    }
}

fn end_row<W: Write>(table: &mut csv::Writer<W>) -> io::Result<()> {
    Ok(table.write_record(None::<&[u8]>)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, unit: &str, values: &[f64]) -> Column {
        Column {
            name: name.into(),
            unit: unit.into(),
            labels: vec![],
            values: values.to_vec(),
        }
    }

    fn trace() -> Trace {
        let mut contact = column("contact", "", &[0.0, 1.0, 7.0]);
        contact.labels = vec!["touching".into(), "flying".into()];
        let event = |t_s, name: &str, args: &[(&str, f64)]| EventRow {
            t_s,
            key: 39,
            event: name.into(),
            args: args.iter().map(|(n, v)| ((*n).into(), *v)).collect(),
        };
        Trace {
            rate_hz: 44_100,
            columns: vec![
                column("x", "m", &[0.0, 0.1 + 0.2, -1e-9]),
                column(
                    "phi'",
                    "rad_per_s",
                    &[f64::MAX, f64::MIN_POSITIVE, f64::NAN],
                ),
                contact,
            ],
            events: vec![
                event(0.5, "note", &[("speed_m_per_s", 2.25)]),
                event(0.75, "contact: flying -> touching", &[]),
                event(
                    0.8,
                    "tilt, \"odd\"",
                    &[("angle_rad", 0.1), ("speed_m_per_s", -1.0)],
                ),
            ],
        }
    }

    fn text(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> String {
        let mut bytes = Vec::new();
        write(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn the_tables_look_as_documented() {
        insta::assert_snapshot!("ticks", text(|w| trace().write_ticks(w, 1)));
        insta::assert_snapshot!("events", text(|w| trace().write_events(w)));
    }

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let mut seed = 1_u64;
        let values: Vec<f64> = (0..2000)
            .map(|_| {
                seed = seed
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                f64::from_bits(seed)
            })
            .filter(|v| v.is_finite())
            .collect();
        let trace = Trace {
            rate_hz: 44_100,
            columns: vec![column("x", "m", &values)],
            events: vec![],
        };
        let table = text(|w| trace.write_ticks(w, 1));
        let mut rows = csv::Reader::from_reader(table.as_bytes());
        let mut count = 0;
        for (tick, row) in rows.records().enumerate() {
            let row = row.unwrap();
            assert_eq!(
                row[0].parse::<f64>().unwrap().to_bits(),
                trace.time_s(tick).to_bits()
            );
            assert_eq!(
                row[1].parse::<f64>().unwrap().to_bits(),
                values[tick].to_bits()
            );
            count += 1;
        }
        assert_eq!(count, values.len());
    }

    #[test]
    fn rows_are_thinned_and_empty_traces_have_a_header() {
        let ten = Trace {
            rate_hz: 10,
            columns: vec![column("x", "m", &[0.0; 10])],
            events: vec![],
        };
        assert_eq!(
            text(|w| ten.write_ticks(w, 4)),
            "t_s,x_m\n0.0,0.0\n0.4,0.0\n0.8,0.0\n"
        );
        assert_eq!(text(|w| ten.write_ticks(w, 0)).lines().count(), 11);
        assert_eq!(text(|w| Trace::default().write_ticks(w, 1)), "t_s\n");
        assert_eq!(
            text(|w| Trace::default().write_events(w)),
            "t_s,key,event\n"
        );
    }

    #[test]
    fn files_are_written_whole() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("trace.csv");
        trace().save_ticks(&path, 1).unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            text(|w| trace().write_ticks(w, 1))
        );
        let error = trace()
            .save_events(&dir.path().join("no/events.csv"))
            .unwrap_err();
        assert!(
            error
                .to_string()
                .contains("no/events.csv: cannot be written: there is no such file"),
            "{error}"
        );
    }
}
