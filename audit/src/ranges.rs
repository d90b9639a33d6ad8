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
mod types;

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
    known: HashMap<u32, Defined>,
    found: Ranges,
}

impl KernelCheck<'_> {
    /// What things hold at first lies in their intervals.
    fn declared(&self) -> Result<(), String> {
        for own in &self.kernel.declared {
            let of_type = types::of_type(&own.ty);
            if !of_type.is_some_and(|all| all.contains(own.range)) || own.range.is_empty() {
                return Err(format!("`{}` has no {} in {}", own.name, own.ty, own.range));
            }
            if !own.starts.iter().all(|start| own.range.holds(*start)) {
                return Err(format!("`{}` begins outside of {}", own.name, own.range));
            }
        }
        Ok(())
    }

    fn region(&mut self, region: &Region) -> Result<Vec<Defined>, String> {
        let outside = self.known.clone();
        for statement in &region.statements {
            self.statement(statement)
                .map_err(|why| format!("`{}`: {why}", statement.text))?;
        }
        let yields = region.yields.iter().map(|value| self.value(*value));
        let yields = yields.collect();
        self.known = outside;
        yields
    }

    fn statement(&mut self, own: &Statement) -> Result<(), String> {
        match own.op.as_str() {
            "if" => {
                let ([value], [then, other]) = (&own.args[..], &own.regions[..]) else {
                    return Err("has not one condition and two regions".into());
                };
                if self.value(*value)?.ty != "i1" || !own.numbers.is_empty() {
                    return Err("has no condition".into());
                }
                let [then, mut other] = [self.region(then)?, self.region(other)?];
                room(&own.results, &then)?;
                room(&own.results, &other)?;
                for (other, then) in other.iter_mut().zip(&then) {
                    other.range = other.range.union(then.range);
                }
                exactly(&own.results, &other)?;
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
        if *rounds < 1 {
            return Err("has no rounds".into());
        }
        let (round, carried) = own.params.split_first().ok_or("has no round")?;
        let first = Defined {
            range: Interval::new(0, rounds - 1),
            ty: "i32".to_string(),
            value: round.value,
        };
        room(std::slice::from_ref(round), &[first])?;
        let starts: Result<Vec<_>, _> = own.args.iter().map(|value| self.value(*value)).collect();
        room(carried, &starts?)?;
        let outside = self.known.clone();
        own.params.iter().try_for_each(|param| self.define(param))?;
        let yields = self.region(body)?;
        self.known = outside;
        room(carried, &yields)?;
        room(&own.results, &yields)
    }

    fn plain(&mut self, own: &Statement) -> Result<(), String> {
        let row = types::row_of(&own.op).ok_or("is no operator")?;
        let args: Result<Vec<_>, _> = own.args.iter().map(|value| self.value(*value)).collect();
        let args = args?;
        let named = own.names.iter().zip(row.kinds()).map(|(name, kind)| {
            let found = self.kernel.find(name);
            found.filter(|own| own.kind == kind)
        });
        let named: Option<Vec<_>> = named.collect();
        let named = named.ok_or("names what is not declared")?;
        let ty = named.first().map(|own| types::of_value(&own.ty));
        let of_args: Vec<&str> = args.iter().map(|own| own.ty.as_str()).collect();
        if !row.fits(own, &of_args, ty) {
            return Err("has operands, numbers or a result of other types".into());
        }
        let args: Vec<Interval> = args.iter().map(|own| own.range).collect();
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
            return Ok(());
        };
        let computed = own.results.iter().map(|own| Defined {
            range: computed,
            ..own.clone()
        });
        exactly(&own.results, &computed.collect::<Vec<_>>())
    }

    fn value(&self, value: u32) -> Result<Defined, String> {
        let known = self.known.get(&value).cloned();
        known.ok_or_else(|| format!("v{value} is not defined on the way here"))
    }

    fn define(&mut self, own: &Defined) -> Result<(), String> {
        let ty = types::of_type(&own.ty).filter(|_| types::of_value(&own.ty) == own.ty);
        let ty = ty.ok_or_else(|| format!("`{}` is no type of values", own.ty))?;
        if own.range.is_empty() || !ty.contains(own.range) {
            return Err(format!("{} does not lie in an {}", own.range, own.ty));
        }
        self.found.values += 1;
        match self.known.insert(own.value, own.clone()) {
            Some(_) => Err(format!("v{} is defined twice", own.value)),
            None => Ok(()),
        }
    }
}

/// Whether results are declared as what is computed, and no larger: so no end of an interval can be
/// changed without being noticed.
fn exactly(results: &[Defined], computed: &[Defined]) -> Result<(), String> {
    room(results, computed)?;
    let larger = results.iter().zip(computed);
    let mut larger = larger.filter(|(own, computed)| own.range != computed.range);
    larger.next().map_or(Ok(()), |(own, computed)| {
        let (own, computed) = (own.range, computed.range);
        Err(format!("{own} is declared, {computed} is computed"))
    })
}

/// Whether results have room for what is computed, and its types.
fn room(results: &[Defined], computed: &[Defined]) -> Result<(), String> {
    if results.len() != computed.len() {
        return Err("as many results as are computed are wanted".into());
    }
    for (result, computed) in results.iter().zip(computed) {
        if result.ty != computed.ty {
            let (own, other) = (&result.ty, &computed.ty);
            return Err(format!("{own} is declared, {other} is computed"));
        }
        if !result.range.contains(computed.range) {
            let (own, computed) = (result.range, computed.range);
            return Err(format!("{own} is declared, {computed} is computed"));
        }
    }
    Ok(())
}
