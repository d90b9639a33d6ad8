//! Construction of a tick's graph from its instructions, by symbolic execution of both arms of
//! every `if`.

use super::graph::{EffectSource, Graph, Kind, NodeId, keeps_place};
use rustc_hash::FxHashMap;
use whippen_kernel::{Inst, Kernel, Op, Region, Type, Value};

/// A tick by what it leaves.
#[derive(Debug, Clone)]
pub(super) struct Tick {
    /// What every cell that is not left in memory holds at the end; for the others their number is
    /// of no use.
    pub cells: Vec<Option<NodeId>>,
    /// Words that leave, pushes.
    pub writes: Vec<NodeId>,
    /// The last effect.
    pub last: NodeId,
}

/// Cells that are left in memory: grids, and what loops touch.
pub(super) fn in_memory(kernel: &Kernel, region: &Region) -> Vec<bool> {
    let mut found: Vec<bool> = kernel.cells.iter().map(|cell| cell.len != 1).collect();
    for inst in region.all_insts() {
        match inst.op {
            Op::GetAt(cell) | Op::SetAt(cell) => found[cell as usize] = true,
            Op::Loop(_) => {
                for inner in inst.all_insts() {
                    if let Op::Get(cell) | Op::Set(cell) = inner.op {
                        found[cell as usize] = true;
                    }
                }
            }
            _ => {}
        }
    }
    found
}

/// Adds a region to the graph: `tick`, or `init`.
pub(super) fn read(graph: &mut Graph, region: &Region, in_memory: &[bool]) -> Tick {
    let always = graph.constant_node(Type::I1, 1);
    let last = graph.node(Kind::Start, Type::I1, &[]);
    let mut reader = Reader {
        graph,
        in_memory,
        values: FxHashMap::default(),
        cells: Vec::new(),
        writes: Vec::new(),
        last,
    };
    for (at, cell) in reader.graph.kernel.cells.iter().enumerate() {
        let start = (!in_memory[at]).then(|| {
            reader
                .graph
                .node(Kind::Op(Op::Get(at as u32)), cell.ty, &[])
        });
        reader.cells.push(start);
    }
    reader.region(region, always);
    Tick {
        cells: reader.cells,
        writes: reader.writes,
        last: reader.last,
    }
}

struct Reader<'a, 'k> {
    graph: &'a mut Graph<'k>,
    in_memory: &'a [bool],
    values: FxHashMap<Value, NodeId>,
    cells: Vec<Option<NodeId>>,
    writes: Vec<NodeId>,
    last: NodeId,
}

impl Reader<'_, '_> {
    fn region(&mut self, region: &Region, guard: NodeId) {
        region.insts.iter().for_each(|inst| self.inst(inst, guard));
    }

    fn inst(&mut self, inst: &Inst, guard: NodeId) {
        self.graph.origin = inst.origin;
        match (inst.op, &inst.regions[..]) {
            _ if keeps_place(inst, self.in_memory) => self.effect(inst, guard),
            (Op::If, [then, other]) => self.if_else(inst, then, other, guard),
            (Op::Get(cell), _) => {
                let held = self.cells[cell as usize];
                self.values.extend(inst.results.iter().copied().zip(held));
            }
            (Op::Set(cell), _) => self.cells[cell as usize] = Some(self.value(inst.args[0])),
            (op, _) => {
                let args: Vec<NodeId> = inst.args.iter().map(|arg| self.value(*arg)).collect();
                let ty = inst
                    .results
                    .first()
                    .map_or(Type::I1, |result| self.ty(*result));
                let id = self.graph.node(Kind::Op(op), ty, &args);
                match inst.results.first() {
                    Some(result) => self.values.extend([(*result, id)]),
                    None => self.writes.push(id),
                }
            }
        }
    }

    /// Both arms one after the other; what they leave is chosen.
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region, guard: NodeId) {
        let condition = self.value(inst.args[0]);
        let start = self.cells.clone();
        let inside = self
            .graph
            .node(Kind::Op(Op::And), Type::I1, &[guard, condition]);
        self.region(then, inside);
        let held = std::mem::replace(&mut self.cells, start);
        let not = self.graph.node(Kind::Op(Op::Not), Type::I1, &[condition]);
        let outside = self.graph.node(Kind::Op(Op::And), Type::I1, &[guard, not]);
        self.region(other, outside);
        for (at, held) in held.into_iter().enumerate() {
            self.cells[at] = held
                .zip(self.cells[at])
                .map(|(yes, no)| self.choose(condition, yes, no));
        }
        for (at, result) in inst.results.iter().enumerate() {
            let (yes, no) = (self.value(then.yields[at]), self.value(other.yields[at]));
            let chosen = self.choose(condition, yes, no);
            self.values.insert(*result, chosen);
        }
    }

    fn choose(&mut self, condition: NodeId, yes: NodeId, no: NodeId) -> NodeId {
        let ty = self.graph.ty(yes);
        if yes == no {
            yes
        } else {
            self.graph
                .node(Kind::Op(Op::Select), ty, &[condition, yes, no])
        }
    }

    fn effect(&mut self, inst: &Inst, guard: NodeId) {
        let reads = outside(inst);
        let always = self.graph.constant_node(Type::I1, 1);
        let only_reads = matches!(inst.op, Op::Get(_) | Op::GetAt(_));
        let mut args = vec![if only_reads { always } else { guard }, self.last];
        args.extend(reads.iter().map(|read| self.value(*read)));
        self.graph.sources.push(EffectSource {
            inst: inst.clone(),
            reads,
        });
        let source = self.graph.sources.len() as u32 - 1;
        self.last = self.graph.node(Kind::Effect(source), Type::I1, &args);
        for (index, result) in inst.results.iter().enumerate() {
            let id = self
                .graph
                .node(Kind::Result(index as u32), self.ty(*result), &[self.last]);
            self.values.insert(*result, id);
        }
    }

    fn value(&self, value: Value) -> NodeId {
        self.values[&value]
    }

    fn ty(&self, value: Value) -> Type {
        self.graph.kernel.values[value].ty
    }
}

/// Values that an instruction and its regions read and do not define, each once.
fn outside(inst: &Inst) -> Vec<Value> {
    let (mut reads, mut inner) = (Vec::new(), Vec::new());
    uses(inst, &mut reads, &mut inner);
    let mut found: Vec<Value> = Vec::new();
    for value in reads {
        if !inner.contains(&value) && !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

fn uses(inst: &Inst, reads: &mut Vec<Value>, inner: &mut Vec<Value>) {
    reads.extend(&inst.args);
    for region in &inst.regions {
        inner.extend(&region.params);
        for inst in &region.insts {
            uses(inst, reads, inner);
            inner.extend(&inst.results);
        }
        reads.extend(&region.yields);
    }
}
