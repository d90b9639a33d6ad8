//! A number side by side with a word: an unknown unit, or a product without its `*`.

use std::collections::HashSet;

use super::{Tokens, assigns, at, defines, leaves};
use crate::diag::{Advice, Code, Diagnostic};
use crate::syntax::ast::Spanned;
use crate::syntax::token::{Literal, Token};
use crate::units::{nearest_unit, parse_unit, unit_names};
use whippen_source::Span;

/// Inserts the missing `*`, or replaces number and unknown unit by [`Token::Broken`].
pub(super) fn repair<'s>(
    text: &'s str,
    tokens: Tokens<'s>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Tokens<'s> {
    let repair = NumberRepair {
        text,
        declared: declared(&tokens),
        repaired: Tokens::with_capacity(tokens.len()),
        tokens,
        diagnostics,
    };
    repair.run()
}

/// A row of tokens that is being repaired.
struct NumberRepair<'s, 'd> {
    text: &'s str,
    tokens: Tokens<'s>,
    declared: HashSet<&'s str>,
    repaired: Tokens<'s>,
    diagnostics: &'d mut Vec<Diagnostic>,
}

impl<'s> NumberRepair<'s, '_> {
    fn run(mut self) -> Tokens<'s> {
        let mut i = 0;
        while i < self.tokens.len() {
            let token = self.tokens[i];
            self.repaired.push(token);
            i = match token.node {
                Token::Number(literal) => self.repair_number(i, literal),
                _ => i + 1,
            };
        }
        self.repaired
    }

    /// A number, which is pushed already; gives the place of the first token that is not.
    fn repair_number(&mut self, at: usize, literal: Literal<'s>) -> usize {
        let next = at + 1;
        let has_unit = !literal.unit.is_empty();
        if let Some(end) = goes_on(&self.tokens, at, &self.declared).filter(|_| has_unit) {
            self.replace_wrong_unit(at, end, literal);
            return end;
        }
        if next >= self.tokens.len() || !adjoins(self.text, &self.tokens, next) {
            return next;
        }
        if self.is_factor(next) {
            self.insert_times(at);
            return next;
        }
        let mut end = unit_end(&self.tokens, next);
        while has_unit && end < self.tokens.len() && self.is_unit(end) {
            end = unit_end(&self.tokens, end);
        }
        self.replace_word(at, end, literal);
        end
    }

    /// Whether the token at this place can be multiplied by the number before it.
    fn is_factor(&self, next: usize) -> bool {
        let is_called = matches!(at(&self.tokens, next + 1), Some(Token::LeftParen));
        let name = self.tokens[next].node.name();
        name.is_none_or(|name| self.declared.contains(name) || is_called)
    }

    /// Whether nothing but one more unit begins at this place (`0.1 mN m s`).
    fn is_unit(&self, at: usize) -> bool {
        let source = self.source(self.tokens[at].span);
        parse_unit(source).is_some()
            && !self.declared.contains(source)
            && adjoins(self.text, &self.tokens, at)
    }

    /// A number whose unit goes on with what is none (`75 N/mmm`), up to `end`.
    fn replace_wrong_unit(&mut self, at: usize, end: usize, literal: Literal<'s>) {
        let number = self.tokens[at].span;
        let whole = number.to(self.tokens[end - 1].span);
        let unit = Span {
            start: number.end - literal.unit.len() as u32,
            ..whole
        };
        let bare = Literal {
            unit: "",
            ..literal
        };
        let source = self.source(unit);
        let node = report_unit(bare, source, number, unit, self.diagnostics);
        self.replace_last(node, whole);
    }

    /// A number and the word behind it, which ends before `end`.
    fn replace_word(&mut self, at: usize, end: usize, literal: Literal<'s>) {
        let number = self.tokens[at].span;
        let unit = self.tokens[at + 1].span.to(self.tokens[end - 1].span);
        let source = self.source(unit);
        let gap = &self.text[number.end as usize..unit.start as usize];
        // Letters and signs that are no part of the language have been reported by the lexer.
        let is_reported = !source.is_ascii() || !gap.trim().is_empty();
        let node = match is_reported {
            true => Token::Broken,
            false => report_unit(literal, source, number, unit, self.diagnostics),
        };
        self.replace_last(node, number.to(unit));
    }

    /// A `*` behind a number.
    fn insert_times(&mut self, number: usize) {
        let (span, next) = (self.tokens[number].span, &self.tokens[number + 1]);
        let after = at(&self.tokens, number + 2);
        self.diagnostics
            .push(missing_times(self.text, span, next, after));
        self.repaired.push(Spanned {
            node: Token::Star,
            span: Span {
                start: span.end,
                ..span
            },
        });
    }

    fn replace_last(&mut self, node: Token<'s>, span: Span) {
        self.repaired.pop();
        self.repaired.push(Spanned { node, span });
    }

    fn source(&self, span: Span) -> &'s str {
        &self.text[span.start as usize..span.end as usize]
    }
}

/// The names that a number could be meant to be multiplied by: declared in this file, or built in.
fn declared<'s>(tokens: &Tokens<'s>) -> HashSet<&'s str> {
    use Token::{Angle, Colon, Let, Live, Noise, Param, Position, Pulse, Sense, State};
    let mut names = HashSet::from(["gravity", "pi"]);
    for (i, token) in tokens.iter().enumerate() {
        let Some(name) = token.node.name() else {
            continue;
        };
        let before = i.checked_sub(1).and_then(|b| at(tokens, b));
        let introduced = matches!(
            before,
            Some(Sense | Param | Live | Let | State | Pulse | Noise | Angle | Position)
        );
        if introduced || matches!(at(tokens, i + 1), Some(Colon)) {
            names.insert(name);
        }
    }
    names
}

/// Whether the token at this place, which follows a number, can be nothing but a unit or a factor.
fn adjoins(text: &str, tokens: &Tokens, i: usize) -> bool {
    let token = tokens[i].node;
    let between = text.get(tokens[i - 1].span.end as usize..tokens[i].span.start as usize);
    if between.is_none_or(|gap| gap.contains('\n')) {
        return false;
    }
    if token.name().is_none() {
        return token == Token::LeftParen;
    }
    let goes_on = at(tokens, i + 1)
        .is_some_and(|t| t.begins_expression() || matches!(t, Token::Sharp(_) | Token::Text(_)));
    let soft = goes_on && !matches!(token, Token::Word(_));
    let argument = at(tokens, i + 1) == Some(Token::Colon);
    !(soft
        || argument
        || defines(tokens, i)
        || assigns(tokens, i)
        || leaves(tokens, i)
        || sets_per_key(tokens, i))
}

/// Whether `instrument.param =` begins here.
fn sets_per_key(tokens: &Tokens, i: usize) -> bool {
    matches!(at(tokens, i + 1), Some(Token::Dot)) && defines(tokens, i + 2)
}

fn missing_times(
    text: &str,
    number: Span,
    next: &Spanned<Token>,
    after: Option<Token>,
) -> Diagnostic {
    let source = |s: Span| &text[s.start as usize..s.end as usize];
    let (factor, label) = match (next.node, after) {
        (Token::LeftParen, _) => ("(..)".to_string(), "a factor"),
        (_, Some(Token::LeftParen)) => (format!("{}(..)", source(next.span)), "a factor"),
        _ => (source(next.span).to_string(), "this is a name, not a unit"),
    };
    let message = format!(
        "a `*` is missing between `{}` and `{factor}`",
        source(number)
    );
    let hint = format!("write `{} * {factor}`", source(number));
    let gap = Span {
        start: number.end,
        end: next.span.start,
        ..number
    };
    Diagnostic::new(Code::MissingTimes, next.span, message, label)
        .hint(hint)
        .replace(gap, " * ")
}

/// One past the last token of `word(^int)?([*/]word(^int)?)*` written without spaces from here on.
fn unit_end(tokens: &Tokens, start: usize) -> usize {
    let touches = |i: usize| {
        tokens
            .get(i)
            .is_some_and(|t| t.span.start == tokens[i - 1].span.end)
    };
    let mut end = start + 1;
    loop {
        if touches(end) && tokens[end].node == Token::Caret && touches(end + 1) {
            end += 2;
        }
        let sign = touches(end) && matches!(tokens[end].node, Token::Star | Token::Slash);
        if !(sign && touches(end + 1) && tokens[end + 1].node.name().is_some()) {
            return end;
        }
        end += 2;
    }
}

/// Reports a word after a number that is no unit there, and gives the token that stands for both.
fn report_unit<'s>(
    literal: Literal<'s>,
    source: &'s str,
    number: Span,
    unit: Span,
    diagnostics: &mut Vec<Diagnostic>,
) -> Token<'s> {
    let digits = literal.digits;
    if !literal.unit.is_empty() {
        diagnostics.push(second_unit(literal, source, unit));
    } else if parse_unit(source).is_some() {
        diagnostics.push(far_unit(digits, source, number.to(unit)));
        return Token::Number(Literal {
            digits,
            unit: source,
        });
    } else {
        diagnostics.push(unknown_unit(digits, source, unit));
    }
    Token::Broken
}

fn second_unit(literal: Literal, source: &str, unit: Span) -> Diagnostic {
    let Literal {
        digits, unit: own, ..
    } = literal;
    let message = format!("`{source}` follows a number that has its unit `{own}` already");
    let factors: Vec<&str> = source.split_whitespace().collect();
    let whole = format!("{own}*{}", factors.join("*"));
    let hint = match parse_unit(&whole) {
        Some(_) => format!("write `{digits} {whole}`"),
        None => format!(
            "a factor needs its sign: `{digits} {own} * {}`",
            factors.join(" * ")
        ),
    };
    Diagnostic::new(Code::UnknownUnit, unit, message, "not expected here").hint(hint)
}

fn far_unit(digits: &str, source: &str, whole: Span) -> Diagnostic {
    let message = format!("the unit `{source}` must follow its number after exactly one space");
    let label = format!("this far from `{digits}`, it is no unit");
    let right = format!("{digits} {source}");
    Diagnostic::new(Code::UnknownUnit, whole, message, label)
        .hint(Advice::instead(format!("write `{right}`"), right))
}

fn unknown_unit(digits: &str, source: &str, unit: Span) -> Diagnostic {
    let word = source
        .split(['*', '/', '^'])
        .find(|w| parse_unit(w).is_none())
        .unwrap_or(source);
    let message = format!("`{word}` is not a unit");
    let diagnostic = Diagnostic::new(Code::UnknownUnit, unit, message, "unknown unit");
    match powered(word).or_else(|| nearest_unit(word).map(str::to_string)) {
        Some(near) => {
            let right = source.replacen(word, &near, 1);
            let advice = format!("did you mean `{digits} {right}`?");
            diagnostic.hint(Advice::instead(advice, right))
        }
        None => {
            let known: Vec<&str> = unit_names().collect();
            diagnostic.hint(format!("known units are {}", known.join(", ")))
        }
    }
}

/// `mm^2` for `mm2`.
fn powered(word: &str) -> Option<String> {
    let power = word.chars().next_back().filter(char::is_ascii_digit)?;
    let base = &word[..word.len() - 1];
    parse_unit(base).map(|_| format!("{base}^{power}"))
}

/// Where a unit goes on with a word that is nearly one and no name (`75 N/mmm`), one past its last
/// token.
fn goes_on(tokens: &Tokens, number: usize, declared: &HashSet<&str>) -> Option<usize> {
    let touches = |i: usize| {
        tokens
            .get(i)
            .is_some_and(|t| t.span.start == tokens[i - 1].span.end)
    };
    let sign = touches(number + 1) && matches!(tokens[number + 1].node, Token::Star | Token::Slash);
    let word = tokens
        .get(number + 2)
        .and_then(|t| t.node.name())
        .filter(|_| sign && touches(number + 2))?;
    let call = matches!(at(tokens, number + 3), Some(Token::LeftParen));
    let end = unit_end(tokens, number + 2);
    let other = matches!(at(tokens, end), Some(Token::Dot | Token::Prime));
    let near = powered(word).is_some() || nearest_unit(word).is_some();
    (near && !call && !other && !declared.contains(word)).then_some(end)
}
