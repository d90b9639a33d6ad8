//! Signs of other languages: what they mean here.

use logos::Lexer;

use super::Token;
use crate::diag::{Code, Diagnostic};
use whippen_source::Span;

/// A sign that is no token, the token that stands in for it, and what to write.
struct Foreign {
    text: &'static str,
    meant: Option<Token<'static>>,
    hint: &'static str,
}

const fn sign(text: &'static str, meant: Token<'static>, hint: &'static str) -> Foreign {
    Foreign {
        text,
        meant: Some(meant),
        hint,
    }
}

const fn nothing(text: &'static str, hint: &'static str) -> Foreign {
    Foreign {
        text,
        meant: None,
        hint,
    }
}

/// So much of what is not understood is repeated in the message.
const LONGEST: usize = 20;
const NAMES: &str = "names are made of the letters `A` to `Z`, digits and `_`";
const QUOTES: &str = "write the value itself: only the file of a `device` stands in quotes, `device \"my-key.toml\"`";
const COMPARE: &str =
    "values are compared with `<`, `<=`, `>`, `>=`; a machine's state is asked with `is`";

/// The signs that are known. An equality stands for some comparison, so that both sides are still
/// read.
const FOREIGN: &[Foreign] = &[
    sign("==", Token::LessEqual, COMPARE),
    sign("!=", Token::LessEqual, COMPARE),
    sign("=<", Token::LessEqual, "write `<=`"),
    sign("≤", Token::LessEqual, "write `<=`"),
    sign("≥", Token::GreaterEqual, "write `>=`"),
    sign(
        "=>",
        Token::Arrow,
        "a transition is written `from -> to when ..`",
    ),
    sign("→", Token::Arrow, "write `->`"),
    sign("&&", Token::And, "write `and`"),
    sign("||", Token::Or, "write `or`"),
    sign("!", Token::Not, "write `not`"),
    sign("**", Token::Caret, "a power is written `x^2`"),
    sign("×", Token::Star, "write `*`"),
    sign("·", Token::Star, "write `*`"),
    sign("÷", Token::Slash, "write `/`"),
    sign("−", Token::Minus, "write the minus of the keyboard, `-`"),
    sign("–", Token::Minus, "write the minus of the keyboard, `-`"),
    sign("…", Token::DotDot, "write `..`"),
    sign("’", Token::Prime, "write the straight quote, `'`"),
    sign("′", Token::Prime, "write the straight quote, `'`"),
    sign("[", Token::LeftParen, "only `(` and `{` enclose"),
    sign("]", Token::RightParen, "only `(` and `{` enclose"),
    nothing(";", "declarations end by themselves"),
    nothing("/*", "comments begin with `//` and end with the line"),
    nothing("#", "comments begin with `//`"),
    nothing("\"", QUOTES),
    nothing("“", QUOTES),
    nothing("”", QUOTES),
    sign("‘", Token::Prime, "write the straight quote, `'`"),
    sign("`", Token::Prime, "write the straight quote, `'`"),
    nothing("?", "choose with `if condition then a else b`"),
    nothing("$", NAMES),
    nothing("%", "write a fraction, such as `0.05`"),
    nothing("°", "write the unit `deg` after one space"),
    nothing("²", "write `^2`"),
    nothing("³", "write `^3`"),
    nothing(
        "\u{feff}",
        "this invisible byte order mark says something at the beginning only: delete it",
    ),
    nothing("\u{a0}", "this is a no-break space: write a plain one"),
];

/// The row of a sign of another language. `None` if the sign is unknown.
fn find(text: &str) -> Option<&'static Foreign> {
    let text = if text.starts_with("/*") { "/*" } else { text };
    FOREIGN.iter().find(|f| f.text == text)
}

/// Reports a sign that belongs to no token and gives the token that stands in for it.
pub(super) fn report(
    sign: &str,
    span: Span,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Token<'static>> {
    let found = find(sign);
    diagnostics.push(stray(
        found.map_or(sign, |f| f.text),
        span,
        found.map_or(NAMES, |f| f.hint),
    ));
    found.and_then(|f| f.meant)
}

/// How much of the text repeats an unknown sign.
pub(super) fn repeated(sign: &str, rest: &str) -> usize {
    let known = find(sign).is_some();
    let same = |c: char| !known && sign.starts_with(c);
    rest.len() - rest.trim_start_matches(same).len()
}

/// How much of the text belongs to a name with letters beyond `A` to `Z`.
pub(super) fn rest_of_name(text: &str) -> usize {
    text.find(|c: char| !c.is_alphanumeric() && c != '_')
        .unwrap_or(text.len())
}

/// Reports a name with letters beyond `A` to `Z`, and takes it for a name all the same.
pub(super) fn report_name<'s>(
    name: &'s str,
    span: Span,
    diagnostics: &mut Vec<Diagnostic>,
) -> Token<'s> {
    let micro = name.starts_with(['\u{b5}', '\u{3bc}']);
    diagnostics.push(stray(
        name,
        span,
        if micro {
            "micro is written `u`: `um`, `us`"
        } else {
            NAMES
        },
    ));
    Token::Word(name)
}

fn stray(shown: &str, span: Span, hint: &str) -> Diagnostic {
    let beginning: String = shown.chars().take(LONGEST).collect();
    let more = if beginning.len() < shown.len() {
        "…"
    } else {
        ""
    };
    let message = format!(
        "`{}{more}` is not part of the language",
        beginning
            .escape_debug()
            .to_string()
            .replace("\\\"", "\"")
            .replace("\\'", "'")
    );
    Diagnostic::new(Code::UnexpectedCharacter, span, message, "not understood").hint(hint)
}

/// Called with `/*` read: takes everything up to `*/`, or the rest of the line.
pub(super) fn block_comment<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let rest = lexer.remainder();
    let length = match rest.find("*/") {
        Some(end) => end + 2,
        None => rest.find('\n').unwrap_or(rest.len()),
    };
    lexer.bump(length);
    lexer.slice()
}
