//! Transitions and events: which act in this tick, and what their actions do to the new values.

use super::Lowerer;
use super::commit::Writes;
use super::export::{LoweredEvent, LoweredEventKind};
use super::format::{self, exp2};
use super::real::{Scale, power_of_two};
use super::update::Writer;
use whippen_ids::IdMap;
use whippen_kernel::{Builder, Op, OpError, Range, Type, Value};
use whippen_lang::model::{Action, EmissionId, Interval, NodeId, PulseId, Rule, RuleKind};
use whippen_source::Span;

/// Kernel events, and what they mean.
#[derive(Debug, Default)]
pub(super) struct Events {
    pub meanings: Vec<LoweredEvent>,
    /// Kernel event of each rule, where rules are observed.
    rules: Vec<u32>,
    /// Fraction bits of each argument of each emission.
    bits: IdMap<EmissionId, Vec<i32>>,
}

/// A place in the new values that a rule writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum WrittenCell {
    Cell(u32),
    Machine(u32),
    PulseLeft(u32),
}

impl Writes {
    fn get(&self, place: WrittenCell) -> Option<Value> {
        match place {
            WrittenCell::Cell(c) => self.cells.get(&c).copied(),
            WrittenCell::Machine(m) => self.machines.get(&m).copied(),
            WrittenCell::PulseLeft(p) => self.pulse_left.get(&p).copied(),
        }
    }

    /// The values of places that have one.
    fn at(&self, places: &[WrittenCell]) -> Vec<Value> {
        places.iter().filter_map(|&place| self.get(place)).collect()
    }

    fn set(&mut self, place: WrittenCell, value: Value) {
        match place {
            WrittenCell::Cell(c) => self.cells.insert(c, value),
            WrittenCell::Machine(m) => self.machines.insert(m, value),
            WrittenCell::PulseLeft(p) => self.pulse_left.insert(p, value),
        };
    }
}

impl Lowerer<'_> {
    /// One kernel event per emission, and where observed one per rule.
    pub(super) fn declare_events(&mut self) -> Events {
        let mut events = Events::default();
        let model = &self.step.model;
        for (id, emission) in model.emissions.enumerated() {
            let bits = self.argument_bits(id, emission.args.len());
            self.b.event(&emission.name, emission.args.len() as u32);
            let arg_lsbs = bits.iter().map(|&b| exp2(-b)).collect();
            events.meanings.push(LoweredEvent {
                kind: LoweredEventKind::Emission(id.0),
                arg_lsbs,
            });
            events.bits.push(bits);
        }
        if self.observe {
            for rule in &model.rules {
                events
                    .rules
                    .push(self.declare_rule(&model.rule_name(rule), &mut events.meanings));
            }
        }
        events
    }

    /// The kernel event of a rule; rules of one name (two transitions from one state to another)
    /// share it.
    fn declare_rule(&mut self, name: &str, meanings: &mut Vec<LoweredEvent>) -> u32 {
        let kind = LoweredEventKind::Rule(name.to_string());
        if let Some(known) = meanings.iter().position(|m| m.kind == kind) {
            return known as u32;
        }
        meanings.push(LoweredEvent {
            kind,
            arg_lsbs: Vec::new(),
        });
        self.b.event(&format!("rule {name}"), 0)
    }

    /// The finest format that holds what any `emit` of this kind may pass.
    fn argument_bits(&self, emission: EmissionId, count: usize) -> Vec<i32> {
        let mut ranges: Vec<Option<Interval>> = vec![None; count];
        for action in self.step.model.rules.iter().flat_map(|r| &r.actions) {
            if let Action::Emit {
                emission: e, args, ..
            } = action
                && *e == emission
            {
                for (range, arg) in ranges.iter_mut().zip(args) {
                    let own = self.ranges.get(*arg);
                    *range = Some(range.map_or(own, |r| r.union(own)));
                }
            }
        }
        ranges
            .into_iter()
            .map(|r| format::fraction_bits(r.unwrap_or(Interval::point(0.0))))
            .collect()
    }

    /// Whether a rule acts in this tick; `fired` says it of the rules before it.
    fn fires(&mut self, index: usize, rule: &Rule, fired: &[Value]) -> Result<Value, OpError> {
        let guard = self.bool(rule.guard)?;
        let RuleKind::Transition { machine, from, .. } = rule.kind else {
            return self.edge(index, guard);
        };
        let here = self.is(machine, from)?;
        let mut acts = self.b.op(Op::And, &[here, guard])?;
        for (earlier, &done) in self.step.model.rules[..index].iter().zip(fired) {
            if matches!(
                earlier.kind,
                RuleKind::Transition { machine: m, from: f, .. } if m == machine && f == from
            ) {
                let not = self.b.op(Op::Not, &[done])?;
                acts = self.b.op(Op::And, &[acts, not])?;
            }
        }
        Ok(acts)
    }

    /// Lets every rule that acts replace new values, in the order of the text.
    pub(super) fn rules(&mut self, events: &Events, writes: &mut Writes) -> Result<(), OpError> {
        for machine in 0..self.step.model.machines.len() as u32 {
            if let Some(now) = self.machine(whippen_lang::model::MachineId(machine))? {
                writes.machines.insert(machine, now);
            }
        }
        // A guard is computed where its rule stands: few values are alive at a time.
        let mut fired = Vec::new();
        for (index, rule) in self.step.model.rules.iter().enumerate() {
            let fires = self.from_place(rule.span, rule.call, |s| {
                let fires = s.fires(index, rule, &fired)?;
                s.rule(events, index, fires, writes)?;
                Ok(fires)
            })?;
            fired.push(fires);
        }
        Ok(())
    }

    fn rule(
        &mut self,
        events: &Events,
        index: usize,
        fires: Value,
        writes: &mut Writes,
    ) -> Result<(), OpError> {
        let rule = &self.step.model.rules[index];
        if rule.actions.is_empty() && !self.observe {
            return self.step_machine(rule, fires, writes);
        }
        let places = self.places(rule, writes);
        let after = self.branch(fires, writes.at(&places), |s| {
            let mut inside = writes.clone();
            s.act(events, index, rule, &mut inside)?;
            Ok(inside.at(&places))
        })?;
        for (&place, value) in places.iter().zip(after) {
            writes.set(place, value);
        }
        Ok(())
    }

    /// A transition that does nothing else needs no branch.
    fn step_machine(
        &mut self,
        rule: &Rule,
        fires: Value,
        writes: &mut Writes,
    ) -> Result<(), OpError> {
        let RuleKind::Transition { machine, to, .. } = rule.kind else {
            return Ok(());
        };
        let Some(&now) = writes.machines.get(&machine.0) else {
            return Ok(());
        };
        let next = match (self.b.ty(now), to) {
            (Type::I1, 0) => {
                let stays = self.b.op(Op::Not, &[fires])?;
                self.b.op(Op::And, &[now, stays])?
            }
            (Type::I1, _) => self.b.op(Op::Or, &[now, fires])?,
            (ty, _) => {
                let to = self.b.constant(ty, i64::from(to))?;
                self.b.op(Op::Select, &[fires, to, now])?
            }
        };
        writes.machines.insert(machine.0, next);
        Ok(())
    }

    /// `if condition { then } else { other }`; what is computed inside is forgotten outside.
    fn branch(
        &mut self,
        condition: Value,
        other: Vec<Value>,
        then: impl FnOnce(&mut Self) -> Result<Vec<Value>, OpError>,
    ) -> Result<Vec<Value>, OpError> {
        let saved = (
            self.reals.clone(),
            self.bools.clone(),
            self.loads.clone(),
            self.moved.clone(),
        );
        let mut builder = std::mem::replace(&mut self.b, Builder::new("", 0));
        let result = builder.if_else(
            condition,
            |b| {
                std::mem::swap(&mut self.b, b);
                let out = then(self);
                std::mem::swap(&mut self.b, b);
                out
            },
            |_| Ok(other),
        );
        self.b = builder;
        (self.reals, self.bools, self.loads, self.moved) = saved;
        result
    }

    /// What the rule writes, in a fixed order, among what has a place.
    fn places(&self, rule: &Rule, writes: &Writes) -> Vec<WrittenCell> {
        let mut places = Vec::new();
        if let RuleKind::Transition { machine, .. } = rule.kind {
            places.push(WrittenCell::Machine(machine.0));
        }
        for action in &rule.actions {
            match action {
                Action::Write { cell, .. } => places.push(WrittenCell::Cell(cell.0)),
                Action::Fire { pulse, .. } => {
                    let level = self.step.model.pulses[pulse].level;
                    places.extend([WrittenCell::Cell(level.0), WrittenCell::PulseLeft(pulse.0)]);
                }
                Action::Emit { .. } => {}
            }
        }
        places.sort();
        places.dedup();
        places.retain(|&p| writes.get(p).is_some());
        places
    }

    fn act(
        &mut self,
        events: &Events,
        index: usize,
        rule: &Rule,
        writes: &mut Writes,
    ) -> Result<(), OpError> {
        if let Some(&event) = events.rules.get(index) {
            self.b.effect(Op::Emit(event), &[])?;
        }
        if let RuleKind::Transition { machine, to, .. } = rule.kind
            && let Some(&now) = writes.machines.get(&machine.0)
        {
            let ty = self.b.ty(now);
            let to = self.b.constant(ty, i64::from(to))?;
            writes.machines.insert(machine.0, to);
        }
        rule.actions.iter().try_for_each(|action| {
            self.from_place(action.span(), rule.call, |s| {
                s.act_once(events, action, writes)
            })
        })
    }

    fn act_once(
        &mut self,
        events: &Events,
        action: &Action,
        writes: &mut Writes,
    ) -> Result<(), OpError> {
        match action {
            Action::Write { cell, value, span } => {
                let value = self.new_value(*cell, *value, Writer::Write(*span))?;
                writes.cells.insert(cell.0, value);
                Ok(())
            }
            Action::Fire { pulse, value, span } => self.fire(*pulse, *value, *span, writes),
            Action::Emit { emission, args, .. } => {
                let bits = &events.bits[emission];
                let mut words = Vec::new();
                for (&arg, &bits) in args.iter().zip(bits) {
                    let real = self.real(arg)?;
                    let kept = self.saturated(
                        real,
                        Scale::plain(exp2(-bits)),
                        Range::new(-0x7fff_ffff, 0x7fff_ffff),
                    )?;
                    words.push(kept.value);
                }
                self.b.effect(Op::Emit(emission.0), &words)
            }
        }
    }

    fn fire(
        &mut self,
        pulse: PulseId,
        level: NodeId,
        span: Span,
        writes: &mut Writes,
    ) -> Result<(), OpError> {
        let p = &self.step.model.pulses[pulse];
        let real = self.real(level)?;
        let (scale, range) = (self.units.scale_of_cell(p.level), self.cell_range(p.level));
        let real = match power_of_two(real.lsb / scale.lsb) {
            Some(_) => real,
            None => self.rescaled(real, scale.lsb)?,
        };
        // Where the present level is the larger one of levels below zero, they need no clamp of
        // their own.
        let is_as_fine = range.low == 0 && real.lsb <= scale.lsb;
        let low = if is_as_fine {
            Type::I32.range().low
        } else {
            range.low
        };
        let kept = self.nearly(real, scale, Range { low, ..range })?;
        self.note_update(p.level, Writer::Fire(span), level, kept);
        let level = kept.value;
        let now = self.cell(p.level)?.value;
        let larger = self.b.op(Op::Max, &[level, now])?;
        // A pulse at rest has the level 0, which is the larger one only of levels below.
        let counts = self.counts(p.level);
        let level = if !counts {
            larger
        } else {
            let (left, zero) = (self.pulse_left(pulse)?, self.constant(0)?);
            let runs = self.b.op(Op::Lt, &[zero, left])?;
            self.b.op(Op::Select, &[runs, larger, level])?
        };
        writes.cells.insert(p.level.0, level);
        let ticks = if counts {
            self.constant(p.ticks.into())?
        } else {
            self.b.op(Op::Tick(p.ticks), &[])?
        };
        writes.pulse_left.insert(pulse.0, ticks);
        Ok(())
    }
}
