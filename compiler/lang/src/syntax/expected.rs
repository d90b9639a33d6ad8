//! Syntax errors in words.
//!
//! The generated parser knows which tokens it could have gone on with; a person wants to hear "an
//! expression" or "`when`". Errors close behind another one are its consequences and are dropped.

mod words;

use lalrpop_util::ParseError;

use super::ast::Spanned;
use super::build::Error;
use super::token::{HARD_KEYWORDS, Token};
use crate::check::function_names;
use crate::diag::{Advice, Code, Diagnostic, nearest};
use whippen_source::Span;

/// So many tokens must have been understood since the last error before another one is believed,
/// unless something began anew between them.
const UNDERSTOOD: usize = 3;

/// The settings of a keyboard.
const SETTINGS: &[&str] = &["board", "device", "rate", "keys", "programs", "zones"];

/// The diagnostics of the errors worth telling.
pub(super) fn describe(
    file: u32,
    text: &str,
    tokens: &[Spanned<Token>],
    mut errors: Vec<Error>,
) -> Vec<Diagnostic> {
    errors.sort_by_key(|e| place(&e.error).0);
    let mut believed_from = 0;
    let mut last = 0;
    let mut diagnostics = Vec::new();
    for error in errors {
        let (start, end) = place(&error.error);
        let index = tokens.partition_point(|t| t.span.start < start);
        let anew = (last..index)
            .any(|i| begins(tokens[i].node) && (i > last || begins_line(text, tokens, i)));
        if index >= believed_from || anew {
            let span = Span { file, start, end };
            let expected = expected(&error.error)
                .iter()
                .map(|e| e.trim_matches('"'))
                .collect();
            diagnostics.push(
                Failure {
                    text,
                    tokens,
                    index,
                    span,
                    expected,
                }
                .diagnostic(),
            );
        }
        last = index;
        believed_from = index + error.dropped_tokens.len() + UNDERSTOOD;
    }
    diagnostics
}

/// Whether a token is the first of its line.
fn begins_line(text: &str, tokens: &[Spanned<Token>], index: usize) -> bool {
    let from = index
        .checked_sub(1)
        .map_or(0, |before| tokens[before].span.end);
    text.get(from as usize..tokens[index].span.start as usize)
        .is_some_and(|gap| gap.contains('\n'))
}

/// Whether a declaration, a transition, an action or a block begins with it.
fn begins(token: Token) -> bool {
    use Token::*;
    let declares = matches!(
        token,
        Sense | Live | Param | Let | Body | States | State | Next | Event | Pulse | Hold | Force
    );
    let acts = matches!(token, Emit | Fire | Assigned(_) | Left(_) | Defined(_));
    declares
        || acts
        || matches!(
            token,
            Instrument
                | Term
                | Keyboard
                | Angle
                | Position
                | Inertia
                | Mass
                | Torque
                | Friction
                | Sound
                | String
                | Density
                | Load
                | Ends
                | Points
        )
}

type Parse<'s> = ParseError<u32, Token<'s>, &'static str>;

fn place(error: &Parse) -> (u32, u32) {
    match error {
        ParseError::UnrecognizedToken { token, .. } | ParseError::ExtraToken { token } => {
            (token.0, token.2)
        }
        ParseError::UnrecognizedEof { location, .. } | ParseError::InvalidToken { location } => {
            (*location, *location)
        }
        ParseError::User { .. } => (0, 0),
    }
}

fn expected<'e>(error: &'e Parse) -> &'e [String] {
    match error {
        ParseError::UnrecognizedToken { expected, .. }
        | ParseError::UnrecognizedEof { expected, .. } => expected,
        _ => &[],
    }
}

/// One syntax error: the token at `index` is not among the expected ones.
struct Failure<'a> {
    text: &'a str,
    tokens: &'a [Spanned<Token<'a>>],
    index: usize,
    span: Span,
    expected: Vec<&'a str>,
}

impl<'a> Failure<'a> {
    fn diagnostic(&self) -> Diagnostic {
        if self.expected == ["."] {
            return self.unknown_setting();
        }
        let wanted = words::of(&self.expected);
        let diagnostic = match self.before().filter(|_| self.lacks_its_end()) {
            Some(before) => Diagnostic::new(
                Code::UnexpectedToken,
                before,
                format!("expected {wanted} after `{}`", self.source(before)),
                format!("expected {wanted} after this"),
            ),
            None => {
                let found = if self.span.start < self.span.end {
                    self.source(self.span)
                } else {
                    ""
                };
                let found = if found.is_empty() {
                    "the end".to_string()
                } else {
                    format!("`{found}`")
                };
                let message = format!("expected {wanted}, found {found}");
                Diagnostic::new(
                    Code::UnexpectedToken,
                    self.span,
                    message,
                    format!("expected {wanted}"),
                )
            }
        };
        match self.advice() {
            Some(hint) => diagnostic.hint(hint),
            None if wanted == "`else`" => {
                diagnostic.hint("an `if` chooses between two values: add `else ..`")
            }
            None => diagnostic,
        }
    }

    fn source(&self, span: Span) -> &'a str {
        self.text
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }

    fn found(&self) -> Option<Token<'a>> {
        self.tokens.get(self.index).map(|t| t.node)
    }

    /// The place of the token before the error.
    fn before(&self) -> Option<Span> {
        self.index
            .checked_sub(1)
            .map(|before| self.tokens[before].span)
            .filter(|s| s.start < s.end)
    }

    /// Whether the mistake is rather that the line before has no end: the error stands on a later
    /// line, in the midst of something.
    fn lacks_its_end(&self) -> bool {
        let midst = !self
            .expected
            .iter()
            .any(|e| matches!(*e, "}" | "}1" | "}2" | "instrument"));
        midst
            && (self.index >= self.tokens.len() || begins_line(self.text, self.tokens, self.index))
    }

    /// A keyboard's line that begins with an unknown word, which could only be `instrument.param =
    /// ..`.
    fn unknown_setting(&self) -> Diagnostic {
        let span = self.before().unwrap_or(self.span);
        let name = self.source(span);
        let message = format!("a keyboard has no setting `{name}`");
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, span, message, "unknown setting");
        let line = self.text[..span.start as usize]
            .rsplit('\n')
            .next()
            .unwrap_or_default();
        diagnostic.hint(match nearest(name, SETTINGS.iter().copied()) {
            Some(near) => Advice::did_you_mean(near),
            None if !line.trim().is_empty() => {
                format!("if `{name}` belongs to a list, a `,` is missing before it").into()
            }
            None => format!(
                "its settings are {} and `instrument.param = {{ .. }}`",
                SETTINGS.join(", ")
            )
            .into(),
        })
    }

    /// What to do about some frequent mistakes.
    fn advice(&self) -> Option<Advice> {
        use Token::*;
        let wants = |token: &str| self.expected.contains(&token);
        let next = self.tokens.get(self.index + 1).map(|t| t.node);
        let found = self.found()?;
        if let Some(fixed) = self.advice_of_slip(found) {
            return Some(fixed.into());
        }
        if let Some(fixed) = self.advice_of_habit(found, next) {
            return Some(fixed.into());
        }
        let fixed = match found {
            Less | LessEqual | Greater | GreaterEqual if wants("and") => {
                "comparisons are not chained: write `a < b and b < c`"
            }
            Equals if ["and", "let", "left", "then"].iter().any(|t| wants(t)) => {
                "`=` defines; values are compared with `<`, `<=`, `>`, `>=`, states with `is`"
            }
            Assign => "`:=` stands only in the actions of an event or a transition",
            _ if wants(",") && wants("=") => {
                "a coordinate ends with the range of its rate: `, rate in a .. b`"
            }
            Comma if self.decimal().is_some() => return self.decimal(),
            Comma if wants("}") => "declarations need no separator",
            If if wants("when") => "the guard of a transition stands behind `when`",
            In if wants(":") => "its type comes first: `sense x: length in ..`",
            Close(_) if wants("(") => {
                "an event has its arguments in brackets: `emit note(speed: x')`, `emit release()`"
            }
            Word(name) if wants("let") && self.continues_an_expression() => {
                let before = self.before().map_or("..", |span| self.source(span));
                return Some(
                    format!("if `{name}` is a factor, its `*` is missing: `{before} * {name}`")
                        .into(),
                );
            }
            Word(_) if wants("assigned") && next == Some(Equals) => "an action writes with `:=`",
            Word(_) if wants("left") => "a transition is written `from -> to when ..`",
            _ if found.is_hard_keyword() && wants("word") && !wants("number") => {
                "a keyword cannot be a name"
            }
            _ if begins(found) && wants("instrument") => {
                "declarations stand inside of an instrument or a term"
            }
            Word(name) => return self.near(name),
            _ => return None,
        };
        Some(fixed.into())
    }

    /// What to do about habits of other languages.
    fn advice_of_habit(&self, found: Token, next: Option<Token>) -> Option<&'static str> {
        use Token::*;
        let wants = |token: &str| self.expected.contains(&token);
        Some(match found {
            Open(_) if wants("then") => {
                "a choice between two values is written `if c then a else b`, without braces"
            }
            If if wants("let") => {
                "`if` chooses between values, not between declarations: `force a = if c then b else 0 N`"
            }
            Equals if wants("word") && self.labels_force() => {
                "a force has a label, for traces and plots: `force spring = ..`"
            }
            Colon if wants("=") && self.after_param() => {
                "a param has no type, as its value says it: `param k = 75 N/m`"
            }
            Open(_) if wants(":") => "a machine is declared with `states`, a value with `state`",
            Emit | Fire if wants("let") => "actions stand in braces: `event e when .. { emit .. }`",
            Word(_) if wants("emit") && next == Some(LeftParen) => {
                "what is told is written `emit name(..)`"
            }
            Word(_) if self.expected == ["param"] => {
                "what may be turned while playing is a `live param`"
            }
            _ => return None,
        })
    }

    /// What to do about what is left out, or is too much.
    fn advice_of_slip(&self, found: Token) -> Option<String> {
        use Token::*;
        let wants = |token: &str| self.expected.contains(&token);
        let before = |back: usize| {
            let at = self.index.checked_sub(back)?;
            Some(self.tokens[at].node)
        };
        Some(match found {
            Number(part) if wants("let") && !begins_line(self.text, self.tokens, self.index) => {
                let Some(Number(whole)) = before(1).filter(|_| part.digits.len() == 3) else {
                    return None;
                };
                let digits = format!("{}{}", whole.digits, part.digits);
                let unit = format!("{digits} {}", part.unit);
                format!("the digits of a number stand together: `{}`", unit.trim())
            }
            When if wants("let") => "an event has a name: `event name when .. { .. }`".to_string(),
            Comma if wants("left") => "transitions need no separator".to_string(),
            Prime | RightParen if wants(":") && before(4) == Some(Emit) => {
                "an argument has a name: `emit note(speed: x')`".to_string()
            }
            Colon if wants("word") && self.labels_force() => {
                "a force has a label and no type: `force spring = ..`".to_string()
            }
            Word(name) if wants("let") && self.continues_an_expression() => {
                let called = before(1).and_then(Token::name);
                let function = function_names().find(|function| called == Some(*function))?;
                format!("arguments stand in brackets: `{function}({name})`")
            }
            _ => return None,
        })
    }

    /// Whether the token before could end an expression, and stands on the same line.
    fn continues_an_expression(&self) -> bool {
        let before = self.index.checked_sub(1).map(|i| self.tokens[i].node);
        before.is_some_and(Token::ends_expression)
            && !begins_line(self.text, self.tokens, self.index)
    }

    /// Whether the token before is the keyword of a force.
    fn labels_force(&self) -> bool {
        let before = self.index.checked_sub(1).map(|i| self.tokens[i].node);
        matches!(before, Some(Token::Force | Token::Torque | Token::Sound))
    }

    /// Whether the two tokens before are `param name`.
    fn after_param(&self) -> bool {
        let before = self.index.checked_sub(2).map(|i| self.tokens[i].node);
        matches!(before, Some(Token::Param))
    }

    /// `7.5` for `7,5`.
    fn decimal(&self) -> Option<Advice> {
        let number = |i: usize| match self.tokens.get(i)?.node {
            Token::Number(literal) => Some(literal),
            _ => None,
        };
        let (whole, part) = (number(self.index.checked_sub(1)?)?, number(self.index + 1)?);
        if whole.digits.contains('.') {
            let thousands = whole.digits.replace('.', "");
            let right = format!("{thousands}.{}", part.digits);
            let hint = format!("the decimal point is `.`, and digits stand together: `{right}`");
            return Some(hint.into());
        }
        let right = format!("{}.{}", whole.digits, part.digits);
        whole
            .unit
            .is_empty()
            .then(|| Advice::instead(format!("the decimal point is `.`: write `{right}`"), "."))
    }

    /// The expected keyword that looks most like a word.
    fn near(&self, name: &str) -> Option<Advice> {
        let keywords = self
            .expected
            .iter()
            .copied()
            .filter(|e| e.len() > 1 && e.starts_with(char::is_alphabetic));
        let near = nearest(
            name,
            keywords
                .filter(|e| HARD_KEYWORDS.contains(e) || super::token::SOFT_KEYWORDS.contains(e)),
        );
        match near {
            Some(near) => Some(Advice::did_you_mean(near)),
            None if self.expected.contains(&"let") => Some(
                "a declaration begins with its keyword, such as `let`, `param` or `force`".into(),
            ),
            None => None,
        }
    }
}
