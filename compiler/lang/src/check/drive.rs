//! `force` and `torque`: what the player feels.
//!
//! An instrument whose sense is an angle turns and drives torques; any other drives forces. Their
//! sums are different quantities, so an instrument has one kind of them.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use super::types::Ty;
use crate::diag::{Code, Diagnostic};
use crate::model::Named;
use crate::syntax::ast::{Expr, Name};
use crate::units::Dim;

impl<'a> Elaborator<'a, '_> {
    /// `force name = value`, `torque name = value`
    pub fn force(&mut self, scope: ScopeId, turning: bool, name: &Name, value: &'a Expr) {
        let fits = self.fits_the_sense(turning, name);
        let (word, dim) = if turning {
            ("torque", Dim::TORQUE)
        } else {
            ("force", Dim::FORCE)
        };
        let Some(found) = self.expr(scope, value) else {
            return;
        };
        let what = || format!("the {word} `{}`", name.node);
        let Some(node) = self
            .expect(found, value, Ty::Real(dim), what)
            .filter(|_| fits)
        else {
            return;
        };
        self.model.forces.push(Named {
            name: name.node.clone(),
            dim: Some(dim),
            value: node,
            span: name.span,
        });
    }

    /// Whether the first sense moves the way this term pushes; without a sense everything does.
    fn fits_the_sense(&mut self, turning: bool, name: &Name) -> bool {
        let Some(sense) = self.model.senses.first() else {
            return true;
        };
        if sense.dim.is_number() == turning {
            return true;
        }
        let (word, other) = if turning {
            ("torque", "force")
        } else {
            ("force", "torque")
        };
        let moves = if turning { "slides" } else { "turns" };
        let message = format!(
            "a {word} does not act on what {moves}: `{}` is {}",
            sense.name,
            Ty::Real(sense.dim).moved()
        );
        let diagnostic = Diagnostic::new(Code::WrongDrive, name.span, message, format!("a {word}"))
            .also(sense.span, Ty::Real(sense.dim).moved())
            .hint(format!(
                "write `{other} {} = ..`, or sense {}",
                name.node,
                if turning { "an angle" } else { "a length" }
            ));
        self.report(diagnostic);
        false
    }
}
