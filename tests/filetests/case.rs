//! The parts of a file: commands, the text under test, sections with what was printed.

/// Begins a section.
const MARK: &str = "==== ";

/// Begins, behind the comment's mark, a line of more words.
const FURTHER: &str = "   ";

/// A file.
pub struct Case<'a> {
    /// Commands with their words, in order; a line of comment that is indented further goes on with
    /// the words of the line before.
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
        let mut commands: Vec<String> = Vec::new();
        for line in comments {
            if let Some(command) = line.trim().strip_prefix("test ") {
                commands.push(command.trim().to_string());
            } else if let (true, Some(last)) = (line.starts_with(FURTHER), commands.last_mut()) {
                *last += &format!("\n{}", line.trim());
            }
        }
        if commands.is_empty() {
            return Err(format!("no line `{comment} test ..` at the top"));
        }
        Ok(Case { commands, body })
    }

    /// The whole file with these sections; a section's title is the first line of its command.
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
    let long = Case::read("; test run a=1\n;     b=2\n; why\nkernel\n", "kernel");
    assert_eq!(long.expect("has a command").commands, ["run a=1\nb=2"]);
    assert!(
        Case::read("kernel k @1 { }\n", "kernel").is_err(),
        "no command"
    );
    assert!(
        Case::read("; test verify\n", "txt").is_err(),
        "no such ending"
    );
}
