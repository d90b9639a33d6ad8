//! Value graph by hash consing: a tick with every computation once, memory read at the start and
//! written at the end.
//!
//! ```text
//!   v4 = get c                       Get c ------+
//!   if b { set c v3  emit e v4 }  =>  Select b v3 *  = what c holds at the end
//!   v5 = get c                       Emit e (guard b, after what came before, v4)
//! ```
//!
//! Nodes are numbered in an order in which operands come first, and equal nodes are one. So a tick
//! is a handful of roots (what its cells hold at the end, words that leave it, the last of its
//! effects), code that nobody needs is not reachable from them, and two ways of going on are equal
//! where their roots are.
//!
//! Effects (events, grids, loops) keep their order: each depends on the one before. A cell that a
//! loop touches, or that has several words, is left in memory and its reads and writes are effects.

use super::cost;
use rustc_hash::FxHashMap;
use whippen_ids::{Id, IdMap, impl_id};
use whippen_kernel::{Inst, Kernel, Op, Range, Type, Value, ValueInfo};

/// A node of a [`Graph`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct NodeId(pub u32);

impl_id!(NodeId);

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    /// Before all effects.
    Start,
    /// A pure operator, a read of what memory held at the start, or a write at the end (`set`,
    /// `out`, `push`).
    Op(Op),
    /// An effect of the kernel by number; operands are the guard, the effect before, and what it
    /// reads.
    Effect(u32),
    /// A result of the effect that is its operand.
    Result(u32),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Node {
    kind: Kind,
    ty: Type,
    /// Where its operands stand.
    operands: Operands,
}

/// Up to three operands here, more in a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Operands {
    Few(u8, [NodeId; 3]),
    List(u32),
}

/// An instruction that is an effect, and the values from outside that it reads.
#[derive(Debug, Clone)]
pub(super) struct EffectSource {
    pub inst: Inst,
    pub reads: Vec<Value>,
}

/// All nodes.
#[derive(Debug, Clone)]
pub(super) struct Graph<'k> {
    pub kernel: &'k Kernel,
    pub sources: Vec<EffectSource>,
    nodes: IdMap<NodeId, Node>,
    origins: IdMap<NodeId, Option<u32>>,
    cycles: IdMap<NodeId, u32>,
    /// Nodes by what they are; none where each is to be new.
    known: Option<FxHashMap<Node, NodeId>>,
    lists: Vec<Vec<NodeId>>,
    known_lists: FxHashMap<Vec<NodeId>, u32>,
    /// Nodes made from here on stem from this place.
    pub origin: Option<u32>,
}

impl<'k> Graph<'k> {
    pub fn new(kernel: &'k Kernel) -> Graph<'k> {
        Graph {
            kernel,
            sources: Vec::new(),
            nodes: IdMap::new(),
            origins: IdMap::new(),
            cycles: IdMap::new(),
            known: Some(FxHashMap::default()),
            lists: Vec::new(),
            known_lists: FxHashMap::default(),
            origin: None,
        }
    }

    /// A graph where every node is new, equal to another or not.
    pub fn unshared(kernel: &'k Kernel) -> Graph<'k> {
        Graph {
            known: None,
            ..Graph::new(kernel)
        }
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    pub fn kind(&self, id: NodeId) -> Kind {
        self.nodes[id].kind
    }

    /// The operator, of a node that is one.
    pub fn op(&self, id: NodeId) -> Option<Op> {
        match self.kind(id) {
            Kind::Op(op) => Some(op),
            _ => None,
        }
    }

    pub fn ty(&self, id: NodeId) -> Type {
        self.nodes[id].ty
    }

    pub fn origin_of(&self, id: NodeId) -> Option<u32> {
        self.origins[id]
    }

    /// What it costs, roughly.
    pub fn cycles(&self, id: NodeId) -> u32 {
        self.cycles[id]
    }

    pub fn args(&self, id: NodeId) -> &[NodeId] {
        match &self.nodes[id].operands {
            Operands::Few(count, args) => &args[..usize::from(*count)],
            Operands::List(list) => &self.lists[*list as usize],
        }
    }

    /// The value of a constant.
    pub fn constant(&self, id: NodeId) -> Option<i64> {
        match self.kind(id) {
            Kind::Op(Op::Const(value)) => Some(value),
            _ => None,
        }
    }

    /// Whether it stands for something done, not for a value.
    pub fn has_no_value(&self, id: NodeId) -> bool {
        match self.kind(id) {
            Kind::Start | Kind::Effect(_) => true,
            Kind::Op(op) => op.row().result.is_none(),
            Kind::Result(_) => false,
        }
    }

    /// Whether it is such an operator, or an effect with one inside.
    pub fn contains_op(&self, id: NodeId, such: &dyn Fn(Op) -> bool) -> bool {
        match self.kind(id) {
            Kind::Op(op) => such(op),
            Kind::Effect(source) => {
                let mut inside = self.sources[source as usize].inst.all_insts();
                inside.any(|inst| such(inst.op))
            }
            Kind::Start | Kind::Result(_) => false,
        }
    }

    /// The node, new or known.
    pub fn node(&mut self, kind: Kind, ty: Type, args: &[NodeId]) -> NodeId {
        let operands = self.operands(args);
        let node = Node { kind, ty, operands };
        let fresh = self.nodes.next_id();
        let id = self
            .known
            .as_mut()
            .map_or(fresh, |known| *known.entry(node).or_insert(fresh));
        if id == fresh {
            self.nodes.push(node);
            self.origins.push(self.origin);
            self.cycles.push(cost::of_node(self, id));
        }
        id
    }

    pub fn constant_node(&mut self, ty: Type, value: i64) -> NodeId {
        self.node(Kind::Op(Op::Const(value)), ty, &[])
    }

    /// What is known of a result of an effect.
    pub fn result_info(&self, effect: NodeId, index: u32) -> Option<ValueInfo> {
        let Kind::Effect(source) = self.kind(effect) else {
            return None;
        };
        let result = self.sources[source as usize]
            .inst
            .results
            .get(index as usize)?;
        Some(self.kernel.values[result])
    }

    /// Where a pure operator lies for such ranges of its operands; none if the table cannot tell,
    /// because the result might not fit its type.
    pub fn op_range(&self, id: NodeId, op: Op, operands: [Range; 3]) -> Option<Range> {
        let args = self.args(id);
        let mut infos = [ValueInfo {
            ty: Type::I1,
            range: Type::I1.range(),
        }; 3];
        for (at, arg) in args.iter().enumerate().take(3) {
            infos[at] = ValueInfo {
                ty: self.ty(*arg),
                range: operands[at],
            };
        }
        let info = infos
            .get(..args.len())
            .and_then(|infos| op.apply(self.kernel, infos).ok());
        info.map(|info| info.map_or(self.ty(id).range(), |info| info.range))
    }

    /// All that the roots need and the roots, operands first.
    pub fn reachable(&self, roots: &[NodeId]) -> Vec<NodeId> {
        Walk::default().over(self, roots.iter().copied())
    }

    fn operands(&mut self, args: &[NodeId]) -> Operands {
        if let Some(few) = args.len().checked_sub(4).is_none().then_some(args) {
            let mut all = [NodeId(0); 3];
            all[..few.len()].copy_from_slice(few);
            return Operands::Few(few.len() as u8, all);
        }
        let fresh = self.lists.len() as u32;
        let list = *self.known_lists.entry(args.to_vec()).or_insert(fresh);
        if list == fresh {
            self.lists.push(args.to_vec());
        }
        Operands::List(list)
    }
}

/// Which nodes a walk came by: a bit for each, and a bit for each word of those, so that few among
/// many are found in order. It can be used again, at the cost of what it comes by.
#[derive(Debug, Default)]
pub(super) struct Walk {
    seen: Vec<u64>,
    words: Vec<u64>,
    count: usize,
    open: Vec<NodeId>,
}

impl Walk {
    /// All that the roots need and the roots, operands first.
    pub fn over(&mut self, graph: &Graph, roots: impl Iterator<Item = NodeId>) -> Vec<NodeId> {
        let words = graph.len().div_ceil(64);
        if self.seen.len() < words {
            self.seen.resize(words, 0);
            self.words.resize(words.div_ceil(64), 0);
        }
        roots.for_each(|root| self.come_by(root));
        while let Some(id) = self.open.pop() {
            graph.args(id).iter().for_each(|arg| self.come_by(*arg));
        }
        self.taken()
    }

    fn come_by(&mut self, id: NodeId) {
        let (word, bit) = (id.index() / 64, 1 << (id.index() % 64));
        if self.seen[word] & bit == 0 {
            self.seen[word] |= bit;
            self.words[word / 64] |= 1 << (word % 64);
            self.count += 1;
            self.open.push(id);
        }
    }

    /// The nodes it came by, in their order; they are forgotten.
    fn taken(&mut self) -> Vec<NodeId> {
        let mut all = Vec::with_capacity(std::mem::take(&mut self.count));
        for (at, words) in self.words.iter_mut().enumerate() {
            for word in ones(std::mem::take(words)) {
                let word = 64 * at + word;
                all.extend(
                    ones(std::mem::take(&mut self.seen[word]))
                        .map(|bit| NodeId((64 * word + bit) as u32)),
                );
            }
        }
        all
    }
}

/// The places of the bits that are set, in order.
fn ones(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (at < 64).then_some(at)
    })
}

/// Whether it is an effect that keeps its place among the others, given which cells are left in
/// memory.
pub(super) fn keeps_place(inst: &Inst, in_memory: &[bool]) -> bool {
    match inst.op {
        Op::Get(cell) | Op::Set(cell) => in_memory[cell as usize],
        Op::Delay(..) | Op::DelayAt(_) | Op::Out(_) | Op::Push(_) | Op::If => false,
        op => !op.row().effect.is_pure(),
    }
}
