//! Instruction emission: a node of the graph, with what it is made of per use, at the end of the
//! block that is filled.

use super::Scheduler;
use crate::graph::{Kind, NodeId};
use crate::tuning;
use rustc_hash::FxHashMap;
use whippen_kernel::{Inst, Op, Range, Region, Value, ValueInfo};

impl Scheduler<'_, '_> {
    /// Puts the node at the end of the block; none if it is made of too much.
    pub(super) fn emit(&mut self, id: NodeId) -> Option<Value> {
        self.depth += 1;
        let value = if self.depth <= tuning::BOOLS_DEEP {
            self.emit_node(id)
        } else {
            None
        };
        self.depth -= 1;
        value
    }

    fn emit_node(&mut self, id: NodeId) -> Option<Value> {
        let args: Vec<NodeId> = self.graph.args(id).to_vec();
        let value = match self.graph.kind(id) {
            Kind::Start => Value(u32::MAX),
            Kind::Result(index) => *self.results.get(&args[0])?.get(index as usize)?,
            Kind::Effect(source) => {
                self.effect(id, source, &args)?;
                Value(u32::MAX)
            }
            Kind::Op(op) => {
                let args = args
                    .iter()
                    .map(|arg| self.value(*arg))
                    .collect::<Option<Vec<Value>>>()?;
                let info = ValueInfo {
                    ty: self.graph.ty(id),
                    range: self.eval.range(id),
                };
                let results: Vec<Value> =
                    op.row().result.iter().map(|_| self.define(info)).collect();
                let value = results.first().copied().unwrap_or(Value(u32::MAX));
                self.push(op, args, results, Vec::new(), self.graph.origin_of(id));
                value
            }
        };
        if self.is_made_per_use(id) {
            self.here.insert(id, value);
        } else {
            self.placed.insert(id, value);
            self.trail.push(id);
        }
        Some(value)
    }

    /// The node's value, made here if it is one of those that are.
    pub(super) fn value(&mut self, id: NodeId) -> Option<Value> {
        let known = self.placed.get(&id).or_else(|| self.here.get(&id)).copied();
        known.or_else(|| {
            let natural = self.eval.range_from_operands(self.graph, id);
            self.eval.set_range(id, natural);
            self.emit(id)
        })
    }

    fn effect(&mut self, id: NodeId, source: u32, args: &[NodeId]) -> Option<()> {
        let source = self.graph.sources[source as usize].clone();
        let mut inside: FxHashMap<Value, Value> = FxHashMap::default();
        for (read, arg) in source.reads.iter().zip(&args[2..]) {
            inside.insert(*read, self.value(*arg)?);
        }
        let mut inst = self.renamed(&source.inst, &mut inside);
        if self.graph.constant(args[0]) != Some(1) {
            inst = self.guarded(inst, args[0])?;
        }
        self.results.insert(id, inst.results.clone());
        self.blocks[self.at].insts.push(inst);
        Some(())
    }

    /// `if` around an instruction; where it is not run its results are the least they may be.
    fn guarded(&mut self, inst: Inst, guard: NodeId) -> Option<Inst> {
        let condition = self.value(guard)?;
        let origin = inst.origin;
        let yields = inst.results.clone();
        let infos: Vec<ValueInfo> = yields.iter().map(|result| self.values[result]).collect();
        let mut other = Region::default();
        for info in &infos {
            let value = self.define(ValueInfo {
                range: Range::point(info.range.low),
                ..*info
            });
            let op = Op::Const(info.range.low);
            other.insts.push(Inst {
                op,
                args: Vec::new(),
                results: vec![value],
                regions: Vec::new(),
                origin,
            });
            other.yields.push(value);
        }
        let results = infos.into_iter().map(|info| self.define(info)).collect();
        let then = Region {
            params: Vec::new(),
            insts: vec![inst],
            yields,
        };
        Some(Inst {
            op: Op::If,
            args: vec![condition],
            results,
            regions: vec![then, other],
            origin,
        })
    }

    /// The instruction with values of this mode.
    fn renamed(&mut self, inst: &Inst, inside: &mut FxHashMap<Value, Value>) -> Inst {
        let mut inst = inst.clone();
        inst.for_each_value_mut(&mut |value| *value = self.rename(*value, inside));
        inst
    }

    fn rename(&mut self, value: Value, inside: &mut FxHashMap<Value, Value>) -> Value {
        if let Some(known) = inside.get(&value) {
            return *known;
        }
        let new = self.define(self.graph.kernel.values[value]);
        inside.insert(value, new);
        new
    }

    fn push(
        &mut self,
        op: Op,
        args: Vec<Value>,
        results: Vec<Value>,
        regions: Vec<Region>,
        origin: Option<u32>,
    ) {
        self.blocks[self.at].insts.push(Inst {
            op,
            args,
            results,
            regions,
            origin,
        });
    }

    fn define(&mut self, info: ValueInfo) -> Value {
        self.values.push(info)
    }
}
