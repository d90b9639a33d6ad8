//! Lines being written, and their text with the comments in columns.

use super::COMMENT;

/// A line: code without indentation, and the comment that ends it.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// Columns before the code.
    pub indent: usize,
    pub code: String,
    pub comment: Option<String>,
}

impl Line {
    /// Columns up to the end of the code.
    pub fn width(&self) -> usize {
        self.indent + self.code.chars().count()
    }

    pub fn is_empty(&self) -> bool {
        self.code.is_empty() && self.comment.is_none()
    }
}

/// The text of the lines.
pub(super) fn text(lines: &[Line]) -> String {
    let mut out = String::new();
    for run in lines.chunk_by(|a, b| is_long(a) && is_long(b)) {
        // What is too long for the column of comments shares one with its neighbours.
        let column = run
            .iter()
            .map(|l| l.width() + 2)
            .max()
            .unwrap_or(0)
            .max(COMMENT);
        run.iter().for_each(|line| write(&mut out, line, column));
    }
    out
}

/// Whether the comment of the line cannot stand in its column.
fn is_long(line: &Line) -> bool {
    line.comment.is_some() && line.width() + 2 > COMMENT
}

fn write(out: &mut String, line: &Line, column: usize) {
    if !line.is_empty() {
        out.extend(std::iter::repeat_n(' ', line.indent));
        out.push_str(&line.code);
    }
    if let Some(comment) = &line.comment {
        out.extend(std::iter::repeat_n(
            ' ',
            column.saturating_sub(line.width()),
        ));
        out.push_str(comment);
    }
    out.push('\n');
}
