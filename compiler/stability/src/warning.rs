//! Warnings of instability, at the force term that makes the loop ring, with the most it may be.

use super::linear::System;
use super::modes::{Between, Loops, Mode, Stability};
use whippen_lang::diag::{Code, Diagnostic};
use whippen_lang::model::Model;
use whippen_lang::units::{Dim, shown};

/// So often an interval is halved: a thousandth of the coefficient.
const HALVINGS: u32 = 10;

/// What is said of one force term.
struct Blame<'a> {
    force: usize,
    mode: &'a Mode,
    /// The most that the term may be, as a part of what it is; none where it alone cannot help.
    safe: Option<f64>,
}

/// A warning for every force term that makes a mode ring, in the order of the text.
pub fn warnings(model: &Model, stability: &Stability) -> Vec<Diagnostic> {
    let mut blames: Vec<Blame> = Vec::new();
    for mode in stability
        .modes
        .iter()
        .filter(|m| m.settles && m.worst.factor <= 1.0)
    {
        let force = guilty(&stability.loops, mode);
        let safe = safe(&stability.loops, &mode.system, force);
        match blames.iter_mut().find(|b| b.force == force) {
            None => blames.push(Blame { force, mode, safe }),
            // Told is the mode in which it must become smallest, of those in which it can help.
            Some(known) if safe.is_some_and(|part| known.safe.is_none_or(|other| part < other)) => {
                *known = Blame { force, mode, safe };
            }
            Some(_) => {}
        }
    }
    blames.sort_by_key(|b| b.force);
    let mut found: Vec<Diagnostic> = blames
        .iter()
        .map(|b| warn_of(model, stability, b))
        .collect();
    if let Some(mode) = stability.modes.iter().find(|m| !m.settles) {
        let message = format!(
            "`{}` is unstable by itself while the key stands still",
            model.name
        );
        found.push(
            Diagnostic::new(
                Code::Unstable,
                model.span,
                message,
                format!("where {}", mode.name),
            )
            .hint("the body's springs and dampers are too stiff for its inertia at this rate"),
        );
    }
    found
}

/// The force term with the largest share of what rings, where the loop rings.
fn guilty(loops: &Loops, mode: &Mode) -> usize {
    let theta = mode.worst.ring_hz / loops.rate_hz * std::f64::consts::TAU;
    let forces = loops.forces(&mode.system, theta);
    let total: num_complex::Complex64 = forces.iter().sum();
    let share = |force: usize| (forces[force] / total).re;
    (0..forces.len())
        .max_by(|a, b| share(*a).total_cmp(&share(*b)))
        .unwrap_or(0)
}

/// The largest part of a force term with which the system rings in no hand, by halving.
fn safe(loops: &Loops, system: &System, force: usize) -> Option<f64> {
    let rings = |part: f64| {
        let mut system = system.clone();
        let output = &mut system.outputs[force];
        output
            .direct
            .iter_mut()
            .chain(&mut output.cells)
            .for_each(|gain| *gain *= part);
        loops.worst(&system, &mut Between::default()).factor <= 1.0
    };
    if rings(0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if rings(middle) {
            high = middle
        } else {
            low = middle
        }
    }
    Some(low)
}

fn warn_of(model: &Model, stability: &Stability, blame: &Blame) -> Diagnostic {
    let Blame { force, mode, safe } = blame;
    let term = &model.forces[*force];
    let (kind, value, dim) = coefficient(model, blame);
    let hz = mode.worst.ring_hz;
    let hand = held_by(model, stability, mode);
    let kind_of_term = if model.turns() { "torque" } else { "force" };
    let message = format!(
        "the {kind_of_term} `{}` makes the loop ring, at {hz:.0} Hz {hand}",
        term.name
    );
    // The units of what turns leave the radian away, as the language's do.
    let label = format!("its {kind} here is {}", shown(rounded(value), dim));
    let diagnostic = Diagnostic::new(Code::Unstable, term.span, message, label);
    let diagnostic = match safe {
        Some(part) => diagnostic.hint(format!(
            "up to {} is stable with every hand; x' and x'' come late by half their window, so a shorter one allows more",
            shown(rounded_down(value * part), dim)
        )),
        None => diagnostic.hint("other terms ring as well: no value of this one alone is stable"),
    };
    if mode.name == "everywhere" {
        diagnostic
    } else {
        diagnostic.hint(format!("it rings where {}", mode.name))
    }
}

/// What of the term counts most where it rings: its name, its value, its dimension.
fn coefficient(model: &Model, blame: &Blame) -> (&'static str, f64, Dim) {
    let w = std::f64::consts::TAU * blame.mode.worst.ring_hz;
    let direct = &blame.mode.system.outputs[blame.force].direct;
    let sum = |part: usize| direct.iter().skip(part).step_by(3).sum::<f64>();
    let stiffness = if model.turns() {
        Dim::TORQUE
    } else {
        Dim::FORCE.div(Dim::LENGTH)
    };
    let names = ["stiffness", "damping", "added mass"];
    let weight = |part: usize| sum(part).abs() * w.powi(part as i32);
    let most = (0..3)
        .max_by(|a, b| weight(*a).total_cmp(&weight(*b)))
        .unwrap_or(0);
    let dim = (0..most).fold(stiffness, |dim, _| dim.mul(Dim::TIME));
    (names[most], sum(most), dim)
}

fn held_by(model: &Model, stability: &Stability, mode: &Mode) -> String {
    let hand = mode.worst.hand;
    if hand == super::key::Hand::FREE {
        let what = if model.turns() { "knob" } else { "key" };
        return format!(
            "when nobody holds the {what} of {}",
            shown(stability.key.mass, mass(model))
        );
    }
    let damping = if model.turns() {
        Dim::TORQUE
    } else {
        Dim::FORCE.div(Dim::LENGTH)
    }
    .mul(Dim::TIME);
    let stiffness = damping.div(Dim::TIME);
    format!(
        "in a hand of {}, {}, {}",
        shown(hand.mass, mass(model)),
        shown(hand.damping, damping),
        shown(hand.stiffness, stiffness)
    )
}

fn mass(model: &Model) -> Dim {
    if model.turns() {
        Dim::INERTIA
    } else {
        Dim::MASS
    }
}

fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Three digits, towards zero.
fn rounded_down(value: f64) -> f64 {
    let close = rounded(value);
    if close.abs() > value.abs() {
        rounded(value * 0.998)
    } else {
        close
    }
}
