//! Where each instruction comes from: the declaration it was made for, and the calls of terms on
//! the way there.
//!
//! Code is made for a place when a value written there is first needed; what several places need
//! belongs to the first. What no declaration asks for (clipping the drive word) belongs to the
//! instrument as a whole.
//!
//! Not here: lines of a debugger (`image::lines` chooses the line of an origin), instructions.

use std::collections::HashMap;

use super::Lowerer;
use whippen_kernel::OpError;
use whippen_lang::model::{Item, Model, NodeId};
use whippen_source::{Origin, Span};

/// The origins met so far.
#[derive(Debug, Default)]
pub(super) struct Origins {
    pub list: Vec<Origin>,
    numbers: HashMap<Origin, u32>,
}

impl Origins {
    fn number(&mut self, origin: Origin) -> u32 {
        let list = &mut self.list;
        *self.numbers.entry(origin).or_insert_with_key(|origin| {
            list.push(origin.clone());
            list.len() as u32 - 1
        })
    }
}

#[expect(
    clippy::wrong_self_convention,
    reason = "from a place of the source, not from another type"
)]
impl Lowerer<'_> {
    /// What `make` makes was asked for by the instrument as a whole.
    pub(super) fn from_all<T>(
        &mut self,
        make: impl FnOnce(&mut Self) -> Result<T, OpError>,
    ) -> Result<T, OpError> {
        let model = &self.step.model;
        let origin = Origin {
            item: format!("instrument {}", model.name),
            span: model.span,
            calls: Vec::new(),
        };
        self.from_origin(origin, make)
    }

    /// What `make` makes was asked for at `span`, which stands inside a call of a term.
    pub(super) fn from_place<T>(
        &mut self,
        span: Span,
        call: Option<u32>,
        make: impl FnOnce(&mut Self) -> Result<T, OpError>,
    ) -> Result<T, OpError> {
        let model = &self.step.model;
        let inside = |item: &Item| item.span.file == span.file && item.span.to(span) == item.span;
        let length = |item: &&Item| item.span.end - item.span.start;
        let within = |call: Option<u32>| {
            model
                .items
                .iter()
                .filter(move |item| item.call == call && inside(item))
        };
        let own = within(call).min_by_key(length);
        // A value that was first written while another scope was looked at: some call of its term.
        let item = own.or_else(|| {
            model
                .items
                .iter()
                .filter(|item| inside(item))
                .min_by_key(length)
        });
        let call = item.map_or(call, |item| item.call);
        let item = item.map_or_else(
            || format!("instrument {}", model.name),
            |item| item.name.clone(),
        );
        let calls = model.calls_from(call).collect();
        self.from_origin(Origin { item, span, calls }, make)
    }

    /// What `make` makes was asked for by a declaration, known by kind and name.
    pub(super) fn from_item<T>(
        &mut self,
        item: &str,
        make: impl FnOnce(&mut Self) -> Result<T, OpError>,
    ) -> Result<T, OpError> {
        match self.step.model.items.iter().find(|own| own.name == item) {
            Some(&Item { span, call, .. }) => self.from_place(span, call, make),
            None => make(self),
        }
    }

    /// What `make` makes was asked for where a value was written, if that is known.
    pub(super) fn from_node<T>(
        &mut self,
        node: NodeId,
        make: impl FnOnce(&mut Self) -> Result<T, OpError>,
    ) -> Result<T, OpError> {
        let model = &self.step.model;
        match model.spans.get(node).copied().flatten() {
            Some(span) => self.from_place(span, model.within.get(node).copied().flatten(), make),
            None => make(self),
        }
    }

    fn from_origin<T>(
        &mut self,
        origin: Origin,
        make: impl FnOnce(&mut Self) -> Result<T, OpError>,
    ) -> Result<T, OpError> {
        let number = self.origins.number(origin);
        let before = self.b.set_origin(Some(number));
        let made = make(self);
        self.b.set_origin(before);
        made
    }
}

/// The force term whose value a summand of the drive of a port is part of: the first of the text.
pub(super) fn force_of(model: &Model, port: usize, summand: NodeId) -> Option<Span> {
    use whippen_lang::model::Node;
    let sums = |value: NodeId| match model.dag.get(value) {
        Node::Linear(_, terms) => value == summand || terms.iter().any(|(_, x)| *x == summand),
        _ => value == summand,
    };
    model
        .forces
        .iter()
        .find(|force| force.port == port && sums(force.value))
        .map(|force| force.span)
}
