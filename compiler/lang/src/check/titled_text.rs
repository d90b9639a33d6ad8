//! Text of a table: a line of titles, and rows of cells between commas, semicolons or tabs.
//!
//! Not here: what the columns mean, and files.

/// The titles of a table, and how its cells are told apart.
#[derive(Debug, Clone, PartialEq)]
pub struct TitledText<'a> {
    /// The first line that is not empty.
    pub titles: Vec<&'a str>,
    /// What stands between cells; none where there is one column.
    comma: Option<char>,
    /// The lines below, with their numbers from 0.
    lines: Vec<(usize, &'a str)>,
}

impl<'a> TitledText<'a> {
    /// Finds the titles.
    ///
    /// # Errors
    /// What the text is, in words that go on from its name: no text, or empty.
    pub fn of(text: &'a str) -> Result<TitledText<'a>, &'static str> {
        let text = text.trim_start_matches('\u{feff}');
        if text.contains('\0') {
            return Err("is no text");
        }
        let filled = |(_, line): &(usize, &str)| !line.trim().is_empty();
        let mut lines = text.lines().enumerate().filter(filled);
        let (_, head) = lines.next().ok_or("is empty")?;
        let mut signs = [',', ';', '\t'].into_iter();
        let comma = signs.find(|sign| head.contains(*sign));
        Ok(TitledText {
            titles: cells(head, comma),
            comma,
            lines: lines.collect(),
        })
    }

    /// Whether it has several columns.
    pub fn is_table(&self) -> bool {
        self.comma.is_some()
    }

    /// The rows: the number of the line, counted from 1, and its cells.
    pub fn rows(&self) -> impl Iterator<Item = (usize, Vec<&'a str>)> {
        let cells = |(at, line): &(usize, &'a str)| (at + 1, cells(line, self.comma));
        self.lines.iter().map(cells)
    }

    /// The first titles, for a message.
    pub fn shown_titles(&self) -> String {
        let shown: Vec<String> = self.titles.iter().take(8).map(|t| short(t)).collect();
        shown.join(", ")
    }
}

fn cells(line: &str, comma: Option<char>) -> Vec<&str> {
    let cells = line.split(comma.unwrap_or(','));
    cells
        .map(|cell| cell.trim().trim_matches('"').trim())
        .collect()
}

/// A title or a cell in backticks, cut where it is none.
pub fn short(text: &str) -> String {
    const LONGEST: usize = 24;
    let kept: String = text
        .chars()
        .take(LONGEST)
        .filter(|c| !c.is_control())
        .collect();
    let rest = if text.chars().count() > LONGEST {
        ".."
    } else {
        ""
    };
    format!("`{kept}{rest}`")
}
