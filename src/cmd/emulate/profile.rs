//! The profile: cycles and instructions per address, added up per function and per source line.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;
use whippen_emulator::elf::Line;
use whippen_emulator::{Observer, Step};

use super::image::Image;

/// So many functions are printed.
const SHOWN: usize = 12;

/// What cycles between instructions are called: entry to and return from exceptions, and waiting
/// for them.
const BETWEEN: &str = "(exceptions, sleep)";

/// Cycles and instructions.
#[derive(Clone, Copy, Default, Serialize)]
pub struct Spent {
    cycles: u64,
    instructions: u64,
}

impl Spent {
    fn add(&mut self, other: Self) {
        self.cycles += other.cycles;
        self.instructions += other.instructions;
    }
}

/// What each address cost.
#[derive(Default)]
pub struct Profile {
    by_address: HashMap<u32, Spent>,
    /// Per core, the cycle in which its last instruction ended.
    ended: Vec<u64>,
    /// Cycles between instructions.
    between: u64,
}

impl Observer for Profile {
    fn instruction(&mut self, step: &Step<'_>) {
        let spent = self.by_address.entry(step.address).or_default();
        let cycles = u64::from(step.cost.cycles());
        spent.add(Spent {
            cycles,
            instructions: 1,
        });
        if self.ended.len() <= step.core {
            self.ended.resize(step.core + 1, step.cycle);
        }
        let ended = &mut self.ended[step.core];
        self.between += step.cycle.saturating_sub(*ended);
        *ended = step.cycle + cycles;
    }
}

/// One function or line in the file.
#[derive(Serialize)]
struct Row {
    #[serde(skip_serializing_if = "Option::is_none")]
    function: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    address: Option<u32>,
    #[serde(flatten)]
    spent: Spent,
}

/// The file.
#[derive(Serialize)]
struct ProfileReport {
    #[serde(flatten)]
    total: Spent,
    functions: Vec<Row>,
    lines: Vec<Row>,
}

impl Profile {
    fn report(&self, image: &Image) -> ProfileReport {
        let mut total = Spent {
            cycles: self.between,
            instructions: 0,
        };
        let mut functions: BTreeMap<(String, Option<u32>), Spent> = BTreeMap::new();
        if self.between > 0 {
            functions.insert((BETWEEN.into(), None), total);
        }
        let mut lines: BTreeMap<Line, Spent> = BTreeMap::new();
        for (address, spent) in &self.by_address {
            total.add(*spent);
            let symbol = image
                .elf
                .symbols
                .covering(*address)
                .map(|(s, _)| (s.name.clone(), Some(s.address)));
            functions
                .entry(symbol.unwrap_or(("?".into(), None)))
                .or_default()
                .add(*spent);
            if let Some(line) = image.lines.at(*address) {
                lines.entry(line.clone()).or_default().add(*spent);
            }
        }
        let function = |((name, address), spent)| Row {
            function: Some(name),
            file: None,
            line: None,
            address,
            spent,
        };
        let line = |(line, spent): (Line, Spent)| Row {
            function: None,
            file: Some(line.file),
            line: Some(line.line),
            address: None,
            spent,
        };
        ProfileReport {
            total,
            functions: most_expensive_first(functions.into_iter().map(function)),
            lines: most_expensive_first(lines.into_iter().map(line)),
        }
    }

    /// The file's text.
    pub fn json(&self, image: &Image) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(&self.report(image)).map(|text| text + "\n")
    }

    /// The most expensive functions, for people.
    pub fn table(&self, image: &Image) -> String {
        let report = self.report(image);
        let total = report.total.cycles.max(1) as f64;
        let mut text = format!(
            "{:>14}  {:>6}  {:>12}  function\n",
            "cycles", "share", "instructions"
        );
        for row in report.functions.iter().take(SHOWN) {
            let Spent {
                cycles,
                instructions,
            } = row.spent;
            let share = 100.0 * cycles as f64 / total;
            let name = row.function.as_deref().unwrap_or("?");
            text.push_str(&format!(
                "{cycles:>14}  {share:>5.1}%  {instructions:>12}  {name}\n"
            ));
        }
        let more = report.functions.len().saturating_sub(SHOWN);
        if more > 0 {
            text.push_str(&format!("{:>14}  and {more} more\n", ""));
        }
        text
    }
}

/// Sorted by cycles; what costs the same stays in its order.
fn most_expensive_first(rows: impl Iterator<Item = Row>) -> Vec<Row> {
    let mut rows: Vec<Row> = rows.collect();
    rows.sort_by_key(|row| std::cmp::Reverse(row.spent.cycles));
    rows
}
