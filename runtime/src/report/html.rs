//! Pieces of HTML: text made harmless, and tables.

use std::fmt::Write;

/// A table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Heading above it.
    pub title: String,
    /// A sentence below the heading; may be empty.
    pub note: String,
    /// Headings of the columns.
    pub heads: Vec<String>,
    /// Rows.
    pub rows: Vec<Row>,
}

/// One row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Its cells, one per heading.
    pub cells: Vec<Cell>,
    /// The instant it speaks of (s): a click on the row zooms there.
    pub at_s: Option<f64>,
    /// The section a click on the row leads to.
    pub section: Option<String>,
    /// Whether it is one of those shown at first, where a table has two kinds of rows.
    pub minor: bool,
}

/// One cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// What it shows.
    pub text: String,
    /// What it is sorted by, and that it is a number.
    pub number: Option<f64>,
}

impl Cell {
    /// A word.
    pub fn text(text: impl Into<String>) -> Cell {
        Cell {
            text: text.into(),
            number: None,
        }
    }

    /// A number, and how it is written.
    pub fn number(number: f64, text: impl Into<String>) -> Cell {
        Cell {
            text: text.into(),
            number: Some(number),
        }
    }
}

/// Text that is only text, between tags and in attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // What HTML knows no place for.
            '\u{0}'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}

/// JSON that can stand inside a script element.
pub fn script_json(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

impl Table {
    /// The table as HTML.
    pub fn html(&self) -> String {
        let mut out = format!("<div class=\"table\"><h3>{}</h3>\n", escape(&self.title));
        if !self.note.is_empty() {
            let _ = writeln!(out, "<p class=\"note\">{}</p>", escape(&self.note));
        }
        if self.rows.is_empty() {
            return out + "<p class=\"note\">None.</p></div>\n";
        }
        if self.rows.iter().any(|row| row.minor) {
            out.push_str("<label class=\"all\"><input type=\"checkbox\"> show all</label>\n");
        }
        out.push_str("<div class=\"scroll\" tabindex=\"0\"><table><thead><tr>");
        for (at, head) in self.heads.iter().enumerate() {
            let number = self
                .rows
                .iter()
                .any(|row| row.cells.get(at).is_some_and(|cell| cell.number.is_some()));
            let _ = write!(
                out,
                "<th scope=\"col\"{}>{}</th>",
                if number { " class=\"n\"" } else { "" },
                escape(head)
            );
        }
        out.push_str("</tr></thead><tbody>\n");
        self.rows.iter().for_each(|row| row.write(&mut out));
        out.push_str("</tbody></table></div></div>\n");
        out
    }
}

impl Row {
    fn write(&self, out: &mut String) {
        out.push_str("<tr");
        if let Some(at_s) = self.at_s {
            let _ = write!(out, " data-t=\"{at_s}\"");
        }
        if let Some(section) = &self.section {
            let _ = write!(out, " data-section=\"{}\"", escape(section));
        }
        out.push_str(if self.minor { " class=\"minor\">" } else { ">" });
        for cell in &self.cells {
            let text = escape(&cell.text);
            let _ = match cell.number {
                Some(number) => write!(out, "<td class=\"n\" data-n=\"{number:e}\">{text}</td>"),
                None => write!(out, "<td>{text}</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_a_text_becomes_a_tag() {
        assert_eq!(
            escape("<b>\"a\" & 'b'</b>\u{0}"),
            "&lt;b&gt;&quot;a&quot; &amp; &#39;b&#39;&lt;/b&gt;\u{fffd}"
        );
        let json = script_json(&serde_json::json!({ "doc": "</script><!--" }));
        assert_eq!(json, r#"{"doc":"\u003c/script>\u003c!--"}"#);
    }

    #[test]
    fn a_table_knows_its_numbers() {
        let row = Row {
            cells: vec![Cell::text("a<b"), Cell::number(-0.5, "−0.5 mm")],
            at_s: Some(1.25),
            ..Row::default()
        };
        let table = Table {
            title: "T".into(),
            heads: vec!["name".into(), "low".into()],
            rows: vec![row],
            ..Table::default()
        };
        let html = table.html();
        assert!(
            html.contains("<th scope=\"col\">name</th><th scope=\"col\" class=\"n\">low</th>"),
            "{html}"
        );
        assert!(
            html.contains("<tr data-t=\"1.25\"><td>a&lt;b</td><td class=\"n\" data-n=\"-5e-1\">−0.5 mm</td></tr>"),
            "{html}"
        );
    }
}
