//! Gives every bracket its partner, and every brace its level.
//!
//! A block that is still open where a declaration begins was meant to end before it: declarations
//! stand one level deep, or two in a bank, and their keywords stand nowhere else.

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
        is_bank: false,
        diagnostics,
    };
    let closed = closed_later(&tokens);
    let mut i = 0;
    while i < tokens.len() {
        let token = tokens[i];
        if opens(token.node) {
            i = repair.opens(&tokens, i);
            continue;
        }
        match token.node {
            Token::RightParen => repair.closes(token, Bracket::Round),
            Token::RightBracket => repair.closes(token, Bracket::Square),
            Token::Close(_) => {
                let goes_on = begins_declaration(&tokens, i + 1) && closed[i + 1] > 0;
                repair.closes_brace(token, goes_on);
            }
            _ => {
                let keep = repair.outermost(&tokens, i, closed[i]);
                repair.ends_before(token.span, keep);
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

/// What opens and closes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bracket {
    /// `(`
    Round,
    /// `[`
    Square,
    /// `{`
    Brace,
    /// The `{` of a bank.
    Bank,
}

impl Bracket {
    fn is_brace(self) -> bool {
        matches!(self, Bracket::Brace | Bracket::Bank)
    }

    fn signs(self) -> (&'static str, &'static str) {
        match self {
            Bracket::Round => ("(", ")"),
            Bracket::Square => ("[", "]"),
            Bracket::Brace | Bracket::Bank => ("{", "}"),
        }
    }
}

fn opens(token: Token) -> bool {
    matches!(
        token,
        Token::LeftParen | Token::LeftBracket | Token::Open(_)
    )
}

/// Whether `bank NAME over`, or a bank that lacks its `over`, begins here.
fn begins_bank(tokens: &Tokens, i: usize) -> bool {
    let is_name = |place: usize| at(tokens, place).is_some_and(|t| t.name().is_some());
    let over = at(tokens, i + 2) == Some(Token::Over);
    at(tokens, i) == Some(Token::Bank)
        && match at(tokens, i + 1) {
            Some(Token::Word(_)) => over || matches!(at(tokens, i + 2), Some(Token::Open(_))),
            _ => is_name(i + 1) && over && is_name(i + 3) && at(tokens, i + 4) == Some(Token::In),
        }
}

/// Whether a declaration begins here that cannot stand in a bank.
fn begins_outside_of_banks(tokens: &Tokens, i: usize) -> bool {
    use Token::{Bank, Force, Sense, Sound, Torque};
    matches!(tokens[i].node, Sense | Force | Torque | Sound | Bank) && begins_declaration(tokens, i)
}

/// Whether a declaration of an instrument or a term begins here, and nothing else can.
fn begins_declaration(tokens: &Tokens, i: usize) -> bool {
    use Token::*;
    let named = at(tokens, i + 1).is_some_and(|t| t.name().is_some());
    match at(tokens, i) {
        Some(Sense | Live | Param | Let | States | State | Next | Body | Event | Pulse | Hold) => {
            true
        }
        Some(Bank) => begins_bank(tokens, i),
        Some(Feed) => named && defines(tokens, i + 1),
        Some(Delay | Table) => named && at(tokens, i + 2) == Some(Colon),
        Some(String) => named && at(tokens, i + 2) == Some(Along),
        Some(Force | Torque | Sound) => {
            let is_name = |place: usize| at(tokens, place).is_some_and(|t| t.name().is_some());
            let on_a_sense = at(tokens, i + 2) == Some(On) && is_name(i + 3);
            is_name(i + 1) && (defines(tokens, i + 1) || on_a_sense && defines(tokens, i + 3))
        }
        _ => false,
    }
}

/// For every place, how many blocks that are open there are closed further on, before something
/// begins that stands in no block. A block that seems to be over goes on where a declaration
/// follows and one is closed.
///
/// One walk from the end: a block is closed where the depth falls below what it is at the place,
/// so the lowest depth behind a place decides.
fn closed_later(tokens: &Tokens) -> Vec<usize> {
    let step = |token: &Token| match token {
        Token::Open(_) => 1_i64,
        Token::Close(_) => -1,
        _ => 0,
    };
    // Depths are counted from the end, where they are 0.
    let (mut depth, mut lowest) = (0, 0);
    let mut closed = vec![0; tokens.len() + 1];
    for (i, token) in tokens.iter().enumerate().rev() {
        depth -= step(&token.node);
        lowest = match token.node {
            Token::Instrument | Token::Term | Token::Keyboard => depth,
            _ => depth.min(lowest),
        };
        closed[i] = usize::try_from(depth - lowest).unwrap_or(0);
    }
    closed
}

struct Repair<'s, 'd> {
    out: Tokens<'s>,
    /// The open brackets: where, and of which kind.
    open: Vec<(Span, Bracket)>,
    /// Whether the next brace is that of a bank.
    is_bank: bool,
    diagnostics: &'d mut Vec<Diagnostic>,
}

impl<'s> Repair<'s, '_> {
    /// The open braces, those of banks aside.
    fn braces(&self) -> usize {
        let open = self.open.iter();
        open.filter(|(_, kind)| *kind == Bracket::Brace).count()
    }

    /// How many brackets may be open where this token stands, behind which so many are closed.
    fn outermost(&mut self, tokens: &Tokens, i: usize, closed: usize) -> usize {
        match tokens[i].node {
            Token::Instrument | Token::Term | Token::Keyboard => 0,
            _ if begins_declaration(tokens, i) => {
                self.is_bank = tokens[i].node == Token::Bank;
                let blocks = self.open.iter().filter(|(_, kind)| kind.is_brace()).count();
                let is_over = blocks > closed && begins_outside_of_banks(tokens, i);
                let bank = |(_, kind): &(Span, Bracket)| *kind == Bracket::Bank;
                let bank = self.open.iter().rposition(bank).filter(|_| !is_over);
                bank.map_or(1, |bank| bank + 1)
            }
            _ => usize::MAX,
        }
    }

    /// An opening bracket; gives the place to go on at.
    fn opens(&mut self, tokens: &Tokens<'s>, i: usize) -> usize {
        let Spanned { node, span } = tokens[i];
        let kind = match node {
            Token::LeftParen => Bracket::Round,
            Token::LeftBracket => Bracket::Square,
            _ if std::mem::take(&mut self.is_bank) => Bracket::Bank,
            _ => Bracket::Brace,
        };
        let brace = kind.is_brace();
        if brace {
            self.close_parens(span);
        }
        let opened = match kind {
            Bracket::Round | Bracket::Square => Some(node),
            Bracket::Brace => Level::inside(self.braces()).map(Token::Open),
            Bracket::Bank => Some(Token::Open(Level::Bank)),
        };
        match opened.filter(|_| self.open.len() < DEEPEST) {
            Some(node) => {
                self.out.push(Spanned { node, span });
                self.open.push((span, kind));
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

    /// A `)` or `]`; what is open inside of its bracket is closed before.
    fn closes(&mut self, token: Spanned<Token<'s>>, kind: Bracket) {
        let inner = self.open.iter().rev().take_while(|(_, k)| !k.is_brace());
        match inner.enumerate().find(|(_, (_, k))| *k == kind) {
            Some((above, _)) => {
                self.ends_before(token.span, self.open.len() - above);
                self.open.pop();
                self.out.push(token);
            }
            None => self.surplus(token.span, kind.signs().1),
        }
    }

    /// A closing brace; surplus if it closes nothing, or the outermost block before its
    /// declarations are over.
    fn closes_brace(&mut self, token: Spanned<Token<'s>>, goes_on: bool) {
        self.close_parens(token.span);
        let innermost = self.open.last().map(|(_, kind)| *kind);
        let level = match innermost {
            Some(Bracket::Bank) => Some(Level::Bank),
            _ => self.braces().checked_sub(1).and_then(Level::inside),
        };
        match level {
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
            .rposition(|(_, kind)| kind.is_brace())
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
        for (depth, (_, kind)) in missing.iter().enumerate().rev() {
            let outside = self
                .open
                .iter()
                .chain(&missing[..depth])
                .filter(|(_, kind)| *kind == Bracket::Brace)
                .count();
            let node = match kind {
                Bracket::Round => Some(Token::RightParen),
                Bracket::Square => Some(Token::RightBracket),
                Bracket::Brace => Level::inside(outside).map(Token::Close),
                Bracket::Bank => Some(Token::Close(Level::Bank)),
            };
            self.out
                .extend(node.map(|node| Spanned { node, span: place }));
        }
        let Some(&(span, kind)) = missing.last() else {
            return;
        };
        let message = format!("this `{}` is never closed", kind.signs().0);
        let mut report = Diagnostic::new(Code::UnclosedBlock, span, message, "opened here");
        for &(span, _) in missing.iter().rev().skip(1) {
            report = report.also(span, "neither is this");
        }
        let signs: String = missing
            .iter()
            .rev()
            .map(|(_, kind)| kind.signs().1)
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
            token if opens(token) => depth += 1,
            Token::RightParen | Token::RightBracket | Token::Close(_) => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i;
        }
    }
    tokens.len() - 1
}
