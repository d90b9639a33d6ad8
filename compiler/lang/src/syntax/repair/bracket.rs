//! Gives every bracket its partner, and every brace its level.
//!
//! A block that is still open where a declaration begins was meant to end before it: declarations
//! stand one level deep, and their keywords stand nowhere else.

use super::{Tokens, at, defines};
use crate::diag::{Advice, Code, Diagnostic};
use crate::syntax::ast::Spanned;
use crate::syntax::token::{Level, Token};
use whippen_source::Span;

/// Brackets may be nested this deeply.
const DEEPEST: usize = 64;

/// Inserts missing brackets, drops surplus ones, and reports both.
pub(super) fn repair<'s>(tokens: Tokens<'s>, diagnostics: &mut Vec<Diagnostic>) -> Tokens<'s> {
    let mut repair = Repair {
        out: Tokens::with_capacity(tokens.len()),
        open: Vec::new(),
        diagnostics,
    };
    let closed = closed_later(&tokens);
    let mut i = 0;
    while i < tokens.len() {
        let token = tokens[i];
        if token.node == Token::LeftParen || matches!(token.node, Token::Open(_)) {
            i = repair.opens(&tokens, i);
            continue;
        }
        match token.node {
            Token::RightParen => repair.closes_paren(token),
            Token::Close(_) => {
                let goes_on = begins_declaration(&tokens, i + 1) && closed[i + 1];
                repair.closes_brace(token, goes_on);
            }
            _ => {
                repair.ends_before(token.span, outermost(&tokens, i));
                repair.out.push(token);
            }
        }
        i += 1;
    }
    let end = tokens.last().map_or(Span::default(), |t| Span {
        start: t.span.end,
        ..t.span
    });
    repair.ends_before(end, 0);
    repair.out
}

/// How many brackets may be open where this token stands.
fn outermost(tokens: &Tokens, i: usize) -> usize {
    match tokens[i].node {
        Token::Instrument | Token::Term | Token::Keyboard => 0,
        _ if begins_declaration(tokens, i) => 1,
        _ => usize::MAX,
    }
}

/// Whether a declaration of an instrument or a term begins here, and nothing else can.
fn begins_declaration(tokens: &Tokens, i: usize) -> bool {
    use Token::*;
    let named = at(tokens, i + 1).is_some_and(|t| t.name().is_some());
    match at(tokens, i) {
        Some(Sense | Live | Param | Let | States | State | Next | Body | Event | Pulse | Hold) => {
            true
        }
        Some(Feed) => named && defines(tokens, i + 1),
        Some(Delay) => named && at(tokens, i + 2) == Some(Colon),
        Some(String) => named && at(tokens, i + 2) == Some(Along),
        Some(Force | Torque | Sound) => {
            let is_name = |place: usize| at(tokens, place).is_some_and(|t| t.name().is_some());
            let on_a_sense = at(tokens, i + 2) == Some(On) && is_name(i + 3);
            is_name(i + 1) && (defines(tokens, i + 1) || on_a_sense && defines(tokens, i + 3))
        }
        _ => false,
    }
}

/// For every place, whether a block that is open there is closed further on, before something
/// begins that stands in no block. A block that seems to be over goes on where a declaration
/// follows and this holds.
///
/// One walk from the end: a block is closed where the depth falls below what it is at the place,
/// so the lowest depth behind a place decides.
fn closed_later(tokens: &Tokens) -> Vec<bool> {
    let step = |token: &Token| match token {
        Token::Open(_) => 1_i64,
        Token::Close(_) => -1,
        _ => 0,
    };
    // Depths are counted from the end, where they are 0.
    let (mut depth, mut lowest) = (0, 0);
    let mut closed = vec![false; tokens.len() + 1];
    for (i, token) in tokens.iter().enumerate().rev() {
        depth -= step(&token.node);
        lowest = match token.node {
            Token::Instrument | Token::Term | Token::Keyboard => depth,
            _ => depth.min(lowest),
        };
        closed[i] = lowest < depth;
    }
    closed
}

struct Repair<'s, 'd> {
    out: Tokens<'s>,
    /// The open brackets: where, and whether a brace.
    open: Vec<(Span, bool)>,
    diagnostics: &'d mut Vec<Diagnostic>,
}

impl<'s> Repair<'s, '_> {
    fn braces(&self) -> usize {
        self.open.iter().filter(|(_, brace)| *brace).count()
    }

    /// An opening bracket; gives the place to go on at.
    fn opens(&mut self, tokens: &Tokens<'s>, i: usize) -> usize {
        let Spanned { node, span } = tokens[i];
        let brace = node != Token::LeftParen;
        if brace {
            self.close_parens(span);
        }
        let opened = if brace {
            Level::inside(self.braces()).map(Token::Open)
        } else {
            Some(node)
        };
        match opened.filter(|_| self.open.len() < DEEPEST) {
            Some(node) => {
                self.out.push(Spanned { node, span });
                self.open.push((span, brace));
                i + 1
            }
            None => {
                let message = if brace {
                    "no block can stand here"
                } else {
                    "brackets are nested too deeply"
                };
                let hint = if brace {
                    "close the block before it first"
                } else {
                    "give parts of the expression names with `let`"
                };
                self.diagnostics.push(
                    Diagnostic::new(Code::TooDeep, span, message, "left out from here on")
                        .hint(hint),
                );
                self.out.extend((!brace).then_some(Spanned {
                    node: Token::Broken,
                    span,
                }));
                partner(tokens, i) + 1
            }
        }
    }

    fn closes_paren(&mut self, token: Spanned<Token<'s>>) {
        match self.open.last() {
            Some((_, false)) => {
                self.open.pop();
                self.out.push(token);
            }
            _ => self.surplus(token.span, ")"),
        }
    }

    /// A closing brace; surplus if it closes nothing, or the outermost block before its
    /// declarations are over.
    fn closes_brace(&mut self, token: Spanned<Token<'s>>, goes_on: bool) {
        self.close_parens(token.span);
        match self.braces().checked_sub(1).and_then(Level::inside) {
            Some(level) if level > Level::Outer || !goes_on => {
                self.open.pop();
                self.out.push(Spanned {
                    node: Token::Close(level),
                    ..token
                });
            }
            _ => self.surplus(token.span, "}"),
        }
    }

    fn surplus(&mut self, span: Span, bracket: &str) {
        let message = format!("`{bracket}` closes nothing");
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, span, message, "one too many");
        self.diagnostics
            .push(diagnostic.hint(Advice::instead("take it away", "")));
    }

    /// Closes round brackets down to the innermost brace.
    fn close_parens(&mut self, before: Span) {
        let keep = self
            .open
            .iter()
            .rposition(|(_, brace)| *brace)
            .map_or(0, |brace| brace + 1);
        self.ends_before(before, keep);
    }

    /// Closes all open brackets but so many, and reports them together.
    fn ends_before(&mut self, before: Span, keep: usize) {
        if self.open.len() <= keep {
            return;
        }
        let place = self.out.last().map_or(before, |t| Span {
            start: t.span.end,
            ..t.span
        });
        let missing = self.open.split_off(keep);
        let sign = |brace: bool| if brace { ("{", "}") } else { ("(", ")") };
        for (depth, (_, brace)) in missing.iter().enumerate().rev() {
            let outside = self
                .open
                .iter()
                .chain(&missing[..depth])
                .filter(|(_, brace)| *brace)
                .count();
            let node = if *brace {
                Level::inside(outside).map(Token::Close)
            } else {
                Some(Token::RightParen)
            };
            self.out
                .extend(node.map(|node| Spanned { node, span: place }));
        }
        let Some(&(span, brace)) = missing.last() else {
            return;
        };
        let message = format!("this `{}` is never closed", sign(brace).0);
        let mut report = Diagnostic::new(Code::UnclosedBlock, span, message, "opened here");
        for &(span, _) in missing.iter().rev().skip(1) {
            report = report.also(span, "neither is this");
        }
        let signs: String = missing
            .iter()
            .rev()
            .map(|(_, brace)| sign(*brace).1)
            .collect();
        let report = report.also(place, format!("`{signs}` is missing before here"));
        self.diagnostics.push(
            report
                .hint(format!("add `{signs}` there"))
                .replace(place, format!(" {signs}")),
        );
    }
}

/// The bracket that closes the one at this place, or the last token.
fn partner(tokens: &Tokens, start: usize) -> usize {
    let mut depth = 0usize;
    for (i, token) in tokens.iter().enumerate().skip(start) {
        match token.node {
            Token::LeftParen | Token::Open(_) => depth += 1,
            Token::RightParen | Token::Close(_) => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i;
        }
    }
    tokens.len() - 1
}
