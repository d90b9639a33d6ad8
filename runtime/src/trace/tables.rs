//! The tables of a trace as CSV, written row by row while a run goes on.

use std::io::{self, Write};

use super::{EventRow, Heading};
use crate::decimal::Decimal;
use crate::titles::identifier;

/// How numbers and rows of a table are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Form {
    /// Every so many ticks have a row, beginning with the first; 0 counts as 1.
    pub every: usize,
    /// All digits of an `f64`, whether they mean something or not.
    pub exact: bool,
}

impl Default for Form {
    fn default() -> Form {
        Form {
            every: 1,
            exact: false,
        }
    }
}

impl Form {
    /// How values of a step are written.
    fn of_step(self, step: Option<f64>) -> Decimal {
        match step {
            Some(step) if !self.exact => Decimal::of_step(step),
            _ => Decimal::EXACT,
        }
    }

    /// How times are written.
    fn of_times(self) -> Decimal {
        if self.exact {
            Decimal::EXACT
        } else {
            Decimal::NANO
        }
    }
}

/// The table of ticks.
pub struct TickTable<W: Write> {
    table: csv::Writer<W>,
    form: Form,
    columns: Vec<(Heading, Decimal)>,
    cell: String,
}

impl<W: Write> TickTable<W> {
    /// A table with its titles.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new<'h>(
        to: W,
        headings: impl Iterator<Item = &'h Heading>,
        form: Form,
    ) -> io::Result<TickTable<W>> {
        let mut table = csv::Writer::from_writer(to);
        let columns: Vec<(Heading, Decimal)> = headings
            .map(|heading| (heading.clone(), form.of_step(heading.step)))
            .collect();
        let titles = columns.iter().map(|(heading, _)| heading.title());
        table.write_record(std::iter::once("t_s".to_string()).chain(titles))?;
        Ok(TickTable {
            table,
            form,
            columns,
            cell: String::new(),
        })
    }

    /// Whether a tick has a row.
    pub fn wants(&self, tick: usize) -> bool {
        tick.is_multiple_of(self.form.every.max(1))
    }

    /// The row of a tick at a time (s), if it has one.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn row(&mut self, tick: usize, t_s: f64, values: &[f64]) -> io::Result<()> {
        if !self.wants(tick) {
            return Ok(());
        }
        number(&mut self.table, &mut self.cell, self.form.of_times(), t_s)?;
        for ((heading, decimal), value) in self.columns.iter().zip(values) {
            match heading.label(*value) {
                Some(label) => self.table.write_field(label)?,
                None => number(&mut self.table, &mut self.cell, *decimal, *value)?,
            }
        }
        end_row(&mut self.table)
    }

    /// What was written to, with all rows.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn into_inner(self) -> io::Result<W> {
        self.table.into_inner().map_err(|e| e.into_error())
    }
}

/// A column of the table of events.
#[derive(Debug, Clone, PartialEq)]
pub struct Argument {
    /// Its title, with its unit (`speed_m_per_s`).
    pub title: String,
    /// The distance of neighbouring values (SI), where they are words of fixed point.
    pub step: Option<f64>,
}

impl Argument {
    /// The columns of events whose arguments these are: each title once, with its finest step.
    pub fn merged(all: impl IntoIterator<Item = Argument>) -> Vec<Argument> {
        let mut merged: Vec<Argument> = Vec::new();
        for argument in all {
            match merged.iter_mut().find(|a| a.title == argument.title) {
                Some(found) => {
                    found.step = found.step.zip(argument.step).map(|(a, b)| a.min(b));
                }
                None => merged.push(argument),
            }
        }
        merged
    }
}

/// The table of events: one column per argument of any event, blank where an event has no such
/// argument.
pub struct EventTable<W: Write> {
    table: csv::Writer<W>,
    form: Form,
    arguments: Vec<(String, Decimal)>,
    cell: String,
}

impl<W: Write> EventTable<W> {
    /// A table with its titles; `named` keys have a column `name` behind `key`.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new(
        to: W,
        arguments: &[Argument],
        named: bool,
        form: Form,
    ) -> io::Result<EventTable<W>> {
        let mut table = csv::Writer::from_writer(to);
        let fixed = if named {
            &["t_s", "key", "name", "event"][..]
        } else {
            &["t_s", "key", "event"]
        };
        let titles = arguments.iter().map(|a| identifier(&a.title));
        table.write_record(fixed.iter().map(|t| t.to_string()).chain(titles))?;
        let decimal = |a: &Argument| (a.title.clone(), form.of_step(a.step));
        Ok(EventTable {
            table,
            form,
            arguments: arguments.iter().map(decimal).collect(),
            cell: String::new(),
        })
    }

    /// The row of an event, with the name of its key where keys are named.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn row(&mut self, event: &EventRow, name: Option<&str>) -> io::Result<()> {
        let (table, cell) = (&mut self.table, &mut self.cell);
        number(table, cell, self.form.of_times(), event.t_s)?;
        table.write_field(event.key.to_string())?;
        if let Some(name) = name {
            table.write_field(name)?;
        }
        table.write_field(&event.event)?;
        for (title, decimal) in &self.arguments {
            match event.args.iter().find(|(name, _)| name == title) {
                Some((_, value)) => number(table, cell, *decimal, *value)?,
                None => table.write_field("")?,
            }
        }
        end_row(table)
    }

    /// What was written to, with all rows.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn into_inner(self) -> io::Result<W> {
        self.table.into_inner().map_err(|e| e.into_error())
    }
}

fn number<W: Write>(
    table: &mut csv::Writer<W>,
    cell: &mut String,
    decimal: Decimal,
    value: f64,
) -> io::Result<()> {
    cell.clear();
    decimal.write(value, cell);
    Ok(table.write_field(&*cell)?)
}

fn end_row<W: Write>(table: &mut csv::Writer<W>) -> io::Result<()> {
    Ok(table.write_record(None::<&[u8]>)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heading(name: &str, unit: &str, labels: &[&str], step: Option<f64>) -> Heading {
        Heading {
            name: name.into(),
            unit: unit.into(),
            labels: labels.iter().map(|l| l.to_string()).collect(),
            step,
        }
    }

    fn ticks(form: Form) -> String {
        let headings = [
            heading("x", "m", &[], Some(11e-3 / 65_535.0)),
            heading("phi'", "rad_per_s", &[], None),
            heading("contact", "", &["touching", "flying"], None),
        ];
        let mut table = TickTable::new(Vec::new(), headings.iter(), form).unwrap();
        let rows = [
            [0.0, f64::MAX, 0.0],
            [30_000.0 * 11e-3 / 65_535.0, f64::MIN_POSITIVE, 1.0],
            [-11e-3 / 65_535.0, f64::NAN, 7.0],
        ];
        for (tick, row) in rows.iter().enumerate() {
            table.row(tick, tick as f64 / 44_100.0, row).unwrap();
        }
        String::from_utf8(table.into_inner().unwrap()).unwrap()
    }

    #[test]
    fn the_tables_look_as_documented() {
        insta::assert_snapshot!("ticks", ticks(Form::default()));
        let exact = Form {
            exact: true,
            ..Form::default()
        };
        insta::assert_snapshot!("ticks_exact", ticks(exact));
        assert_eq!(ticks(Form { every: 2, ..exact }).lines().count(), 3);
        assert_eq!(ticks(Form { every: 0, ..exact }).lines().count(), 4);
    }

    #[test]
    fn events_have_a_column_for_every_argument() {
        let event = |t_s, name: &str, args: &[(&str, f64)]| EventRow {
            t_s,
            key: 39,
            event: name.into(),
            args: args.iter().map(|(n, v)| ((*n).into(), *v)).collect(),
        };
        let argument = |title: &str, step| Argument {
            title: title.into(),
            step,
        };
        let arguments = Argument::merged([
            argument("speed_m_per_s", Some(1e-2)),
            argument("angle_rad", None),
            argument("speed_m_per_s", Some(1e-3)),
        ]);
        assert_eq!(arguments[0].step, Some(1e-3));
        let events = [
            event(0.5, "note", &[("speed_m_per_s", 2.25)]),
            event(0.75, "contact: flying -> touching", &[]),
            event(
                0.8,
                "tilt, \"odd\"",
                &[("angle_rad", 0.1), ("speed_m_per_s", -1.0)],
            ),
        ];
        let mut table = EventTable::new(Vec::new(), &arguments, true, Form::default()).unwrap();
        for event in &events {
            table.row(event, Some("C4")).unwrap();
        }
        let text = String::from_utf8(table.into_inner().unwrap()).unwrap();
        insta::assert_snapshot!("events", text);
    }
}
