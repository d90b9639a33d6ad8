//! How many points strings have: as many as are stable over all that may change while playing.

use std::collections::HashMap;

use crate::diag::{Code, Diagnostic};
use crate::model::{Interval, Model, Node, NodeId, Reading, Strand, StrandId};
use crate::range::{Problem, along_string, outside_string, transfer};
use crate::units::{Dim, shown, shown_range};

/// Gives every string its points, once everything is known; says what is wrong with it.
pub fn choose(model: &mut Model) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for id in in_order(model) {
        // What has no range is told of later.
        model.strands[id].parts = Strand::PARTS[0];
        let signs = signs(model, id);
        let is_right = signs.is_empty();
        found.extend(signs);
        if !is_right {
            continue;
        }
        let unstable = parts(model, id);
        let is_right = unstable.is_none();
        found.extend(unstable);
        if !is_right {
            continue;
        }
        found.extend(tuned(model, id));
        found.extend(pushed_outside(model, id));
        found.extend(read_by_own_friction(model, id));
    }
    found
}

/// Strings, those first that others depend on.
fn in_order(model: &Model) -> Vec<StrandId> {
    let needs = |id: StrandId| -> Vec<StrandId> {
        let strand = &model.strands[id];
        let mut roots = strand.coefficients.to_vec();
        roots.extend(strand.loads);
        let mut others: Vec<StrandId> = Vec::new();
        for node in roots.into_iter().flat_map(|root| model.dag.below(root)) {
            if let &(Node::Grid(other, _)
            | Node::Read(other, ..)
            | Node::Mean(other, _)
            | Node::Spread(other, _)) = model.dag.get(node)
                && other != id
            {
                others.push(other);
            }
        }
        others
    };
    let mut open: Vec<StrandId> = model.strands.ids().collect();
    let mut order = Vec::new();
    while !open.is_empty() {
        let ready = open.iter().position(|id| {
            let needs = needs(*id);
            needs.iter().all(|other| order.contains(other))
        });
        order.push(open.remove(ready.unwrap_or(0)));
    }
    order
}

/// The intervals of some values; none where one has none.
fn intervals<const N: usize>(model: &Model, roots: [NodeId; N]) -> Option<[Interval; N]> {
    let mut known: HashMap<NodeId, Interval> = HashMap::new();
    for root in roots {
        for id in model.dag.below(root) {
            if known.contains_key(&id) {
                continue;
            }
            let node = model.dag.get(id);
            // A place is judged where it is used.
            let value = match node {
                Node::Read(strand, reading, _) => {
                    model.strands[strand].reach(*reading, model.rate_hz)
                }
                Node::Mean(strand, _) => model.strands[strand].reach(Reading::Rate, model.rate_hz),
                Node::Spread(..) => Strand::SPREAD,
                node => transfer(model, node, |operand| known[&operand]).ok()?,
            };
            known.insert(id, value);
        }
    }
    Some(roots.map(|root| known[&root]))
}

/// Tension, stiffness, losses and density have a sign.
fn signs(model: &Model, id: StrandId) -> Vec<Diagnostic> {
    let strand = &model.strands[id];
    let [a, b, c, d] = strand.loads;
    // A tuned tension depends on how many points there are, and is judged then.
    let Some(all) = intervals(model, [strand.density, a, b, c, d]) else {
        return Vec::new();
    };
    let n_s = Dim::FORCE.mul(Dim::TIME);
    let area = Dim::LENGTH.mul(Dim::LENGTH);
    let rows = [
        ("density", Dim::MASS.div(Dim::LENGTH)),
        ("tension", Dim::FORCE),
        ("stiffness", Dim::FORCE.mul(area)),
        ("loss before `u'`", n_s.div(area)),
        ("loss before `d2(u')`", n_s),
    ];
    let mut found = Vec::new();
    for (at, ((what, dim), range)) in rows.into_iter().zip(all).enumerate() {
        let is_bad = match at {
            0 => range.low <= 0.0,
            1 if strand.pitch.is_some() => false,
            _ => range.low < 0.0,
        };
        if is_bad {
            let (may, hint) = match at {
                0 => (
                    "zero or less",
                    "a string has a mass per length, which is above zero in all its range",
                ),
                1 => (
                    "negative",
                    "a string is pulled: keep its tension at zero or above",
                ),
                2 => (
                    "negative",
                    "the stiffness stands with a minus: `load -stiffness * d4(u)`",
                ),
                3 => (
                    "negative",
                    "losses slow down: `load -2 * rho * sigma0 * u'`",
                ),
                _ => (
                    "negative",
                    "losses slow down: `load 2 * rho * sigma1 * d2(u')`",
                ),
            };
            let message = format!(
                "the {what} of the string `{}` may be {may}: it is {}",
                strand.name,
                shown_one_or_all(range, dim)
            );
            let label = "its loads decide this";
            found.push(Diagnostic::new(Code::StringSign, strand.span, message, label).hint(hint));
        }
    }
    found
}

/// The largest P, Q, V and R over all ranges; none where a value has no range.
pub fn largest(model: &Model, id: StrandId) -> Option<[f64; 4]> {
    let all = intervals(model, model.strands[id].coefficients)?;
    Some(all.map(|range| range.high))
}

/// Chooses the largest number of parts that is stable; what is wrong with what is asked for.
fn parts(model: &mut Model, id: StrandId) -> Option<Diagnostic> {
    let [fewest, most] = Strand::PARTS;
    let asked = model.strands[id].points.map(|points| points + 1);
    for parts in (fewest..=most).rev() {
        model.strands[id].parts = parts;
        if !Strand::is_stable(largest(model, id)?) {
            continue;
        }
        let asked = asked?;
        if asked > parts {
            return Some(too_many(model, id, asked));
        }
        model.strands[id].parts = asked;
        return None;
    }
    Some(unstable(model, id))
}

fn too_many(model: &Model, id: StrandId, asked: u32) -> Diagnostic {
    let strand = &model.strands[id];
    let message = format!(
        "the string `{}` is unstable with {} points: at most {} are stable",
        strand.name,
        asked - 1,
        strand.parts - 1
    );
    let label = "its waves would run faster than a part in a tick";
    Diagnostic::new(Code::UnstableString, strand.span, message, label).hint(format!(
        "write `points {}`, or leave the line away: then a string has as many as are stable",
        strand.parts - 1
    ))
}

/// A string that is unstable with the fewest points: what is too much of it.
fn unstable(model: &Model, id: StrandId) -> Diagnostic {
    let strand = &model.strands[id];
    let message = format!(
        "the string `{}` is unstable even with {} points",
        strand.name,
        strand.parts - 1
    );
    let label = "its waves run faster than a part in a tick";
    let mut found = Diagnostic::new(Code::UnstableString, strand.span, message, label);
    if let Some([p, q, v, r]) = largest(model, id) {
        let shares = [
            (2.0 * p, "tension"),
            (8.0 * q, "stiffness"),
            (4.0 * v, "losses before `d2(u')`"),
            (r, "losses before `u'`"),
        ];
        let most = shares
            .iter()
            .fold(shares[0], |a, b| if b.0 > a.0 { *b } else { a });
        found = found.hint(format!(
            "its {} is {:.1} times too much for so few points: make it less, or the string longer, or the tick rate higher",
            most.1,
            Strand::sum([p, q, v, r]) / 2.0
        ));
    }
    found
}

/// A tension that was found from a pitch must be above zero.
fn tuned(model: &Model, id: StrandId) -> Option<Diagnostic> {
    let strand = &model.strands[id];
    strand.pitch?;
    let [tension] = intervals(model, [strand.loads[0]])?;
    (tension.low <= 0.0).then(|| {
        let message = format!(
            "the tension of the string `{}` would have to be {}: its stiffness alone is higher",
            strand.name,
            shown_one_or_all(tension, Dim::FORCE)
        );
        let label = "cannot be tuned so low";
        Diagnostic::new(Code::StringTuned, strand.span, message, label)
            .hint("make it less stiff or longer, or tune it higher")
    })
}

/// A value, or the range that it may lie in.
fn shown_one_or_all(range: Interval, dim: Dim) -> String {
    match range.low == range.high {
        true => shown(range.low, dim),
        false => shown_range(range, dim),
    }
}

/// Places of a string that is rubbed that depend on a friction of a string: it is read before any
/// is rubbed.
fn read_by_own_friction(model: &Model, id: StrandId) -> Option<Diagnostic> {
    model.strands[id].friction.as_ref()?;
    let is_rubbed = |node: NodeId| {
        let below = model.dag.below(node).into_iter();
        below
            .map(|below| model.dag.get(below))
            .any(|below| matches!(below, Node::Mean(..)))
    };
    let (read, _) = model.dag.nodes().find(
        |(_, node)| matches!(node, Node::Read(own, _, place) if *own == id && is_rubbed(*place)),
    )?;
    let name = &model.strands[id].name;
    let message = format!("where `{name}` is read depends on a friction of this very tick");
    let span = model.spans.get(read).copied().flatten().unwrap_or_default();
    Some(
        Diagnostic::new(Code::Circle, span, message, "needs what comes after it").hint(
            "break the circle with a `state`: it keeps the value that `next` gave it in the tick before",
        ),
    )
}

/// Forces at places that may lie outside.
fn pushed_outside(model: &Model, id: StrandId) -> Vec<Diagnostic> {
    let strand = &model.strands[id];
    let outside = |push: &crate::model::Push| {
        let [places] = intervals(model, [push.place])?;
        match along_string(strand, places) {
            Err(Problem::OutsideString(places)) => Some(outside_string(strand, push.span, places)),
            _ => None,
        }
    };
    strand.pushes.iter().filter_map(outside).collect()
}
