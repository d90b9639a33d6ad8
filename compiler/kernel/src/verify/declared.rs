//! Verification of what a kernel declares.

use super::{VerifyError, WORDS_MAX};
use crate::print::Name;
use crate::{Kernel, Range, Table, Type};
use std::collections::BTreeSet;

const U16: Range = Range::new(0, 65_535);
const I16: Range = Range::new(-32_768, 32_767);

/// Checks declarations and finds duplicate names.
pub(super) fn check(kernel: &Kernel, errors: &mut Vec<VerifyError>) {
    let mut list = List {
        errors,
        names: BTreeSet::new(),
    };
    for input in &kernel.inputs {
        list.range("in", &input.name, input.range, U16);
    }
    for output in &kernel.outputs {
        list.range("out", &output.name, output.range, I16);
    }
    for live in &kernel.lives {
        list.range("live", &live.name, live.range, Type::I32.range());
        list.holds("live", &live.name, live.range, [live.init.into()]);
    }
    for keyed in &kernel.keyed {
        list.range("keyed", &keyed.name, keyed.range, Type::I32.range());
        list.size("keyed", &keyed.name, keyed.values.len());
        list.holds(
            "keyed",
            &keyed.name,
            keyed.range,
            keyed.values.iter().map(|value| i64::from(*value)),
        );
    }
    for cell in &kernel.cells {
        list.range("cell", &cell.name, cell.range, cell.ty.range());
        list.size("cell", &cell.name, cell.len as usize);
        list.holds("cell", &cell.name, cell.range, [cell.init]);
    }
    for line in &kernel.lines {
        list.range("line", &line.name, line.range, Type::I32.range());
        list.size("line", &line.name, line.len as usize);
    }
    for table in &kernel.tables {
        list.table(table);
    }
    for event in &kernel.events {
        list.name("event", &event.name);
        if event.args > 16 {
            list.error(
                "event",
                &event.name,
                format!("{} arguments are more than 16", event.args),
            );
        }
    }
    for probe in &kernel.probes {
        list.name("probe", &probe.name);
    }
}

struct List<'a> {
    errors: &'a mut Vec<VerifyError>,
    names: BTreeSet<(&'static str, String)>,
}

impl List<'_> {
    fn table(&mut self, table: &Table) {
        self.name("table", &table.name);
        self.size("table", &table.name, table.values.len());
        let columns = table.columns as usize;
        if columns == 0 || !table.values.len().is_multiple_of(columns) {
            let message = format!(
                "{} words are no whole number of rows of {columns}",
                table.values.len()
            );
            self.error("table", &table.name, message);
        }
    }

    fn error(&mut self, word: &str, name: &str, message: String) {
        self.errors.push(VerifyError {
            place: format!("{word} {}", Name(name)),
            message,
        });
    }

    fn name(&mut self, word: &'static str, name: &str) {
        if !self.names.insert((word, name.to_string())) {
            self.error(word, name, "declared twice".to_string());
        }
    }

    /// The name is new and the range is one of the type's.
    fn range(&mut self, word: &'static str, name: &str, range: Range, all: Range) {
        self.name(word, name);
        if range.is_empty() {
            self.error(word, name, format!("{range} is empty"));
        } else if !all.contains(range) {
            self.error(word, name, format!("{range} is not within {all}"));
        }
    }

    fn holds(
        &mut self,
        word: &str,
        name: &str,
        range: Range,
        values: impl IntoIterator<Item = i64>,
    ) {
        if let Some(value) = values.into_iter().find(|value| !range.has(*value)) {
            self.error(word, name, format!("{value} is not in {range}"));
        }
    }

    fn size(&mut self, word: &str, name: &str, words: usize) {
        if words == 0 || words > WORDS_MAX as usize {
            self.error(
                word,
                name,
                format!("{words} words, where 1 to {WORDS_MAX} are possible"),
            );
        }
    }
}
