//! Prose in Markdown: one sentence on a line, and none that is too long.

use super::{Text, none, only_listed, texts};

/// Columns of a line of Markdown outside of tables and code.
const MARKDOWN_MAX: usize = 350;

/// Documents with longer sentences, and why.
const LONG_SENTENCES: &[(&str, &str)] = &[];

/// The lines of a document that are prose: nothing in fences, no tables, no code by indentation.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        let code = fenced || fence || line.starts_with("    ");
        !code && !line.trim_start().starts_with('|')
    })
}

fn documents() -> Vec<Text> {
    let mut documents = texts();
    documents.retain(|text| text.path.ends_with(".md"));
    documents
}

#[test]
fn sentences_are_short() {
    let long = |text: &Text| prose(&text.text).any(|(_, l)| l.chars().count() > MARKDOWN_MAX);
    let found = documents()
        .into_iter()
        .filter(long)
        .map(|text| text.path)
        .collect();
    let rule = format!("a line of Markdown has at most {MARKDOWN_MAX} columns");
    only_listed(&found, LONG_SENTENCES.iter().map(|e| e.0), &rule);
}

/// Whether a sentence ends before the end of a line and another begins. Code and what is in
/// parentheses does not count, nor the number of a heading or of a list.
fn holds_two_sentences(line: &str) -> bool {
    let mut plain = String::new();
    let (mut quoted, mut depth) = (false, 0_usize);
    for c in line.chars() {
        match c {
            '`' => quoted = !quoted,
            '(' if !quoted => depth += 1,
            ')' if !quoted => depth = depth.saturating_sub(1),
            _ if !quoted && depth == 0 => plain.push(c),
            _ => {}
        }
        // Something stands there.
        if matches!(c, '`' | ')') && !quoted && depth == 0 {
            plain.push('x');
        }
    }
    let number = |c: char| c.is_ascii_digit() || "#. *".contains(c);
    let plain = plain.trim_start_matches(number);
    plain.match_indices(". ").any(|(at, _)| {
        let ends = plain[..at].ends_with(|c: char| c.is_lowercase() || c.is_ascii_digit());
        ends && plain[at + 2..].starts_with(|c: char| c.is_uppercase() || c == '`')
    })
}

#[test]
fn one_sentence_stands_on_a_line() {
    assert!(holds_two_sentences("One ends (here. No). Two begins."));
    assert!(!holds_two_sentences(
        "3. `a. B` (see there. It says) goes on."
    ));
    let mut found = Vec::new();
    for text in documents() {
        let lines = prose(&text.text).filter(|(_, line)| holds_two_sentences(line));
        found.extend(lines.map(|(number, _)| format!("{}:{number}", text.path)));
    }
    none(&found, "one sentence stands on a line of Markdown");
}
