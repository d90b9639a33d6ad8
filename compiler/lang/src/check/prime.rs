//! Primes in the source: `x'`, and what to say where there is none.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use super::types::Value;
use crate::diag::{Code, Diagnostic};
use crate::model::NodeId;
use crate::model::prime::{NoPrime, NoPrimeKind, prime};
use crate::syntax::ast::Expr;
use crate::units::Dim;
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// `base'`
    pub fn primed(&mut self, scope: ScopeId, base: &'a Expr, span: Span) -> Option<Value> {
        let value = self.expr(scope, base)?;
        let dim = self.real(value, base, "a prime needs")?;
        let model = &mut self.model;
        let result = prime(&mut model.dag, &model.cells, &model.bodies, value.node);
        self.mark(span);
        match result {
            Ok(derivative) => {
                derivative
                    .jumps
                    .iter()
                    .for_each(|jump| self.note_jump(*jump, span));
                Some(Value::real(derivative.value, dim.div(Dim::TIME)))
            }
            Err(mut errors) => {
                // A friction is reason enough: what it is made of is of no concern.
                if errors
                    .iter()
                    .any(|error| error.kind == NoPrimeKind::Friction)
                {
                    errors.retain(|error| error.kind == NoPrimeKind::Friction);
                }
                errors
                    .iter()
                    .for_each(|error| self.report_no_prime(error, span));
                None
            }
        }
    }

    fn place(&self, node: NodeId) -> Option<Span> {
        self.model.spans.get(node).copied().flatten()
    }

    fn note_jump(&mut self, node: NodeId, prime: Span) {
        let place = self.place(node).unwrap_or(prime);
        let message = "a jump between modes is not motion: the prime leaves it out";
        let mut note = Diagnostic::new(
            Code::JumpOfMode,
            place,
            message,
            "may jump when the mode changes",
        );
        if place != prime {
            note = note.also(prime, "the prime is taken here");
        }
        self.report(note.hint("nothing to do if the branches agree where the mode changes"));
    }

    fn report_no_prime(&mut self, error: &NoPrime, prime: Span) {
        let (message, label, hint) = words(error.kind);
        let code = match error.kind {
            NoPrimeKind::Comparison => Code::PrimeOfComparison,
            _ => Code::NoPrime,
        };
        let mut diagnostic = Diagnostic::new(code, prime, message, "the prime is taken here");
        if let Some(place) = self.place(error.node).filter(|p| *p != prime) {
            diagnostic = diagnostic.also(place, label);
        }
        self.report(diagnostic.hint(hint));
    }
}

/// Message, label of the place that has no prime, and what to do.
fn words(kind: NoPrimeKind) -> (&'static str, &'static str, &'static str) {
    match kind {
        NoPrimeKind::Rate => (
            "a rate has no prime: blows change it within one tick",
            "the coordinate whose rate it is",
            "an acceleration is the sum of torques divided by the inertia: write that",
        ),
        NoPrimeKind::State => (
            "a `state` has no prime: it changes in steps",
            "the state",
            "keep its value of the tick before in a second `state` and use the difference",
        ),
        NoPrimeKind::Pulse => (
            "a pulse has no prime: it is a rectangle",
            "the pulse",
            "take the prime of the other parts only",
        ),
        NoPrimeKind::Glide => (
            "a param that glides has no prime: nobody knows when it will be set",
            "glides",
            "take the prime of the other parts only",
        ),
        NoPrimeKind::Noise => (
            "noise has no prime: it jumps in every tick",
            "noise",
            "take the prime of the other parts only",
        ),
        NoPrimeKind::Delay | NoPrimeKind::Table | NoPrimeKind::String => words_of_read(kind),
        NoPrimeKind::Third => (
            "a sensed value has no third prime",
            "what is measured",
            "the differentiators end at the second prime",
        ),
        NoPrimeKind::Comparison => (
            "this choice has no prime: its condition compares values, so it may jump at any time",
            "the choice",
            "use `min`, `max` or `clamp`, or let a machine of `states` decide",
        ),
        NoPrimeKind::Friction => (
            "a friction has no prime: it may let go within one tick",
            "the friction",
            "keep its value of the tick before in a `state` and use the difference",
        ),
        NoPrimeKind::Bool => (
            "a bool has no prime",
            "the bool",
            "take the prime of the numbers it chooses between",
        ),
    }
}

/// As [`words`], of what is read at a time or a place.
fn words_of_read(kind: NoPrimeKind) -> (&'static str, &'static str, &'static str) {
    match kind {
        NoPrimeKind::Delay => (
            "what is read from a delay line has no prime",
            "is read here",
            "feed the prime to a second delay line",
        ),
        NoPrimeKind::Table => (
            "a table has no second prime",
            "the table",
            "take the prime once: a table is made of pieces, whose slopes bend or jump at its knots",
        ),
        _ => (
            "a rate and a slope of a string have no prime",
            "is read here",
            "`u(place)` alone has one, its rate `u(place)'`",
        ),
    }
}
