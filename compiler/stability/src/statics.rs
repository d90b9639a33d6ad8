//! The worst static force: the key held still somewhere, what hangs on it at rest.

use super::pieces::{Law, Piece};
use whippen_lang::diag::{Code, Diagnostic};
use whippen_lang::model::{CellKind, Interval, Model, Node, NodeId};
use whippen_lang::range::transfer;
use whippen_lang::units::{Dim, shown};

/// What an instrument may ask for while nothing moves: sums of the force terms (N, or N*m);
/// positive pushes the key up.
#[derive(Debug, Clone, PartialEq)]
pub struct Static {
    /// With every body in balance, or at an end of its range.
    pub balanced: Interval,
    /// With some body held. Where it is held is not known to intervals, so much of this may never
    /// occur.
    pub held: Option<Interval>,
    /// The balanced interval of each force term.
    pub terms: Vec<Interval>,
}

/// The intervals of the force of an instrument as checked while the key stands still: no speed, no
/// acceleration, no pulse. `None` where its values cannot be bounded.
pub fn static_force(model: &Model) -> Option<Static> {
    static_force_of(&Law::of(model)?)
}

/// The same of its law.
pub fn static_force_of(law: &Law) -> Option<Static> {
    let zero = Interval::point(0.0);
    let still = law.nodes.iter().filter(|id| match law.model.dag.get(**id) {
        Node::Slope(_) | Node::Curvature(_) => true,
        Node::Cell(c) => matches!(law.model.cells[c].kind, CellKind::Rate | CellKind::Pulse),
        _ => false,
    });
    let still: Vec<(NodeId, Interval)> = still.map(|id| (*id, zero)).collect();
    let mut found: [Option<Interval>; 2] = [None, None];
    let mut terms: Vec<Interval> = Vec::new();
    for (piece, _) in law.pieces() {
        let Some(piece) = law.given(piece, &still) else {
            continue;
        };
        for (rest, held) in at_rest(law, piece) {
            let own = values(law, &rest);
            let sum = own.iter().fold(zero, |sum, v| sum + *v);
            let all = &mut found[usize::from(held)];
            *all = Some(all.map_or(sum, |all| all.union(sum)));
            if !held {
                terms = if terms.is_empty() {
                    own
                } else {
                    terms.iter().zip(own).map(|(a, b)| a.union(b)).collect()
                };
            }
        }
    }
    Some(Static {
        balanced: found[0]?,
        held: found[1],
        terms,
    })
}

/// A warning at the largest term if the force of a key held still is more than the motor gives for
/// ever (N or N*m).
pub fn too_strong(model: &Model, found: &Static, rated: f64) -> Option<Diagnostic> {
    let worst = found.balanced.magnitude();
    let sizes = found.terms.iter().map(|term| term.magnitude()).enumerate();
    let (at, size) = sizes.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let term = &model.forces[at];
    let dim = if model.turns() {
        Dim::TORQUE
    } else {
        Dim::FORCE
    };
    let of = |value: f64| shown(format!("{value:.2e}").parse().unwrap_or(value), dim);
    let message = format!(
        "held still, `{}` asks for up to {}, and the motor gives {} for ever",
        model.name,
        of(worst),
        of(rated)
    );
    let warn = || {
        Diagnostic::new(
            Code::TooStrong,
            term.span,
            message,
            format!("up to {} of it", of(size)),
        )
        .hint("make the force smaller, end it before the stop, or give the device a stronger motor")
    };
    (worst > rated).then(warn)
}

/// The places of a piece in which every body that matters is held, in balance or at an end; and
/// whether one is held.
fn at_rest(law: &Law, piece: Piece) -> Vec<(Piece, bool)> {
    let mut places = vec![(piece, false)];
    for body in law
        .model
        .bodies
        .iter()
        .filter(|b| law.cells.contains(&b.coordinate))
    {
        let held = |p: &Piece| {
            body.hold
                .is_some_and(|hold| super::gradient::decided(&p.at, hold) == Some(true))
        };
        let range = law.model.cells[body.coordinate].range;
        let coordinate = law
            .nodes
            .iter()
            .find(|n| law.model.dag.get(**n) == &Node::Cell(body.coordinate))
            .copied();
        let mut next = Vec::new();
        for (place, some_held) in places {
            if held(&place) {
                next.push((place, true));
                continue;
            }
            let up = Interval {
                low: 0.0,
                high: f64::INFINITY,
            };
            let ends = [
                (None, Interval::point(0.0)),
                (Some(Interval::point(range.low)), -up),
                (Some(Interval::point(range.high)), up),
            ];
            for (end, acceleration) in ends {
                let mut given = vec![(body.acceleration, acceleration)];
                match (end, coordinate) {
                    (None, _) => {}
                    (Some(end), Some(node)) => given.push((node, end)),
                    (Some(_), None) => continue,
                }
                next.extend(law.given(&place, &given).map(|place| (place, some_held)));
            }
        }
        places = next;
    }
    places
}

/// The force terms at a place.
fn values(law: &Law, place: &Piece) -> Vec<Interval> {
    let mut at = place.at.clone();
    // Once more from the leaves: narrowing does not meet every node in its last round.
    for &id in &law.nodes {
        if let Ok(own) = transfer(&law.model, law.model.dag.get(id), |o| at[o]) {
            let narrowed = at[id];
            let cut = Interval {
                low: own.low.max(narrowed.low),
                high: own.high.min(narrowed.high),
            };
            at[id] = if cut.low <= cut.high { cut } else { narrowed };
        }
    }
    law.model.forces.iter().map(|f| at[f.value]).collect()
}
