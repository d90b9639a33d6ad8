//! The pages behind the codes: finding a code by what a person types, and the pages as plain text.

use super::wrap::fill_page;
use super::{Code, nearest};

/// The groups of codes: the first three characters of the number after `WH`, and what they are
/// about.
pub const GROUPS: &[(&str, &str)] = &[
    ("01", "Text"),
    ("02", "Names"),
    ("03", "Types and dimensions"),
    ("04", "Motion and causality"),
    ("05", "Ranges and numbers"),
    ("06", "Physics and keyboards"),
    ("07", "Budgets"),
];

impl Code {
    /// Its name in words (`unknown-name`).
    pub fn name(self) -> String {
        let mut name = String::new();
        for c in self.variant().chars() {
            if c.is_uppercase() && !name.is_empty() {
                name.push('-');
            }
            name.extend(c.to_lowercase());
        }
        name
    }

    /// The code that is meant by `WH0203`, `wh0203`, `203` or `unknown-term`.
    ///
    /// # Errors
    /// There is none; the nearest, if one is near.
    pub fn find(text: &str) -> Result<Code, Option<Code>> {
        let lower = text.trim().to_lowercase();
        let digits = lower.strip_prefix("wh").unwrap_or(&lower);
        let number = format!("WH{digits:0>4}");
        let all = || Code::ALL.iter().copied();
        if let Some(code) = all().find(|c| c.number() == number || c.name() == lower) {
            return Ok(code);
        }
        let known: Vec<String> = all()
            .flat_map(|c| [c.name(), c.number().to_string()])
            .collect();
        let known = || known.iter().map(String::as_str);
        let near = nearest(&lower, known()).or_else(|| nearest(&number, known()));
        Err(near.and_then(|near| all().find(|c| c.number() == near || c.name() == near)))
    }

    /// The programs on its page: in order, with whether each has the mistake.
    pub fn examples(self) -> Vec<(bool, &'static str)> {
        let blocks = self.page().split("```").skip(1).step_by(2);
        let programs: Vec<&str> = blocks
            .map(|b| b.strip_prefix("whip\n").unwrap_or(b))
            .collect();
        let wrong = self.page().contains("\nWrong:\n");
        programs
            .into_iter()
            .enumerate()
            .map(|(i, program)| (wrong && i == 0, program))
            .collect()
    }

    /// Its page for a terminal of so many columns: paragraphs are filled, programs are indented
    /// instead of fenced.
    pub fn plain_page(self, columns: usize) -> String {
        fill_page(self.page(), columns)
    }
}
