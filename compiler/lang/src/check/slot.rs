//! Slots: values that are evaluated when first asked for. A slot that is asked for while it is
//! being evaluated closes a circle.

use super::elaborate::Elaborator;
use super::friction::{Rubbed, RubbedBy};
use super::param::ParamDecl;
use super::scope::ScopeId;
use super::strand::TunedLine;
use super::types::{Ty, Value};
use crate::diag::{Code, Diagnostic};
use crate::model::StrandId;
use crate::syntax::ast::{BodyPart, Expr};
use whippen_source::Span;

/// Index of a [`Slot`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SlotId(pub usize);

/// A value and how far it is known.
pub struct Slot<'a> {
    /// Its full name, for messages.
    pub name: String,
    /// Where it is declared.
    pub span: Span,
    /// Where its value comes from.
    pub source: Source<'a>,
    /// How far it is known.
    pub state: State,
}

/// Where a value comes from.
#[derive(Clone, Copy)]
pub enum Source<'a> {
    /// Nowhere: a message has been given.
    Missing,
    /// It is known from the start.
    Given(Value),
    /// An expression.
    Expr(ScopeId, &'a Expr),
    /// An expression that must have a type: an argument, seen where the call stands, or a result.
    Typed(ScopeId, &'a Expr, Option<Ty>),
    /// A parameter of the instrument.
    Param(ScopeId, ParamDecl<'a>),
    /// The acceleration of a body (index into the Model's), with all that stands in it.
    Body(ScopeId, usize, &'a [BodyPart]),
    /// The tension that a string is tuned by.
    Tension(StrandId, TunedLine<'a>),
    /// The slip that a friction tries, and what it rubs.
    Trial(ScopeId, RubbedBy, Rubbed<'a>),
    /// The force of a friction, and what it rubs.
    Friction(ScopeId, RubbedBy, Rubbed<'a>),
    /// The motion of a string, with all that stands in it but its friction.
    Strand(StrandId),
}

/// How far a value is known.
#[derive(Clone, Copy)]
pub enum State {
    /// Not asked for yet.
    Waiting,
    /// Being evaluated.
    Running,
    /// Known, or in error.
    Done(Option<Value>),
}

impl<'a> Elaborator<'a, '_> {
    /// A new slot.
    pub fn new_slot(&mut self, name: String, span: Span, source: Source<'a>) -> SlotId {
        self.slots.push(Slot {
            name,
            span,
            source,
            state: State::Waiting,
        });
        SlotId(self.slots.len() - 1)
    }

    /// The value of a slot.
    pub fn slot(&mut self, id: SlotId) -> Option<Value> {
        match self.slots[id.0].state {
            State::Done(value) => return value,
            State::Running => {
                if self.circles.insert(id) {
                    self.report_circle(id);
                }
                return None;
            }
            State::Waiting => {}
        }
        self.slots[id.0].state = State::Running;
        self.running.push(id);
        let value = self.evaluate(id);
        self.running.pop();
        self.slots[id.0].state = State::Done(value);
        value
    }

    fn evaluate(&mut self, id: SlotId) -> Option<Value> {
        match self.slots[id.0].source {
            Source::Missing => None,
            Source::Given(value) => Some(value),
            Source::Expr(scope, expr) => self.expr(scope, expr),
            Source::Typed(scope, expr, ty) => {
                let value = self.expr(scope, expr)?;
                let full = &self.slots[id.0].name;
                let what = format!("`{}`", full.rsplit('.').next().unwrap_or(full));
                let node = self.expect(value, expr, ty?, || what)?;
                Some(Value { node, ty: ty? })
            }
            Source::Param(scope, decl) => self.param(scope, decl),
            Source::Body(scope, index, parts) => self.body(scope, index, parts),
            Source::Strand(id) => self.string_motion(id),
            Source::Tension(id, line) => self.tuned_tension(id, line),
            Source::Trial(scope, index, rubbed) => self.trial(scope, index, rubbed),
            Source::Friction(scope, index, rubbed) => self.friction(scope, index, rubbed),
        }
    }

    fn report_circle(&mut self, id: SlotId) {
        let from = self.running.iter().position(|r| *r == id).unwrap_or(0);
        let mut circle: Vec<&Slot> = self.running[from..]
            .iter()
            .map(|r| &self.slots[r.0])
            .collect();
        let depth = |slot: &Slot| slot.name.matches('.').count();
        let outermost = (0..circle.len())
            .min_by_key(|i| depth(circle[*i]))
            .unwrap_or(0);
        circle.rotate_left(outermost);
        let first = &circle[0];
        let path: Vec<&str> = circle
            .iter()
            .chain([first])
            .map(|s| s.name.as_str())
            .collect();
        let message = format!(
            "`{}` depends on itself within one tick: {}",
            first.name,
            path.join(" -> ")
        );
        let mut diagnostic =
            Diagnostic::new(Code::Circle, first.span, message, "needs its own value");
        for slot in &circle[1..] {
            diagnostic = diagnostic.also(slot.span, format!("`{}` is on the way", slot.name));
        }
        let constant = circle.iter().all(|s| matches!(s.source, Source::Param(..)));
        let diagnostic = diagnostic.hint(if constant {
            "give one of these parameters a value of its own"
        } else {
            "break the circle with a `state`: it keeps the value that `next` gave it in the tick before"
        });
        self.diags.push(diagnostic);
    }
}
