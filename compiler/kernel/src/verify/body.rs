//! Verification of regions and instructions.

use super::{DEPTH_MAX, VerifyError, WORK_MAX};
use crate::op::Effect;
use crate::{Inst, Kernel, Op, Range, Region, Type, Value, ValueInfo};
use std::collections::HashSet;
use whippen_ids::IdMap;

/// Checks `init` and `tick`.
pub(super) fn check(kernel: &Kernel, errors: &mut Vec<VerifyError>) {
    let count = kernel.values.len();
    let mut body = Body {
        kernel,
        errors,
        visible: IdMap::filled(false, count),
        defined: IdMap::filled(false, count),
        trail: Vec::new(),
        written: HashSet::new(),
        depth: 0,
        tick: false,
    };
    body.outermost("init", &kernel.init);
    body.tick = true;
    body.outermost("tick", &kernel.tick);
    for (index, output) in kernel.outputs.iter().enumerate() {
        if !body.written.contains(&Op::Out(index as u32)) {
            body.fail(&format!("out {}", output.name), "is never written");
        }
    }
}

/// What is wrong with one instruction.
type Fault = String;

struct Body<'a> {
    kernel: &'a Kernel,
    errors: &'a mut Vec<VerifyError>,
    /// Values that are defined on every way to here.
    visible: IdMap<Value, bool>,
    /// Values that are defined anywhere above in the text.
    defined: IdMap<Value, bool>,
    /// The visible ones in order.
    trail: Vec<Value>,
    /// Lines pushed and outputs written above.
    written: HashSet<Op>,
    /// How many regions are open.
    depth: usize,
    tick: bool,
}

impl Body<'_> {
    fn outermost(&mut self, word: &str, region: &Region) {
        if !region.params.is_empty() || !region.yields.is_empty() {
            self.fail(word, "has no parameters and yields nothing");
        }
        let work = self.region(word, region);
        if work > WORK_MAX {
            self.fail(
                word,
                format!("runs through {work} instructions, more than {WORK_MAX}"),
            );
        }
    }

    /// Checks a region; what it defines is out of sight at its end. Gives how many instructions it
    /// runs through.
    fn region(&mut self, place: &str, region: &Region) -> u64 {
        if self.depth == DEPTH_MAX {
            self.fail(place, format!("regions nest deeper than {DEPTH_MAX}"));
            return 0;
        }
        self.depth += 1;
        let outside = self.trail.len();
        region
            .params
            .iter()
            .for_each(|param| self.define(place, *param));
        let work = region
            .insts
            .iter()
            .fold(0_u64, |work, inst| work.saturating_add(self.inst(inst)));
        self.uses("yield", &region.yields);
        for value in self.trail.drain(outside..) {
            self.visible[value] = false;
        }
        self.depth -= 1;
        work
    }

    fn inst(&mut self, inst: &Inst) -> u64 {
        let place = self.kernel.headline(inst);
        self.uses(&place, &inst.args);
        let inner = match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => self.region(&place, then).max(self.region(&place, other)),
            (Op::Loop(rounds), [body]) => self.region(&place, body).saturating_mul(rounds.into()),
            _ => 0,
        };
        if let Err(fault) = self.placed(inst.op).and_then(|()| self.typed(inst)) {
            self.fail(&place, fault);
        }
        inst.results
            .iter()
            .for_each(|result| self.define(&place, *result));
        inner.saturating_add(1)
    }

    /// Whether the operator may stand here.
    fn placed(&mut self, op: Op) -> Result<(), Fault> {
        let (allowed, rule) = match op.row().effect {
            Effect::Pure | Effect::PerTick | Effect::PerKey => (true, ""),
            Effect::Reads | Effect::Writes | Effect::Control => (true, ""),
            Effect::WritesInTick => (self.tick, "stands in `tick` only"),
            Effect::WritesInInit => (!self.tick, "stands in `init` only"),
            Effect::WritesOnce if !self.tick || self.depth > 1 => {
                (false, "stands in `tick` only, outside `if` and `loop`")
            }
            Effect::WritesOnce => (self.written.insert(op), "stands once only"),
        };
        if !allowed {
            return Err(rule.to_string());
        }
        match op {
            Op::Delay(line, _) | Op::DelayAt(line) if self.written.contains(&Op::Push(line)) => {
                Err("stands after the push".to_string())
            }
            _ => Ok(()),
        }
    }

    fn typed(&self, inst: &Inst) -> Result<(), Fault> {
        match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => self.if_else(inst, then, other),
            (Op::Loop(rounds), [body]) => self.repeat(inst, rounds, body),
            (Op::If | Op::Loop(_), _) => Err(format!("{} regions", inst.regions.len())),
            (_, []) => self.plain(inst),
            _ => Err("owns regions".to_string()),
        }
    }

    fn plain(&self, inst: &Inst) -> Result<(), Fault> {
        let expected = match (inst.op, &inst.results[..], &inst.args[..]) {
            (Op::Const(value), [result], []) => {
                Op::constant(self.info(*result)?.ty, value).map(Some)
            }
            _ => inst.op.apply(self.kernel, &self.infos(&inst.args)?),
        };
        let expected: Vec<ValueInfo> = expected
            .map_err(|error| error.to_string())?
            .into_iter()
            .collect();
        self.results(inst, &expected)
    }

    fn if_else(&self, inst: &Inst, then: &Region, other: &Region) -> Result<(), Fault> {
        let condition: Vec<Type> = self.infos(&inst.args)?.iter().map(|info| info.ty).collect();
        if condition != [Type::I1] {
            return Err("takes one i1".to_string());
        }
        if !then.params.is_empty() || !other.params.is_empty() {
            return Err("its regions have no parameters".to_string());
        }
        self.results(inst, &self.infos(&then.yields)?)?;
        self.results(inst, &self.infos(&other.yields)?)
    }

    fn repeat(&self, inst: &Inst, rounds: u32, body: &Region) -> Result<(), Fault> {
        let params = self.infos(&body.params)?;
        let Some((index, carried)) = params.split_first() else {
            return Err("its region has no parameters".to_string());
        };
        let expected = Range::new(0, i64::from(rounds) - 1);
        if expected.is_empty() || index.ty != Type::I32 || !index.range.contains(expected) {
            return Err(format!("the round is an i32 in {expected}"));
        }
        hold("carried values", carried, &self.infos(&inst.args)?)?;
        let yields = self.infos(&body.yields)?;
        hold("carried values", carried, &yields)?;
        self.results(inst, &yields)
    }

    /// The results have room for what is computed.
    fn results(&self, inst: &Inst, expected: &[ValueInfo]) -> Result<(), Fault> {
        hold("results", &self.infos(&inst.results)?, expected)
    }

    fn uses(&mut self, place: &str, values: &[Value]) {
        for value in values {
            if self.visible.get(*value) != Some(&true) {
                self.fail(place, format!("{value} is not defined on the way here"));
            }
        }
    }

    fn define(&mut self, place: &str, value: Value) {
        let Some(info) = self.kernel.values.get(value) else {
            return self.fail(place, format!("nothing is known of {value}"));
        };
        if std::mem::replace(&mut self.defined[value], true) {
            self.fail(place, format!("{value} is defined twice"));
        }
        if info.range.is_empty() || !info.ty.range().contains(info.range) {
            self.fail(
                place,
                format!("{} is no range of {value}, an {}", info.range, info.ty),
            );
        }
        self.visible[value] = true;
        self.trail.push(value);
    }

    fn info(&self, value: Value) -> Result<ValueInfo, Fault> {
        let info = self.kernel.values.get(value);
        info.copied()
            .ok_or_else(|| format!("nothing is known of {value}"))
    }

    fn infos(&self, values: &[Value]) -> Result<Vec<ValueInfo>, Fault> {
        values.iter().map(|value| self.info(*value)).collect()
    }

    fn fail(&mut self, place: &str, message: impl Into<String>) {
        self.errors.push(VerifyError {
            place: place.to_string(),
            message: message.into(),
        });
    }
}

/// Whether values of these types and ranges can hold what is computed.
fn hold(what: &str, declared: &[ValueInfo], computed: &[ValueInfo]) -> Result<(), Fault> {
    if declared.len() != computed.len() {
        return Err(format!(
            "{} {what}, where it gives {}",
            declared.len(),
            computed.len()
        ));
    }
    for (declared, computed) in declared.iter().zip(computed) {
        if declared.ty != computed.ty {
            return Err(format!(
                "{what}: an {} is declared {}",
                computed.ty, declared.ty
            ));
        }
        if !declared.range.contains(computed.range) {
            return Err(format!(
                "{what}: {} is declared {}",
                computed.range, declared.range
            ));
        }
    }
    Ok(())
}
