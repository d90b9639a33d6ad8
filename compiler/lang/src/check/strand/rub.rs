//! Frictions of strings: the slip is the mean of before and after the tick, at a place.

use super::super::elaborate::Elaborator;
use super::super::friction::Rubbed;
use super::super::scope::ScopeId;
use super::super::types::Value;
use crate::model::strand::{force_of_slip, push_of_slip, slip_by_force};
use crate::model::{CellId, Node, NodeId, Push, Rub, StrandId};
use crate::syntax::ast::{Expr, StringPart};
use crate::units::Dim;
use whippen_source::Span;

/// A friction as it is written, if a line is one.
pub fn rubbed(part: &StringPart) -> Option<Rubbed<'_>> {
    let StringPart::Friction {
        name,
        slip,
        place,
        against,
        law,
        span,
    } = part
    else {
        return None;
    };
    Some(Rubbed {
        name,
        slip,
        place: Some(place),
        against,
        law,
        span: *span,
    })
}

impl<'a> Elaborator<'a, '_> {
    /// What the rate at a place would be without the friction, as the mean of before and after.
    pub fn free_rate_of_string(
        &mut self,
        scope: ScopeId,
        id: StrandId,
        place: &'a Expr,
    ) -> Option<Value> {
        self.slot(self.strands[id].motion?)?;
        let at = self.place_on(scope, id, place)?;
        self.strands[id].rubbed_at = Some(at);
        let strand = &self.model.strands[id];
        let mut all = vec![at];
        all.extend(strand.coefficients);
        for push in &strand.pushes {
            all.extend([push.change, push.place]);
        }
        let node = self.node(Node::Mean(id, all), place.span);
        Some(Value::real(node, Dim::SPEED))
    }

    /// What a force changes the slip by.
    pub fn slip_of_string(&mut self, id: StrandId) -> Option<NodeId> {
        let place = self.strands[id].rubbed_at?;
        let strand = &self.model.strands[id];
        let of = [strand.density, strand.loads[2], place];
        let rate_hz = self.model.rate_hz.into();
        Some(slip_by_force(&mut self.model.dag, id, rate_hz, of))
    }

    /// The force that takes so much off the slip.
    pub fn force_of_string(&mut self, id: StrandId, taken: NodeId) -> Option<NodeId> {
        let place = self.strands[id].rubbed_at?;
        let strand = &self.model.strands[id];
        let of = [taken, strand.density, strand.loads[2], place];
        let rate_hz = self.model.rate_hz.into();
        Some(force_of_slip(&mut self.model.dag, id, rate_hz, of))
    }

    /// Gives a string its friction: name, what it takes off the slip, its memory, its line.
    pub fn string_is_rubbed(
        &mut self,
        id: StrandId,
        (name, taken, last, span): (String, NodeId, CellId, Span),
    ) {
        let Some(place) = self.strands[id].rubbed_at else {
            return;
        };
        let rate_hz = self.model.rate_hz.into();
        let change = push_of_slip(&mut self.model.dag, id, rate_hz, [taken, place]);
        self.mark(span);
        let push = Push {
            change,
            place,
            span,
        };
        self.model.strands[id].friction = Some(Rub { name, push, last });
    }
}
