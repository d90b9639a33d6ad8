//! Interval analysis of a Model: a proven interval for every value, which lowering requires.
//!
//! Memory has declared ranges and every write is clamped to them, so one pass over the graph,
//! operands first, bounds everything: no fixed point is needed. Interval ends are moved outwards by
//! one unit in the last place per operation, so that rounding of the analysis itself stays on the
//! safe side.
//!
//! Not here: integers (the Kernel proves its own ranges again, exactly), relations between values.

mod interval;
mod problem;
#[cfg(test)]
mod tests;

pub use problem::outside_string;

use std::collections::HashMap;

use crate::diag::Diagnostic;
use crate::model::{Balance, Cmp, Delay, Function, Interval, Model, Node, NodeId, Reading, Strand};
use whippen_ids::IdMap;

/// What was proven: an interval per node. Only the analysis makes one.
#[derive(Debug, Clone)]
pub struct Ranges {
    nodes: IdMap<NodeId, Interval>,
}

impl Ranges {
    /// The interval of a real node; `0 .. 1` for a bool that is undecided.
    pub fn get(&self, node: NodeId) -> Interval {
        self.nodes[node]
    }

    /// The interval of every node.
    pub fn all(&self) -> &IdMap<NodeId, Interval> {
        &self.nodes
    }
}

/// Largest magnitude (SI) that counts as bounded; far beyond anything mechanical.
pub const LIMIT: f64 = 1e15;

/// Bounds every value of `model`.
///
/// # Errors
/// One diagnostic per division whose divisor may be zero, per odd half-power of a value that may be
/// negative, per function of what may lie outside of its domain, and per value that is not bounded
/// by [`LIMIT`]; users of a value in error are not
/// reported again.
pub fn analyze(model: &Model) -> Result<Ranges, Vec<Diagnostic>> {
    let none = Ranges {
        nodes: IdMap::new(),
    };
    none.extended_to(model)
}

impl Ranges {
    /// The same for a model whose graph has grown since: only what is new is bounded.
    ///
    /// # Errors
    /// As [`analyze`], of what is new.
    pub fn extended_to(self, model: &Model) -> Result<Ranges, Vec<Diagnostic>> {
        let mut nodes = self.nodes;
        let known = nodes.len();
        let mut bad = IdMap::filled(false, model.dag.len());
        let mut diagnostics = Vec::new();
        for (id, node) in model.dag.nodes().skip(known) {
            let tainted = node.operands().iter().any(|o| bad[o]);
            let result: Result<Interval, Option<Problem>> = if tainted {
                Err(None)
            } else {
                transfer(model, node, |o| nodes[o])
                    .and_then(|value| rubs(model, node, &nodes).map(|()| value))
                    .map_err(Some)
            };
            nodes.push(result.unwrap_or(Interval {
                low: 0.0,
                high: 0.0,
            }));
            if let Err(problem) = result {
                bad[id] = true;
                diagnostics.extend(problem.map(|p| p.diagnostic(model, id)));
            }
        }
        if diagnostics.is_empty() {
            Ok(Ranges { nodes })
        } else {
            Err(diagnostics)
        }
    }
}

/// Whether the law of a friction, if that is what the node is, never pushes: it is not negative
/// where the slip is not, and not positive where the slip is not.
fn rubs(model: &Model, node: &Node, nodes: &IdMap<NodeId, Interval>) -> Result<(), Problem> {
    let Node::Slip(balance) = node else {
        return Ok(());
    };
    let tried = nodes[balance.trial];
    let halves = [
        (
            tried.cut(0.0, f64::INFINITY),
            Interval {
                low: 0.0,
                high: f64::INFINITY,
            },
        ),
        (
            tried.cut(f64::NEG_INFINITY, 0.0),
            Interval {
                low: f64::NEG_INFINITY,
                high: 0.0,
            },
        ),
    ];
    for (slip, allowed) in halves {
        let mut at = HashMap::from([(balance.trial, slip)]);
        for id in model
            .dag
            .between(balance.trial, balance.law)
            .into_iter()
            .skip(1)
        {
            let of = |o: NodeId| at.get(&o).copied().unwrap_or(nodes[o]);
            let value = transfer(model, model.dag.get(id), of).unwrap_or(nodes[id]);
            at.insert(id, value);
        }
        let law = at.get(&balance.law).copied().unwrap_or(nodes[balance.law]);
        if law.low < allowed.low || law.high > allowed.high {
            return Err(Problem::Pushes(slip, law));
        }
    }
    Ok(())
}

/// Why a value has no interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Problem {
    /// The divisor's interval contains zero.
    ZeroDivisor(Interval),
    /// A fractional power of what may be negative.
    NegativeBase(Interval),
    /// A function of what may lie outside of its domain.
    OutsideDomain(Function, Interval),
    /// A time that a delay line may not hold, in ticks, and the least and most that it may be.
    OutsideDelay(Interval, Interval),
    /// A place that may lie outside of its string (m from where it begins).
    OutsideString(Interval),
    /// A friction whose law pushes at slips in the first interval: it lies in the second.
    Pushes(Interval, Interval),
    /// Beyond [`LIMIT`].
    Unbounded,
}

/// The interval of one node from those of its operands.
///
/// # Errors
/// See [`Problem`].
pub fn transfer(
    model: &Model,
    node: &Node,
    of: impl Fn(NodeId) -> Interval,
) -> Result<Interval, Problem> {
    let value = match node {
        Node::Const(c) => Interval::point(c.0),
        Node::Bool(b) => Interval::point(f64::from(*b)),
        Node::Sense(s) => model.senses[*s as usize].range,
        Node::Slope(s) => slope_range(model, *s as usize),
        Node::Curvature(s) => curvature_range(model, *s as usize),
        Node::Live(l) | Node::LiveBool(l) => model.lives[*l as usize].range,
        Node::Keyed(k) => model.keyed[*k as usize].range,
        Node::Cell(c) => model.cells[c].range,
        Node::Noise(_) => Interval::around(1.0),
        &Node::Tap(d, t) => within_line(&model.delays[d], of(t), 1.0)?,
        &Node::Tuned(d, t, _) => tuned(&model.delays[d], of(t))?,
        Node::Read(..) | Node::Mean(..) | Node::Spread(..) | Node::Grid(..) => {
            of_string(model, node, &of)?
        }
        Node::Is(m, _) if model.machines[m].states.len() == 1 => Interval::point(1.0),
        Node::Is(..) => EITHER,
        Node::Linear(c0, terms) => terms.iter().fold(Interval::point(c0.0), |sum, (c, x)| {
            sum + of(*x) * Interval::point(c.0)
        }),
        &Node::Add(a, b) => of(a) + of(b),
        &Node::Sub(a, b) => of(a) - of(b),
        &Node::Mul(a, b) if a == b => of(a).power(4),
        &Node::Mul(a, b) => of(a) * of(b),
        &Node::Div(a, b) => divide(of(a), of(b))?,
        &Node::Trial(_, free) | &Node::Slip(Balance { free, .. }) => {
            of(free).union(Interval::point(0.0))
        }
        &Node::Ratio(a, b, limit) => divide(of(a), of(b))?.cut(-limit.0, limit.0),
        Node::Curve(curve, x) => curve.values_over(of(*x)),
        Node::Incline(curve, x) => curve.slopes_over(of(*x)),
        &Node::Neg(a) => -of(a),
        &Node::Min(a, b) => of(a).min(of(b)),
        &Node::Max(a, b) => of(a).max(of(b)),
        &Node::Abs(a) => of(a).abs(),
        &Node::Power(a, halves) => power(of(a), halves)?,
        &Node::Function(function, a) => {
            let found = function.interval(of(a));
            found.ok_or(Problem::OutsideDomain(function, of(a)))?
        }
        &Node::Compare(cmp, a, b) => compare(cmp, of(a), of(b)),
        &Node::And(a, b) => of(a).min(of(b)),
        &Node::Or(a, b) => of(a).max(of(b)),
        &Node::Not(a) => Interval {
            low: 1.0 - of(a).high,
            high: 1.0 - of(a).low,
        },
        &Node::Select(c, a, b) | &Node::SelectBool(c, a, b) => chosen(of(c), of(a), of(b)),
    };
    if value.magnitude() <= LIMIT {
        Ok(value)
    } else {
        Err(Problem::Unbounded)
    }
}

/// A bool that is not known.
const EITHER: Interval = Interval {
    low: 0.0,
    high: 1.0,
};

/// What an allpass gives.
fn tuned(delay: &Delay, ticks: Interval) -> Result<Interval, Problem> {
    within_line(delay, ticks, Delay::TUNED_TICKS_MIN)?;
    Ok(Interval::around(delay.tuned_reach()))
}

/// Of what a choice may give.
fn chosen(condition: Interval, a: Interval, b: Interval) -> Interval {
    match (condition.low, condition.high) {
        (1.0, _) => a,
        (_, 0.0) => b,
        _ => a.union(b),
    }
}

/// Times are rounded on their way to ticks.
const TICKS_SLACK: f64 = 1e-9;

/// What a delay line gives, if it holds all of these times (ticks).
fn within_line(delay: &Delay, ticks: Interval, least: f64) -> Result<Interval, Problem> {
    let (low, high) = (least, f64::from(delay.ticks));
    if ticks.low < low - TICKS_SLACK || ticks.high > high + TICKS_SLACK {
        return Err(Problem::OutsideDelay(ticks, Interval { low, high }));
    }
    // Nothing was fed before the first tick.
    Ok(delay.range.union(Interval::point(0.0)))
}

/// What a string gives.
fn of_string(
    model: &Model,
    node: &Node,
    of: &impl Fn(NodeId) -> Interval,
) -> Result<Interval, Problem> {
    Ok(match node {
        &Node::Read(s, reading, place) => {
            along_string(&model.strands[s], of(place))?;
            model.strands[s].reach(reading, model.rate_hz)
        }
        Node::Mean(s, all) => {
            along_string(&model.strands[s], of(all[0]))?;
            model.strands[s].reach(Reading::Rate, model.rate_hz)
        }
        &Node::Spread(s, place) => spread(&model.strands[s], of(place)),
        &Node::Grid(s, number) => Interval::point(model.strands[s].number(number)),
        _ => return Err(Problem::Unbounded),
    })
}

/// The sum of the squares of the weights at these places.
fn spread(strand: &Strand, places: Interval) -> Interval {
    match places.low == places.high {
        true => Interval::point(Strand::spread(strand.cell(places.low).1)),
        false => Strand::SPREAD,
    }
}

/// Whether all of these places (m from where it begins) are on the string.
pub fn along_string(strand: &Strand, places: Interval) -> Result<(), Problem> {
    // Places are rounded on their way.
    const SLACK: f64 = 1e-9;
    let slack = SLACK * strand.length();
    if places.low < -slack || places.high > strand.length() + slack {
        return Err(Problem::OutsideString(places));
    }
    Ok(())
}

fn power(a: Interval, halves: u8) -> Result<Interval, Problem> {
    if halves % 2 == 1 && a.low < 0.0 {
        return Err(Problem::NegativeBase(a));
    }
    Ok(a.power(halves))
}

fn divide(a: Interval, b: Interval) -> Result<Interval, Problem> {
    a.quotient(b).ok_or(Problem::ZeroDivisor(b))
}

/// `1 .. 1` where the comparison always holds, `0 .. 0` where it never does.
fn compare(cmp: Cmp, a: Interval, b: Interval) -> Interval {
    let (always, never) = match cmp {
        Cmp::Lt => (a.high < b.low, a.low >= b.high),
        Cmp::Le => (a.high <= b.low, a.low > b.high),
        Cmp::Gt => (a.low > b.high, a.high <= b.low),
        Cmp::Ge => (a.low >= b.high, a.high < b.low),
    };
    Interval {
        low: f64::from(always),
        high: f64::from(!never),
    }
}

/// Largest slope of the least-squares line over the window: the first half of the samples at one
/// end of the range, the second half at the other.
fn slope_range(model: &Model, sense: usize) -> Interval {
    let (s, rate) = (&model.senses[sense], f64::from(model.rate_hz));
    // The window is odd.
    let half = 1..=s.window / 2;
    let weights: f64 = half.clone().map(f64::from).sum();
    let squares: f64 = 2.0 * half.map(|j| f64::from(j * j)).sum::<f64>();
    Interval::around(weights / squares * rate * s.range.width())
}

/// Largest second derivative of the least-squares parabola: the positive weights on one end of the
/// range, the negative on the other.
fn curvature_range(model: &Model, sense: usize) -> Interval {
    let (s, rate) = (&model.senses[sense], f64::from(model.rate_hz));
    let n = f64::from(s.window);
    let m = (n - 1.0) / 2.0;
    let weight = |i: u32| (f64::from(i) - m).powi(2) - (n * n - 1.0) / 12.0;
    let positive: f64 = (0..s.window).map(weight).filter(|w| *w > 0.0).sum();
    let squares: f64 = (0..s.window).map(|i| weight(i).powi(2)).sum();
    Interval::around(2.0 * positive / squares * rate * rate * s.range.width())
}
