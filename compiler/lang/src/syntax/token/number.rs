//! Numbers with their units.

use logos::Lexer;

use super::Token;
use crate::diag::{Advice, Code, Diagnostic};
use crate::units::{longest_unit, parse_unit, word_length};
use whippen_source::Span;

/// A number as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Literal<'s> {
    /// The digits.
    pub digits: &'s str,
    /// The unit; empty if there is none.
    pub unit: &'s str,
}

/// Called with the digits read: takes the rest of a number gone wrong, then the unit after exactly
/// one space.
pub(super) fn scan<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> Literal<'s> {
    lexer.bump(wrong_length(lexer.remainder()));
    // `80N/m`: the number takes all of a unit that touches it.
    if let Some(letters) = lexer.slice().find(|c: char| c.is_ascii_alphabetic()) {
        let glued = &lexer.source()[lexer.span().start + letters..];
        let beyond = longest_unit(glued).map_or(0, |(length, _)| {
            (letters + length).saturating_sub(lexer.slice().len())
        });
        lexer.bump(beyond);
    }
    let digits = lexer.slice();
    let rest = lexer.remainder();
    let unit = rest
        .strip_prefix(' ')
        .and_then(|after| longest_unit(after).map(|(length, _)| &after[..length]));
    lexer.bump(unit.map_or(0, |unit| 1 + unit.len()));
    Literal {
        digits,
        unit: unit.unwrap_or_default(),
    }
}

/// How much of the text after the digits belongs to a number gone wrong (`.2.3`, `mm`, `.`).
fn wrong_length(rest: &str) -> usize {
    let mut end = 0;
    loop {
        let tail = &rest[end..];
        let part = tail.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
        let point = tail.starts_with('.') && !tail.starts_with("..");
        if !part && !point {
            return end;
        }
        end += 1;
    }
}

/// The token of a number as read: itself, or [`Token::Broken`] with a diagnostic.
pub(super) fn check<'s>(
    literal: Literal<'s>,
    span: Span,
    diagnostics: &mut Vec<Diagnostic>,
) -> Token<'s> {
    let digits = literal.digits;
    let number_end = digits
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(digits.len());
    let (front, back) = digits.split_at(number_end);
    let mut report = |message: String, hint: Advice| {
        diagnostics
            .push(Diagnostic::new(Code::BadNumber, span, message, "not a number").hint(hint));
    };
    match digits.parse::<f64>() {
        Ok(value) if value.is_infinite() => {
            report(format!("`{digits}` is too large"), largest().into())
        }
        Ok(_) if digits.starts_with('.') => {
            report(
                format!("`{digits}` has no digit before the point"),
                instead(format!("0{digits}")),
            );
        }
        Ok(_) if digits.ends_with('.') => {
            report(
                format!("`{digits}` has no digit after the point"),
                instead(format!("{digits}0")),
            );
        }
        Ok(_) => return Token::Number(literal),
        Err(_) if parse_unit(back).is_some() && front.parse::<f64>().is_ok() => {
            report(
                format!("`{digits}` lacks the space before its unit"),
                Advice::instead(
                    format!("put one space between number and unit: `{front} {back}`"),
                    format!("{front} {back}"),
                ),
            );
            return Token::Number(Literal {
                digits: front,
                unit: back,
            });
        }
        Err(_) if is_apart(digits) => {
            report(format!("`{digits}` is not a number"), together(digits));
        }
        Err(_)
            if word_length(back) == back.len() && front.parse::<f64>().is_ok_and(|n| n != 0.0) =>
        {
            report(
                format!("`{digits}` is not a number"),
                format!("if `{back}` is a name, write `{front} * {back}`").into(),
            );
        }
        Err(_) => report(format!("`{digits}` is not a number"), shape().into()),
    }
    Token::Broken
}

/// Whether signs between its digits alone make no number of it (`1_000`).
fn is_apart(digits: &str) -> bool {
    let plain = |c: u8| c.is_ascii_digit() || b"_.".contains(&c);
    let number = digits.replace('_', "").parse::<f64>();
    digits.contains('_') && digits.bytes().all(plain) && number.is_ok()
}

fn together(digits: &str) -> Advice {
    let right = digits.replace('_', "");
    let hint = format!("the digits of a number stand together: `{right}`");
    Advice::instead(hint, right)
}

fn instead(text: String) -> Advice {
    Advice::instead(format!("write `{text}`"), text)
}

fn shape() -> String {
    "a number is written `12`, `0.5` or `8e3`; a unit follows after one space".to_string()
}

fn largest() -> String {
    "numbers reach up to 1.7e308".to_string()
}
