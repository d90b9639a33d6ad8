//! Reads the text of a Kernel (see `print`). Only the shape is checked here: names exist, operators
//! have their operands; types and ranges are for `verify`.
//!
//! A grammar in which one token decides, read by recursive descent; the first error ends it.

mod body;
mod lex;

use super::{Cell, Event, Immediate, Kernel, Keyed, Line, Live, Port, Probe, Range, Table, Type};
use lex::{Lexeme, Token};
use std::collections::HashMap;
use std::fmt;
use whippen_rate::Rate;

/// Why a text is no Kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseError {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong there.
    pub message: String,
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:{}: {}", self.line, self.column, self.message)
    }
}

impl std::error::Error for ParseError {}

/// Reads one Kernel.
///
/// # Errors
/// The first place where the text is not one.
pub fn parse(text: &str) -> Result<Kernel, ParseError> {
    let mut parser = Parser {
        tokens: lex::tokens(text)?,
        at: 0,
        kernel: Kernel::default(),
        names: HashMap::new(),
    };
    parser.kernel()?;
    Ok(parser.kernel)
}

struct Parser {
    /// Ends with [`Token::End`].
    tokens: Vec<Lexeme>,
    at: usize,
    kernel: Kernel,
    /// Index of everything declared so far.
    names: HashMap<(Declaration, String), u32>,
}

/// What an operator's immediate may name; one name space each.
type Declaration = std::mem::Discriminant<Immediate>;

impl Parser {
    fn kernel(&mut self) -> Result<(), ParseError> {
        self.word("kernel")?;
        self.kernel.name = self.name()?;
        self.sign(Token::At)?;
        self.kernel.rate_hz = self.rate()?;
        self.sign(Token::Open)?;
        while !self.takes(Token::Close) {
            let lexeme = self.peek().clone();
            match lexeme.token {
                Token::Name(word) => self.item(&word)?,
                _ => return Err(self.expected("a declaration, `init`, `tick` or `}`")),
            }
        }
        self.sign(Token::End)
    }

    /// `44100` or `750000/17`
    fn rate(&mut self) -> Result<Rate, ParseError> {
        let at = self.at;
        let ticks = self.number()?;
        let seconds = if self.takes(Token::Slash) {
            self.number()?
        } else {
            1
        };
        Rate::new(ticks, seconds).ok_or_else(|| self.error_at(at, "a rate of 0".to_string()))
    }

    fn item(&mut self, word: &str) -> Result<(), ParseError> {
        match word {
            "in" => self.input(),
            "out" => self.output(),
            "live" => self.live(),
            "keyed" => self.keyed(),
            "cell" => self.cell(),
            "line" => self.line(),
            "table" => self.table(),
            "event" => self.event(),
            "probe" => self.probe(),
            "init" | "tick" => self.outermost(word == "tick"),
            _ => Err(self.expected("a declaration, `init`, `tick` or `}`")),
        }
    }

    fn input(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Input, self.kernel.inputs.len())?;
        self.typed("u16")?;
        let range = self.range()?;
        self.kernel.inputs.push(Port { name, range });
        Ok(())
    }

    fn output(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Output, self.kernel.outputs.len())?;
        self.typed("i16")?;
        let range = self.range()?;
        self.kernel.outputs.push(Port { name, range });
        Ok(())
    }

    fn live(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Live, self.kernel.lives.len())?;
        self.typed("i32")?;
        let range = self.range()?;
        self.sign(Token::Equals)?;
        let init = self.number()?;
        self.kernel.lives.push(Live { name, range, init });
        Ok(())
    }

    fn keyed(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Keyed, self.kernel.keyed.len())?;
        self.typed("i32")?;
        let range = self.range()?;
        let values = self.numbers()?;
        self.kernel.keyed.push(Keyed {
            name,
            range,
            values,
        });
        Ok(())
    }

    fn cell(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Cell, self.kernel.cells.len())?;
        self.sign(Token::Colon)?;
        let ty = self.ty()?;
        let len = self.times()?;
        let range = self.range()?;
        self.sign(Token::Equals)?;
        let init = self.number()?;
        self.kernel.cells.push(Cell {
            name,
            ty,
            len,
            range,
            init,
        });
        Ok(())
    }

    fn line(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Line, self.kernel.lines.len())?;
        self.sign(Token::Colon)?;
        let len = self.number()?;
        let range = self.range()?;
        self.kernel.lines.push(Line { name, len, range });
        Ok(())
    }

    fn table(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Table, self.kernel.tables.len())?;
        let columns = self.times()?;
        let values = self.numbers()?;
        self.kernel.tables.push(Table {
            name,
            columns,
            values,
        });
        Ok(())
    }

    fn event(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Event, self.kernel.events.len())?;
        self.sign(Token::Left)?;
        let args = self.number()?;
        self.sign(Token::Right)?;
        self.kernel.events.push(Event { name, args });
        Ok(())
    }

    fn probe(&mut self) -> Result<(), ParseError> {
        let name = self.declare(Immediate::Probe, self.kernel.probes.len())?;
        self.sign(Token::Colon)?;
        let ty = self.ty()?;
        self.kernel.probes.push(Probe { name, ty });
        Ok(())
    }

    /// The keyword and a new name.
    fn declare(&mut self, kind: Immediate, index: usize) -> Result<String, ParseError> {
        self.skip();
        let place = self.at;
        let name = self.name()?;
        let key = (std::mem::discriminant(&kind), name.clone());
        if self.names.insert(key, index as u32).is_some() {
            return Err(self.error_at(place, format!("`{name}` is declared twice")));
        }
        Ok(name)
    }

    /// `x 84`, or 1 where nothing is written.
    fn times(&mut self) -> Result<u32, ParseError> {
        if self.takes(Token::Name("x".to_string())) {
            self.number()
        } else {
            Ok(1)
        }
    }

    /// `= { 1, 2, 3 }`
    fn numbers(&mut self) -> Result<Vec<i32>, ParseError> {
        self.sign(Token::Equals)?;
        self.sign(Token::Open)?;
        let mut values = Vec::new();
        while !self.takes(Token::Close) {
            if !values.is_empty() {
                self.sign(Token::Comma)?;
            }
            values.push(self.number()?);
        }
        Ok(values)
    }

    /// `: u16`
    fn typed(&mut self, ty: &str) -> Result<(), ParseError> {
        self.sign(Token::Colon)?;
        self.word(ty)
    }

    fn ty(&mut self) -> Result<Type, ParseError> {
        let ty = match &self.peek().token {
            Token::Name(word) => Type::named(word),
            _ => None,
        };
        let ty = ty.ok_or_else(|| self.expected("`i1`, `i32` or `i64`"))?;
        self.skip();
        Ok(ty)
    }

    fn range(&mut self) -> Result<Range, ParseError> {
        self.sign(Token::LeftSquare)?;
        let low = self.number()?;
        self.sign(Token::Dots)?;
        let high = self.number()?;
        self.sign(Token::RightSquare)?;
        Ok(Range { low, high })
    }

    fn name(&mut self) -> Result<String, ParseError> {
        match self.peek().token.clone() {
            Token::Name(name) | Token::Quoted(name) => {
                self.skip();
                Ok(name)
            }
            _ => Err(self.expected("a name")),
        }
    }

    fn number<T: TryFrom<i64>>(&mut self) -> Result<T, ParseError> {
        let Token::Number(number) = self.peek().token else {
            return Err(self.expected("a number"));
        };
        let number = T::try_from(number)
            .map_err(|_| self.error_at(self.at, format!("{number} is out of bounds")))?;
        self.skip();
        Ok(number)
    }

    fn word(&mut self, word: &str) -> Result<(), ParseError> {
        self.sign(Token::Name(word.to_string()))
    }

    fn sign(&mut self, token: Token) -> Result<(), ParseError> {
        if self.takes(token.clone()) {
            Ok(())
        } else {
            Err(self.expected(&token.to_string()))
        }
    }

    /// Goes past the token if it is the next.
    fn takes(&mut self, token: Token) -> bool {
        let found = self.peek().token == token;
        if found {
            self.skip();
        }
        found
    }

    fn peek(&self) -> &Lexeme {
        &self.tokens[self.at]
    }

    fn skip(&mut self) -> &mut Parser {
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        self
    }

    fn expected(&self, what: &str) -> ParseError {
        self.error_at(
            self.at,
            format!("expected {what}, found {}", self.peek().token),
        )
    }

    fn error_at(&self, at: usize, message: String) -> ParseError {
        let Lexeme { line, column, .. } = self.tokens[at];
        ParseError {
            line,
            column,
            message,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify;

    const EVERYTHING: &str = "\
kernel \"two words\" @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  live weight: i32 [-100..100] = 5
  keyed bias: i32 [0..9] = { 1, 2 }
  cell phi': i32 [-1000..1000] = 0
  cell jack.held: i64 x 84 [-9..9] = 0
  line hist: 31 [0..65535]
  table t = { 1, 2, 3 }
  table pairs x 2 = { 1, 2, 3, 4 }
  event note(1)
  probe \"p\\u{e4}\": i64
  init {
    v0: i32 [0..65535] = in x
    fill hist v0
  }
  tick {
    v1: i32 [0..65535] = in x
    v2: i32 [0..65535] = delay hist 31
    v20: i32 [2..2] = const 2
    v3: i1 [0..1] = lt v1 v2
    v4: i32 [0..65535] = if v3 {
      emit note v1
      yield v1
    } else {
      yield v2
    }
    if v3 {
      set phi' v20
    }
    v7: i64 [-9..9] = const -9
    v8: i64 [-9..9] = loop 84 (v9: i32 [0..83], v10: i64 [-9..9] = v7) {
      v11: i64 [-9..9] = get_at jack.held v9
      v12: i64 [-9..9] = max v10 v11
      yield v12
    }
    probe \"p\\u{e4}\" v8
    push hist v4
    v13: i32 [0..32767] = sar v4 1
    out f v13
  }
}
";

    #[test]
    fn text_and_kernel_are_one() {
        let kernel = parse(EVERYTHING).expect("parses");
        assert_eq!(kernel.to_string(), EVERYTHING);
        verify(&kernel).expect("verifies");
        assert_eq!(parse(&kernel.to_string()), Ok(kernel));
    }

    #[test]
    fn a_rate_may_be_a_fraction_and_is_not_0() {
        let text = EVERYTHING.replace("@44100 {", "@750000/17 {");
        let kernel = parse(&text).expect("parses");
        assert_eq!(kernel.rate_hz.fraction(), [750_000, 17]);
        assert_eq!(kernel.to_string(), text);
        for rate in ["@0 {", "@1/0 {"] {
            let error = parse(&EVERYTHING.replace("@44100 {", rate)).expect_err(rate);
            assert!(error.message.contains("a rate of 0"), "{error}");
        }
    }

    #[test]
    fn origins_are_written_where_they_are_asked_for() {
        let text = EVERYTHING
            .replace("sar v4 1", "sar v4 1 @7")
            .replace("if v3 {", "if v3 @8 {");
        let kernel = parse(&text).expect("parses");
        assert_eq!(kernel.to_string(), EVERYTHING);
        assert_eq!(format!("{kernel:#}"), text);
        assert_eq!(parse(&format!("{kernel:#}")), Ok(kernel));
        assert_eq!(
            parse(&text.replace("@7", "@-7"))
                .expect_err("negative")
                .to_string(),
            "39:37: -7 is out of bounds"
        );
    }

    #[test]
    fn errors_have_places() {
        let error = |from: &str, to: &str| {
            parse(&EVERYTHING.replace(from, to))
                .expect_err(to)
                .to_string()
        };
        assert_eq!(
            error("in x\n    fill", "in y\n    fill"),
            "14:29: `y` is not declared"
        );
        assert_eq!(
            error("max v10 v11", "max v10"),
            "34:26: `max` takes 2 operands, not 1"
        );
        assert_eq!(
            error("max v10", "maximum v10"),
            "34:26: expected an operator, found `maximum`"
        );
        assert_eq!(
            error("[0..9] =", "[0..] ="),
            "5:23: expected a number, found `]`"
        );
        assert_eq!(
            error("v7:", "v7777777:"),
            "31:5: values are numbered up to 999999"
        );
        assert_eq!(
            error("sar v4 1", "sar v4 256"),
            "39:27: an immediate is out of bounds"
        );
        assert_eq!(
            error("line hist", "keyed bias"),
            "8:9: `bias` is declared twice"
        );
        assert_eq!(error("@44100", "@44100?"), "1:26: what is `?`?");
    }
}
