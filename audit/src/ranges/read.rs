//! Reading the text of Kernels, as `compiler/kernel/src/print.rs` says that they are written.

use super::rule::{self, Interval};

/// Something that a Kernel declares.
#[derive(Debug, Clone)]
pub(super) struct Declared {
    pub name: String,
    /// What it holds, whenever.
    pub range: Interval,
    /// What it holds at first, of each key; of a table its entries.
    pub starts: Vec<i128>,
    /// Of a table.
    pub columns: usize,
    /// Of a line, in words.
    pub length: i128,
}

/// `v5: i32 [0..9]`
#[derive(Debug, Clone)]
pub(super) struct Defined {
    pub value: u32,
    pub ty: String,
    pub range: Interval,
}

/// What stands between braces.
#[derive(Debug, Clone, Default)]
pub(super) struct Region {
    pub statements: Vec<Statement>,
    pub yields: Vec<u32>,
}

/// An instruction.
#[derive(Debug, Clone, Default)]
pub(super) struct Statement {
    /// Its line.
    pub text: String,
    pub results: Vec<Defined>,
    pub op: String,
    pub names: Vec<String>,
    pub args: Vec<u32>,
    pub numbers: Vec<i128>,
    /// Of a loop: the round, and what is carried.
    pub params: Vec<Defined>,
    pub regions: Vec<Region>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Kernel {
    pub name: String,
    pub declared: Vec<Declared>,
    pub init: Region,
    pub tick: Region,
}

impl Kernel {
    pub fn find(&self, name: &str) -> Option<&Declared> {
        self.declared.iter().find(|own| own.name == name)
    }
}

/// All Kernels of a text, one behind the other.
pub(super) fn kernels(text: &str) -> Result<Vec<Kernel>, String> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let mut lines = Lines(lines.collect::<Vec<_>>().into_iter());
    let mut all = Vec::new();
    while let Some(line) = lines.0.next() {
        let mut words = LineWords::of(line);
        if words.next().as_deref() != Some("kernel") {
            return Err(format!("`{line}` begins no Kernel"));
        }
        let name = words.next().ok_or("a Kernel has a name")?;
        let mut kernel = Kernel {
            name,
            ..Kernel::default()
        };
        while let Some(line) = lines.0.next().filter(|line| *line != "}") {
            match line {
                "init {" => kernel.init = lines.region()?.0,
                "tick {" => kernel.tick = lines.region()?.0,
                _ => {
                    let own = declared(line);
                    let own = own.ok_or_else(|| format!("`{line}` declares nothing"))?;
                    if kernel.find(&own.name).is_some() {
                        return Err(format!("`{}` is declared twice", own.name));
                    }
                    kernel.declared.push(own);
                }
            }
        }
        all.push(kernel);
    }
    Ok(all)
}

struct Lines<'a>(std::vec::IntoIter<&'a str>);

impl Lines<'_> {
    /// A region, and the line that ends it.
    fn region(&mut self) -> Result<(Region, &str), String> {
        let mut region = Region::default();
        loop {
            let line = self.0.next().ok_or("a region does not end")?;
            if line.starts_with('}') {
                return Ok((region, line));
            }
            let wrong = || format!("`{line}` is no instruction");
            if let Some(values) = line.strip_prefix("yield") {
                let values = LineWords::of(values).map(|word| value(&word));
                region.yields = values.collect::<Option<_>>().ok_or_else(wrong)?;
                continue;
            }
            let mut own = statement(line).ok_or_else(wrong)?;
            if line.ends_with('{') {
                loop {
                    let (inner, end) = self.region()?;
                    let goes_on = end == "} else {";
                    own.regions.push(inner);
                    if !goes_on {
                        break;
                    }
                }
                if own.op == "if" && own.regions.len() == 1 {
                    own.regions.push(Region::default());
                }
            }
            region.statements.push(own);
        }
    }
}

/// The words of a line: names (without their quotes), numbers, intervals, signs.
struct LineWords<'a>(&'a str);

impl LineWords<'_> {
    fn of(line: &str) -> LineWords<'_> {
        LineWords(line)
    }

    fn is(&mut self, word: &str) -> Option<()> {
        (self.next()? == word).then_some(())
    }

    fn interval(&mut self) -> Option<Interval> {
        let word = self.next()?;
        let (low, high) = word
            .strip_prefix('[')?
            .strip_suffix(']')?
            .split_once("..")?;
        Some(Interval::new(low.parse().ok()?, high.parse().ok()?))
    }

    /// `v5: i32 [0..9]`, behind its value.
    fn defined(&mut self, value: u32) -> Option<Defined> {
        self.is(":")?;
        let ty = self.next()?;
        let range = self.interval()?;
        Some(Defined { value, ty, range })
    }
}

impl Iterator for LineWords<'_> {
    type Item = String;

    fn next(&mut self) -> Option<String> {
        self.0 = self.0.trim_start();
        let first = self.0.chars().next()?;
        let length = match first {
            '"' => 2 + self.0[1..].find('"')?,
            '[' => 1 + self.0.find(']')?,
            ':' | ',' | '=' | '(' | ')' | '{' | '}' => 1,
            _ => {
                let ends = |c: char| c.is_whitespace() || ":,=(){}[".contains(c);
                self.0.find(ends).unwrap_or(self.0.len())
            }
        };
        let (word, rest) = self.0.split_at(length);
        self.0 = rest;
        let quoted = word
            .strip_prefix('"')
            .and_then(|word| word.strip_suffix('"'));
        Some(quoted.unwrap_or(word).to_string())
    }
}

fn value(word: &str) -> Option<u32> {
    word.strip_prefix('v')?.parse().ok()
}

/// A line that declares something.
fn declared(line: &str) -> Option<Declared> {
    let mut words = LineWords::of(line);
    let kind = words.next()?;
    let mut own = Declared {
        name: words.next()?,
        range: Interval::new(i64::MIN.into(), i64::MAX.into()),
        starts: Vec::new(),
        columns: 1,
        length: 0,
    };
    let rest: Vec<String> = words.collect();
    let numbers = |words: &[String]| -> Vec<i128> {
        words.iter().filter_map(|word| word.parse().ok()).collect()
    };
    let range = rest.iter().position(|word| word.starts_with('['));
    if let Some(at) = range {
        own.range = LineWords::of(&rest[at]).interval()?;
    }
    let starts = rest.iter().position(|word| word == "=");
    match kind.as_str() {
        "in" | "out" => range.map(|_| ())?,
        "line" => own.length = range.and_then(|at| rest[..at].last()?.parse().ok())?,
        "live" | "keyed" | "cell" => {
            range?;
            own.starts = numbers(&rest[starts?..]);
        }
        "table" => {
            own.starts = numbers(&rest[starts?..]);
            if rest[0] == "x" {
                own.columns = rest[1].parse().ok()?;
            }
        }
        "event" | "probe" => {}
        _ => return None,
    }
    Some(own)
}

fn statement(line: &str) -> Option<Statement> {
    let mut own = Statement {
        text: line.trim_end_matches('{').trim_end().to_string(),
        ..Statement::default()
    };
    let mut words = LineWords::of(line);
    let mut word = words.next()?;
    // `v6: i32 [0..9], v7: i32 [0..9] = `
    if words.0.trim_start().starts_with(':') {
        loop {
            own.results.push(words.defined(value(&word)?)?);
            let sign = words.next()?;
            word = words.next()?;
            match sign.as_str() {
                "," => {}
                "=" => break,
                _ => return None,
            }
        }
    }
    own.op = word;
    for _ in 0..rule::names(&own.op) {
        own.names.push(words.next()?);
    }
    while let Some(word) = words.next().filter(|word| word != "{") {
        match (value(&word), word.parse()) {
            (Some(value), _) => own.args.push(value),
            (_, Ok(number)) => own.numbers.push(number),
            _ if word == "(" && own.op == "loop" => carried(&mut own, &mut words)?,
            _ => return None,
        }
    }
    Some(own)
}

/// `v7: i32 [0..83], v8: i32 [0..9] = v1)`
fn carried(own: &mut Statement, words: &mut LineWords) -> Option<()> {
    loop {
        let value_of = value(&words.next()?)?;
        own.params.push(words.defined(value_of)?);
        let mut sign = words.next()?;
        if sign == "=" {
            own.args.push(value(&words.next()?)?);
            sign = words.next()?;
        }
        match sign.as_str() {
            "," => {}
            ")" => return Some(()),
            _ => return None,
        }
    }
}
