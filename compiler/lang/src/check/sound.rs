//! `sound`: terms of what is heard, and the channels that they are added to.

use super::elaborate::Elaborator;
use super::scope::{Made, NameEntry, ScopeId};
use super::types::Ty;
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Node, NodeId, Side, Sound};
use crate::syntax::ast::{Expr, Name};
use crate::units::Dim;

/// The sides and their names.
const SIDES: [(&str, Side); 2] = [("left", Side::Left), ("right", Side::Right)];

impl<'a> Elaborator<'a, '_> {
    /// Enters a term of the sound: a label stands once for each side.
    pub fn declare_sound(
        &mut self,
        scope: ScopeId,
        name: &'a Name,
        side: Option<&'a Name>,
    ) -> Made {
        let side = side.map(|side| side.node.as_str());
        let sounds = &mut self.scopes[scope.0].sounds;
        let shares = |other: Option<&str>| other.is_none() || side.is_none() || other == side;
        let first = sounds
            .iter()
            .find(|((label, other), _)| *label == name.node && shares(*other));
        match first.map(|(_, first)| first.span) {
            Some(first) => self.duplicate("sound", name, first, "a second one of this name"),
            None => {
                let entry = NameEntry {
                    id: (),
                    span: name.span,
                };
                sounds.insert((&name.node, side), entry);
            }
        }
        Made::Itself
    }

    /// `sound label [on side] = value`
    pub fn sound(&mut self, scope: ScopeId, name: &'a Name, side: Option<&Name>, value: &'a Expr) {
        let found = self.expr(scope, value);
        let side = match side {
            Some(side) => match self.side(side) {
                Some(side) => Some(side),
                None => return,
            },
            None => None,
        };
        let what = || format!("the sound `{}`", name.node);
        let number = Ty::Real(Dim::NUMBER);
        let node = found.and_then(|found| self.expect(found, value, number, what));
        if let Some(node) = node {
            self.model.sounds.push(Sound {
                name: name.node.clone(),
                value: node,
                side,
                span: name.span,
            });
        }
    }

    fn side(&mut self, name: &Name) -> Option<Side> {
        let found = SIDES.iter().find(|(side, _)| *side == name.node);
        if found.is_none() {
            let message = format!("sound has no side `{}`", name.node);
            let hint = match nearest(&name.node, SIDES.iter().map(|(side, _)| *side)) {
                Some(near) => Advice::did_you_mean(near),
                None => "write `on left` or `on right`, or nothing for both".into(),
            };
            let label = "neither left nor right";
            self.report(Diagnostic::new(Code::Channel, name.span, message, label).hint(hint));
        }
        found.map(|(_, side)| *side)
    }

    /// Where a label stands on both sides, its name tells them apart: `out.left`, `out.right`.
    fn name_sounds(&mut self) {
        let sounds = &self.model.sounds;
        let again = |sound: &Sound| sounds.iter().filter(|s| s.name == sound.name).count() > 1;
        let name = |sound: &Sound| match SIDES.iter().find(|(_, side)| Some(*side) == sound.side) {
            Some((side, _)) if again(sound) => format!("{}.{side}", sound.name),
            _ => sound.name.clone(),
        };
        let names: Vec<String> = sounds.iter().map(name).collect();
        for (sound, name) in self.model.sounds.iter_mut().zip(names) {
            sound.name = name;
        }
    }

    /// Adds the terms of each channel, -1 .. 1.
    pub fn channels(&mut self) {
        self.name_sounds();
        let sides: &[Option<Side>] = match &self.model.sounds[..] {
            [] => &[],
            all if all.iter().all(|sound| sound.side.is_none()) => &[None],
            _ => &[Some(Side::Left), Some(Side::Right)],
        };
        for side in sides {
            let heard = |sound: &&Sound| sound.side.is_none() || sound.side == *side;
            let terms = self.model.sounds.iter().filter(heard);
            let terms: Vec<NodeId> = terms.map(|sound| sound.value).collect();
            let dag = &mut self.model.dag;
            let (zero, low, high) = (dag.constant(0.0), dag.constant(-1.0), dag.constant(1.0));
            let sum = terms
                .into_iter()
                .reduce(|a, b| dag.add_folded(Node::Add(a, b)))
                .unwrap_or(zero);
            let raised = dag.add_folded(Node::Max(sum, low));
            let held = dag.add_folded(Node::Min(raised, high));
            self.model.channels.push(held);
        }
        let place = self.model.sounds.first().map(|sound| sound.span);
        self.mark(place.unwrap_or_default());
    }
}
