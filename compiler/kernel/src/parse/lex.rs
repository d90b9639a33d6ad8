//! Lexer of the Kernel's text.

use super::ParseError;
use logos::Logos;
use std::fmt;

/// A token.
#[derive(Logos, Debug, Clone, PartialEq, Eq)]
#[logos(skip r"[ \t\r\n\f]+", skip(r";[^\n]*", allow_greedy = true))]
pub(super) enum Token {
    #[regex(r"[A-Za-z_][A-Za-z0-9_']*(\.[A-Za-z0-9_']+)*", |lex| lex.slice().to_string())]
    Name(String),
    #[regex(r#""([^"\\\n]|\\[^\n])*""#, |lex| unquote(lex.slice()))]
    Quoted(String),
    #[regex(r"-?[0-9]+", |lex| lex.slice().parse().ok())]
    Number(i64),
    #[token("{")]
    Open,
    #[token("}")]
    Close,
    #[token("(")]
    Left,
    #[token(")")]
    Right,
    #[token("[")]
    LeftSquare,
    #[token("]")]
    RightSquare,
    #[token(":")]
    Colon,
    #[token(",")]
    Comma,
    #[token("=")]
    Equals,
    #[token("@")]
    At,
    #[token("/")]
    Slash,
    #[token("..")]
    Dots,
    /// End of the text.
    End,
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let sign = match self {
            Token::Name(name) => return write!(f, "`{name}`"),
            Token::Quoted(name) => return write!(f, "{name:?}"),
            Token::Number(number) => return write!(f, "`{number}`"),
            Token::End => return f.write_str("the end"),
            Token::Open => "{",
            Token::Close => "}",
            Token::Left => "(",
            Token::Right => ")",
            Token::LeftSquare => "[",
            Token::RightSquare => "]",
            Token::Colon => ":",
            Token::Comma => ",",
            Token::Equals => "=",
            Token::At => "@",
            Token::Slash => "/",
            Token::Dots => "..",
        };
        write!(f, "`{sign}`")
    }
}

/// A token and its place.
#[derive(Debug, Clone)]
pub(super) struct Lexeme {
    pub token: Token,
    /// From 1.
    pub line: usize,
    /// In characters, from 1.
    pub column: usize,
}

/// All tokens, then [`Token::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<Lexeme>, ParseError> {
    let mut place = LinePosition {
        text,
        at: 0,
        line: 1,
        column: 1,
    };
    let mut all = Vec::new();
    for (token, span) in Token::lexer(text).spanned() {
        let (line, column) = place.advance(span.start);
        let Ok(token) = token else {
            return Err(ParseError {
                line,
                column,
                message: format!("what is `{}`?", &text[span]),
            });
        };
        all.push(Lexeme {
            token,
            line,
            column,
        });
    }
    let (line, column) = place.advance(text.len());
    all.push(Lexeme {
        token: Token::End,
        line,
        column,
    });
    Ok(all)
}

/// A place that moves forward through a text.
struct LinePosition<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    column: usize,
}

impl LinePosition<'_> {
    /// Line and column of a byte offset not before the last one.
    fn advance(&mut self, to: usize) -> (usize, usize) {
        for c in self.text[self.at..to].chars() {
            (self.line, self.column) = if c == '\n' {
                (self.line + 1, 1)
            } else {
                (self.line, self.column + 1)
            };
        }
        self.at = to;
        (self.line, self.column)
    }
}

/// The name between quotes, its escapes resolved; none if one is unknown.
fn unquote(quoted: &str) -> Option<String> {
    let mut name = String::new();
    let mut rest = quoted.strip_prefix('"')?.strip_suffix('"')?.chars();
    while let Some(c) = rest.next() {
        name.push(match c {
            '\\' => escape(&mut rest)?,
            c => c,
        });
    }
    Some(name)
}

/// What follows a backslash: the escapes of `char::escape_default`.
fn escape(rest: &mut std::str::Chars) -> Option<char> {
    match rest.next()? {
        'n' => Some('\n'),
        't' => Some('\t'),
        'r' => Some('\r'),
        'u' => {
            let (digits, after) = rest.as_str().strip_prefix('{')?.split_once('}')?;
            *rest = after.chars();
            u32::from_str_radix(digits, 16)
                .ok()
                .and_then(char::from_u32)
        }
        c @ ('\\' | '"' | '\'') => Some(c),
        _ => None,
    }
}
