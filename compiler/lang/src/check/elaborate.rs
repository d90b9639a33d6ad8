//! The elaborator: what is known while one instrument becomes a Model, and the walk over its
//! declarations.

use std::collections::{HashMap, HashSet};

use super::Options;
use super::bank::{Bank, BankRead};
use super::body::BodyInfo;
use super::diags::Diags;
use super::dubious::DoubtKind;
use super::friction;
use super::items::{Items, TermItem};
use super::scope::{Made, Scope, ScopeId, Thing};
use super::settings::Settings;
use super::slot::{Slot, SlotId};
use super::strand::{StrandInfo, points};
use super::table::{TableId, TableInfo};
use super::types::{Ty, Value};
use crate::diag::Diagnostic;
use crate::model::{Dag, DelayId, EmissionId, Force, Item, Model, Named, Node, NodeId, StrandId};
use crate::syntax::ast::{Decl, DeclKind, Name};
use whippen_ids::IdMap;
use whippen_source::Span;

/// Everything known while one instrument becomes a Model.
pub struct Elaborator<'a, 'd> {
    /// What the files declare.
    pub items: &'a Items<'a>,
    /// What keyboard and caller decide about this instrument.
    pub settings: Settings<'a>,
    /// The messages.
    pub diags: &'d mut Diags,
    /// The Model as far as it is.
    pub model: Model,
    /// The tree of scopes; the first is the root.
    pub scopes: Vec<Scope<'a>>,
    /// What is known of each body of the Model while it is elaborated.
    pub bodies: Vec<BodyInfo>,
    /// What is known of each string of the Model while it is elaborated.
    pub strands: IdMap<StrandId, StrandInfo<'a>>,
    /// Values.
    pub slots: Vec<Slot<'a>>,
    /// The values being evaluated, outermost first.
    pub running: Vec<SlotId>,
    /// Values whose circle has been reported.
    pub circles: HashSet<SlotId>,
    /// How deep the expression at hand is nested, through all values being evaluated.
    pub depth: usize,
    /// The banks.
    pub banks: Vec<Bank>,
    /// What has been read of banks for the value or declaration at hand.
    pub reads: Vec<BankRead>,
    /// The type of each `each`, and where it was first seen.
    pub eaches: HashMap<Span, (Ty, Span)>,
    /// The scope that is being looked at.
    pub here: Option<ScopeId>,
    /// Whether a term is checked by itself: then its parameters are live values that stand for
    /// anything.
    pub alone: bool,
    /// Where each `next` of the Model stands.
    pub next_spans: Vec<Span>,
    /// Where each delay line is fed.
    pub feed_spans: IdMap<DelayId, Option<Span>>,
    /// What is known of each table.
    pub tables: IdMap<TableId, TableInfo<'a>>,
    /// Where each kind of emission was first seen.
    pub emission_spans: IdMap<EmissionId, Span>,
}

/// Checks a term by itself. A term that fails here fails the program even if nobody calls it.
pub fn term_alone(items: &Items, term: &TermItem, options: &Options, diags: &mut Diags) {
    let mut elaborator = Elaborator::new(
        items,
        Settings::bare(options),
        diags,
        &term.ast.name.node,
        "",
    );
    elaborator.alone = true;
    let root = elaborator.instantiate_alone(*term);
    elaborator.scope(root);
}

/// The Model of an instrument; `None` if there is an error in it.
pub fn instrument(
    items: &Items,
    index: usize,
    settings: Settings,
    diags: &mut Diags,
) -> Option<Model> {
    let ast = items.instruments[index];
    let errors = diags.errors();
    let mut elaborator = Elaborator::new(items, settings, diags, &ast.name.node, &ast.doc);
    let root = elaborator.instantiate(Scope::new(String::new(), &ast.decls, None, None));
    elaborator.scope(root);
    elaborator.unfed();
    elaborator.channels();
    let Elaborator {
        mut model, diags, ..
    } = elaborator;
    model.span = ast.name.span;
    name_forces(&mut model);
    if diags.errors() > errors {
        return None;
    }
    model.sweep();
    for diagnostic in points::choose(&mut model) {
        diags.push(diagnostic);
    }
    if diags.errors() > errors {
        return None;
    }
    friction::remember_slips(&mut model);
    Some(model)
}

/// Where several ports are driven, a label may stand once for each: the port tells them apart.
fn name_forces(model: &mut Model) {
    let name = |force: &Force| model.name_of_driven(&force.name, force.port);
    let names: Vec<String> = model.forces.iter().map(name).collect();
    for (force, name) in model.forces.iter_mut().zip(names) {
        force.name = name;
    }
}

impl<'a, 'd> Elaborator<'a, 'd> {
    /// An elaborator that knows nothing yet.
    pub fn new(
        items: &'a Items<'a>,
        settings: Settings<'a>,
        diags: &'d mut Diags,
        name: &str,
        doc: &str,
    ) -> Elaborator<'a, 'd> {
        let model = Model {
            name: name.to_string(),
            span: Span::default(),
            doc: doc.to_string(),
            rate_hz: settings.rate_hz,
            dag: Dag::default(),
            spans: IdMap::new(),
            within: IdMap::new(),
            calls: Vec::new(),
            items: Vec::new(),
            senses: Vec::new(),
            parameters: Vec::new(),
            lives: Vec::new(),
            keyed: Vec::new(),
            cells: IdMap::new(),
            machines: IdMap::new(),
            bodies: Vec::new(),
            strands: IdMap::new(),
            pulses: IdMap::new(),
            noises: IdMap::new(),
            delays: IdMap::new(),
            tuned: IdMap::new(),
            nexts: Vec::new(),
            rules: Vec::new(),
            emissions: IdMap::new(),
            forces: Vec::new(),
            sounds: Vec::new(),
            channels: Vec::new(),
            named: Vec::new(),
        };
        Elaborator {
            items,
            settings,
            diags,
            model,
            scopes: Vec::new(),
            bodies: Vec::new(),
            strands: IdMap::new(),
            slots: Vec::new(),
            running: Vec::new(),
            circles: HashSet::new(),
            depth: 0,
            banks: Vec::new(),
            reads: Vec::new(),
            eaches: HashMap::new(),
            here: None,
            alone: false,
            next_spans: Vec::new(),
            feed_spans: IdMap::new(),
            tables: IdMap::new(),
            emission_spans: IdMap::new(),
        }
    }

    /// Adds a message. Inside a call it also shows the call, because what is wrong there regardless
    /// of the call has been told before, when the term was checked by itself.
    pub fn report(&mut self, mut diagnostic: Diagnostic) {
        let mut scope = self.here;
        while let Some(caller) = scope.and_then(|id| self.scopes[id.0].caller) {
            diagnostic = diagnostic.also(caller.span, "in this call");
            scope = Some(caller.scope);
        }
        let repeats = self.here.and_then(|here| self.member_around(here));
        match repeats.filter(|member| member.number > 0) {
            Some(_) => self.diags.push_again(diagnostic),
            None => self.diags.push(diagnostic),
        }
    }

    /// Adds a node, folded if it is constant, and remembers where it was first seen.
    pub fn node(&mut self, node: Node, span: Span) -> NodeId {
        let id = self.model.dag.add_folded(node);
        self.mark(span);
        id
    }

    /// Gives the nodes that are new since the last mark a place.
    pub fn mark(&mut self, span: Span) {
        self.model.spans.resize(self.model.dag.len(), Some(span));
        let call = self.here.and_then(|scope| self.scopes[scope.0].call);
        self.model.within.resize(self.model.dag.len(), call);
    }

    /// Elaborates a scope: its arguments, then its declarations, the calls in each before itself.
    pub fn scope(&mut self, id: ScopeId) {
        for slot in self.scopes[id.0].args.clone() {
            self.slot(slot);
        }
        for (index, decl) in self.scopes[id.0].decls.iter().enumerate() {
            for child in self.scopes[id.0].children[index].clone() {
                self.scope(child);
            }
            self.here = Some(id);
            self.item(id, decl);
            self.reads.clear();
            self.declaration(id, decl, self.scopes[id.0].made[index]);
            self.check_reads(id, decl);
        }
    }

    fn item(&mut self, scope: ScopeId, decl: &Decl) {
        let here = &self.scopes[scope.0];
        let (kind, name) = decl.kind.label();
        let name = format!("{kind} {}", here.full(&name.node));
        self.model.items.push(Item {
            name,
            span: decl.span,
            call: here.call,
        });
    }

    fn declaration(&mut self, scope: ScopeId, decl: &'a Decl, made: Made) {
        match (&decl.kind, made) {
            (_, Made::Nothing) => {}
            (
                DeclKind::Sense {
                    range, slew, over, ..
                },
                Made::Sense(index),
            ) => {
                self.sense(scope, index, range, slew.as_ref(), over.as_ref());
            }
            (DeclKind::Let { name, .. }, Made::Slot(slot)) => self.named_let(scope, name, slot),
            (DeclKind::Result { name, .. }, Made::Slot(slot)) => {
                self.named_result(scope, name, slot)
            }
            (_, Made::Slot(slot)) => {
                self.slot(slot);
            }
            (DeclKind::States { transitions, .. }, Made::Machine(machine)) => {
                self.states(scope, machine, transitions);
            }
            (
                DeclKind::State {
                    ty, range, init, ..
                },
                Made::Cell(cell),
            ) => {
                self.state(scope, cell, range, init.as_ref());
                if let Some(kind) = DoubtKind::of_type(&ty.node) {
                    self.doubt_range(range, kind);
                }
            }
            (DeclKind::Next { name, value }, _) => self.next(scope, name, value),
            (DeclKind::Body { parts, .. }, Made::Body(body)) => self.moved_body(scope, body, parts),
            (
                DeclKind::Event {
                    name,
                    trigger,
                    actions,
                },
                _,
            ) => self.event(scope, name, trigger, actions, decl.span),
            (DeclKind::Pulse { range, lasting, .. }, Made::Pulse(pulse)) => {
                self.pulse(scope, pulse, range, lasting)
            }
            (DeclKind::Hold { body, guard }, _) => self.hold(scope, body, guard),
            (
                DeclKind::Force {
                    turning,
                    name,
                    on,
                    value,
                },
                _,
            ) => self.force(scope, *turning, name, on.as_ref(), value),
            _ => self.of_signals(scope, decl, made),
        }
    }

    /// Strings, delay lines and sound.
    fn of_signals(&mut self, scope: ScopeId, decl: &'a Decl, made: Made) {
        match (&decl.kind, made) {
            (DeclKind::Delay { range, lasting, .. }, Made::Delay(delay)) => {
                self.delay(scope, delay, range, lasting);
            }
            (DeclKind::Table { .. }, Made::Table(table)) => drop(self.table(table)),
            (DeclKind::Feed { delay, value }, _) => self.feed(scope, delay, value),
            (DeclKind::String { .. }, Made::Strand(id)) => self.string(id),
            (DeclKind::Sound { name, side, value }, _) => {
                self.sound(scope, name, side.as_ref(), value);
            }
            _ => {}
        }
    }

    /// A `let` is exported, unless it names a call with several results or stands inside `std`.
    fn named_let(&mut self, scope: ScopeId, name: &Name, slot: SlotId) {
        let here = &self.scopes[scope.0];
        if let Some(Thing::Let(_, Some(child))) =
            here.values.get(name.node.as_str()).map(|e| e.thing)
            && self.scopes[child.0].results.len() != 1
        {
            return;
        }
        let exported = !here.in_std();
        let value = self.slot(slot);
        if exported {
            self.export(scope, name, value);
        }
    }

    /// A result is exported, unless a `let` gives it its own name.
    fn named_result(&mut self, scope: ScopeId, name: &Name, slot: SlotId) {
        let here = &self.scopes[scope.0];
        let is_let = here.results.len() == 1 && here.caller.is_some_and(|c| c.is_let);
        let value = self.slot(slot);
        if !is_let {
            self.export(scope, name, value);
        }
    }

    pub fn export(&mut self, scope: ScopeId, name: &Name, value: Option<Value>) {
        let Some(value) = value else { return };
        let full = self.scopes[scope.0].full(&name.node);
        self.model.named.push(Named {
            name: full,
            dim: value.ty.dim(),
            value: value.node,
            span: name.span,
        });
    }
}
