//! What a program declares.

use super::{Definition, Index, NameKind, Occurrence};
use crate::syntax::ast::*;
use whippen_source::Span;

/// All definitions; each is an occurrence of its name.
pub(super) fn collect(files: &[File]) -> Index {
    let mut index = Index::default();
    for item in files.iter().flat_map(|f| &f.items) {
        match item {
            Item::Instrument(i) => {
                index.item(NameKind::Instrument, &i.name, i.span, &i.doc);
                i.decls.iter().for_each(|d| index.decl(d));
            }
            Item::Term(t) => {
                index.item(NameKind::Term, &t.name, t.span, &t.doc);
                t.params
                    .iter()
                    .for_each(|p| index.typed(NameKind::Parameter, p));
                t.results
                    .iter()
                    .for_each(|r| index.typed(NameKind::Result, r));
                t.decls.iter().for_each(|d| index.decl(d));
            }
            Item::Keyboard(k) => {
                index.item(NameKind::Keyboard, &k.name, k.span, &k.doc);
                for setting in &k.settings {
                    if let Setting::Zones { name, span, .. } = setting {
                        index.define(NameKind::Zones, name, *span);
                    }
                }
            }
        }
    }
    index
}

impl Index {
    fn item(&mut self, kind: NameKind, name: &Name, whole: Span, doc: &str) {
        self.items.push(whole);
        self.define(kind, name, whole);
        if let Some(item) = self.definitions.last_mut() {
            item.doc = doc.to_string();
        }
    }

    /// Adds a definition to the last item and gives its place.
    fn define(&mut self, kind: NameKind, name: &Name, whole: Span) -> usize {
        let definition = self.definitions.len();
        self.definitions.push(Definition {
            kind,
            name: name.node.clone(),
            span: name.span,
            whole,
            item: self.items.len().saturating_sub(1),
            ty: None,
            doc: String::new(),
            calls: None,
            machine: None,
        });
        self.occurrences.push(Occurrence {
            span: name.span,
            definition,
        });
        definition
    }

    fn typed(&mut self, kind: NameKind, typed: &TypedName) {
        let definition = self.define(kind, &typed.name, typed.name.span.to(typed.ty.span));
        self.definitions[definition].ty = Some(typed.ty.node.clone());
    }

    fn decl(&mut self, decl: &Decl) {
        let (kind, name, ty) = match &decl.kind {
            DeclKind::Sense { name, ty, .. } => (NameKind::Sense, name, Some(ty)),
            DeclKind::Param {
                live: true, name, ..
            } => (NameKind::Live, name, None),
            DeclKind::Param { name, .. } => (NameKind::Param, name, None),
            DeclKind::Let { name, .. } => (NameKind::Let, name, None),
            DeclKind::State { name, ty, .. } => (NameKind::State, name, Some(ty)),
            DeclKind::Pulse { name, ty, .. } => (NameKind::Pulse, name, Some(ty)),
            DeclKind::Event { name, .. } => (NameKind::Event, name, None),
            DeclKind::Force { name, .. } => (NameKind::Force, name, None),
            DeclKind::Sound { name, .. } => (NameKind::Sound, name, None),
            DeclKind::Noise { name } => (NameKind::Noise, name, None),
            DeclKind::Delay { name, ty, .. } => (NameKind::Delay, name, Some(ty)),
            DeclKind::Table { name, ty, .. } => (NameKind::Table, name, Some(ty)),
            DeclKind::States { name, .. } => (NameKind::Machine, name, None),
            DeclKind::Bank { name, .. } => (NameKind::Bank, name, None),
            DeclKind::Body { name, .. } => (NameKind::Body, name, None),
            DeclKind::String { name, .. } => (NameKind::String, name, None),
            DeclKind::Next { .. }
            | DeclKind::Feed { .. }
            | DeclKind::Hold { .. }
            | DeclKind::Result { .. } => return,
        };
        let at = self.define(kind, name, decl.span);
        self.definitions[at].ty = ty.map(|ty| ty.node.clone());
        match &decl.kind {
            DeclKind::Let {
                value:
                    Expr {
                        kind: ExprKind::Call(callee, _),
                        ..
                    },
                ..
            } => {
                self.definitions[at].calls = Some(callee.node.clone());
            }
            DeclKind::States { transitions, .. } => self.machine(at, transitions),
            DeclKind::Bank { index, decls, .. } => self.bank(index, decls),
            DeclKind::Body { parts, .. } => {
                for part in parts {
                    match part {
                        BodyPart::Coordinate { name, span, .. } => {
                            self.define(NameKind::Coordinate, name, *span);
                        }
                        BodyPart::Friction {
                            name, slip, span, ..
                        } => {
                            self.define(NameKind::Friction, name, *span);
                            self.define(NameKind::Slip, slip, *span);
                        }
                        BodyPart::Inertia { .. } | BodyPart::Torque { .. } => {}
                    }
                }
            }
            DeclKind::String { parts, .. } => self.string(parts),
            _ => {}
        }
    }

    /// The displacement of a string, and its tension.
    fn string(&mut self, parts: &[StringPart]) {
        for part in parts {
            match part {
                StringPart::Coordinate { name, span, .. } => {
                    self.define(NameKind::Coordinate, name, *span);
                }
                StringPart::Friction {
                    name, slip, span, ..
                } => {
                    self.define(NameKind::Friction, name, *span);
                    self.define(NameKind::Slip, slip, *span);
                }
                StringPart::Tuned { name, span, .. } => {
                    self.define(NameKind::Tension, name, *span);
                }
                _ => {}
            }
        }
    }

    /// The number of its members and what they declare.
    fn bank(&mut self, index: &Name, decls: &[Decl]) {
        self.define(NameKind::Number, index, index.span);
        decls.iter().for_each(|inner| self.decl(inner));
    }

    /// The states of a machine, each where it is named first.
    fn machine(&mut self, machine: usize, transitions: &[Transition]) {
        for transition in transitions {
            for state in [&transition.from, &transition.to] {
                let known = self.states(machine).any(|s| s.name == state.node);
                if !known {
                    let at = self.define(NameKind::MachineState, state, transition.span);
                    self.definitions[at].machine = Some(machine);
                }
            }
        }
    }
}
