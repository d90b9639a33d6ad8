//! The parameters that a fit may change: `NAME` within its declared range, or `NAME=LOW..HIGH`.

use std::str::FromStr;

use whippen_compiler::model::{Model, Parameter};
use whippen_compiler::units::Dim;

use super::super::sweep::grid::Over;
use crate::exit::Failure;

/// A parameter as it is named on the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeName {
    name: String,
    bounds: Option<Over>,
}

impl FromStr for FreeName {
    type Err = String;

    fn from_str(text: &str) -> Result<FreeName, String> {
        if !text.contains('=') {
            return Ok(FreeName {
                name: text.trim().to_string(),
                bounds: None,
            });
        }
        let over: Over = text.parse()?;
        if over.count.is_some() {
            return Err("a fit has no points: leave the count away".into());
        }
        Ok(FreeName {
            name: over.name.clone(),
            bounds: Some(over),
        })
    }
}

/// A parameter that is free, with its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// As `--set` names it.
    pub name: String,
    /// What its values are.
    pub dim: Dim,
    /// The least and the greatest value (SI).
    pub bounds: (f64, f64),
    /// What it is in the program (SI).
    pub value: f64,
}

impl Free {
    /// Finds the parameters that are named in an instrument.
    ///
    /// # Errors
    /// One is unknown, has no bounds, or is named twice.
    pub fn find(named: &[FreeName], model: &Model) -> Result<Vec<Free>, Failure> {
        for (number, one) in named.iter().enumerate() {
            if named[..number].iter().any(|other| other.name == one.name) {
                let why = format!("--free {}: it is named twice", one.name);
                return Err(Failure::Usage(why));
            }
        }
        named.iter().map(|named| Free::of(named, model)).collect()
    }

    fn of(named: &FreeName, model: &Model) -> Result<Free, Failure> {
        let usage = |why: String| Failure::Usage(format!("--free {}: {why}", named.name));
        let own =
            parameter(model, &named.name).ok_or_else(|| usage(unknown(&named.name, model)))?;
        let declared = own.range.map(|range| (range.low, range.high));
        let bounds = match (&named.bounds, declared) {
            (Some(over), _) if over.dim != own.dim => {
                return Err(usage(format!("its bounds are not in {}", own.dim.unit())));
            }
            (Some(over), Some((low, high))) if over.ends.0 < low || over.ends.1 > high => {
                let unit = own.dim.unit();
                return Err(usage(format!(
                    "its range in the program is {low} {unit} .. {high} {unit}; stay within it, or widen it there"
                )));
            }
            (Some(over), _) => over.ends,
            (None, Some(declared)) if declared.0 < declared.1 => declared,
            (None, _) => {
                let unit = own.dim.unit();
                let (low, high) = (own.value / 2.0, own.value * 2.0);
                return Err(usage(format!(
                    "between which values? it has no range in the program; write --free {}={low}{unit}..{high}{unit}",
                    named.name
                )));
            }
        };
        Ok(Free {
            name: named.name.clone(),
            dim: own.dim,
            bounds,
            value: own.value,
        })
    }

    /// The value at a part of the way between the bounds; both ends are exact.
    pub fn at(&self, part: f64) -> f64 {
        let (low, high) = self.bounds;
        low * (1.0 - part) + high * part
    }

    /// The part of the way at which the program's own value is, or the nearer bound.
    pub fn start(&self) -> f64 {
        let (low, high) = self.bounds;
        ((self.value - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// How far it is from bound to bound (SI).
    pub fn width(&self) -> f64 {
        self.bounds.1 - self.bounds.0
    }

    /// A value as `--set` takes it.
    pub fn setting(&self, value: f64) -> (String, String) {
        (self.name.clone(), format!("{value}{}", self.dim.unit()))
    }
}

/// The parameter of a name, or of `instrument.name`.
pub fn parameter<'m>(model: &'m Model, name: &str) -> Option<&'m Parameter> {
    let own = name
        .strip_prefix(&model.name)
        .and_then(|rest| rest.strip_prefix('.'));
    let all = || model.parameters.iter();
    all()
        .find(|p| p.name == name)
        .or_else(|| all().find(|p| Some(p.name.as_str()) == own))
}

fn unknown(name: &str, model: &Model) -> String {
    let names: Vec<&str> = model.parameters.iter().map(|p| &*p.name).collect();
    match names.is_empty() {
        true => format!("`{}` has no parameters", model.name),
        false => format!(
            "`{}` has no parameter `{name}`; it has {}",
            model.name,
            names.join(", ")
        ),
    }
}
