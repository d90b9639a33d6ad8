//! Keys beside what was recorded of a real keyboard, as text.

use std::fmt::Write;

use whippen_compiler::check::note_name;
use whippen_runtime::measure::{Compared, Measured};

use super::Measurement;
use super::table::{number, unit};

/// How far the keys are from each column of the table; nothing where there is no table.
pub fn compared(all: &Measurement) -> Vec<Compared> {
    let keys: Vec<(Option<u8>, &Measured)> = all
        .keys
        .iter()
        .map(|key| (key.note, &key.measured))
        .collect();
    let table = all.recorded.map(|table| table.compare(&keys));
    table.unwrap_or_default()
}

/// A row for each column.
pub fn text(all: &Measurement) -> String {
    let Some(table) = all.recorded else {
        return String::new();
    };
    let rows = compared(all);
    let mut out = String::from("beside the recorded keys\n");
    for row in &rows {
        let kind = row.what.unit;
        let unit = unit(kind);
        let (note, worst) = row.worst();
        let _ = writeln!(
            out,
            "  {:<28} {} keys, {} {unit} in the mean; here {} {unit}, rms {} {unit}, most at {} ({} {unit})",
            row.title,
            row.pairs.len(),
            number(kind, row.recorded()),
            signed(number(kind, row.difference())),
            number(kind, row.rms()),
            note_name(note),
            signed(number(kind, worst)),
        );
    }
    if rows.is_empty() {
        out += "  no key of the table was measured\n";
    }
    if !table.unused.is_empty() {
        let _ = writeln!(out, "  not measured: {}", table.unused.join(", "));
    }
    out
}

fn signed(text: String) -> String {
    if text.starts_with('-') {
        text
    } else {
        format!("+{text}")
    }
}
