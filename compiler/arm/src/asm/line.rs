//! A line into its statements: labels, directives, instructions, and what a comment tells static
//! analysis.

/// A statement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Statement<'a> {
    /// `name:`
    Label(&'a str),
    /// `.name arguments`, without the dot.
    Directive(&'a str, &'a str),
    /// `mnemonic operands`
    Instruction(&'a str, &'a str),
    /// `@! words`
    Note(&'a str),
}

/// The statements of a line.
///
/// # Errors
/// A string does not end.
pub fn statements(line: &str) -> Result<Vec<Statement<'_>>, String> {
    let (mut code, comment) = cut(line, '@')?;
    let mut all = Vec::new();
    if let Some(note) = comment.strip_prefix('!') {
        all.push(Statement::Note(note.trim()));
    }
    while !code.trim().is_empty() {
        let (statement, rest) = cut(code, ';')?;
        labelled(statement.trim(), &mut all);
        code = rest;
    }
    Ok(all)
}

/// What stands before and after the first `at` outside a string.
fn cut(text: &str, at: char) -> Result<(&str, &str), String> {
    let (mut quoted, mut escaped) = (false, false);
    for (place, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if c == at && !quoted => return Ok((&text[..place], &text[place + c.len_utf8()..])),
            _ => {}
        }
    }
    if quoted {
        Err("the string does not end; close it with \"".to_string())
    } else {
        Ok((text, ""))
    }
}

fn labelled<'a>(mut text: &'a str, all: &mut Vec<Statement<'a>>) {
    while let Some((name, rest)) = text.split_once(':').filter(|(name, _)| is_name(name)) {
        all.push(Statement::Label(name));
        text = rest.trim_start();
    }
    if text.is_empty() {
        return;
    }
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    all.push(match word.strip_prefix('.') {
        Some(directive) => Statement::Directive(directive, rest.trim()),
        None => Statement::Instruction(word, rest.trim()),
    });
}

/// Whether a text is the name of a label or a constant; digits alone are a local label.
pub fn is_name(text: &str) -> bool {
    !text.is_empty()
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$'))
}
