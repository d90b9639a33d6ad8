//! What depends on live values, the tick's number and constants alone is the same for all keys: it
//! is computed once a tick, at its entry.
//!
//! ```text
//!   mode:   v9 = add (live 0) 4;  v10 = div_round 1 v9;  .. v10 ..      entry of the tick:  live 3 = div_round 1 (add (live 0) 4)
//!      ->   v10 = live 3;  .. v10 ..
//! ```
//!
//! Such a value becomes one more live value, which nobody outside can see. What costs no more than
//! to load it (a shift that becomes an operand, a comparison) stays where it is.

use super::beyond_doubt;
use super::select::plan::indices::{index_of, parts_of_index};
use std::borrow::Cow;
use std::collections::HashMap;
use whippen_ids::IdMap;
use whippen_kernel::op::Meaning;
use whippen_kernel::{Effect, Inst, Kernel, Op, Range, Type, Value, ValueInfo, sweep_insts};
use whippen_modes::{End, Mode, Modes};
use whippen_target_info::{AtEntry, row};

/// What is computed once a tick.
#[derive(Debug, Default)]
pub(super) struct TickInvariants {
    pub values: IdMap<Value, ValueInfo>,
    pub insts: Vec<Inst>,
    /// The live values that are added, in order.
    pub results: Vec<Value>,
    known: HashMap<(Op, Vec<Value>, Type, Range), Value>,
}

/// What the entry of a tick computes for all keys, as [`TickAbi::shares`](super::TickAbi) says.
#[derive(Debug, Clone, Default)]
pub struct SharedValues {
    /// Its values.
    pub values: IdMap<Value, ValueInfo>,
    /// How they are computed.
    pub insts: Vec<Inst>,
    /// What is stored, in the order of the live values that are added.
    pub results: Vec<Value>,
}

/// What the entry of a tick computes for all keys of these modes.
pub fn shared_values(modes: &Modes) -> SharedValues {
    let (_, shared) = hoist_invariants(modes);
    SharedValues {
        values: shared.values,
        insts: shared.insts,
        results: shared.results,
    }
}

/// Modes that read what is shared, and how it is computed.
pub(super) fn hoist_invariants(modes: &Modes) -> (Cow<'_, Modes>, TickInvariants) {
    let mut shared = TickInvariants::default();
    let found: Vec<Vec<Value>> = modes
        .modes
        .iter()
        .map(|mode| InvariantScan::new(mode).roots())
        .collect();
    if found.iter().all(Vec::is_empty) {
        return (Cow::Borrowed(modes), shared);
    }
    let mut modes = modes.clone();
    for (mode, roots) in modes.modes.iter_mut().zip(&found) {
        shared.replace(&modes.kernel, mode, roots);
    }
    (Cow::Owned(modes), shared)
}

/// Whether it reads what all keys share in a tick.
fn is_per_tick(op: Op) -> bool {
    op.row().effect == Effect::PerTick
}

/// The instruction that makes each value.
type Makers<'a> = IdMap<Value, Option<&'a Inst>>;

/// Which values of a mode depend on live values alone.
struct InvariantScan<'m> {
    mode: &'m Mode,
    /// By value: what makes it, if it depends on nothing but live values and constants.
    made: Makers<'m>,
    /// Whether a live value, and something costly, is part of it.
    depends_on_param: IdMap<Value, bool>,
    costly: IdMap<Value, bool>,
    /// Whether somebody needs it who depends on more.
    needed: IdMap<Value, bool>,
}

impl<'m> InvariantScan<'m> {
    fn new(mode: &'m Mode) -> InvariantScan<'m> {
        let no = IdMap::filled(false, mode.values.len());
        InvariantScan {
            mode,
            made: IdMap::filled(None, mode.values.len()),
            depends_on_param: no.clone(),
            costly: no.clone(),
            needed: no,
        }
    }

    /// Those that are to be shared, in the order in which they are made.
    fn roots(mut self) -> Vec<Value> {
        let mode = self.mode;
        let mut order = Vec::new();
        for block in &mode.blocks {
            for inst in &block.insts {
                if self.is_alone(inst) {
                    self.define(inst);
                    order.push(inst.results[0]);
                } else {
                    self.need_all(inst);
                }
            }
            if let End::Branch { condition, .. } = &block.end {
                self.need(*condition);
            }
            block
                .end
                .targets()
                .flat_map(|target| &target.args)
                .for_each(|value| self.need(*value));
        }
        // What is not shared itself is computed where it stands, so what it is made of is needed
        // there.
        let mut roots = Vec::new();
        for value in order.into_iter().rev() {
            if !self.needed[value] {
                continue;
            }
            let is_word = mode.values[value].ty == Type::I32;
            if is_word && self.depends_on_param[value] && self.costly[value] {
                roots.push(value);
            } else if let Some(inst) = self.made[value] {
                inst.args.iter().for_each(|arg| self.need(*arg));
            }
        }
        roots.reverse();
        roots
    }

    fn is_alone(&self, inst: &Inst) -> bool {
        let computes = matches!(inst.op.row().meaning, Meaning::Exact(_));
        (computes || is_per_tick(inst.op))
            && inst.regions.is_empty()
            && inst.args.iter().all(|arg| self.made[arg].is_some())
    }

    fn define(&mut self, inst: &'m Inst) {
        let any = |of: &IdMap<Value, bool>| inst.args.iter().any(|arg| of[arg]);
        let depends_on_param = any(&self.depends_on_param);
        let costly = any(&self.costly);
        let result = inst.results[0];
        let is_hoisted = row(inst.op).at_entry == AtEntry::Hoisted;
        self.depends_on_param[result] = depends_on_param || is_per_tick(inst.op);
        self.costly[result] = costly || is_hoisted;
        self.made[result] = Some(inst);
    }

    fn constant(&self, value: Value) -> Option<i64> {
        let Range { low, high } = self.mode.values[value].range;
        (low == high).then_some(low)
    }

    fn need(&mut self, value: Value) {
        self.needed[value] = true;
    }

    fn need_all(&mut self, inst: &Inst) {
        let index = index_of(inst);
        for arg in &inst.args {
            // An index and a constant make one address, which several accesses share.
            let parts = self.made[arg].filter(|_| Some(*arg) == index);
            let parts = parts.and_then(|made| parts_of_index(made, |value| self.constant(value)));
            self.need(parts.map_or(*arg, |(value, _)| value));
        }
        for region in &inst.regions {
            region.insts.iter().for_each(|inner| self.need_all(inner));
            region.yields.iter().for_each(|value| self.need(*value));
        }
    }
}

impl TickInvariants {
    /// Where the live values lie that are added, even if promises are wrong.
    pub fn ranges(&self, kernel: &Kernel) -> Vec<Range> {
        let proven = beyond_doubt::intervals(kernel, &self.values, &[&self.insts], &[]);
        self.results.iter().map(|result| proven[result]).collect()
    }

    /// Has the mode load these values.
    fn replace(&mut self, kernel: &Kernel, mode: &mut Mode, roots: &[Value]) {
        let mut made: Makers = IdMap::filled(None, mode.values.len());
        for inst in mode.blocks.iter().flat_map(|block| &block.insts) {
            inst.results
                .iter()
                .for_each(|result| made[result] = Some(inst));
        }
        let lives: HashMap<Value, Op> = roots
            .iter()
            .map(|root| (*root, self.live(kernel, mode, &made, *root)))
            .collect();
        for inst in mode.blocks.iter_mut().flat_map(|block| &mut block.insts) {
            if let Some(op) = inst.results.first().and_then(|result| lives.get(result)) {
                (inst.op, inst.args) = (*op, Vec::new());
            }
        }
        remove_unused(mode);
    }

    /// The live value that holds this.
    fn live(&mut self, kernel: &Kernel, mode: &Mode, made: &Makers, root: Value) -> Op {
        let value = self.copy(mode, made, root);
        let place = self
            .results
            .iter()
            .position(|result| *result == value)
            .unwrap_or_else(|| {
                self.results.push(value);
                self.results.len() - 1
            });
        Op::Live((kernel.lives.len() + place) as u32)
    }

    fn copy(&mut self, mode: &Mode, made: &Makers, value: Value) -> Value {
        let info = mode.values[value];
        let Some(inst) = made[value] else {
            return value;
        };
        let args: Vec<Value> = inst
            .args
            .iter()
            .map(|arg| self.copy(mode, made, *arg))
            .collect();
        let key = (inst.op, args.clone(), info.ty, info.range);
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let result = self.values.push(info);
        self.insts.push(Inst {
            results: vec![result],
            args,
            ..inst.clone()
        });
        self.known.insert(key, result);
        result
    }
}

/// Leaves out what nobody uses any more.
fn remove_unused(mode: &mut Mode) {
    let mut needed = IdMap::filled(false, mode.values.len());
    // What a block uses is made in it or in a block before.
    for block in mode.blocks.iter_mut().rev() {
        if let End::Branch { condition, .. } = &block.end {
            needed[condition] = true;
        }
        block
            .end
            .targets()
            .flat_map(|target| &target.args)
            .for_each(|value| needed[value] = true);
        sweep_insts(&mut block.insts, &mut needed);
    }
}
