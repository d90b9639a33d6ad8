//! Machines: their states, their transitions, and which states can ever be entered.

use super::elaborate::Elaborator;
use super::scope::{Made, NameEntry, ScopeId};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Machine, MachineId, RuleKind};
use crate::syntax::ast::{Name, Transition};
use whippen_source::Span;

impl<'a> Elaborator<'a, '_> {
    /// Enters a machine. Its states are those its transitions name, in the order of the text; it
    /// starts in the first.
    pub fn declare_machine(
        &mut self,
        scope: ScopeId,
        name: &'a Name,
        transitions: &[Transition],
    ) -> Made {
        let mut states: Vec<String> = Vec::new();
        for state in transitions.iter().flat_map(|t| [&t.from, &t.to]) {
            if !states.contains(&state.node) {
                states.push(state.node.clone());
            }
        }
        if states.is_empty() {
            let message = format!(
                "the machine `{}` has no transitions, so it has no states",
                name.node
            );
            let hint = "add `from -> to when ..`; it starts in the first state named";
            self.report(
                Diagnostic::new(Code::EmptyMachine, name.span, message, "empty").hint(hint),
            );
        }
        let full = self.scopes[scope.0].full(&name.node);
        let id = self.model.machines.push(Machine {
            name: full,
            states,
            span: name.span,
        });
        match self.scopes[scope.0].machines.get(name.node.as_str()) {
            Some(first) => {
                self.duplicate("machine", name, first.span, "a second machine of this name")
            }
            None => drop(self.scopes[scope.0].machines.insert(
                &name.node,
                NameEntry {
                    id,
                    span: name.span,
                },
            )),
        }
        Made::Machine(id)
    }

    /// Its transitions.
    pub fn states(&mut self, scope: ScopeId, machine: MachineId, transitions: &'a [Transition]) {
        for transition in transitions {
            let index = |state: &Name| {
                let states = &self.model.machines[machine].states;
                states.iter().position(|s| *s == state.node).unwrap_or(0) as u32
            };
            let kind = RuleKind::Transition {
                machine,
                from: index(&transition.from),
                to: index(&transition.to),
            };
            self.rule(
                scope,
                kind,
                &transition.guard,
                &transition.actions,
                transition.span,
            );
            if transition.from.node == transition.to.node && transition.actions.is_empty() {
                let message = format!(
                    "this step from `{}` to itself does nothing",
                    transition.from.node
                );
                let diagnostic =
                    Diagnostic::new(Code::IdleStep, transition.span, message, "no actions");
                self.report(diagnostic.hint("take it away, or give it something to do"));
            }
        }
        self.warn_unreachable(transitions);
    }

    fn warn_unreachable(&mut self, transitions: &[Transition]) {
        let Some(first) = transitions.first() else {
            return;
        };
        let mut reached = vec![first.from.node.as_str()];
        let mut next = 0;
        while next < reached.len() {
            let here = reached[next];
            for t in transitions.iter().filter(|t| t.from.node == here) {
                if !reached.contains(&t.to.node.as_str()) {
                    reached.push(&t.to.node);
                }
            }
            next += 1;
        }
        let mut reported: Vec<&str> = Vec::new();
        for t in transitions {
            let state = t.from.node.as_str();
            if reached.contains(&state) || reported.contains(&state) {
                continue;
            }
            reported.push(state);
            let hint = match nearest(state, reached.iter().copied()) {
                Some(near) => Advice::did_you_mean(near),
                None => {
                    format!("add a transition that ends in `{state}`, or take those from it away")
                        .into()
                }
            };
            let message = format!("the state `{state}` is never entered");
            let diagnostic = Diagnostic::new(
                Code::UnreachableState,
                t.from.span,
                message,
                "no transition leads here",
            );
            self.report(
                diagnostic
                    .also(first.from.span, "the machine starts here")
                    .hint(hint),
            );
        }
    }

    /// Reports a machine that is not there.
    pub fn unknown_machine(&mut self, scope: ScopeId, machine: &Name) {
        let here = &self.scopes[scope.0];
        let hint = if here.values.contains_key(machine.node.as_str()) {
            format!(
                "`{}` is a value: compare it, or ask a machine",
                machine.node
            )
            .into()
        } else if let Some(near) = nearest(&machine.node, here.machines.keys().copied()) {
            Advice::did_you_mean(near)
        } else {
            format!("declare it: `states {} {{ .. }}`", machine.node).into()
        };
        let message = format!("there is no machine `{}`", machine.node);
        self.report(
            Diagnostic::new(
                Code::UnknownMachine,
                machine.span,
                message,
                "unknown machine",
            )
            .hint(hint),
        );
    }

    /// Reports a state that the machine does not have.
    pub fn unknown_state(&mut self, machine: MachineId, declared: Span, state: &Name) {
        let machine = &self.model.machines[machine];
        if machine.states.is_empty() {
            return;
        }
        let hint = match nearest(&state.node, machine.states.iter().map(String::as_str)) {
            Some(near) => Advice::did_you_mean(near),
            None => format!("its states are {}", machine.states.join(", ")).into(),
        };
        let message = format!(
            "the machine `{}` has no state `{}`",
            machine.name, state.node
        );
        let diagnostic = Diagnostic::new(Code::UnknownState, state.span, message, "unknown state");
        self.report(diagnostic.also(declared, "the machine").hint(hint));
    }
}
