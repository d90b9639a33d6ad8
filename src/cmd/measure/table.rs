//! The numbers as text: of one key in rows, of many keys a row for each.

use std::fmt::Write;

use whippen_compiler::check::note_name;
use whippen_runtime::measure::{DEFINITIONS, Definition, GRAM_FORCE_N, Measured};

use super::{Measurement, compare};

/// What is shown of many keys.
const OF_KEYS: [(&str, &str); 8] = [
    ("down_weight", "down"),
    ("up_weight", "up"),
    ("balance_weight", "balance"),
    ("friction_weight", "friction"),
    ("let_off_travel", "let-off"),
    ("let_off_bump", "bump"),
    ("aftertouch", "after"),
    ("repetition_limit", "repeats"),
];

/// A row of one key: name, number, what technicians expect.
pub struct NumberRow {
    pub name: String,
    pub value: String,
    pub expected: String,
}

/// How a unit is shown: its name, its size and its digits.
fn shown(unit: &str) -> (&'static str, f64, usize) {
    match unit {
        "n" => ("gf", GRAM_FORCE_N, 1),
        "m" => ("mm", 1e-3, 2),
        "hz" => ("Hz", 1.0, 1),
        "m_per_s" => ("m/s", 1.0, 3),
        _ => ("dB", 1.0, 1),
    }
}

/// A value as the unit of its kind is shown, without the unit.
pub fn number(unit: &str, value: f64) -> String {
    let (_, size, digits) = shown(unit);
    plain(format!("{:.digits$}", value / size))
}

/// The unit in which a kind is shown.
pub fn unit(unit: &str) -> &'static str {
    shown(unit).0
}

/// Without the sign of a zero.
fn plain(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_string(),
        _ => text,
    }
}

/// The name of a number, as technicians write it.
pub fn name(definition: &Definition) -> String {
    match definition.name {
        "key_dip" | "rate_effect" | "repetition_limit" | "dynamic_range" | "softest_strike"
        | "loudest_strike" => definition.name.replace('_', " "),
        "let_off_travel" | "let_off_force" | "let_off_bump" => {
            definition.name.replace("let_off_", "let-off ")
        }
        other => other.replace('_', "-"),
    }
}

/// All numbers of a key.
pub fn rows(measured: &Measured) -> Vec<NumberRow> {
    let row = |definition: &Definition| NumberRow {
        name: name(definition),
        value: value(definition, measured),
        expected: expected(definition, measured.value(definition.name)),
    };
    let mut rows: Vec<NumberRow> = DEFINITIONS.iter().map(row).collect();
    let after = DEFINITIONS.iter().position(|d| d.name == "key_dip");
    let drop = match &measured.drop {
        Some((unit, angle)) if unit == "rad" => format!("{:>7.2} deg", angle.to_degrees()),
        Some((_, way)) => format!("{:>7.2} mm", 1e3 * way),
        None => format!("{:>7}", "none"),
    };
    rows.insert(
        after.unwrap_or(0),
        NumberRow {
            name: "drop".to_string(),
            value: drop,
            expected: String::new(),
        },
    );
    rows
}

fn value(definition: &Definition, measured: &Measured) -> String {
    let Some(value) = measured.value(definition.name) else {
        return format!("{:>7}", "none");
    };
    let (kind, unit) = (definition.unit, unit(definition.unit));
    let text = format!("{:>7} {unit}", number(kind, value));
    match kind {
        "n" => format!("{text}  {:>7} N", plain(format!("{value:.3}"))),
        "hz" if measured.repeats_beyond => format!("{text} or more"),
        _ => text,
    }
}

/// The range that is expected, and on which side of it the value is.
fn expected(definition: &Definition, value: Option<f64>) -> String {
    let Some((low, high)) = definition.expected else {
        return String::new();
    };
    let side = match value {
        Some(value) if value < low => ", below",
        Some(value) if value > high => ", above",
        _ => "",
    };
    format!(
        "{} .. {} {}{side}",
        number(definition.unit, low),
        number(definition.unit, high),
        unit(definition.unit)
    )
}

/// The report as text.
pub fn text(all: &Measurement) -> String {
    let first = &all.keys[0];
    let key = match &all.keys[..] {
        [one] => one.name().map_or(String::new(), |name| format!(", {name}")),
        many => format!(", {} keys", many.len()),
    };
    let mut out = format!(
        "{}{key}: pressed {} mm and let up at {} mm/s on engine {}\n",
        first.compiled.model.name,
        number("m", all.protocol.dip_m),
        number("m", all.protocol.speed_m_per_s),
        all.protocol.engine
    );
    match &all.keys[..] {
        [one] => add_rows(&mut out, &rows(&one.measured)),
        _ => add_keys(&mut out, all),
    }
    out + &compare::text(all)
}

fn add_rows(out: &mut String, rows: &[NumberRow]) {
    let _ = writeln!(
        out,
        "  {:<17} {:>7} {:<14} expected of a grand",
        "", "", "measured"
    );
    for row in rows {
        let line = format!(
            "  {:<17} {:<22} {}",
            row.name,
            row.value.trim_start(),
            row.expected
        );
        let _ = writeln!(out, "{}", line.trim_end());
    }
}

fn add_keys(out: &mut String, all: &Measurement) {
    let _ = write!(out, "  {:<5}", "");
    OF_KEYS.iter().for_each(|(_, head)| {
        let _ = write!(out, " {head:>9}");
    });
    let _ = write!(out, "\n  {:<5}", "");
    let kinds = OF_KEYS.map(|(name, _)| {
        let found = DEFINITIONS.iter().find(|d| d.name == name);
        found.map_or("", |d| d.unit)
    });
    kinds.iter().for_each(|kind| {
        let _ = write!(out, " {:>9}", unit(kind));
    });
    out.push('\n');
    for key in &all.keys {
        let name = key.note.map_or(String::new(), note_name);
        let _ = write!(out, "  {name:<5}");
        for ((what, _), kind) in OF_KEYS.iter().zip(kinds) {
            let value = key.measured.value(what);
            let text = value.map_or("none".to_string(), |value| number(kind, value));
            let _ = write!(out, " {text:>9}");
        }
        out.push('\n');
    }
}
