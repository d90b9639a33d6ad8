//! Diagnostics of values that cannot be bounded: the value, what it is made of, and the call of a
//! term that led there.

use super::{LIMIT, Problem, TICKS_SLACK};
use crate::diag::{Code, Diagnostic};
use crate::model::{Interval, Model, Node, NodeId, Strand};
use crate::units::{Dim, shown, shown_range};
use whippen_source::Span;

impl Problem {
    /// The message about a node.
    pub(super) fn diagnostic(self, model: &Model, node: NodeId) -> Diagnostic {
        let span = place(model, node).unwrap_or_default();
        let operand = model.dag.get(node).operands().last().copied();
        let diagnostic = match self {
            Problem::ZeroDivisor(interval) => divisor(model, operand, interval, span),
            Problem::NegativeBase(interval) => negative_base(model, node, interval, span),
            Problem::OutsideDomain(function, interval) => {
                let name = function.name();
                let message = format!(
                    "`{name}` of a value that may be zero or negative: it lies in {}",
                    si(interval)
                );
                let label = "no real number where its operand is not above zero";
                Diagnostic::new(Code::OutsideDomain, span, message, label).hint(format!(
                    "keep it above zero, for example `{name}(max(.., 0.001))`"
                ))
            }
            Problem::OutsideDelay(ticks, held) => outside_delay(model, node, ticks, held),
            Problem::OutsideString(places) => match model.dag.get(node) {
                Node::Mean(strand, _) | Node::Read(strand, ..) => {
                    outside_string(&model.strands[strand], span, places)
                }
                _ => unbounded(model, node, span),
            },
            Problem::Pushes(slip, law) => pushes(model, node, slip, law),
            Problem::Unbounded => unbounded(model, node, span),
        };
        model
            .calls_around(node)
            .fold(diagnostic, |d, span| d.also(span, "in this call"))
    }
}

fn place(model: &Model, node: NodeId) -> Option<Span> {
    model.spans.get(node).copied().flatten()
}

/// A time that a delay line may not hold.
fn outside_delay(model: &Model, node: NodeId, ticks: Interval, held: Interval) -> Diagnostic {
    let span = place(model, node).unwrap_or_default();
    let seconds = |ticks: f64| shown(ticks / f64::from(model.rate_hz), Dim::TIME);
    let (&Node::Tap(delay, _) | &Node::Tuned(delay, ..)) = model.dag.get(node) else {
        return unbounded(model, node, span);
    };
    let delay = &model.delays[delay];
    let message = format!(
        "`{}` may be read {} .. {} ago, and it holds {} .. {}",
        delay.name,
        seconds(ticks.low),
        seconds(ticks.high),
        seconds(held.low),
        seconds(held.high)
    );
    let hint = match ticks.high > held.high + TICKS_SLACK {
        true => format!(
            "write `lasting {}` or more, or put a `clamp` around the time",
            seconds(ticks.high)
        ),
        false => format!(
            "the last tick is the nearest: put `max(.., {})` around the time",
            match held.low > 1.0 {
                true => "1.3 * tick",
                false => "tick",
            }
        ),
    };
    Diagnostic::new(
        Code::OutsideDelay,
        span,
        message,
        "a time that it may not hold",
    )
    .also(delay.span, "declared here")
    .hint(hint)
}

/// A place that may lie outside of a string.
pub fn outside_string(strand: &Strand, span: Span, places: Interval) -> Diagnostic {
    let start = strand.along.low;
    let placed = Interval {
        low: places.low + start,
        high: places.high + start,
    };
    let message = match placed.low == placed.high {
        true => format!(
            "{} is outside of the string `{}`",
            shown(placed.low, Dim::LENGTH),
            strand.name
        ),
        false => format!(
            "this place may be {}, and the string `{}` does not reach so far",
            shown_range(placed, Dim::LENGTH),
            strand.name
        ),
    };
    let ends = shown_range(strand.along, Dim::LENGTH);
    let hint = match placed.low == placed.high {
        true => format!("it goes from {}", ends.replace(" .. ", " to ")),
        false => "put a `clamp` around the place".to_string(),
    };
    Diagnostic::new(Code::OutsideString, span, message, "no part of the string")
        .also(strand.span, format!("along {ends}"))
        .hint(hint)
}

fn pushes(model: &Model, node: NodeId, slip: Interval, law: Interval) -> Diagnostic {
    let (sign, forward) = match slip.high > 0.0 {
        true => ("negative", "forward"),
        false => ("positive", "backward"),
    };
    let of_bodies = model.bodies.iter().filter_map(|body| {
        let friction = body.friction.as_ref()?;
        Some((&friction.name, friction.span, friction.last))
    });
    let of_strings = model.strands.iter().filter_map(|strand| {
        let rub = strand.friction.as_ref()?;
        Some((&rub.name, rub.push.span, rub.last))
    });
    let rubbed = of_bodies.chain(of_strings).find_map(|(name, span, last)| {
        let Node::Slip(balance) = model.dag.get(node) else {
            return None;
        };
        let own = *model.dag.get(balance.last) == Node::Cell(last);
        own.then_some((name.clone(), span, place(model, balance.law)))
    });
    let (name, span, law_at) = rubbed.unwrap_or_default();
    let message = format!(
        "the friction `{name}` may push: its force may be {sign} where it slips {forward}, it lies in {}",
        si(law)
    );
    let label = format!("slips {forward} at {}", si(slip));
    let hint = "a friction is 0 N or more where its slip is above 0, and 0 N or less below: \
                multiply by the slip, by `tanh` of it, or by what cannot be negative";
    Diagnostic::new(Code::FrictionSign, law_at.unwrap_or(span), message, label).hint(hint)
}

fn negative_base(model: &Model, node: NodeId, interval: Interval, span: Span) -> Diagnostic {
    let (what, base) = match model.dag.get(node) {
        Node::Power(_, 1) => ("the square root", "operand"),
        _ => ("a half-integer power", "base"),
    };
    let message = format!(
        "{what} of a value that may be negative: it lies in {}",
        si(interval)
    );
    let label = format!("not a real number where the {base} is negative");
    let hint = format!("write `max(.., 0)` around the {base}, with its unit behind the 0");
    Diagnostic::new(Code::NegativePower, span, message, label).hint(hint)
}

fn divisor(model: &Model, divisor: Option<NodeId>, interval: Interval, span: Span) -> Diagnostic {
    let named = divisor.and_then(|d| named(model, d));
    let (subject, lies) = match &named {
        Some((name, dim)) => (format!("`{name}`"), shown_range(interval, *dim)),
        None => ("the divisor".to_string(), si(interval)),
    };
    let message = format!("this may divide by zero: {subject} lies in {lies}");
    let mut diagnostic = Diagnostic::new(
        Code::DivisionByZero,
        span,
        message,
        "this division may be by zero",
    );
    if let Some(place) = divisor.and_then(|d| place(model, d)).filter(|p| *p != span) {
        let label = if named.is_some() {
            format!("{subject} is declared here")
        } else {
            format!("the divisor, {lies}")
        };
        diagnostic = diagnostic.also(place, label);
    }
    let example = match named {
        Some((name, dim)) => format!(
            "`max({name}, {})`",
            shown(interval.magnitude().max(1e-3) * 1e-3, dim)
        ),
        None => "`max(.., a)` with some `a` above zero".to_string(),
    };
    diagnostic.hint(format!(
        "keep the divisor away from zero, for example with {example}, or narrow the range of what it is made of"
    ))
}

fn unbounded(model: &Model, node: NodeId, span: Span) -> Diagnostic {
    let own = model
        .named
        .iter()
        .find(|n| n.value == node)
        .map(|n| n.name.as_str());
    let message = match own {
        Some(name) => format!("`{name}` cannot be bounded"),
        None => "this value cannot be bounded".to_string(),
    };
    let label = format!("may exceed {LIMIT:e} in SI units");
    let mut diagnostic = Diagnostic::new(Code::Unbounded, span, message, label);
    let widest = model
        .dag
        .below(node)
        .into_iter()
        .filter_map(|id| declared(model, id))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let hint = match widest {
        Some((name, _, place)) => {
            diagnostic = diagnostic.also(
                place,
                format!("`{name}` reaches furthest of what it is made of"),
            );
            format!("narrow the declared range of `{name}`, or put a `clamp` around this value")
        }
        None => "put a `clamp` around this value".to_string(),
    };
    diagnostic.hint(hint)
}

/// An interval in SI units, whatever they are.
fn si(interval: Interval) -> String {
    format!("{} (SI units)", shown_range(interval, Dim::NUMBER))
}

/// Name and dimension of a value that has a name.
fn named(model: &Model, node: NodeId) -> Option<(String, Dim)> {
    let own = model
        .named
        .iter()
        .find(|n| n.value == node)
        .and_then(|n| Some((n.name.clone(), n.dim?)));
    own.or(match model.dag.get(node) {
        Node::Sense(s) => Some((
            model.senses[*s as usize].name.clone(),
            model.senses[*s as usize].dim,
        )),
        Node::Live(l) => Some((
            model.lives[*l as usize].name.clone(),
            model.lives[*l as usize].dim?,
        )),
        Node::Keyed(k) => Some((
            model.keyed[*k as usize].name.clone(),
            model.keyed[*k as usize].dim,
        )),
        Node::Cell(c) => Some((model.cells[c].name.clone(), model.cells[c].dim)),
        _ => None,
    })
}

/// Name, reach (SI) and place of a value with a declared range.
fn declared(model: &Model, node: NodeId) -> Option<(&str, f64, Span)> {
    match model.dag.get(node) {
        Node::Sense(s) => {
            Some(&model.senses[*s as usize]).map(|s| (s.name.as_str(), s.range.magnitude(), s.span))
        }
        Node::Live(l) => {
            Some(&model.lives[*l as usize]).map(|l| (l.name.as_str(), l.range.magnitude(), l.span))
        }
        Node::Keyed(k) => {
            Some(&model.keyed[*k as usize]).map(|k| (k.name.as_str(), k.range.magnitude(), k.span))
        }
        Node::Cell(c) => {
            Some(&model.cells[c]).map(|c| (c.name.as_str(), c.range.magnitude(), c.span))
        }
        _ => None,
    }
}
