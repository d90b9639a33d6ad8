//! `string`: what moves all along, and what is read of it.

mod load;
mod part;
pub mod points;
mod rub;

use super::elaborate::Elaborator;
use super::friction::{RubInfo, RubbedBy};
use super::scope::{Made, NameEntry, ScopeId, Thing};
use super::slot::{SlotId, Source};
use super::types::{Ty, Value, counted};
use crate::diag::{Code, Diagnostic};
use crate::model::strand::tension;
use crate::model::{End, Interval, Node, NodeId, Reading, Strand, StrandId};
use crate::syntax::ast::{Arg, Expr, ExprKind, Name, RangeExpr, StringPart};
use crate::units::Dim;
use whippen_source::Span;

/// A string as it is written.
#[derive(Debug, Clone, Copy)]
pub struct StringText<'a> {
    /// Its name.
    pub name: &'a Name,
    /// Its ends.
    pub along: &'a RangeExpr,
    /// Its lines.
    pub parts: &'a [StringPart],
}

/// What is known of a string while it is elaborated.
pub struct StrandInfo<'a> {
    scope: ScopeId,
    text: StringText<'a>,
    /// Where it begins and ends, once that has been looked at.
    along: Option<Option<Interval>>,
    /// What it is tuned by.
    tension: Option<SlotId>,
    /// Its motion.
    motion: Option<SlotId>,
    /// Its friction.
    pub rub: RubInfo,
    /// Where that rubs it.
    rubbed_at: Option<NodeId>,
}

/// A line `tuned name to pitch`.
#[derive(Debug, Clone, Copy)]
pub struct TunedLine<'a> {
    /// The tension.
    pub name: &'a Name,
    /// The frequency.
    pub pitch: &'a Expr,
}

impl<'a> Elaborator<'a, '_> {
    /// Enters a string, its displacement and its tension.
    pub fn declare_string(&mut self, scope: ScopeId, text: StringText<'a>) -> Made {
        let StringText { name, parts, .. } = text;
        let zero = self.model.dag.constant(0.0);
        self.mark(name.span);
        let point = Interval::point(0.0);
        let id = self.model.strands.push(Strand {
            name: self.scopes[scope.0].full(&name.node),
            displacement: String::new(),
            along: point,
            range: point,
            rate: 0.0,
            ends: [End::Pinned; 2],
            points: None,
            parts: 0,
            density: zero,
            loads: [zero; 4],
            coefficients: [zero; 4],
            pushes: Vec::new(),
            friction: None,
            pitch: None,
            hold: None,
            span: name.span,
        });
        self.strands.push(StrandInfo {
            scope,
            text,
            along: None,
            tension: None,
            motion: None,
            rub: RubInfo::default(),
            rubbed_at: None,
        });
        let full = self.model.strands[id].name.clone();
        let motion = self.new_slot(full, name.span, Source::Strand(id));
        self.strands[id].motion = Some(motion);
        let mut is_first = true;
        for part in parts {
            if let StringPart::Coordinate { name, .. } = part {
                let thing = match std::mem::take(&mut is_first) {
                    true => Thing::Displacement(id),
                    false => Thing::Broken,
                };
                self.model.strands[id].displacement = self.scopes[scope.0].full(&name.node);
                self.enter(scope, name, thing);
            }
        }
        self.declare_tension(scope, id, parts);
        let all = parts.iter().filter_map(rub::rubbed);
        self.declare_frictions(scope, Some(RubbedBy::Strand(id)), all);
        self.name_string(scope, id, name);
        Made::Strand(id)
    }

    fn declare_tension(&mut self, scope: ScopeId, id: StrandId, parts: &'a [StringPart]) {
        for part in parts {
            let StringPart::Tuned { name, pitch, .. } = part else {
                continue;
            };
            if self.strands[id].tension.is_some() {
                self.enter(scope, name, Thing::Broken);
                continue;
            }
            let full = self.scopes[scope.0].full(&name.node);
            let source = Source::Tension(id, TunedLine { name, pitch });
            let slot = self.new_slot(full, name.span, source);
            self.strands[id].tension = Some(slot);
            self.enter(scope, name, Thing::Tension(slot));
        }
    }

    /// Its label, which is one of a body too.
    fn name_string(&mut self, scope: ScopeId, id: StrandId, name: &'a Name) {
        let here = &self.scopes[scope.0];
        let string = here.strands.get(name.node.as_str()).map(|first| first.span);
        let body = here.bodies.get(name.node.as_str()).map(|first| first.span);
        if let Some(first) = string.or(body) {
            self.duplicate(
                "string",
                name,
                first,
                "a second string or body of this name",
            );
            return;
        }
        let span = name.span;
        let strands = &mut self.scopes[scope.0].strands;
        strands.insert(&name.node, NameEntry { id, span });
    }

    /// Its ends (m).
    fn along(&mut self, id: StrandId) -> Option<Interval> {
        if let Some(known) = self.strands[id].along {
            return known;
        }
        let StrandInfo { scope, text, .. } = self.strands[id];
        let what = format!("the string `{}`", text.name.node);
        let found = self.range(scope, text.along, Dim::LENGTH, &what);
        self.strands[id].along = Some(found);
        if let Some(along) = found {
            self.model.strands[id].along = along;
        }
        found
    }

    /// The tension to which a string is tuned.
    pub fn tuned_tension(&mut self, id: StrandId, line: TunedLine<'a>) -> Option<Value> {
        let StrandInfo { scope, text, .. } = self.strands[id];
        let outer = self.here.replace(scope);
        let pitch = self.expr(scope, line.pitch);
        let pitch = pitch.and_then(|pitch| {
            self.expect(pitch, line.pitch, Ty::Real(Dim::PER_TIME), || {
                "what a string is tuned to".to_string()
            })
        });
        let density = self.density(scope, text);
        let loads = self.loads(id, Some(&line.name.node));
        let value = match (pitch, density, loads) {
            (Some(pitch), Some(density), Some([_, stiffness, ..])) => {
                let rate_hz = self.model.rate_hz.into();
                self.model.strands[id].pitch = Some(pitch);
                let of = [pitch, density, stiffness];
                let node = tension(&mut self.model.dag, id, rate_hz, of);
                self.mark(line.name.span);
                Some(Value::real(node, Dim::FORCE))
            }
            _ => None,
        };
        self.here = outer;
        value
    }

    /// The string whose displacement a callee names.
    pub fn displacement_of(&self, scope: ScopeId, callee: &Name) -> Option<StrandId> {
        self.displacement(scope, &callee.node)
    }

    fn displacement(&self, scope: ScopeId, name: &str) -> Option<StrandId> {
        match self.scopes[scope.0].values.get(name)?.thing {
            Thing::Displacement(id) => Some(id),
            _ => None,
        }
    }

    /// Whether a call is of `d1`, `d2` or `d4` of a displacement; of which string, then.
    pub fn derivative_of(&self, scope: ScopeId, callee: &Name, args: &[Arg]) -> Option<StrandId> {
        if !["d1", "d2", "d4"].contains(&callee.node.as_str()) {
            return None;
        }
        let first = &args.first()?.value;
        let of = match &first.kind {
            ExprKind::Prime(inner) => inner,
            _ => first,
        };
        match &of.kind {
            ExprKind::Name(name) => self.displacement(scope, name),
            _ => None,
        }
    }

    /// `u(p)`
    pub fn displacement_at(
        &mut self,
        scope: ScopeId,
        id: StrandId,
        callee: &Name,
        args: &'a [Arg],
        span: Span,
    ) -> Option<Value> {
        let [Arg { name: None, value }] = args else {
            let name = &callee.node;
            let count = counted(args.len(), "argument");
            let message = format!("`{name}` is read at one place, not with {count}");
            let diagnostic = Diagnostic::new(Code::MissingArgument, span, message, "where?");
            self.report(diagnostic.hint(format!("write `{name}(place)`")));
            return None;
        };
        let place = self.place_on(scope, id, value)?;
        let node = self.node(Node::Read(id, Reading::Displacement, place), span);
        Some(Value::real(node, Dim::LENGTH))
    }

    /// `d1(u, p)`; `d2` and `d4` stand in loads alone.
    pub fn derivative_at(
        &mut self,
        scope: ScopeId,
        id: StrandId,
        callee: &Name,
        args: &'a [Arg],
        span: Span,
    ) -> Option<Value> {
        let name = &callee.node;
        let [u, Arg { name: None, value }] = args else {
            let own = own_name(&self.model.strands[id]);
            let (message, hint) = match name.as_str() {
                "d1" => (
                    "a slope is read at one place".to_string(),
                    format!("write `d1({own}, place)`"),
                ),
                _ => (
                    format!("`{name}({own})` is what a string has all along"),
                    format!("it stands in a `load` of the string; `d1({own}, place)` is its slope"),
                ),
            };
            let diagnostic = Diagnostic::new(Code::AllAlong, span, message, "where?");
            self.report(diagnostic.hint(hint));
            return None;
        };
        if name != "d1" || matches!(u.value.kind, ExprKind::Prime(_)) {
            let own = own_name(&self.model.strands[id]);
            let message = "of a string its slope alone is read at a place";
            let label = "no slope of a displacement";
            let diagnostic = Diagnostic::new(Code::AllAlong, span, message, label);
            self.report(diagnostic.hint(format!(
                "`{own}(place)` is the displacement, `{own}(place)'` its rate, `d1({own}, place)` the slope"
            )));
            return None;
        }
        let place = self.place_on(scope, id, value)?;
        let node = self.node(Node::Read(id, Reading::Slope, place), span);
        Some(Value::real(node, Dim::NUMBER))
    }

    /// A place on a string, from where it begins.
    fn place_on(&mut self, scope: ScopeId, id: StrandId, place: &'a Expr) -> Option<NodeId> {
        let value = self.expr(scope, place)?;
        let place_node = self.expect(value, place, Ty::Real(Dim::LENGTH), || {
            "a place on a string".to_string()
        })?;
        let start = self.along(id)?.low;
        let start = self.model.dag.constant(start);
        Some(self.node(Node::Sub(place_node, start), place.span))
    }

    /// `hold string when condition`
    pub fn hold_string(&mut self, id: StrandId, condition: Option<NodeId>, span: Span) {
        let Some(condition) = condition else { return };
        let hold = match self.model.strands[id].hold {
            Some(other) => self.node(Node::Or(other, condition), span),
            None => condition,
        };
        self.model.strands[id].hold = Some(hold);
    }

    /// Reports a displacement that stands where a value does.
    pub fn displacement_as_value(&mut self, name: &str, span: Span) {
        let message = format!("`{name}` is how far a string is displaced all along, not one value");
        let diagnostic = Diagnostic::new(Code::AllAlong, span, message, "where?");
        self.report(diagnostic.hint(format!(
            "write `{name}(place)`, or `{name}(place)'` for the rate; a load has `d2({name})`, \
             `d4({name})`, `{name}'` and `d2({name}')`"
        )));
    }
}

/// What a program calls the displacement, without the path of the call.
fn own_name(strand: &Strand) -> String {
    let full = &strand.displacement;
    full.rsplit('.').next().unwrap_or(full).to_string()
}
