//! Bodies: one coordinate, one inertia, any number of torques; and what holds them.

use super::dubious::DoubtKind;
use super::elaborate::Elaborator;
use super::friction::{self, RubInfo, RubbedBy};
use super::scope::{Made, NameEntry, ScopeId, Thing};
use super::slot::{SlotId, Source};
use super::types::{Ty, Value};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Body, CellKind, Node, NodeId};
use crate::syntax::ast::{BodyPart, Expr, Name};
use crate::units::Dim;
use whippen_source::Span;

/// The words and dimensions of a body that turns or slides.
pub struct Motion {
    coordinate: &'static str,
    inertia: &'static str,
    pub torque: &'static str,
    inertia_dim: Dim,
    pub torque_dim: Dim,
}

/// What is known of a body while it is elaborated.
pub struct BodyInfo {
    /// Its acceleration.
    pub acceleration: SlotId,
    /// Its mass or inertia.
    pub inertia: Option<NodeId>,
    /// Its friction.
    pub rub: RubInfo,
}

const TURNING: Motion = Motion {
    coordinate: "an `angle`",
    inertia: "inertia",
    torque: "torque",
    inertia_dim: Dim::INERTIA,
    torque_dim: Dim::TORQUE,
};
const SLIDING: Motion = Motion {
    coordinate: "a `position`",
    inertia: "mass",
    torque: "force",
    inertia_dim: Dim::MASS,
    torque_dim: Dim::FORCE,
};

pub fn motion(angle: bool) -> &'static Motion {
    if angle { &TURNING } else { &SLIDING }
}

impl<'a> Elaborator<'a, '_> {
    /// Enters a body and its coordinate. A second coordinate is known, but broken.
    pub fn declare_body(&mut self, scope: ScopeId, name: &'a Name, parts: &'a [BodyPart]) -> Made {
        let body = self.declare_coordinates(scope, name, parts);
        let all = parts.iter().filter_map(friction::rubbed);
        let spans = self.declare_frictions(scope, body.map(RubbedBy::Body), all);
        for span in spans.iter().skip(1) {
            self.repeated_part(&name.node, "friction", *span, spans[0]);
        }
        let here = &self.scopes[scope.0];
        if let Some(first) = here.strands.get(name.node.as_str()) {
            let first = first.span;
            self.duplicate("body", name, first, "already the name of a string");
        }
        match self.scopes[scope.0].bodies.get(name.node.as_str()) {
            Some(first) => self.duplicate("body", name, first.span, "a second body of this name"),
            None => drop(self.scopes[scope.0].bodies.insert(
                &name.node,
                NameEntry {
                    id: body,
                    span: name.span,
                },
            )),
        }
        match body {
            Some(index) => Made::Body(index),
            None => {
                let message = format!("the body `{}` has no coordinate", name.node);
                let hint = "add `angle phi in low .. high, rate in low .. high`, or `position`";
                let diagnostic =
                    Diagnostic::new(Code::BodyPart, name.span, message, "nothing in it moves");
                self.report(diagnostic.hint(hint));
                Made::Nothing
            }
        }
    }

    fn declare_coordinates(
        &mut self,
        scope: ScopeId,
        name: &'a Name,
        parts: &'a [BodyPart],
    ) -> Option<usize> {
        let mut body = None;
        for part in parts {
            let BodyPart::Coordinate {
                angle,
                name: coordinate,
                ..
            } = part
            else {
                continue;
            };
            if body.is_some() {
                self.enter(scope, coordinate, Thing::Broken);
            } else {
                body = Some(self.new_body(scope, name, *angle, coordinate, parts));
            }
        }
        body
    }

    fn new_body(
        &mut self,
        scope: ScopeId,
        name: &Name,
        angle: bool,
        coordinate: &'a Name,
        parts: &'a [BodyPart],
    ) -> usize {
        let dim = if angle { Dim::NUMBER } else { Dim::LENGTH };
        let full = self.scopes[scope.0].full(&coordinate.node);
        let span = coordinate.span;
        let (cell, value) = self.new_cell(full.clone(), CellKind::Coordinate, dim, span);
        let (rate, _) = self.new_cell(format!("{full}'"), CellKind::Rate, dim.div(Dim::TIME), span);
        self.enter(scope, coordinate, Thing::Coordinate(cell, rate, value));
        let body = Body {
            name: self.scopes[scope.0].full(&name.node),
            coordinate: cell,
            rate,
            acceleration: NodeId(0),
            friction: None,
            hold: None,
            span: name.span,
        };
        let index = self.model.bodies.len();
        let source = Source::Body(scope, index, parts);
        let acceleration = self.new_slot(body.name.clone(), name.span, source);
        self.model.bodies.push(body);
        self.bodies.push(BodyInfo {
            acceleration,
            inertia: None,
            rub: RubInfo::default(),
        });
        index
    }

    /// All that stands in a body.
    pub fn moved_body(&mut self, scope: ScopeId, index: usize, parts: &'a [BodyPart]) {
        self.slot(self.bodies[index].acceleration);
        let first = parts.iter().find_map(friction::rubbed);
        self.frictions(scope, RubbedBy::Body(index), first);
    }

    /// Its ranges, its inertia and its torques; the value is its acceleration.
    pub fn body(&mut self, scope: ScopeId, index: usize, parts: &'a [BodyPart]) -> Option<Value> {
        let outer = self.here.replace(scope);
        let value = self.parts(scope, index, parts);
        self.here = outer;
        value
    }

    fn parts(&mut self, scope: ScopeId, index: usize, parts: &'a [BodyPart]) -> Option<Value> {
        let Body {
            name,
            coordinate,
            rate,
            span,
            ..
        } = self.model.bodies[index].clone();
        let mut first: Option<(bool, Span)> = None;
        for part in parts {
            let BodyPart::Coordinate {
                angle,
                range,
                init,
                rate_range,
                rate_init,
                span,
                ..
            } = part
            else {
                continue;
            };
            if let Some((_, first)) = first {
                self.repeated_part(&name, "coordinate", *span, first);
                continue;
            }
            first = Some((*angle, *span));
            self.fill_cell(scope, coordinate, range, init.as_ref());
            self.fill_cell(scope, rate, rate_range, rate_init.as_ref());
            if *angle {
                self.doubt_range(range, DoubtKind::Angle);
                self.doubt_range(rate_range, DoubtKind::AngularRate);
                init.iter()
                    .for_each(|init| self.doubt(init, DoubtKind::Angle));
                rate_init
                    .iter()
                    .for_each(|init| self.doubt(init, DoubtKind::AngularRate));
            }
        }
        let coordinate = first?;
        let inertia = self.inertia(scope, &name, coordinate, parts, span);
        let torque = self.torque(scope, coordinate, parts, span);
        let (inertia, torque) = (inertia?, torque?);
        let acceleration = self.node(Node::Div(torque, inertia), span);
        self.model.bodies[index].acceleration = acceleration;
        self.bodies[index].inertia = Some(inertia);
        let rate = self.model.cells[rate].dim;
        Some(Value::real(acceleration, rate.div(Dim::TIME)))
    }

    pub fn repeated_part(&mut self, body: &str, what: &str, span: Span, first: Span) {
        let message = format!("the body `{body}` has two lines for its {what}");
        self.report(
            Diagnostic::new(Code::BodyPart, span, message, "the second")
                .also(first, "the first")
                .hint("a body has one: write a second body, or take this line away"),
        );
    }

    fn inertia(
        &mut self,
        scope: ScopeId,
        body: &str,
        (angle, place): (bool, Span),
        parts: &'a [BodyPart],
        name: Span,
    ) -> Option<NodeId> {
        let motion = motion(angle);
        let mut found: Option<(Option<NodeId>, Span)> = None;
        for part in parts {
            let BodyPart::Inertia {
                angle: turning,
                value,
                span,
            } = part
            else {
                continue;
            };
            let node = self.part(scope, (angle, place), *turning, (value, *span), |m| {
                (m.inertia, m.inertia_dim)
            });
            match found {
                Some((_, first)) => self.repeated_part(body, motion.inertia, *span, first),
                None => found = Some((self.positive_inertia(node, motion, value), *span)),
            }
            if !turning {
                self.doubt(value, DoubtKind::Mass);
            }
        }
        if found.is_none() {
            let (word, dim) = (motion.inertia, motion.inertia_dim);
            let message = format!("the body `{body}` has no {word}");
            let diagnostic = Diagnostic::new(Code::BodyPart, name, message, "how heavy is it?");
            self.report(diagnostic.hint(format!("add a line `{word} ..`, a value in {dim}")));
        }
        found.and_then(|(node, _)| node)
    }

    fn positive_inertia(
        &mut self,
        node: Option<NodeId>,
        motion: &Motion,
        value: &Expr,
    ) -> Option<NodeId> {
        let node = node?;
        if let Some(constant) = self.model.dag.real(node) {
            let what = if motion.inertia == "mass" {
                "a mass"
            } else {
                "an inertia"
            };
            self.above_zero(constant, motion.inertia_dim, value.span, what)?;
        }
        Some(node)
    }

    fn torque(
        &mut self,
        scope: ScopeId,
        coordinate: (bool, Span),
        parts: &'a [BodyPart],
        name: Span,
    ) -> Option<NodeId> {
        let mut sum = Some(None);
        for part in parts {
            let BodyPart::Torque { angle, value, span } = part else {
                continue;
            };
            let node = self.part(scope, coordinate, *angle, (value, *span), |m| {
                (m.torque, m.torque_dim)
            });
            if *angle {
                self.doubt(value, DoubtKind::Torque);
            }
            sum = match (sum, node) {
                (Some(Some(sum)), Some(node)) => {
                    Some(Some(self.node(Node::Add(sum, node), value.span)))
                }
                (Some(None), Some(node)) => Some(Some(node)),
                _ => None,
            };
        }
        let zero = self.model.dag.constant(0.0);
        self.mark(name);
        sum.map(|sum| sum.unwrap_or(zero))
    }

    /// The value of an inertia or torque line, which must fit the coordinate's kind of motion.
    fn part(
        &mut self,
        scope: ScopeId,
        (angle, place): (bool, Span),
        turning: bool,
        (value, span): (&'a Expr, Span),
        of: impl Fn(&Motion) -> (&'static str, Dim),
    ) -> Option<NodeId> {
        let found = self.expr(scope, value);
        if angle != turning {
            let ((word, _), (right, _)) = (of(motion(turning)), of(motion(angle)));
            let (has, would) = (motion(angle).coordinate, motion(turning).coordinate);
            let message = format!("a body with {has} takes `{right}`, not `{word}`");
            self.report(
                Diagnostic::new(Code::BodyMotion, span, message, format!("`{word}`"))
                    .also(place, format!("the coordinate is {has}"))
                    .hint(format!("write `{right}`, or let the body have {would}")),
            );
            return None;
        }
        let (word, dim) = of(motion(angle));
        self.expect(found?, value, Ty::Real(dim), || format!("`{word}`"))
    }

    /// `hold body when guard`
    pub fn hold(&mut self, scope: ScopeId, name: &Name, guard: &'a Expr) {
        let condition = self.condition(scope, guard, "the condition of `hold`");
        let string = self.scopes[scope.0].strands.get(name.node.as_str());
        if let Some(id) = string.map(|entry| entry.id) {
            return self.hold_string(id, condition, guard.span);
        }
        let Some(label) = self.scopes[scope.0].bodies.get(name.node.as_str()) else {
            let here = &self.scopes[scope.0];
            let hint = match nearest(&name.node, here.bodies.keys().copied()) {
                Some(near) => Advice::did_you_mean(near),
                None => "name a `body` of this instrument or term".into(),
            };
            let message = format!("there is no body `{}`", name.node);
            self.report(
                Diagnostic::new(Code::UnknownBody, name.span, message, "unknown body").hint(hint),
            );
            return;
        };
        let (Some(index), Some(condition)) = (label.id, condition) else {
            return;
        };
        let hold = match self.model.bodies[index].hold {
            Some(other) => self.node(Node::Or(other, condition), guard.span),
            None => condition,
        };
        self.model.bodies[index].hold = Some(hold);
    }
}
