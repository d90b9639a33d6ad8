//! Expressions of constants and labels, with the operators and precedences of the GNU assembler.

use super::line::is_name;

/// An expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expr {
    /// A number.
    Number(i64),
    /// A label or a constant by name; `.` is the place of the statement.
    Name(String),
    /// One operator on one.
    Unary(char, Box<Expr>),
    /// One operator on two; `l` and `r` are the shifts.
    Binary(char, Box<Expr>, Box<Expr>),
}

/// What an expression is worth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Value {
    /// A number.
    Number(i64),
    /// A place in a section of this text.
    Place {
        /// Which section.
        section: usize,
        /// Where, by the present layout.
        offset: i64,
        /// The label it was reached by, and how far from it.
        label: String,
        /// Distance from the label.
        addend: i64,
    },
    /// A name that is defined elsewhere, and how far from it.
    Outside(String, i64),
}

impl Expr {
    /// Reads a whole text.
    ///
    /// # Errors
    /// It is no expression.
    pub fn parse(text: &str) -> Result<Expr, String> {
        let mut reader = Reader {
            rest: text.trim(),
            depth: 0,
        };
        let expr = reader.level(0)?;
        match reader.rest.trim_start() {
            "" => Ok(expr),
            rest => Err(format!("`{rest}` does not belong to the number before it")),
        }
    }

    /// Puts what is known for names and works numbers out.
    pub fn fold(self, known: &impl Fn(&str) -> Option<Expr>) -> Expr {
        match self {
            Expr::Name(name) => known(&name).unwrap_or(Expr::Name(name)),
            Expr::Unary(op, a) => match a.fold(known) {
                Expr::Number(a) => Expr::Number(unary(op, a)),
                a => Expr::Unary(op, Box::new(a)),
            },
            Expr::Binary(op, a, b) => match (a.fold(known), b.fold(known)) {
                (Expr::Number(a), Expr::Number(b)) => binary(op, a, b)
                    .map_or_else(|| Expr::Binary(op, number(a), number(b)), Expr::Number),
                (a, b) => Expr::Binary(op, Box::new(a), Box::new(b)),
            },
            number => number,
        }
    }

    /// The value, where `find` knows the labels.
    ///
    /// # Errors
    /// Places are used where only numbers can be.
    pub fn value(&self, find: &impl Fn(&str) -> Value) -> Result<Value, String> {
        match self {
            Expr::Number(n) => Ok(Value::Number(*n)),
            Expr::Name(name) => Ok(find(name)),
            Expr::Unary(op, a) => Ok(Value::Number(unary(*op, a.value(find)?.number()?))),
            Expr::Binary(op, a, b) => combine(*op, a.value(find)?, b.value(find)?),
        }
    }
}

fn number(n: i64) -> Box<Expr> {
    Box::new(Expr::Number(n))
}

impl Value {
    /// The number.
    ///
    /// # Errors
    /// It is a place.
    pub fn number(&self) -> Result<i64, String> {
        match self {
            Value::Number(n) => Ok(*n),
            Value::Place { label: name, .. } => Err(format!("`{name}` is a place, not a number")),
            Value::Outside(name, _) => Err(format!(
                "`{name}` is not defined; define it with `.equ {name}, ...`"
            )),
        }
    }

    fn moved(self, by: i64) -> Value {
        match self {
            Value::Number(n) => Value::Number(n.wrapping_add(by)),
            Value::Place {
                section,
                offset,
                label,
                addend,
            } => Value::Place {
                section,
                offset: offset.wrapping_add(by),
                label,
                addend: addend.wrapping_add(by),
            },
            Value::Outside(name, addend) => Value::Outside(name, addend.wrapping_add(by)),
        }
    }
}

fn combine(op: char, a: Value, b: Value) -> Result<Value, String> {
    match (op, a, b) {
        ('+', a, Value::Number(b)) => Ok(a.moved(b)),
        ('+', Value::Number(a), b) => Ok(b.moved(a)),
        ('-', a, Value::Number(b)) => Ok(a.moved(b.wrapping_neg())),
        (
            '-',
            Value::Place {
                section: s,
                offset: a,
                ..
            },
            Value::Place {
                section: t,
                offset: b,
                ..
            },
        ) if s == t => Ok(Value::Number(a - b)),
        (op, a, b) => {
            let (a, b) = (a.number()?, b.number()?);
            binary(op, a, b)
                .map(Value::Number)
                .ok_or_else(|| "division by zero".to_string())
        }
    }
}

fn unary(op: char, a: i64) -> i64 {
    match op {
        '-' => a.wrapping_neg(),
        _ => !a,
    }
}

fn binary(op: char, a: i64, b: i64) -> Option<i64> {
    let shift = u32::try_from(b).unwrap_or(64);
    Some(match op {
        '+' => a.wrapping_add(b),
        '-' => a.wrapping_sub(b),
        '*' => a.wrapping_mul(b),
        '/' => a.checked_div(b)?,
        '%' => a.checked_rem(b)?,
        'l' => a.checked_shl(shift).unwrap_or(0),
        'r' => ((a as u64).checked_shr(shift).unwrap_or(0)) as i64,
        '&' => a & b,
        '|' => a | b,
        '^' => a ^ b,
        '=' => -i64::from(a == b),
        '<' => -i64::from(a < b),
        _ => -i64::from(a > b),
    })
}

/// Operators from the loosest to the tightest; the two letters are what a shift is kept as.
const LEVELS: [&[(&str, char)]; 4] = [
    &[("==", '='), ("<", '<'), (">", '>')],
    &[("+", '+'), ("-", '-')],
    &[("|", '|'), ("&", '&'), ("^", '^')],
    &[("*", '*'), ("/", '/'), ("%", '%'), ("<<", 'l'), (">>", 'r')],
];

/// Deeper than anybody writes.
const DEPTH_MAX: u32 = 60;

struct Reader<'a> {
    rest: &'a str,
    depth: u32,
}

impl Reader<'_> {
    fn level(&mut self, level: usize) -> Result<Expr, String> {
        let Some(operators) = LEVELS.get(level) else {
            return self.atom();
        };
        let mut left = self.level(level + 1)?;
        while let Some(op) = self.operator(operators) {
            let right = self.level(level + 1)?;
            left = Expr::Binary(op, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn operator(&mut self, operators: &[(&str, char)]) -> Option<char> {
        let rest = self.rest.trim_start();
        let (text, op) = operators.iter().find(|(text, _)| rest.starts_with(text))?;
        if text.len() == 1 && (rest.starts_with("<<") || rest.starts_with(">>")) {
            return None;
        }
        self.rest = &rest[text.len()..];
        Some(*op)
    }

    fn atom(&mut self) -> Result<Expr, String> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err("the expression is nested too deeply".to_string());
        }
        let rest = self.rest.trim_start();
        let first = rest.chars().next().ok_or("a number or a name is missing")?;
        let result = match first {
            '-' | '~' => {
                self.rest = &rest[1..];
                Ok(Expr::Unary(first, Box::new(self.atom()?)))
            }
            '(' => {
                self.rest = &rest[1..];
                let inner = self.level(0)?;
                let after = self
                    .rest
                    .trim_start()
                    .strip_prefix(')')
                    .ok_or("`)` is missing")?;
                self.rest = after;
                Ok(inner)
            }
            '\'' => self.character(rest),
            _ => self.word(rest),
        };
        self.depth -= 1;
        result
    }

    fn character(&mut self, rest: &str) -> Result<Expr, String> {
        let mut chars = rest[1..].chars();
        let c = chars
            .next()
            .filter(char::is_ascii)
            .ok_or("a character is missing after '")?;
        let used = if chars.next() == Some('\'') { 3 } else { 2 };
        self.rest = &self.rest[self.rest.len() - rest.len() + used..];
        Ok(Expr::Number(i64::from(u32::from(c))))
    }

    fn word(&mut self, rest: &str) -> Result<Expr, String> {
        let end = rest
            .find(|c: char| !is_name(c.encode_utf8(&mut [0; 4])))
            .unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        self.rest = &self.rest[self.rest.len() - after.len()..];
        if word.is_empty() {
            return Err(format!("`{rest}` is no number and no name"));
        }
        if !word.starts_with(|c: char| c.is_ascii_digit()) || is_local(word) {
            return Ok(Expr::Name(word.to_string()));
        }
        let parsed = match (word.strip_prefix("0x"), word.strip_prefix("0b")) {
            (Some(hex), _) => u32::from_str_radix(hex, 16).map(i64::from),
            (_, Some(bits)) => u32::from_str_radix(bits, 2).map(i64::from),
            _ => word.parse(),
        };
        parsed
            .map(Expr::Number)
            .map_err(|_| format!("`{word}` is no number"))
    }
}

/// `1b` or `1f`: a local label.
pub fn is_local(word: &str) -> bool {
    let digits = word.strip_suffix(['b', 'f']).unwrap_or("");
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}
