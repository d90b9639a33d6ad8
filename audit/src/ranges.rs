//! Ranges: that no value of a Kernel leaves the interval that its text declares.
//!
//! ```text
//!   text --read--> statements --rule--> the interval of each result, from those of its operands
//! ```
//!
//! Each statement is looked at once, in the order of the text. What a cell, a line or a port holds
//! lies in the interval that it declares, because everything that is stored there does; so the
//! proof is by induction over the ticks. What rests on more than intervals is collected as
//! promises.

mod read;
mod rule;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use crate::Refusal;
use read::{Defined, Region, Statement};
use rule::Interval;

/// What was found of one Kernel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ranges {
    /// Its name.
    pub kernel: String,
    /// Values whose interval follows from those of their operands, or of what they read.
    pub values: usize,
    /// Stores into cells, lines and ports that have room for what is stored.
    pub stores: usize,
    /// What is promised by an argument beyond intervals, and so believed.
    pub promises: Vec<String>,
}

/// Checks every Kernel of a text.
///
/// # Errors
/// The first line that cannot be read, or whose interval is too small.
pub fn check_ranges(text: &str) -> Result<Vec<Ranges>, Refusal> {
    let kernels = read::kernels(text).map_err(Refusal::new)?;
    kernels.iter().map(check_kernel).collect()
}

fn check_kernel(kernel: &read::Kernel) -> Result<Ranges, Refusal> {
    let of = |why| Refusal::new(format!("the ranges of `{}`: {why}", kernel.name));
    let mut check = KernelCheck {
        kernel,
        known: HashMap::new(),
        found: Ranges {
            kernel: kernel.name.clone(),
            ..Ranges::default()
        },
    };
    check.declared().map_err(of)?;
    for region in [&kernel.init, &kernel.tick] {
        check.region(region).map_err(of)?;
        check.known.clear();
    }
    Ok(check.found)
}

struct KernelCheck<'k> {
    kernel: &'k read::Kernel,
    /// The values that are defined on every way to here.
    known: HashMap<u32, Interval>,
    found: Ranges,
}

impl KernelCheck<'_> {
    /// What things hold at first lies in their intervals.
    fn declared(&self) -> Result<(), String> {
        for own in &self.kernel.declared {
            if !own.starts.iter().all(|start| own.range.holds(*start)) {
                return Err(format!("`{}` begins outside of {}", own.name, own.range));
            }
        }
        Ok(())
    }

    fn region(&mut self, region: &Region) -> Result<Vec<Interval>, String> {
        let outside = self.known.clone();
        for statement in &region.statements {
            self.statement(statement)
                .map_err(|why| format!("`{}`: {why}", statement.text))?;
        }
        let yields = region.yields.iter().map(|value| self.interval(*value));
        let yields = yields.collect();
        self.known = outside;
        yields
    }

    fn statement(&mut self, own: &Statement) -> Result<(), String> {
        match own.op.as_str() {
            "if" => {
                self.interval(*own.args.first().ok_or("has no condition")?)?;
                let [then, other] = &own.regions[..] else {
                    return Err("has not two regions".into());
                };
                let [then, other] = [self.region(then)?, self.region(other)?];
                let either = then.iter().zip(&other).map(|(a, b)| a.union(*b));
                room(&own.results, &other)?;
                exactly(&own.results, &either.collect::<Vec<_>>())?;
            }
            "loop" => self.repeated(own)?,
            _ => self.plain(own)?,
        }
        for result in &own.results {
            self.define(result)?;
        }
        Ok(())
    }

    /// Rounds, and what is carried from one to the next.
    fn repeated(&mut self, own: &Statement) -> Result<(), String> {
        let ([body], [rounds]) = (&own.regions[..], &own.numbers[..]) else {
            return Err("has not one region".into());
        };
        let (round, carried) = own.params.split_first().ok_or("has no round")?;
        room(std::slice::from_ref(round), &[Interval::new(0, rounds - 1)])?;
        let starts: Result<Vec<_>, _> =
            own.args.iter().map(|value| self.interval(*value)).collect();
        room(carried, &starts?)?;
        let outside = self.known.clone();
        own.params.iter().try_for_each(|param| self.define(param))?;
        let yields = self.region(body)?;
        self.known = outside;
        room(carried, &yields)?;
        room(&own.results, &yields)
    }

    fn plain(&mut self, own: &Statement) -> Result<(), String> {
        let args: Result<Vec<_>, _> = own.args.iter().map(|value| self.interval(*value)).collect();
        let args = args?;
        let named: Option<Vec<_>> = own
            .names
            .iter()
            .map(|name| self.kernel.find(name))
            .collect();
        let named = named.ok_or("names what is not declared")?;
        if let ("delay", [back]) = (own.op.as_str(), &own.numbers[..]) {
            let line = named.first().ok_or("reads no line")?;
            if !(1..=line.length).contains(back) {
                return Err(format!("the line holds {} words", line.length));
            }
        }
        if let "assume" | "wave" = own.op.as_str() {
            self.found.promises.push(own.text.clone());
        }
        if let Some(stored) = rule::stored(&own.op) {
            let into = named.first().ok_or("stores nowhere")?.range;
            let word = args.get(stored).ok_or("stores nothing")?;
            self.found.stores += 1;
            if !into.contains(*word) {
                return Err(format!("{word} is stored where {into} is held"));
            }
        }
        let Some(computed) = rule::interval(&own.op, &args, &named, &own.numbers)? else {
            return match own.results[..] {
                [] => Ok(()),
                _ => Err("has no result".into()),
            };
        };
        exactly(&own.results, &[computed])
    }

    fn interval(&self, value: u32) -> Result<Interval, String> {
        let known = self.known.get(&value).copied();
        known.ok_or_else(|| format!("v{value} is not defined on the way here"))
    }

    fn define(&mut self, own: &Defined) -> Result<(), String> {
        let ty = rule::of_type(&own.ty).ok_or_else(|| format!("`{}` is no type", own.ty))?;
        if own.range.is_empty() || !ty.contains(own.range) {
            return Err(format!("{} does not lie in an {}", own.range, own.ty));
        }
        self.found.values += 1;
        match self.known.insert(own.value, own.range) {
            Some(_) => Err(format!("v{} is defined twice", own.value)),
            None => Ok(()),
        }
    }
}

/// Whether results are declared as what is computed, and no larger: so no end of an interval can be
/// changed without being noticed.
fn exactly(results: &[Defined], computed: &[Interval]) -> Result<(), String> {
    room(results, computed)?;
    let larger = results
        .iter()
        .zip(computed)
        .find(|(own, computed)| own.range != **computed);
    match larger {
        Some((own, computed)) => Err(format!("{} is declared, {computed} is computed", own.range)),
        None => Ok(()),
    }
}

/// Whether results have room for what is computed.
fn room(results: &[Defined], computed: &[Interval]) -> Result<(), String> {
    if results.len() != computed.len() {
        return Err("as many results as are computed are wanted".into());
    }
    for (result, computed) in results.iter().zip(computed) {
        if !result.range.contains(*computed) {
            let declared = result.range;
            return Err(format!("{declared} is declared, {computed} is computed"));
        }
    }
    Ok(())
}
