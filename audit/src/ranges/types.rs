//! What operators are given and what they give: types of values, kinds of what is named, numbers.

#[cfg(test)]
mod tests;

use super::read::Statement;
use super::rule::{Interval, WORD};

/// A row of the table.
pub(super) struct Row {
    /// Operators, each a word.
    ops: &'static str,
    /// What each names, each kind a word.
    names: &'static str,
    /// Types of its operands and of its result: `b` a bit, `w` a word, `d` two words, `n` one of
    /// the latter, `t` any (those two the same wherever they stand), `o` that of what is named
    /// first; `*`: any number of words.
    args: &'static str,
    result: &'static str,
    /// Numbers behind them: `s` a shift, less than the width of the result, `k` any.
    numbers: &'static str,
}

const fn row(
    ops: &'static str,
    names: &'static str,
    args: &'static str,
    result: &'static str,
    numbers: &'static str,
) -> Row {
    Row {
        ops,
        names,
        args,
        result,
        numbers,
    }
}

const ROWS: &[Row] = &[
    row("const", "", "", "t", "k"),
    row("add sub mul min max", "", "nn", "n", ""),
    row("mul_wide", "", "ww", "d", ""),
    row("mac_wide", "", "dww", "d", ""),
    row("mac_top", "", "www", "w", ""),
    row("shl sar sar_round", "", "n", "n", "s"),
    row("shl_wrap", "", "w", "w", "s"),
    row("div_round quot", "", "ww", "w", "s"),
    row("sqrt narrow low", "", "d", "w", ""),
    row("widen", "", "w", "d", ""),
    row("assume", "", "n", "n", "kk"),
    row("mul_top add_wrap sub_wrap mul_wrap", "", "ww", "w", ""),
    row("add_sat sub_sat", "", "ww", "w", ""),
    row("eq", "", "tt", "b", ""),
    row("lt le", "", "nn", "b", ""),
    row("and or", "", "bb", "b", ""),
    row("not", "", "b", "b", ""),
    row("select", "", "btt", "t", ""),
    row("in", "in", "", "o", ""),
    row("out", "out", "o", "", ""),
    row("live", "live", "", "o", ""),
    row("tick", "", "", "w", "k"),
    row("keyed", "keyed", "", "o", ""),
    row("get", "cell", "", "o", ""),
    row("get_at", "cell", "w", "o", ""),
    row("set", "cell", "o", "", ""),
    row("set_at", "cell", "wo", "", ""),
    row("wave", "cell cell", "wwwwww", "", ""),
    row("lookup", "table", "w", "w", "k"),
    row("emit", "event", "*", "", ""),
    row("delay", "line", "", "o", "k"),
    row("delay_at", "line", "w", "o", ""),
    row("push fill", "line", "o", "", ""),
    row("probe", "probe", "o", "", ""),
];

/// The row of an operator; `if` and `loop` have none.
pub(super) fn row_of(op: &str) -> Option<&'static Row> {
    ROWS.iter()
        .find(|row| row.ops.split(' ').any(|own| own == op))
}

impl Row {
    /// Kinds of what it names.
    pub fn kinds(&self) -> impl Iterator<Item = &'static str> {
        self.names.split_whitespace()
    }

    /// Whether a statement with operands of these types is as the row says; `named`: the type of
    /// what it names first.
    pub fn fits(&self, own: &Statement, args: &[&str], named: Option<&str>) -> bool {
        let results = own.results.iter().map(|own| own.ty.as_str());
        let given: Vec<&str> = args.iter().copied().chain(results).collect();
        let args = match self.args {
            "*" => "w".repeat(args.len()),
            _ => self.args.to_string(),
        };
        let wanted = args + self.result;
        let free = wanted.find(['n', 't']).and_then(|at| given.get(at));
        let is = |(letter, ty): (char, &str)| match letter {
            'b' => ty == "i1",
            'w' => ty == "i32",
            'd' => ty == "i64",
            'o' => named == Some(ty),
            'n' if ty == "i1" => false,
            _ => free == Some(&ty),
        };
        let width = if given.last() == Some(&"i64") { 64 } else { 32 };
        let allows = |(letter, number)| letter == 'k' || (0..width).contains(number);
        wanted.len() == given.len()
            && wanted.chars().zip(given.iter().copied()).all(is)
            && own.numbers.len() == self.numbers.len()
            && self.numbers.chars().zip(&own.numbers).all(allows)
            && own.regions.is_empty()
    }
}

/// All that a type of values holds, or one of ports.
pub(super) fn of_type(name: &str) -> Option<Interval> {
    Some(match name {
        "i1" => Interval::new(0, 1),
        "i16" => Interval::new(i16::MIN.into(), i16::MAX.into()),
        "u16" => Interval::new(0, u16::MAX.into()),
        "i32" => WORD,
        "i64" => Interval::new(i64::MIN.into(), i64::MAX.into()),
        _ => return None,
    })
}

/// The type of a value that is read from something of a type, or stored there.
pub(super) fn of_value(ty: &str) -> &str {
    match ty {
        "i16" | "u16" => "i32",
        _ => ty,
    }
}
