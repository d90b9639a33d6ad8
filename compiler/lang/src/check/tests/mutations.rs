//! Broken programs: whatever is done to the text, the front gives messages and never panics.

use super::super::Options;
use super::check_text;
use crate::bundled::programs;
use crate::diag::Severity;
use whippen_source::SourceMap;

const CASES: usize = 10_000;

/// A xorshift generator: the same cases on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// Words, numbers, signs and blanks of a text, without comments.
fn pieces(text: &str) -> Vec<&str> {
    let kind = |c: char| match c {
        c if c.is_alphanumeric() || c == '_' => 0,
        c if c.is_whitespace() => 1,
        _ => 2,
    };
    let mut pieces = Vec::new();
    for line in text.lines() {
        let mut rest = line.split("//").next().unwrap_or("");
        while let Some(first) = rest.chars().next() {
            let end = rest.find(|c| kind(c) != kind(first)).unwrap_or(rest.len());
            let end = if kind(first) == 2 {
                first.len_utf8()
            } else {
                end
            };
            pieces.push(&rest[..end]);
            rest = &rest[end..];
        }
        pieces.push("\n");
    }
    pieces
}

fn mutate<'a>(pieces: &mut Vec<&'a str>, others: &[&'a str], random: &mut Random) {
    let at = random.below(pieces.len());
    match random.below(5) {
        0 => drop(pieces.remove(at)),
        1 => pieces.insert(at, pieces[at]),
        2 => {
            let other = random.below(pieces.len());
            pieces.swap(at, other);
        }
        3 => pieces[at] = others[random.below(others.len())],
        _ => {
            let end = (at + random.below(12)).min(pieces.len());
            drop(pieces.drain(at..end));
        }
    }
}

#[test]
fn mutated_programs_never_panic() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let all: Vec<Vec<&str>> = programs().map(|(_, text)| pieces(text)).collect();
    let mut accepted = 0;
    for case in 0..CASES {
        let mut broken = all[case % all.len()].clone();
        let others = &all[random.below(all.len())];
        for _ in 0..=random.below(4) {
            mutate(&mut broken, others, &mut random);
            if broken.is_empty() {
                break;
            }
        }
        accepted += usize::from(holds_together(&broken.concat()));
    }
    assert!(
        accepted > CASES / 100 && accepted < CASES / 2,
        "{accepted} of {CASES} were still programs"
    );
}

/// Checks one text: a program or an error, every place inside its file.
fn holds_together(text: &str) -> bool {
    let (map, program, diagnostics) = check_text(text, &Options::default());
    let error = diagnostics.iter().any(|d| d.severity() == Severity::Error);
    assert_eq!(program.is_none(), error, "{text}");
    for d in &diagnostics {
        let places = d.others.iter().map(|o| o.span).chain([d.span]);
        assert!(
            places.clone().all(|span| inside(&map, span)),
            "{d:?}\n{text}"
        );
    }
    if let Some(program) = program {
        assert!(
            program
                .instruments
                .iter()
                .all(|m| m.to_string().starts_with("model "))
        );
    }
    !error
}

fn inside(map: &SourceMap, span: whippen_source::Span) -> bool {
    let file = map.files().get(span.file as usize);
    file.is_some_and(|f| f.text.get(span.start as usize..span.end as usize).is_some())
}
