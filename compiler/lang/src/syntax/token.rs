//! The lexer: text to tokens and comments.
//!
//! A number and its unit are one token: after exactly one space the longest run of known units is
//! taken, so `2 m` is a length, while `2 min(a, b)` and `10 lasting 3 ms` leave the word alone.
//! Characters that belong to no token become diagnostics here and, where their meaning is plain,
//! the token that was meant (`foreign`).
//!
//! Not here: what a number followed by an unknown word means (see `repair`), and any grammar.

mod foreign;
mod number;

use logos::Logos;

use super::ast::Spanned;
use crate::diag::Diagnostic;
pub use number::Literal;
use whippen_source::Span;

/// How deep a pair of braces stands; the lexer says [`Level::Outer`] of all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The block of an instrument, a term or a keyboard.
    Outer,
    /// The block of a bank: declarations inside of declarations.
    Bank,
    /// A block in such a block.
    Middle,
    /// The actions of a transition.
    Inner,
}

impl Level {
    /// The level inside so many braces, those of banks aside. `None` where no block may stand.
    pub fn inside(braces: usize) -> Option<Level> {
        [Level::Outer, Level::Middle, Level::Inner]
            .get(braces)
            .copied()
    }
}

macro_rules! tokens {
    (hard { $($hard:ident $hard_text:literal,)* } soft { $($soft:ident $soft_text:literal,)* }
     signs { $($sign:ident $sign_text:literal,)* }) => {
        /// One token.
        #[derive(Logos, Debug, Clone, Copy, PartialEq)]
        #[logos(skip r"[ \t\r\n]+")]
        pub enum Token<'s> {
            /// A number, with its unit if it has one.
            #[regex(r"[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", number::scan)]
            #[regex(r"\.[0-9]+", number::scan)]
            Number(Literal<'s>),
            /// A name.
            #[regex("[A-Za-z_][A-Za-z0-9_]*")]
            Word(&'s str),
            /// A note with a sharp (`C#4`).
            #[regex("[A-G]#[0-9]+")]
            Sharp(&'s str),
            /// A file in quotes, with them, which only `device` and `from` have behind them.
            Text(&'s str),
            /// `///` up to the end of the line.
            #[regex("///[^\n]*", allow_greedy = true)]
            #[doc(hidden)]
            Doc(&'s str),
            /// `//` up to the end of the line.
            #[regex("//[^\n]*", allow_greedy = true)]
            #[doc(hidden)]
            Comment(&'s str),
            /// Something from another language.
            #[token("==")] #[token("!=")] #[token("=<")] #[token("=>")] #[token("&&")] #[token("||")] #[token("**")]
            #[token("/*", foreign::block_comment)]
            Foreign(&'s str),
            /// `{`
            #[token("{", |_| Level::Outer)]
            Open(Level),
            /// `}`
            #[token("}", |_| Level::Outer)]
            Close(Level),
            /// Stands for something that could not be read and has been reported.
            Broken,
            /// The name before `=` where a definition begins.
            Defined(&'s str),
            /// The name before `:=` or `' :=`.
            Assigned(&'s str),
            /// The name before `->` where a transition begins.
            Left(&'s str),
            $(#[doc = concat!("`", $hard_text, "`")] #[token($hard_text)] $hard,)*
            $(#[doc = concat!("`", $soft_text, "`")] #[token($soft_text)] $soft,)*
            $(#[doc = concat!("`", $sign_text, "`")] #[token($sign_text)] $sign,)*
        }

        /// Words that can never be names.
        pub const HARD_KEYWORDS: &[&str] = &[$($hard_text,)*];
        /// Words that are keywords only where the grammar expects them.
        pub const SOFT_KEYWORDS: &[&str] = &[$($soft_text,)*];
        /// Operators and punctuation, braces aside.
        pub const SIGNS: &[&str] = &[$($sign_text,)*];

        impl<'s> Token<'s> {
            /// Whether it is a word that can never be a name.
            pub fn is_hard_keyword(self) -> bool {
                matches!(self, $(Token::$hard)|*)
            }

            /// The name it may be: a word, or a keyword of some places only.
            pub fn name(self) -> Option<&'s str> {
                match self {
                    Token::Word(text) => Some(text),
                    $(Token::$soft => Some($soft_text),)*
                    _ => None,
                }
            }
        }
    };
}

tokens! {
    hard {
        Instrument "instrument", Term "term", Keyboard "keyboard", Sense "sense", Live "live", Param "param", Let "let",
        Body "body", States "states", State "state", Next "next", Event "event", Emit "emit", Pulse "pulse",
        Fire "fire", Force "force", Hold "hold", When "when", If "if", Then "then", Else "else", And "and", Or "or",
        Not "not", Is "is", In "in", On "on", Off "off",
    }
    soft {
        Every "every", Over "over", Slew "slew", Lasting "lasting", Glide "glide", At "at", Angle "angle",
        Position "position", Rate "rate", Noise "noise", Delay "delay", Feed "feed", Sound "sound",
        String "string", Along "along", Density "density", Load "load", Ends "ends", Tuned "tuned", To "to",
        Points "points",
        Inertia "inertia", Mass "mass", Torque "torque", Friction "friction", Against "against",
        Board "board", Device "device", Keys "keys",
        Programs "programs", Zones "zones", Bank "bank",
        Table "table", Cubic "cubic", From "from",
    }
    signs {
        LeftParen "(", RightParen ")", LeftBracket "[", RightBracket "]", Comma ",", Colon ":", Dot ".", DotDot "..", Prime "'", Arrow "->", Assign ":=",
        Equals "=", Plus "+", Minus "-", Star "*", Slash "/", Caret "^", Less "<", LessEqual "<=", Greater ">",
        GreaterEqual ">=",
    }
}

impl Token<'_> {
    /// Whether an expression may begin with it.
    pub fn begins_expression(self) -> bool {
        use Token::*;
        self.name().is_some()
            || matches!(
                self,
                Number(_) | Broken | LeftParen | Minus | Not | If | On | Off
            )
    }

    /// Whether an expression may end with it.
    pub fn ends_expression(self) -> bool {
        use Token::*;
        self.name().is_some()
            || matches!(
                self,
                Number(_) | Broken | RightParen | RightBracket | Prime | On | Off
            )
    }
}

/// What a text consists of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lexed<'s> {
    /// The tokens that the grammar sees.
    pub tokens: Vec<Spanned<Token<'s>>>,
    /// The comments, with their slashes.
    pub comments: Vec<Spanned<&'s str>>,
}

impl Lexed<'_> {
    /// How long the file of a device or of a table is, behind its first quote, if it is closed
    /// on its line.
    fn file_length(&self, sign: &str, rest: &str) -> Option<usize> {
        let last = self.tokens.last().map(|t| t.node);
        let names_file = matches!(last, Some(Token::Device | Token::From));
        let line = rest.lines().next().filter(|_| sign == "\"" && names_file)?;
        line.find('"').map(|end| end + 1)
    }
}

/// Takes a text apart. Never fails: what cannot be read is reported and skipped or replaced.
pub fn lex<'s>(file: u32, text: &'s str, diagnostics: &mut Vec<Diagnostic>) -> Lexed<'s> {
    let mut lexed = Lexed::default();
    let mut lexer = Token::lexer(text);
    // A byte order mark says something at the beginning only.
    lexer.bump(text.len() - text.trim_start_matches('\u{feff}').len());
    while let Some(token) = lexer.next() {
        let mut span = Span {
            file,
            start: lexer.span().start as u32,
            end: lexer.span().end as u32,
        };
        let token = match token {
            Ok(Token::Doc(comment) | Token::Comment(comment)) => {
                lexed.comments.push(Spanned {
                    node: comment.trim_end(),
                    span,
                });
                continue;
            }
            Ok(Token::Number(literal)) => Some(number::check(literal, span, diagnostics)),
            Ok(Token::Foreign(sign)) => foreign::report(sign, span, diagnostics),
            Ok(token) => Some(token),
            Err(()) if lexer.slice().starts_with(char::is_alphabetic) => {
                lexer.bump(foreign::rest_of_name(lexer.remainder()));
                span.end = lexer.span().end as u32;
                let touches =
                    |t: &mut Spanned<Token>| t.span.end == span.start && t.node.name().is_some();
                span.start = lexed
                    .tokens
                    .pop_if(touches)
                    .map_or(span.start, |t| t.span.start);
                Some(foreign::report_name(
                    &text[span.start as usize..span.end as usize],
                    span,
                    diagnostics,
                ))
            }
            Err(()) if lexer.slice() == "#" => {
                foreign::report("#", span, diagnostics);
                let rest = lexer.remainder();
                lexer.bump(rest.find('\n').unwrap_or(rest.len()));
                continue;
            }
            Err(()) if let Some(length) = lexed.file_length(lexer.slice(), lexer.remainder()) => {
                lexer.bump(length);
                span.end = lexer.span().end as u32;
                Some(Token::Text(lexer.slice()))
            }
            Err(()) => {
                lexer.bump(foreign::repeated(lexer.slice(), lexer.remainder()));
                span.end = lexer.span().end as u32;
                foreign::report(lexer.slice(), span, diagnostics)
            }
        };
        lexed
            .tokens
            .extend(token.map(|node| Spanned { node, span }));
    }
    lexed
}
