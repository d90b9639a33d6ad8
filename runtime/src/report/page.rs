//! The page around the sections.

use std::fmt::Write;
use std::path::Path;

use super::Section;
use super::html::{Table, escape, script_json};
use crate::files::{FileError, write_whole};

const LIBRARY: &str = include_str!("vendor/uPlot.iife.min.js");
const LIBRARY_STYLE: &str = include_str!("vendor/uPlot.min.css");
const STYLE: &str = include_str!("page.css");

/// Our scripts, in an order in which each uses only those before it.
const SCRIPTS: &[&str] = &[
    include_str!("data.js"),
    include_str!("view.js"),
    include_str!("panels.js"),
    include_str!("bands.js"),
    include_str!("loop.js"),
    include_str!("roll.js"),
    include_str!("strings.js"),
    include_str!("tables.js"),
    include_str!("page.js"),
];

/// Nothing is loaded from anywhere; the browser is asked to see to it.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

/// A whole report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Page {
    /// Title of the window, and heading where there are several sections.
    pub title: String,
    /// The command that made it.
    pub command: String,
    /// A table over all sections.
    pub overview: Option<Table>,
    /// What it reports, one section shown at a time.
    pub sections: Vec<Section>,
}

impl Page {
    /// The page as one HTML document.
    pub fn html(&self) -> String {
        let mut out = String::with_capacity(1 << 20);
        let _ = write!(
            out,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n\
             <style>\n{LIBRARY_STYLE}\n{STYLE}</style>\n</head>\n<body>\n",
            escape(&self.title)
        );
        self.head(&mut out);
        out.push_str("<main>\n");
        self.sections
            .iter()
            .for_each(|section| section.write(&mut out));
        out.push_str("</main>\n");
        let _ = writeln!(
            out,
            "<footer><p>Made by whippen {} with <code>{}</code></p></footer>",
            env!("CARGO_PKG_VERSION"),
            escape(&self.command)
        );
        self.scripts(&mut out);
        out.push_str("</body>\n</html>\n");
        out
    }

    /// Writes the page to a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        let html = self.html();
        write_whole(path, |w| w.write_all(html.as_bytes()))
    }

    fn head(&self, out: &mut String) {
        out.push_str("<header class=\"top\">\n");
        if self.sections.len() != 1 {
            let _ = writeln!(out, "<h1>{}</h1>", escape(&self.title));
        }
        if let Some(overview) = &self.overview {
            out.push_str(&overview.html());
        }
        if self.sections.len() > 1 {
            out.push_str("<nav aria-label=\"Sections\">");
            for section in &self.sections {
                let _ = write!(
                    out,
                    "<a href=\"#{}\">{}</a>",
                    escape(&section.id),
                    escape(&section.title)
                );
            }
            out.push_str("</nav>\n");
        }
        out.push_str(
            "<noscript><p class=\"warn\">Plots need JavaScript; the tables below do not.</p></noscript>\n</header>\n",
        );
    }

    fn scripts(&self, out: &mut String) {
        for section in &self.sections {
            for (kind, data) in &section.data {
                let id = format!("{kind}-{}", section.id);
                let _ = writeln!(
                    out,
                    "<script type=\"application/json\" id=\"{}\">{}</script>",
                    escape(&id),
                    script_json(data)
                );
            }
        }
        let _ = writeln!(
            out,
            "<script>\n{LIBRARY}\n</script>\n<script>\n\"use strict\";\n(() => {{"
        );
        SCRIPTS.iter().for_each(|script| out.push_str(script));
        out.push_str("})();\n</script>\n");
    }
}
