//! The words of the repository: the glossary is in order and leads to files that are there, and
//! retired words stay out.

use super::{Text, has_word, none, root, texts};

/// Words that were given up: the word, what to say instead, and the beginnings of paths where it
/// may still stand.
const RETIRED: &[(&str, &str, &[&str])] = &[
    ("dearer", "slower, costs more", JUDGES),
    ("dearest", "worst-case", JUDGES),
    // Pins of a chip keep their name.
    (
        "pins",
        "promoted words",
        &[
            "ARCHITECTURE.md",
            "CHANGELOG.md",
            "compiler/board/",
            "compiler/firmware/",
            "docs/",
            "emulator/",
            "instruments/",
            "runtime/",
            "src/cmd/build/report.rs",
            "src/cmd/emulate",
            "tests/firmware/key",
            "tests/firmware/knob",
            "tests/firmware/sound_out.rs",
            "tests/it/bench.rs",
            "tests/it/columns.rs",
            "tests/it/emulate",
        ],
    ),
    ("rivals", "contenders", &["compiler/budget/"]),
    ("speaker", "representative", &["compiler/lower/"]),
    ("surroundings", "interference", JUDGES),
    ("vcode", "minst", &[]),
    ("once_more", "rematerialize", &[]),
];

/// The bound, and those who print what they found: their words are still those of before.
const JUDGES: &[&str] = &["benches/", "compiler/budget/", "runtime/", "src/", "tests/"];

/// Where retired words are spoken of.
const SPOKEN_OF: &[&str] = &["GLOSSARY.md", "tests/tidy/words.rs"];

/// The rows of a table under a heading: their cells.
fn rows<'a>(text: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let section = text.split(heading).nth(1).unwrap_or_default();
    let section = section.split("\n## ").next().unwrap_or_default();
    let cells = |line: &'a str| line.trim_matches('|').split('|').map(str::trim).collect();
    section
        .lines()
        .filter(|line| line.starts_with('|'))
        .skip(2)
        .map(cells)
        .collect()
}

fn glossary() -> String {
    std::fs::read_to_string(root().join("GLOSSARY.md")).expect("the glossary")
}

#[test]
fn every_word_of_the_glossary_has_a_home() {
    let text = glossary();
    let rows = rows(&text, "# Glossary\n");
    assert!(rows.len() > 80, "only {} words", rows.len());
    let words: Vec<String> = rows.iter().map(|row| row[0].to_lowercase()).collect();
    assert!(words.is_sorted(), "words are in the order of the alphabet");
    let mut found = Vec::new();
    for row in &rows {
        match row[..] {
            [word, meaning, home] if !word.is_empty() && !meaning.is_empty() => {
                if !root().join(home.trim_matches('`')).is_file() {
                    found.push(format!("{word}: {home}"));
                }
            }
            _ => found.push(format!("{row:?} is no word with meaning and home")),
        }
    }
    none(&found, "every word has a home");
}

/// A text in one line, without the marks of comments.
fn flowed(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.trim().trim_start_matches(['/', '!']));
    let words = lines.flat_map(str::split_whitespace);
    words.collect::<Vec<_>>().join(" ").to_lowercase()
}

#[test]
fn homes_name_their_words() {
    let text = glossary();
    let mut found = Vec::new();
    for row in rows(&text, "# Glossary\n") {
        let [word, _, home] = row[..] else { continue };
        let home = home.trim_matches('`');
        // An unknown home is found by another test.
        let Ok(text) = std::fs::read_to_string(root().join(home)) else {
            continue;
        };
        let text = flowed(&text);
        let plain = word.split(" (").next().unwrap_or_default().to_lowercase();
        let missing = plain.split(", ").filter(|part| !text.contains(part));
        found.extend(missing.map(|part| format!("{home} does not name {part}")));
    }
    none(&found, "the home of a word names it");
}

#[test]
fn retired_words_stay_out() {
    let listed = glossary();
    let listed = rows(&listed, "## Retired words\n");
    let mut found = Vec::new();
    for (word, instead, allowed) in RETIRED {
        if !listed.iter().any(|row| has_word(row[0], word)) {
            found.push(format!("GLOSSARY.md does not list {word}"));
        }
        let speaks = |path: &str| SPOKEN_OF.contains(&path);
        let may = |text: &&Text| {
            let is_ours = [".rs", ".md"].iter().any(|end| text.path.ends_with(end));
            is_ours && !speaks(&text.path) && !allowed.iter().any(|at| text.path.starts_with(at))
        };
        for text in texts().iter().filter(may) {
            for (number, line) in text.text.lines().enumerate() {
                if has_word(&line.to_lowercase(), word) {
                    let place = format!("{}:{}", text.path, number + 1);
                    found.push(format!("{place}: {word}, say {instead}"));
                }
            }
        }
    }
    none(&found, "retired words stay out");
}
