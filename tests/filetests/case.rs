//! The parts of a file: commands, the text under test, sections with what was printed.

/// Begins a section.
const MARK: &str = "==== ";

/// A file.
pub struct Case<'a> {
    /// Commands with their words, in order.
    pub commands: Vec<String>,
    /// The text under test, with the comments before it, so that line numbers are those of the
    /// file.
    pub body: &'a str,
}

impl Case<'_> {
    /// Finds the parts.
    ///
    /// # Errors
    /// An unknown ending; no command; no text.
    pub fn read<'a>(text: &'a str, ending: &str) -> Result<Case<'a>, String> {
        let comment = match ending {
            "kernel" => ";",
            "whip" => "//",
            _ => return Err(format!("files end in .kernel or .whip, not .{ending}")),
        };
        let end = if text.starts_with(MARK) {
            0
        } else {
            text.find(&format!("\n{MARK}"))
                .map_or(text.len(), |at| at + 1)
        };
        let body = &text[..end];
        let comments = body.lines().map_while(|line| line.strip_prefix(comment));
        let commands: Vec<String> = comments
            .filter_map(|line| line.trim().strip_prefix("test "))
            .map(|line| line.trim().to_string())
            .collect();
        if commands.is_empty() {
            return Err(format!("no line `{comment} test ..` at the top"));
        }
        Ok(Case { commands, body })
    }

    /// The whole file with these sections.
    pub fn with(&self, sections: &[(String, String)]) -> String {
        let mut text = self.body.trim_end().to_string() + "\n";
        for (line, printed) in sections {
            text += &format!("\n{MARK}{line}\n{}\n", printed.trim_end());
        }
        text
    }
}

#[test]
fn parts_are_found() {
    let text =
        "; A comment.\n; test verify\n; test run  a=1\nkernel\n; test no\n\n==== verify\nok\n";
    let case = Case::read(text, "kernel").expect("has commands");
    assert_eq!(case.commands, ["verify", "run  a=1"]);
    assert_eq!(case.with(&[("verify".to_string(), "ok".to_string())]), text);
    assert!(
        Case::read("kernel k @1 { }\n", "kernel").is_err(),
        "no command"
    );
    assert!(
        Case::read("; test verify\n", "txt").is_err(),
        "no such ending"
    );
}
