//! `noise`: another number in every tick.

use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::types::Value;
use crate::model::{Node, Noise};
use crate::syntax::ast::Name;
use crate::units::Dim;

impl<'a> Elaborator<'a, '_> {
    /// Enters a noise.
    pub fn declare_noise(&mut self, scope: ScopeId, name: &'a Name) -> Made {
        let full = self.scopes[scope.0].full(&name.node);
        let (first, last) = match self.settings.is_keyboard {
            true => self.settings.keys,
            false => (0, 0),
        };
        let seeds = (first..=last).map(|key| Noise::seed(&full, key)).collect();
        let noise = self.model.noises.push(Noise {
            name: full,
            seeds,
            span: name.span,
        });
        let node = self.node(Node::Noise(noise), name.span);
        self.enter(scope, name, Thing::Noise(Value::real(node, Dim::NUMBER)));
        Made::Itself
    }
}
