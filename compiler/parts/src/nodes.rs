//! The tick as nodes of a dependence graph: its outermost instructions, what each needs, and which
//! memory it touches.
//!
//! An event belongs to the tail, but what is decided with it does not. So an `if` that emits
//! something and does something else is two nodes: one that only emits, and one that never does.

use std::collections::{BTreeMap, BTreeSet};

use whippen_ids::IdMap;
use whippen_kernel::op::Immediate;
use whippen_kernel::{Effect, Inst, Kernel, Op, Region, Type, Value, sweep_insts};

/// Memory, or what is read in one part alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A cell.
    Cell(u32),
    /// A delay line.
    Line(u32),
    /// A live value.
    Live(u32),
}

/// An outermost instruction.
#[derive(Debug, Clone)]
pub struct Node {
    /// The instruction.
    pub inst: Inst,
    /// Which instruction of the whole's tick it was made of.
    pub at: usize,
    /// The nodes whose results it needs; those of [`Node::copied`] ones are left out for what these
    /// need.
    pub needs: BTreeSet<usize>,
    /// The nodes that it stays with, because it takes 64 bits of them, which no wire has.
    pub stays_with: BTreeSet<usize>,
    /// What it touches.
    pub places: BTreeSet<Place>,
    /// It may stand in several parts: it has no operands and gives the same in all of them, its
    /// value is known, or it is pure and gives 64 bits, which no wire has.
    pub copied: bool,
    /// It reads a sensor word.
    pub senses: bool,
    /// It emits events or writes a drive word.
    pub leaves: bool,
}

/// All nodes.
#[derive(Debug)]
pub struct Nodes {
    /// In the order of the tick.
    pub nodes: Vec<Node>,
    /// The node that defines a value.
    pub defining: BTreeMap<Value, usize>,
    /// Places that must stay together because `init` takes one from the other.
    pub together: Vec<BTreeSet<Place>>,
}

impl Nodes {
    /// The nodes of a kernel's tick; values that are new are added to it.
    pub fn of(kernel: &mut Kernel) -> Nodes {
        let mut nodes = Vec::new();
        for (at, inst) in kernel.tick.insts.clone().into_iter().enumerate() {
            for inst in apart(kernel, inst) {
                nodes.push(Node::of(kernel, inst, at));
            }
        }
        let mut all = Nodes {
            nodes,
            defining: BTreeMap::new(),
            together: together(kernel),
        };
        all.connect(kernel);
        all
    }

    fn connect(&mut self, kernel: &Kernel) {
        for at in 0..self.nodes.len() {
            let (mut needs, mut stays_with) = (BTreeSet::new(), BTreeSet::new());
            for value in uses(&self.nodes[at].inst) {
                let Some(&from) = self.defining.get(&value) else {
                    continue;
                };
                let node = &self.nodes[from];
                if node.copied {
                    needs.extend(&node.needs);
                    stays_with.extend(&node.stays_with);
                    continue;
                }
                needs.insert(from);
                if kernel.values[value].ty == Type::I64 {
                    stays_with.insert(from);
                }
            }
            self.nodes[at].needs = needs;
            self.nodes[at].stays_with = stays_with;
            let results = self.nodes[at].inst.results.clone();
            self.defining
                .extend(results.into_iter().map(|value| (value, at)));
        }
    }
}

impl Node {
    fn of(kernel: &Kernel, inst: Inst, at: usize) -> Node {
        let mut inst = inst;
        let row = inst.op.row();
        let is_wide = |value: &Value| kernel.values[value].ty == Type::I64;
        let alike = matches!(inst.op, Op::Const(_) | Op::Keyed(_) | Op::Tick(_));
        let is_known = |value: &Value| {
            let range = kernel.values[value].range;
            range.low == range.high
        };
        let known = row.effect == Effect::Pure && inst.results.iter().all(is_known);
        let wide = row.effect == Effect::Pure && inst.results.iter().all(is_wide);
        // What has one value needs nothing else.
        if let (true, [only]) = (known, &inst.results[..]) {
            inst.op = Op::Const(kernel.values[only].range.low);
            inst.args.clear();
        }
        Node {
            at,
            needs: BTreeSet::new(),
            stays_with: BTreeSet::new(),
            places: places(&inst),
            copied: alike || wide || known,
            senses: has(&inst, |op| matches!(op, Op::In(_))),
            leaves: has(&inst, |op| matches!(op, Op::Emit(_) | Op::Out(_))),
            inst,
        }
    }
}

/// Whether an instruction, or one inside it, has such an operator.
fn has(inst: &Inst, is: impl Fn(Op) -> bool) -> bool {
    inst.all_insts().any(|inst| is(inst.op))
}

/// What an instruction, and those inside it, touch.
pub fn places(inst: &Inst) -> BTreeSet<Place> {
    let of_inst = |inst: &Inst| {
        let immediates = inst.op.immediates();
        let kinds = inst.op.row().immediates.iter();
        let place = |(kind, number): (&Immediate, i64)| match kind {
            Immediate::Cell => Some(Place::Cell(number as u32)),
            Immediate::Line => Some(Place::Line(number as u32)),
            Immediate::Live => Some(Place::Live(number as u32)),
            _ => None,
        };
        kinds.zip(immediates).filter_map(place).collect::<Vec<_>>()
    };
    inst.all_insts().flat_map(of_inst).collect()
}

/// The values that an instruction, and those inside it, take from outside.
pub fn uses(inst: &Inst) -> BTreeSet<Value> {
    let (mut used, mut own) = (BTreeSet::new(), BTreeSet::new());
    for inner in inst.all_insts() {
        used.extend(&inner.args);
        own.extend(inner.regions.iter().flat_map(|region| &region.params));
        used.extend(inner.regions.iter().flat_map(|region| &region.yields));
        own.extend(&inner.results);
    }
    used.difference(&own).copied().collect()
}

/// An instruction, or what only emits apart from what does all the rest.
fn apart(kernel: &mut Kernel, inst: Inst) -> Vec<Inst> {
    let emits = |op: Op| matches!(op, Op::Emit(_));
    let writes = |op: Op| matches!(op, Op::Set(_) | Op::SetAt(_) | Op::Wave(..));
    let does_more = !inst.results.is_empty() || has(&inst, writes);
    if inst.op != Op::If || !has(&inst, emits) || !does_more {
        return vec![inst];
    }
    // What is read behind what is written would be read too early.
    let written = |inst: &Inst| has(inst, writes);
    let reads = |op: Op| op.row().effect == Effect::Reads;
    if written(&inst) && has(&inst, reads) {
        return vec![inst];
    }
    let (mut emitting, mut rest) = (inst.clone(), inst);
    emitting.results.clear();
    for region in &mut emitting.regions {
        region.yields.clear();
        drop_insts(region, &writes);
        sweep(kernel, region);
    }
    rename(kernel, &mut emitting);
    for region in &mut rest.regions {
        drop_insts(region, &emits);
        sweep(kernel, region);
    }
    vec![emitting, rest]
}

fn drop_insts(region: &mut Region, is: &impl Fn(Op) -> bool) {
    region.insts.retain(|inst| !is(inst.op));
    for inst in &mut region.insts {
        let regions = inst.regions.iter_mut();
        regions.for_each(|region| drop_insts(region, is));
    }
}

/// Leaves out what has no effect and is not yielded.
fn sweep(kernel: &Kernel, region: &mut Region) {
    let mut needed = IdMap::filled(false, kernel.values.len());
    region.yields.iter().for_each(|value| needed[*value] = true);
    sweep_insts(&mut region.insts, &mut needed);
}

/// Gives everything that is defined inside an instruction values of its own.
fn rename(kernel: &mut Kernel, inst: &mut Inst) {
    let mut own = BTreeSet::new();
    for inner in inst.all_insts() {
        own.extend(&inner.results);
        own.extend(inner.regions.iter().flat_map(|region| &region.params));
    }
    let new: BTreeMap<Value, Value> = own
        .into_iter()
        .map(|value: Value| (value, kernel.values.push(kernel.values[value])))
        .collect();
    inst.for_each_value_mut(&mut |value| *value = new.get(value).copied().unwrap_or(*value));
}

/// Places that `init` makes of each other.
fn together(kernel: &Kernel) -> Vec<BTreeSet<Place>> {
    let mut made_of: BTreeMap<Value, BTreeSet<Place>> = BTreeMap::new();
    let mut all = Vec::new();
    for inst in &kernel.init.insts {
        let mut own = places(inst);
        for value in uses(inst) {
            own.extend(made_of.get(&value).into_iter().flatten());
        }
        for value in &inst.results {
            made_of.insert(*value, own.clone());
        }
        all.push(own);
    }
    all
}
