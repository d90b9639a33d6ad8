//! `force` and `torque`: what the player feels.
//!
//! Every sense is a port, and each term acts on one of them: what slides takes forces, what turns
//! takes torques, and what is no position takes nothing.

use super::elaborate::Elaborator;
use super::scope::ScopeId;
use super::types::Ty;
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Force, Moves, Sense};
use crate::syntax::ast::{Expr, Name};
use crate::units::Dim;

impl<'a> Elaborator<'a, '_> {
    /// `force name [on sense] = value`, `torque name [on sense] = value`
    pub fn force(
        &mut self,
        scope: ScopeId,
        turning: bool,
        name: &Name,
        on: Option<&Name>,
        value: &'a Expr,
    ) {
        let port = self.port(turning, name, on);
        let (word, dim) = if turning {
            ("torque", Dim::TORQUE)
        } else {
            ("force", Dim::FORCE)
        };
        let Some(found) = self.expr(scope, value) else {
            return;
        };
        let what = || format!("the {word} `{}`", name.node);
        let node = self.expect(found, value, Ty::Real(dim), what);
        let (Some(node), Some(port)) = (node, port) else {
            return;
        };
        self.model.forces.push(Force {
            name: name.node.clone(),
            dim,
            port,
            value: node,
            span: name.span,
        });
    }

    /// The sense on which a term acts, if that moves the way the term pushes; without a sense
    /// everything does.
    fn port(&mut self, turning: bool, name: &Name, on: Option<&Name>) -> Option<usize> {
        let port = match on {
            None => 0,
            Some(on) => {
                let mut senses = self.model.senses.iter();
                match senses.position(|sense| sense.name == on.node) {
                    Some(port) => port,
                    None => return self.no_sense(on),
                }
            }
        };
        let wanted = if turning { Moves::Turns } else { Moves::Slides };
        match self.model.senses.get(port) {
            Some(sense) if sense.moves != wanted => {
                let mut senses = self.model.senses.iter();
                let fitting = senses.find(|sense| sense.moves == wanted);
                let diagnostic = wrong_drive(sense, turning, name, on, fitting);
                self.report(diagnostic);
                None
            }
            _ => Some(port),
        }
    }

    /// Reports what stands behind `on` and is no sense of the instrument. One that is declared
    /// further down has been entered already.
    fn no_sense(&mut self, on: &Name) -> Option<usize> {
        let known: Vec<&str> = self.model.senses.iter().map(|s| s.name.as_str()).collect();
        let hint: Advice = match nearest(&on.node, known.iter().copied()) {
            Some(near) => Advice::did_you_mean(near),
            None if known.is_empty() => "the instrument senses nothing".into(),
            None => format!("it senses `{}`", known.join("`, `")).into(),
        };
        let message = format!("the instrument senses no `{}`", on.node);
        let diagnostic = Diagnostic::new(Code::UnknownName, on.span, message, "no sense");
        self.report(diagnostic.hint(hint));
        None
    }
}

/// A force on what turns, a torque on what slides, or either on what is no position; and a sense on
/// which it could act.
fn wrong_drive(
    sense: &Sense,
    turning: bool,
    name: &Name,
    on: Option<&Name>,
    fitting: Option<&Sense>,
) -> Diagnostic {
    let (word, other) = if turning {
        ("torque", "force")
    } else {
        ("force", "torque")
    };
    let is = match sense.moves {
        Moves::Turns => "an angle".to_string(),
        _ => Ty::Real(sense.dim).words(),
    };
    let moves = match sense.moves {
        Moves::Slides => "what slides",
        Moves::Turns => "what turns",
        Moves::Not => "what does not move",
    };
    let message = format!("a {word} does not act on {moves}: `{}` is {is}", sense.name);
    let label = name.node.as_str();
    let kind = if turning { "an angle" } else { "a length" };
    let hint = match (fitting, sense.moves) {
        (Some(fitting), _) => format!("write `{word} {label} on {} = ..`", fitting.name),
        (None, Moves::Not) => format!("a {word} acts on a sense that is {kind}"),
        (None, _) => {
            let on = on.map_or(String::new(), |on| format!(" on {}", on.node));
            format!("write `{other} {label}{on} = ..`, or sense {kind}")
        }
    };
    let span = on.map_or(name.span, |on| on.span);
    Diagnostic::new(Code::WrongDrive, span, message, format!("a {word}"))
        .also(sense.span, is)
        .hint(hint)
}
