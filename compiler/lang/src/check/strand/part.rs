//! The lines of a string, each once but loads and forces.

use super::super::elaborate::Elaborator;
use super::super::friction::RubbedBy;
use super::super::scope::ScopeId;
use super::super::types::{Ty, Value};
use super::rub::rubbed;
use super::{StrandInfo, StringText, own_name};
use crate::diag::{Code, Diagnostic};
use crate::model::strand::{coefficients, pushed};
use crate::model::{End, NodeId, Push, Strand, StrandId};
use crate::syntax::ast::{Expr, Name, RangeExpr, StringPart};
use crate::units::{Dim, shown_range};
use whippen_source::Span;

/// kg/m
const DENSITY: Dim = Dim::MASS.div(Dim::LENGTH);

impl<'a> Elaborator<'a, '_> {
    /// All that stands in a string.
    pub fn string(&mut self, id: StrandId) {
        let StrandInfo {
            scope,
            text,
            motion,
            ..
        } = self.strands[id];
        if let Some(motion) = motion {
            self.slot(motion);
        }
        let first = text.parts.iter().find_map(rubbed);
        self.frictions(scope, RubbedBy::Strand(id), first);
    }

    /// All but its friction.
    pub fn string_motion(&mut self, id: StrandId) -> Option<Value> {
        let scope = self.strands[id].scope;
        let outer = self.here.replace(scope);
        let found = self.motion_of(id);
        self.here = outer;
        found
    }

    fn motion_of(&mut self, id: StrandId) -> Option<Value> {
        let StrandInfo {
            scope,
            text,
            tension,
            ..
        } = self.strands[id];
        self.along(id);
        self.lines_once(text);
        self.coordinate(scope, id, text);
        self.ends(id, text);
        self.points(scope, id, text);
        let tension = tension.map(|slot| self.slot(slot));
        let density = self.density(scope, text);
        let loads = self.loads(id, None);
        let (density, loads) = (density?, loads?);
        if let Some(tension) = tension {
            self.tuned_by(id, tension.map(|tension| tension.node), loads[0]);
        }
        let zero = self.model.dag.constant(0.0);
        if loads[0] == zero && loads[1] == zero {
            let u = own_name(&self.model.strands[id]);
            let message = format!("nothing pulls the string `{}` straight", text.name.node);
            let hint = format!("add `load tension * d2({u})`, or `load -stiffness * d4({u})`");
            let diagnostic =
                Diagnostic::new(Code::StringPart, text.name.span, message, "it cannot sound");
            self.report(diagnostic.hint(hint));
        }
        let rate_hz = self.model.rate_hz.into();
        let found = coefficients(&mut self.model.dag, id, rate_hz, density, loads);
        self.mark(text.name.span);
        let strand = &mut self.model.strands[id];
        strand.density = density;
        strand.loads = loads;
        strand.coefficients = found;
        self.pushes(id, density, loads[2]);
        Some(Value::real(density, DENSITY))
    }

    /// What must stand in it once, and what may.
    fn lines_once(&mut self, text: StringText<'a>) {
        let hints = [
            (
                "coordinate",
                "position u in low .. high, rate in low .. high",
            ),
            ("density", "density ..` in kg/m, `mass / length"),
            ("ends", "ends pinned` or `ends clamped"),
            ("tuned", ""),
            ("points", ""),
            ("friction", ""),
        ];
        let name = &text.name.node;
        for (what, line) in hints {
            let mut all = text.parts.iter().filter(|part| word(part) == what);
            match (all.next(), all.next()) {
                (None, _) if !line.is_empty() => {
                    let message = format!("the string `{name}` has no {what}");
                    let span = text.name.span;
                    let label = "a line is missing";
                    let diagnostic = Diagnostic::new(Code::StringPart, span, message, label);
                    self.report(diagnostic.hint(format!("add a line `{line}`")));
                }
                (Some(first), Some(second)) => {
                    let message = format!("the string `{name}` has two lines for its {what}");
                    let span = second.span();
                    self.report(
                        Diagnostic::new(Code::StringPart, span, message, "the second")
                            .also(first.span(), "the first")
                            .hint("take one of them away"),
                    );
                }
                _ => {}
            }
        }
    }

    fn coordinate(&mut self, scope: ScopeId, id: StrandId, text: StringText<'a>) {
        let found = text.parts.iter().find_map(|part| match part {
            StringPart::Coordinate {
                name,
                range,
                rate_range,
                ..
            } => Some((name, range, rate_range)),
            _ => None,
        });
        let Some((name, range, rate_range)) = found else {
            return;
        };
        let own = &name.node;
        let bounds =
            self.range_at_rest(scope, range, Dim::LENGTH, &format!("the range of `{own}`"));
        let rates = format!("the range of `{own}'`");
        let rates = self.range_at_rest(scope, rate_range, Dim::SPEED, &rates);
        let strand = &mut self.model.strands[id];
        strand.range = bounds.unwrap_or(strand.range);
        strand.rate = rates.map_or(strand.rate, |rates| rates.magnitude());
    }

    /// A range that holds the zero of rest.
    fn range_at_rest(
        &mut self,
        scope: ScopeId,
        range: &'a RangeExpr,
        dim: Dim,
        what: &str,
    ) -> Option<crate::model::Interval> {
        let bounds = self.range(scope, range, dim, what)?;
        if bounds.low <= 0.0 && bounds.high >= 0.0 {
            return Some(bounds);
        }
        let message = format!("{what} does not hold zero, where a string begins");
        let label = shown_range(bounds, dim);
        let diagnostic = Diagnostic::new(Code::InitOutOfRange, range.span, message, label);
        self.report(diagnostic.hint("widen the range so that it holds zero"));
        None
    }

    /// Its mass per length.
    pub(super) fn density(&mut self, scope: ScopeId, text: StringText<'a>) -> Option<NodeId> {
        let value = text.parts.iter().find_map(|part| match part {
            StringPart::Density { value, .. } => Some(value),
            _ => None,
        })?;
        let found = self.expr(scope, value)?;
        self.expect(found, value, Ty::Real(DENSITY), || {
            "the density of a string".to_string()
        })
    }

    fn ends(&mut self, id: StrandId, text: StringText<'a>) {
        let found = text.parts.iter().find_map(|part| match part {
            StringPart::Ends { first, second, .. } => {
                Some([first, second.as_ref().unwrap_or(first)])
            }
            _ => None,
        });
        let Some(words) = found else { return };
        for (at, name) in words.into_iter().enumerate() {
            if let Some(end) = self.end(name) {
                self.model.strands[id].ends[at] = end;
            }
        }
    }

    fn end(&mut self, name: &Name) -> Option<End> {
        let hint = match name.node.as_str() {
            "pinned" => return Some(End::Pinned),
            "clamped" => return Some(End::Clamped),
            "free" => "a free end is not built yet: write `pinned` or `clamped`",
            _ => "write `pinned`, at rest and free to turn, or `clamped`, held straight",
        };
        let message = format!("the end of a string cannot be `{}`", name.node);
        let label = "neither pinned nor clamped";
        self.report(Diagnostic::new(Code::StringEnds, name.span, message, label).hint(hint));
        None
    }

    fn points(&mut self, scope: ScopeId, id: StrandId, text: StringText<'a>) {
        let value = text.parts.iter().find_map(|part| match part {
            StringPart::Points { value, .. } => Some(value),
            _ => None,
        });
        let Some(value) = value else { return };
        let what = "the number of points of a string";
        let Some(points) = self.constant(scope, value, Dim::NUMBER, what) else {
            return;
        };
        let [fewest, most] = Strand::PARTS.map(|parts| parts - 1);
        if points.fract() == 0.0 && (f64::from(fewest)..=f64::from(most)).contains(&points) {
            self.model.strands[id].points = Some(points as u32);
            return;
        }
        let message = format!("a string has {fewest} to {most} points, not {points}");
        let label = "not so many";
        self.report(
            Diagnostic::new(Code::StringPoints, value.span, message, label).hint(
                "without this line a string has as many points as are stable, which are the best",
            ),
        );
    }

    /// Whether the tension that was found is that of the loads, and the ends are pinned.
    fn tuned_by(&mut self, id: StrandId, tension: Option<NodeId>, found: NodeId) {
        let StrandInfo { text, .. } = self.strands[id];
        let line = text.parts.iter().find_map(|part| match part {
            StringPart::Tuned { name, span, .. } => Some((name, *span)),
            _ => None,
        });
        let (Some((name, span)), Some(tension)) = (line, tension) else {
            return;
        };
        if self.model.strands[id].ends != [End::Pinned; 2] {
            let message = "a string is tuned between pinned ends only";
            let diagnostic = Diagnostic::new(Code::StringTuned, span, message, "one is clamped");
            self.report(diagnostic.hint("write `ends pinned`, or give the tension by hand"));
        }
        if tension != found {
            let u = own_name(&self.model.strands[id]);
            let name = &name.node;
            let message =
                format!("`{name}` is not what pulls the string straight, so it is not tuned");
            let label = format!("the coefficient of `d2({u})` is another");
            let diagnostic = Diagnostic::new(Code::StringTuned, span, message, label);
            self.report(diagnostic.hint(format!("write `load {name} * d2({u})`, once")));
        }
    }

    /// Forces at places.
    fn pushes(&mut self, id: StrandId, density: NodeId, damping: NodeId) {
        let StrandInfo { scope, text, .. } = self.strands[id];
        for part in text.parts {
            let StringPart::Force { value, place, span } = part else {
                continue;
            };
            let force = self.force_on_string(scope, value);
            let place = self.place_on(scope, id, place);
            if let (Some(force), Some(place)) = (force, place) {
                let rate_hz = self.model.rate_hz.into();
                let of = [force, density, damping];
                let change = pushed(&mut self.model.dag, id, rate_hz, of);
                self.mark(value.span);
                let span: Span = *span;
                let strand = &mut self.model.strands[id];
                strand.pushes.push(Push {
                    change,
                    place,
                    span,
                });
            }
        }
    }

    fn force_on_string(&mut self, scope: ScopeId, value: &'a Expr) -> Option<NodeId> {
        let found = self.expr(scope, value)?;
        self.expect(found, value, Ty::Real(Dim::FORCE), || {
            "a force on a string".to_string()
        })
    }
}

/// What a line says, in a word.
fn word(part: &StringPart) -> &'static str {
    match part {
        StringPart::Coordinate { .. } => "coordinate",
        StringPart::Density { .. } => "density",
        StringPart::Load { .. } => "load",
        StringPart::Force { .. } => "force",
        StringPart::Ends { .. } => "ends",
        StringPart::Tuned { .. } => "tuned",
        StringPart::Points { .. } => "points",
        StringPart::Friction { .. } => "friction",
    }
}
