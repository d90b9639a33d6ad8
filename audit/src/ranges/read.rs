//! Reading the text of Kernels, as `compiler/kernel/src/print.rs` says that they are written.

#[cfg(test)]
mod tests;

use std::mem;
use std::str::FromStr;

use super::rule::{Interval, WORD};
use super::types::{Row, row_of};

/// Something that a Kernel declares.
#[derive(Debug, Clone)]
pub(super) struct Declared {
    /// The first word of its line.
    pub kind: String,
    pub name: String,
    /// Of each of its words.
    pub ty: String,
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
        let name = begun(line).ok_or_else(|| format!("`{line}` begins no Kernel"))?;
        let mut kernel = Kernel {
            name,
            ..Kernel::default()
        };
        let mut has = [false; 2];
        loop {
            let line = lines.0.next().ok_or("a Kernel does not end")?;
            let (region, nth) = match line {
                "}" => break,
                "init {" => (&mut kernel.init, 0),
                "tick {" => (&mut kernel.tick, 1),
                _ => {
                    let own = declared(line);
                    let own = own.ok_or_else(|| format!("`{line}` declares nothing"))?;
                    if kernel.find(&own.name).is_some() {
                        return Err(format!("`{}` is declared twice", own.name));
                    }
                    kernel.declared.push(own);
                    continue;
                }
            };
            if mem::replace(&mut has[nth], true) {
                return Err(format!("`{line}` is there twice"));
            }
            *region = lines.whole_region()?;
        }
        all.push(kernel);
    }
    Ok(all)
}

/// The name of the Kernel that a line begins.
fn begun(line: &str) -> Option<String> {
    let mut words = LineWords::of(line);
    words.is("kernel")?;
    let name = words.next()?;
    words.next().filter(|rate| rate.starts_with('@'))?;
    words.is("{")?;
    words.end(name)
}

struct Lines<'a>(std::vec::IntoIter<&'a str>);

impl Lines<'_> {
    fn whole_region(&mut self) -> Result<Region, String> {
        match self.region()? {
            (region, "}") => Ok(region),
            (_, line) => Err(format!("`{line}` ends no region")),
        }
    }

    /// A region, and the line that ends it.
    fn region(&mut self) -> Result<(Region, &str), String> {
        let mut region = Region::default();
        loop {
            let line = self.0.next().ok_or("a region does not end")?;
            if line.starts_with('}') {
                return Ok((region, line));
            }
            let wrong = || format!("`{line}` is no instruction");
            if let Some(values) = line.strip_prefix("yield ") {
                region.yields = yielded(values).ok_or_else(wrong)?;
                // It is the last line.
                let end = self.0.next().filter(|line| line.starts_with('}'));
                return Ok((region, end.ok_or("a region goes on behind its end")?));
            }
            let mut own = statement(line).ok_or_else(wrong)?;
            if own.op == "if" {
                let (then, end) = self.region()?;
                let other = match end {
                    "} else {" => self.whole_region()?,
                    "}" => Region::default(),
                    _ => return Err(format!("`{end}` ends no region")),
                };
                own.regions = vec![then, other];
            } else if own.op == "loop" {
                own.regions = vec![self.whole_region()?];
            }
            region.statements.push(own);
        }
    }
}

/// `v1 v2`
fn yielded(values: &str) -> Option<Vec<u32>> {
    let mut words = LineWords::of(values);
    let all: Option<Vec<u32>> = words.by_ref().map(|word| value(&word)).collect();
    words.end(all?)
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

    /// What was read, if nothing follows.
    fn end<T>(&self, read: T) -> Option<T> {
        self.0.trim().is_empty().then_some(read)
    }

    fn number<T: FromStr>(&mut self) -> Option<T> {
        self.next()?.parse().ok()
    }

    /// `{ 1, 2 }`, or `{  }`
    fn numbers(&mut self) -> Option<Vec<i128>> {
        self.is("{")?;
        let (mut all, mut word) = (Vec::new(), self.next()?);
        while word != "}" {
            all.push(word.parse().ok()?);
            word = self.next()?;
            if word == "," {
                word = self.next().filter(|word| word != "}")?;
            } else if word != "}" {
                return None;
            }
        }
        Some(all)
    }

    /// `x 3`, or nothing, which is once.
    fn times(&mut self) -> Option<usize> {
        let mut ahead = LineWords(self.0);
        match ahead.next()?.as_str() {
            "x" => {
                let count = ahead.number().filter(|count| *count > 0)?;
                self.0 = ahead.0;
                Some(count)
            }
            _ => Some(1),
        }
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
    let (kind, name) = (words.next()?, words.next()?);
    let mut own = Declared {
        kind,
        name,
        ty: "i32".to_string(),
        range: WORD,
        starts: Vec::new(),
        columns: 1,
        length: 0,
    };
    match own.kind.as_str() {
        "in" | "out" | "live" | "keyed" | "cell" | "probe" => {
            words.is(":")?;
            own.ty = words.next()?;
        }
        "line" => {
            words.is(":")?;
            own.length = words.number()?;
        }
        "table" => own.columns = words.times()?,
        "event" => {
            words.is("(")?;
            words.number::<u32>()?;
            words.is(")")?;
        }
        _ => return None,
    }
    if own.kind == "cell" {
        words.times()?;
    }
    if !["table", "event", "probe"].contains(&own.kind.as_str()) {
        own.range = words.interval()?;
    }
    match own.kind.as_str() {
        "live" | "cell" => {
            words.is("=")?;
            own.starts.push(words.number()?);
        }
        "keyed" | "table" => {
            words.is("=")?;
            own.starts = words.numbers()?;
        }
        _ => {}
    }
    words.end(own)
}

fn statement(line: &str) -> Option<Statement> {
    let mut own = Statement {
        text: line.trim_end_matches([' ', '{']).to_string(),
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
    for _ in row_of(&own.op).into_iter().flat_map(Row::kinds) {
        own.names.push(words.next()?);
    }
    let has_regions = ["if", "loop"].contains(&own.op.as_str());
    while let Some(word) = words.next() {
        if word == "{" && has_regions {
            return words.end(own);
        }
        match (value(&word), word.parse()) {
            (Some(value), _) => own.args.push(value),
            (_, Ok(number)) => own.numbers.push(number),
            _ if word == "(" && own.op == "loop" => carried(&mut own, &mut words)?,
            _ => return None,
        }
    }
    words.end(own).filter(|_| !has_regions)
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
