//! Lines of Rust with code, strings and comments told apart: as much of a lexer as rules about
//! lines need.

/// A line of a Rust file.
pub struct Line<'a> {
    pub text: &'a str,
    /// Without comments, and without what stands in strings.
    pub code: String,
    /// Whether part of a string stands in it, or all of it is in one.
    pub has_string: bool,
    /// What follows `//`, if anything does.
    pub comment: Option<&'a str>,
}

/// What a line begins in, left over from the one before.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Code,
    /// A string with escapes.
    String,
    /// A raw string that ends with a quote and so many `#`.
    Raw(usize),
    /// A comment between `/*` and `*/`, that many deep.
    Block(usize),
}

/// The lines of a text.
pub fn lines(text: &str) -> Vec<Line<'_>> {
    let mut state = State::Code;
    text.lines().map(|line| read(line, &mut state)).collect()
}

fn read<'a>(text: &'a str, state: &mut State) -> Line<'a> {
    let mut line = Line {
        text,
        code: String::new(),
        has_string: matches!(state, State::String | State::Raw(_)),
        comment: None,
    };
    let mut rest = text;
    while !rest.is_empty() {
        let length = match *state {
            State::Code if rest.starts_with("//") => {
                line.comment = Some(&rest[2..]);
                break;
            }
            State::Code => code(rest, state, &mut line),
            State::String => string(rest, state),
            State::Raw(hashes) => raw(rest, hashes, state),
            State::Block(depth) => block(rest, depth, state),
        };
        rest = &rest[length..];
    }
    line
}

/// Takes the next of a line's code; how many bytes that was.
fn code(rest: &str, state: &mut State, line: &mut Line) -> usize {
    let begins_word = !line
        .code
        .ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let length = match rest.as_bytes()[0] {
        b'"' => {
            *state = State::String;
            1
        }
        b'/' if rest.starts_with("/*") => {
            *state = State::Block(1);
            return 2;
        }
        b'r' | b'b' if begins_word && raw_start(rest).is_some() => {
            let (length, hashes) = raw_start(rest).unwrap_or_default();
            *state = State::Raw(hashes);
            length
        }
        b'\'' => character(rest),
        _ => {
            let next = rest.chars().next().unwrap_or_default();
            line.code.push(next);
            return next.len_utf8();
        }
    };
    line.has_string |= *state != State::Code;
    // Something stands there, so that what is around it does not join.
    line.code.push('"');
    length
}

/// Length and number of `#` of what begins a raw string.
fn raw_start(rest: &str) -> Option<(usize, usize)> {
    let letters = ["br", "r"].into_iter().find(|l| rest.starts_with(l))?;
    let behind = &rest[letters.len()..];
    let hashes = behind.len() - behind.trim_start_matches('#').len();
    behind[hashes..]
        .starts_with('"')
        .then_some((letters.len() + hashes + 1, hashes))
}

/// Bytes of a character, or of the quote of a lifetime.
fn character(rest: &str) -> usize {
    let mut chars = rest.char_indices().skip(1);
    let (_, first) = chars.next().unwrap_or((0, ' '));
    if first == '\\' {
        let end = rest[3..].find('\'');
        return end.map_or(1, |end| 3 + end + 1);
    }
    match chars.next() {
        Some((at, '\'')) => at + 1,
        _ => 1,
    }
}

fn string(rest: &str, state: &mut State) -> usize {
    match rest.find(['"', '\\']) {
        Some(at) if rest[at..].starts_with('"') => {
            *state = State::Code;
            at + 1
        }
        // The character behind it, unless the line ends there.
        Some(at) => at + 1 + rest[at + 1..].chars().next().map_or(0, char::len_utf8),
        None => rest.len(),
    }
}

fn raw(rest: &str, hashes: usize, state: &mut State) -> usize {
    let end = format!("\"{}", "#".repeat(hashes));
    match rest.find(&end) {
        Some(at) => {
            *state = State::Code;
            at + end.len()
        }
        None => rest.len(),
    }
}

fn block(rest: &str, depth: usize, state: &mut State) -> usize {
    match (rest.find("/*"), rest.find("*/")) {
        (Some(open), close) if close.is_none_or(|close| open < close) => {
            *state = State::Block(depth + 1);
            open + 2
        }
        (_, Some(close)) => {
            *state = match depth {
                1 => State::Code,
                _ => State::Block(depth - 1),
            };
            close + 2
        }
        _ => rest.len(),
    }
}

#[test]
fn strings_and_comments_are_told_from_code() {
    let text = "let a = \"// f64 \\\" \\\\\"; f(b) // c\nr#\"one \"\n f64 // \"#.len() + '\"' as u8\n\
                fn x<'a>(y: &'a str) /* f64 /* \" */ */ {} '\\'' \"two\\\n  three\" four br\"\\\" five";
    let all = lines(text);
    let code: Vec<&str> = all.iter().map(|line| line.code.as_str()).collect();
    assert_eq!(
        code,
        [
            "let a = \"; f(b) ",
            "\"",
            ".len() + \" as u8",
            "fn x<\"a>(y: &\"a str)  {} \" \"",
            " four \" five",
        ]
    );
    assert_eq!(all[0].comment, Some(" c"));
    assert_eq!(all[2].comment, None);
    let strings: Vec<bool> = all.iter().map(|line| line.has_string).collect();
    assert_eq!(strings, [true, true, true, true, true]);
    assert!(!lines("let c = 'x'; // \"")[0].has_string);
}
