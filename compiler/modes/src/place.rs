//! From the trees of decisions to blocks: where each computation stands.
//!
//! ```text
//!            a, b, compare          what every leaf below needs stands as high as its operands allow,
//!           /             \         what only one side needs stands there;
//!      c, set x a        set x b    bools stand where they are asked for, so that a branch follows its comparison
//! ```

mod decide;
mod sink;
mod sorted;

use super::fold::{Fold, Path};
use super::graph::{Graph, NodeId, Kind};
use super::reach::{self, Reached};
use super::tree::{Discrete, Tree};
use super::{Block, End, Mode, merge};
use rustc_hash::{FxHashMap, FxHashSet};
use sorted::{common, union};
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Op, Range, Region, Type, Value, ValueInfo};

/// Blocks of one mode; parts of conditions that are shared are decided once for each use, which
/// could go on for long.
const BLOCKS: usize = 20_000;
/// Bools that are made of bools, at most so deep: going down them needs stack.
const DEPTH: usize = 200;

/// What all modes know of each other.
pub(super) struct Plan<'a> {
    pub discrete: &'a [Discrete],
    pub modes: &'a [Reached],
    /// Which cells a mode knows, by mode.
    pub known: &'a [Vec<bool>],
}

/// A tree with what stands in it.
struct Needs<'a> {
    path: &'a Path,
    /// Needed by every leaf.
    by_all: Vec<NodeId>,
    /// Needed by some leaf.
    by_some: Vec<NodeId>,
    then: Then<'a>,
}

enum Then<'a> {
    Split(NodeId, Box<Needs<'a>>, Box<Needs<'a>>),
    Next(usize),
}

/// The blocks of all modes.
pub(super) fn modes(graph: &mut Graph, plan: &Plan) -> Option<Vec<Mode>> {
    let needs = plan
        .modes
        .iter()
        .enumerate()
        .map(|(at, reached)| needs(graph, plan, at, &reached.tree));
    let needs: Vec<Needs> = needs.collect::<Option<_>>()?;
    let graph = &*graph;
    let placed = parallel::map_with(needs, Fold::default, |fold, needs| {
        blocks(graph, fold, &needs)
    });
    let modes = plan
        .modes
        .iter()
        .zip(plan.known)
        .zip(placed)
        .map(|((reached, known), placed)| {
            let (values, blocks) = placed?;
            let name = name(graph, plan, reached);
            Some(Mode {
                name,
                cells: reached.cells.clone(),
                known: known.clone(),
                values,
                blocks,
            })
        });
    modes.collect()
}

/// The values and blocks of a mode.
fn blocks(graph: &Graph, fold: &mut Fold, needs: &Needs) -> Option<(IdMap<Value, ValueInfo>, Vec<Block>)> {
    let mut placer = Placer {
        graph,
        fold,
        values: IdMap::new(),
        blocks: vec![open_block()],
        at: 0,
        placed: FxHashMap::default(),
        here: FxHashMap::default(),
        results: FxHashMap::default(),
        trail: Vec::new(),
        depth: 0,
    };
    let placed = placer.place(needs, 0);
    let Placer {
        values,
        blocks,
        fold,
        ..
    } = placer;
    fold.back(0);
    placed?;
    let blocks = in_order(merge::equal_tails(in_order(blocks), &values));
    Some((values, blocks))
}

fn name(graph: &Graph, plan: &Plan, reached: &Reached) -> String {
    let word = |(discrete, class): (&Discrete, &usize)| {
        let name = &graph.kernel.cells[discrete.cell].name;
        let Range { low, high } = discrete.classes[*class];
        if low == high {
            format!("{name}={low}")
        } else {
            format!("{name}={low}..{high}")
        }
    };
    let words: Vec<String> = plan
        .discrete
        .iter()
        .zip(&reached.classes)
        .map(word)
        .collect();
    if words.is_empty() {
        "any".to_string()
    } else {
        words.join(" ")
    }
}

fn needs<'a>(graph: &mut Graph, plan: &Plan, at: usize, tree: &'a Tree) -> Option<Needs<'a>> {
    match tree {
        Tree::Leaf { path, tick, ranges } => {
            let classes = reach::classes(plan.discrete, ranges)?;
            let next = plan.modes.iter().position(|mode| mode.classes == classes)?;
            let mut roots: Vec<NodeId> = tick
                .writes
                .iter()
                .copied()
                .chain(std::iter::once(tick.last))
                .collect();
            for (cell, end) in tick
                .cells
                .iter()
                .enumerate()
                .filter_map(|(cell, end)| Some((cell, (*end)?)))
            {
                let unchanged =
                    graph.op(end) == Some(Op::Get(cell as u32)) && !plan.known[at][cell];
                if !plan.known[next][cell] && !unchanged {
                    roots.push(graph.node(Kind::Op(Op::Set(cell as u32)), Type::I1, &[end]));
                }
            }
            let all = graph.reachable(&roots);
            Some(Needs {
                path,
                by_all: all.clone(),
                by_some: all,
                then: Then::Next(next),
            })
        }
        Tree::Split {
            path,
            condition,
            yes,
            no,
        } => {
            let (yes, no) = (needs(graph, plan, at, yes)?, needs(graph, plan, at, no)?);
            let decided = graph.reachable(&[*condition]);
            let by_all = union(&common(&yes.by_all, &no.by_all), &decided);
            let by_some = union(&union(&yes.by_some, &no.by_some), &decided);
            Some(Needs {
                path,
                by_all,
                by_some,
                then: Then::Split(*condition, Box::new(yes), Box::new(no)),
            })
        }
    }
}

/// Every block before those it names.
fn in_order(mut blocks: Vec<Block>) -> Vec<Block> {
    let (mut order, mut seen) = (Vec::new(), vec![false; blocks.len()]);
    // A block is done once all that it names are.
    let mut open = vec![(0, false)];
    while let Some((block, done)) = open.pop() {
        if done {
            order.push(block);
        } else if !std::mem::replace(&mut seen[block], true) {
            open.push((block, true));
            open.extend(
                blocks[block]
                    .end
                    .targets()
                    .map(|target| (target.block, false)),
            );
        }
    }
    order.reverse();
    let mut place = vec![0; blocks.len()];
    order
        .iter()
        .enumerate()
        .for_each(|(at, block)| place[*block] = at);
    let moved = |block: &usize| {
        let mut block = std::mem::replace(&mut blocks[*block], open_block());
        block
            .end
            .targets_mut()
            .for_each(|target| target.block = place[target.block]);
        block
    };
    order.iter().map(moved).collect()
}

fn open_block() -> Block {
    Block {
        params: Vec::new(),
        insts: Vec::new(),
        end: End::Next(0),
    }
}

struct Placer<'a, 'k> {
    graph: &'a Graph<'k>,
    fold: &'a mut Fold,
    values: IdMap<Value, ValueInfo>,
    blocks: Vec<Block>,
    /// The block that is filled.
    at: usize,
    /// Nodes that stand in this block or above.
    placed: FxHashMap<NodeId, Value>,
    /// Constants and bools in this block.
    here: FxHashMap<NodeId, Value>,
    /// Results of effects.
    results: FxHashMap<NodeId, Vec<Value>>,
    /// What was placed, in order.
    trail: Vec<NodeId>,
    /// How deep in bools this is.
    depth: usize,
}

impl Placer<'_, '_> {
    fn place(&mut self, needs: &Needs, block: usize) -> Option<()> {
        let above = self.trail.len();
        self.go_to(block);
        for id in &needs.by_all {
            let natural = self.fold.natural(self.graph, *id);
            let fact = needs.path.facts.get(id).copied().unwrap_or(natural);
            self.fold.put(*id, super::facts::meet(natural, fact));
        }
        match &needs.then {
            Then::Next(_) => self.stand_all(&needs.by_all)?,
            Then::Split(condition, ..) => {
                let may_stand = self.may_stand(needs);
                let stay = sink::stay(self, needs, *condition, may_stand);
                self.stand_all(&stay)?;
            }
        }
        match &needs.then {
            Then::Next(next) => self.blocks[block].end = End::Next(*next),
            Then::Split(condition, yes, no) => {
                let ends = self.branch(*condition)?;
                self.place(yes, ends.0)?;
                self.place(no, ends.1)?;
            }
        }
        for id in self.trail.split_off(above) {
            self.placed.remove(&id);
        }
        Some(())
    }

    fn go_to(&mut self, block: usize) {
        self.at = block;
        self.here.clear();
    }

    /// Puts all that does not stand yet into the block. What is overwritten at the end is read
    /// before.
    fn stand_all(&mut self, all: &[NodeId]) -> Option<()> {
        for writes in [false, true] {
            for id in all {
                let free = !self.placed.contains_key(id)
                    && !self.on_demand(*id)
                    && self.is_write(*id) == writes;
                if free {
                    self.stand(*id)?;
                }
            }
        }
        Some(())
    }

    /// What may stand here, above decisions that are still to come.
    fn may_stand(&self, needs: &Needs) -> Vec<NodeId> {
        let (mut all, mut there) = (Vec::new(), FxHashSet::default());
        for writes in [false, true] {
            for id in needs
                .by_all
                .iter()
                .filter(|id| !self.placed.contains_key(id))
            {
                let is_ready = self
                    .graph
                    .args(*id)
                    .iter()
                    .all(|arg| self.placed.contains_key(arg) || there.contains(arg));
                if self.on_demand(*id) {
                    if is_ready {
                        there.insert(*id);
                    }
                } else if self.is_write(*id) == writes
                    && is_ready
                    && self.is_allowed(needs, *id, &there)
                {
                    there.insert(*id);
                    all.push(*id);
                }
            }
        }
        all
    }

    /// Whether it does the same here as below.
    fn is_allowed(&self, needs: &Needs, id: NodeId, there: &FxHashSet<NodeId>) -> bool {
        if self.fold.proven(self.graph, id).is_none() {
            return false;
        }
        let later = |reads: &dyn Fn(Op) -> bool| {
            let open = |id: &NodeId| !self.placed.contains_key(id) && !there.contains(id);
            needs
                .by_some
                .iter()
                .any(|id| open(id) && self.graph.asks(*id, reads))
        };
        match self.graph.kind(id) {
            Kind::Op(Op::Set(cell)) => !later(&|op| op == Op::Get(cell)),
            Kind::Op(Op::Push(line)) => !later(&|op| matches!(op, Op::Delay(l, _) if l == line)),
            Kind::Effect(_) => self.graph.constant(self.graph.args(id)[0]) == Some(1),
            _ => true,
        }
    }

    fn is_write(&self, id: NodeId) -> bool {
        self.graph
            .op(id)
            .is_some_and(|op| op.row().result.is_none())
    }

    fn on_demand(&self, id: NodeId) -> bool {
        match self.graph.op(id) {
            Some(Op::Const(_)) => true,
            Some(op) => {
                matches!(op.row().meaning, whippen_kernel::op::Meaning::Exact(_))
                    && self.graph.ty(id) == Type::I1
            }
            None => false,
        }
    }

    /// Puts the node at the end of the block; none if it is made of too much.
    fn stand(&mut self, id: NodeId) -> Option<Value> {
        self.depth += 1;
        let value = if self.depth <= DEPTH {
            self.stand_here(id)
        } else {
            None
        };
        self.depth -= 1;
        value
    }

    fn stand_here(&mut self, id: NodeId) -> Option<Value> {
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
                    range: self.fold.range(id),
                };
                let results: Vec<Value> =
                    op.row().result.iter().map(|_| self.define(info)).collect();
                let value = results.first().copied().unwrap_or(Value(u32::MAX));
                self.push(op, args, results, Vec::new(), self.graph.origin_of(id));
                value
            }
        };
        if self.on_demand(id) {
            self.here.insert(id, value);
        } else {
            self.placed.insert(id, value);
            self.trail.push(id);
        }
        Some(value)
    }

    /// The node's value, made here if it is one of those that are.
    fn value(&mut self, id: NodeId) -> Option<Value> {
        let known = self.placed.get(&id).or_else(|| self.here.get(&id)).copied();
        known.or_else(|| {
            let natural = self.fold.natural(self.graph, id);
            self.fold.put(id, natural);
            self.stand(id)
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
        let (origin, yields) = (inst.origin, inst.results.clone());
        let infos: Vec<ValueInfo> = yields
            .iter()
            .map(|result| self.values[result])
            .collect();
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
