//! What of an experiment held.

use whippen_compiler::units::{Dim, shown};

use super::bind::{Bound, Test, When};
use super::claims::{Claim, Subject};
use super::steps::Moment;
use crate::trace::{EventRow, Trace};

/// What became of a claim, or of an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What was claimed.
    pub claim: String,
    /// Why it should be; may be empty.
    pub why: String,
    /// Whether it held.
    pub held: bool,
    /// What was found, in words.
    pub found: String,
}

/// So many events of an order are told.
const TOLD_MAX: usize = 12;

/// A span of ticks, the last not in it, and the same in time (s).
struct Window {
    ticks: (usize, usize),
    seconds: (f64, f64),
}

impl Bound<'_> {
    /// The instants of a trace (s), as far as they came.
    pub fn instants(&self, trace: &Trace) -> Vec<(String, Option<f64>)> {
        let mut found: Vec<(String, Option<f64>)> = Vec::new();
        for (instant, when) in self.experiment.instants.iter().zip(&self.instants) {
            let from = match &instant.after {
                Some(after) => at(after, &found),
                None => Some(0.0),
            };
            let seconds = from.and_then(|from| first(trace, when, from));
            found.push((instant.name.clone(), seconds));
        }
        found
    }

    /// Whether everything that is claimed holds of a trace of every tick; instants that never come
    /// are told first.
    pub fn verdicts(&self, trace: &Trace) -> Vec<Verdict> {
        let instants = self.instants(trace);
        let named = self.experiment.instants.iter().zip(&instants);
        let missing = named.filter(|(_, (_, seconds))| seconds.is_none());
        let never = missing.map(|(instant, (name, _))| Verdict {
            claim: format!("instant {name}: {}", instant.when.text),
            why: String::new(),
            held: false,
            found: "it never comes".to_string(),
        });
        let judged = self
            .experiment
            .claims
            .iter()
            .zip(&self.tests)
            .map(|(claim, test)| {
                let (held, found) = match window(trace, claim, &instants) {
                    Ok(window) => judge(trace, test, &window, &instants),
                    Err(why) => (false, why),
                };
                Verdict {
                    claim: claim.told(),
                    why: claim.why.clone().unwrap_or_default(),
                    held,
                    found,
                }
            });
        never.chain(judged).collect()
    }
}

/// When an instant is (s).
fn at(moment: &Moment, instants: &[(String, Option<f64>)]) -> Option<f64> {
    let start = match moment.named {
        Some(named) => instants.get(named)?.1?,
        None => 0.0,
    };
    Some(start + moment.offset_s)
}

/// When something first is, not before a time (s).
fn first(trace: &Trace, when: &When, from_s: f64) -> Option<f64> {
    match when {
        When::At(seconds) => Some(*seconds),
        When::Event(name) => {
            let mut events = trace.events.iter();
            events
                .find(|e| e.event == *name && e.t_s >= from_s)
                .map(|e| e.t_s)
        }
        When::Beyond {
            column,
            above,
            value,
        } => {
            let values = trace.columns[*column].values();
            let start = tick(trace, from_s).min(values.len());
            let is_beyond = |v: &f64| if *above { v > value } else { v < value };
            let found = values[start..].iter().position(is_beyond)?;
            Some(trace.time_s(start + found))
        }
    }
}

fn tick(trace: &Trace, seconds: f64) -> usize {
    (seconds * f64::from(trace.rate_hz)).round().max(0.0) as usize
}

fn window(
    trace: &Trace,
    claim: &Claim,
    instants: &[(String, Option<f64>)],
) -> Result<Window, String> {
    let end_s = trace.time_s(trace.ticks());
    let side = |moment: &Option<Moment>, otherwise: f64| match moment {
        None => Ok(otherwise),
        Some(moment) => at(moment, instants).ok_or_else(|| format!("{} never comes", moment.text)),
    };
    let seconds = (side(&claim.from, 0.0)?, side(&claim.until, end_s)?);
    let ticks = (
        tick(trace, seconds.0),
        tick(trace, seconds.1).min(trace.ticks()),
    );
    if ticks.0 >= ticks.1 {
        return Err(format!(
            "there is nothing between {:.4} s and {:.4} s",
            seconds.0, seconds.1
        ));
    }
    Ok(Window { ticks, seconds })
}

/// Whether it holds, and what was found.
fn judge(
    trace: &Trace,
    test: &Test,
    window: &Window,
    instants: &[(String, Option<f64>)],
) -> (bool, String) {
    match test.subject {
        Subject::Order => order(trace, test, window),
        Subject::Count => {
            let count = events(trace, &test.events, window).count() as f64;
            (inside(test, count), format!("{count}"))
        }
        Subject::Argument => {
            let happened = events(trace, &test.events, window);
            let argument = |event: &EventRow| {
                let mut args = event.args.iter();
                args.find(|(title, _)| *title == test.argument)
                    .map(|(_, value)| *value)
            };
            let values: Vec<f64> = happened.filter_map(argument).collect();
            match extent(values.iter().copied()) {
                Some(ends) => (
                    inside(test, ends.0) && inside(test, ends.1),
                    spanned(ends, |value| shown(value, test.dim)),
                ),
                None => (false, "the event never comes".to_string()),
            }
        }
        Subject::Duration => {
            let at = |named: usize| instants[named].1;
            match test
                .between
                .and_then(|(first, last)| Some(at(last)? - at(first)?))
            {
                Some(seconds) => (inside(test, seconds), shown(seconds, Dim::TIME)),
                None => (false, "one of the instants never comes".to_string()),
            }
        }
        _ => of_columns(trace, test, window),
    }
}

fn of_columns(trace: &Trace, test: &Test, window: &Window) -> (bool, String) {
    let (from, until) = window.ticks;
    let values = |at: usize| &trace.columns[test.columns[at].at].values()[from..until];
    let first = values(0);
    if let Some(bad) = test
        .columns
        .iter()
        .enumerate()
        .flat_map(|(at, _)| values(at))
        .find(|v| !v.is_finite())
    {
        return (false, format!("a value is {bad}"));
    }
    let ends = extent(first.iter().copied()).unwrap_or((f64::NAN, f64::NAN));
    let one = |value: f64| (inside(test, value), test.columns[0].shown(value));
    match test.subject {
        Subject::Greatest => one(ends.1),
        Subject::Least => one(ends.0),
        Subject::Mean => one(first.iter().sum::<f64>() / first.len() as f64),
        Subject::Apart => {
            let apart = first.iter().zip(values(1)).map(|(a, b)| (a - b).abs());
            one(apart.fold(0.0, f64::max))
        }
        Subject::Rises => one(against(first.iter().map(|v| -v))),
        Subject::Falls => one(against(first.iter().copied())),
        Subject::Peaks => {
            let count = peaks(first, test.threshold) as f64;
            (inside(test, count), format!("{count}"))
        }
        _ => {
            let found = spanned(ends, |value| test.columns[0].shown(value));
            (inside(test, ends.0) && inside(test, ends.1), found)
        }
    }
}

fn inside(test: &Test, value: f64) -> bool {
    (test.low..=test.high).contains(&value)
}

fn spanned((low, high): (f64, f64), show: impl Fn(f64) -> String) -> String {
    if low == high {
        show(low)
    } else {
        format!("{} .. {}", show(low), show(high))
    }
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |ends, value| {
        let (low, high): (f64, f64) = ends.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// The greatest rise from any value to a later one.
fn against(values: impl Iterator<Item = f64>) -> f64 {
    let mut least = f64::INFINITY;
    values.fold(0.0, |most: f64, value| {
        least = least.min(value);
        most.max(value - least)
    })
}

/// How often values rise above one threshold, with a fall below the other between.
fn peaks(values: &[f64], (above, below): (f64, f64)) -> usize {
    let mut is_up = false;
    let mut count = 0;
    for value in values {
        if !is_up && *value > above {
            count += 1;
            is_up = true;
        } else if *value <= below {
            is_up = false;
        }
    }
    count
}

fn events<'t>(
    trace: &'t Trace,
    names: &'t [String],
    window: &Window,
) -> impl Iterator<Item = &'t EventRow> {
    let (from_s, until_s) = window.seconds;
    let is_inside =
        move |e: &&EventRow| e.t_s >= from_s && e.t_s < until_s && names.contains(&e.event);
    trace.events.iter().filter(is_inside)
}

/// The events of a list are those that come, in this order, as often as they are listed.
fn order(trace: &Trace, test: &Test, window: &Window) -> (bool, String) {
    let came: Vec<&str> = events(trace, &test.events, window)
        .map(|e| e.event.as_str())
        .collect();
    let held = came.iter().eq(test.events.iter());
    let more = if came.len() > TOLD_MAX {
        format!(", and {} more", came.len() - TOLD_MAX)
    } else {
        String::new()
    };
    let told = came
        .iter()
        .take(TOLD_MAX)
        .copied()
        .collect::<Vec<_>>()
        .join(", ");
    (
        held,
        if told.is_empty() {
            "none of them".to_string()
        } else {
            told + &more
        },
    )
}
