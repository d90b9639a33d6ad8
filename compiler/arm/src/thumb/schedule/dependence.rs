//! What must stay before what: definitions before uses, and the order of accesses to flags, fixed
//! registers and memory.

use super::PipelineAfter;
use crate::thumb::minst::{Access, AliasClass, MInst, Reg, VReg};
use rustc_hash::FxHashMap;
use whippen_isa::Flags;
use whippen_isa::timing::Core;

/// Dependences of the instructions of a block.
pub(super) struct Graph {
    /// Who comes behind each, and how many cycles it waits if it comes next.
    pub after: Vec<Vec<(usize, u32)>>,
    /// How many each waits for.
    pub before: Vec<usize>,
    /// Cycles from each to the end along the longest chain.
    pub height: Vec<u32>,
}

/// Something that is read and written.
#[derive(PartialEq, Eq, Hash, Clone, Copy)]
enum Resource {
    Flags,
    Fixed(u8),
    Memory(u32, u32),
}

/// Whoever touched a resource since it was written last.
#[derive(Default)]
struct Touched {
    writer: Option<usize>,
    readers: Vec<usize>,
}

pub(super) fn build_graph(code: &[MInst], core: &Core) -> Graph {
    let mut graph = Graph {
        after: vec![Vec::new(); code.len()],
        before: vec![0; code.len()],
        height: Vec::new(),
    };
    let mut defined: FxHashMap<VReg, usize> = FxHashMap::default();
    let mut read: Vec<(VReg, usize)> = Vec::new();
    let mut touched: FxHashMap<Resource, Touched> = FxHashMap::default();
    for (at, inst) in code.iter().enumerate() {
        for reg in inst.reads() {
            defined
                .get(&reg)
                .into_iter()
                .for_each(|from| graph.add_edge(*from, at));
        }
        // What is overwritten in place is read by all others first, which saves a copy.
        for old in inst
            .operands
            .iter()
            .flatten()
            .filter_map(|operand| operand.old)
        {
            read.iter()
                .filter(|(reg, _)| *reg == old)
                .for_each(|(_, from)| graph.add_edge(*from, at));
        }
        read.extend(inst.reads().map(|reg| (reg, at)));
        defined.extend(inst.writes().map(|reg| (reg, at)));
        for (resource, writes) in resources_of(inst) {
            graph.add_touch(touched.entry(resource).or_default(), at, writes);
        }
    }
    for (from, after) in graph.after.iter_mut().enumerate() {
        let behind = PipelineAfter::new(core, &code[from]);
        after
            .iter_mut()
            .for_each(|(to, wait)| *wait = behind.stall_cycles(core, &code[*to]));
    }
    graph.height = critical_heights(&graph);
    graph
}

impl Graph {
    fn add_edge(&mut self, from: usize, to: usize) {
        let known = self.after[from].last().is_some_and(|(last, _)| *last == to);
        if from != to && !known {
            self.after[from].push((to, 0));
            self.before[to] += 1;
        }
    }

    /// Cycles that `to` waits right behind `from`.
    pub fn stall_between(&self, from: usize, to: usize) -> u32 {
        self.after[from]
            .iter()
            .find(|(at, _)| *at == to)
            .map_or(0, |(_, wait)| *wait)
    }

    fn add_touch(&mut self, touched: &mut Touched, at: usize, writes: bool) {
        touched
            .writer
            .into_iter()
            .for_each(|writer| self.add_edge(writer, at));
        if writes {
            std::mem::take(&mut touched.readers)
                .into_iter()
                .for_each(|reader| self.add_edge(reader, at));
            touched.writer = Some(at);
        } else {
            touched.readers.push(at);
        }
    }
}

/// What an instruction touches, and whether it writes it.
fn resources_of(code: &MInst) -> Vec<(Resource, bool)> {
    let mut all = Vec::new();
    let flags = code.inst.flags();
    let (reads, writes) = (
        flags.reads.intersects(Flags::NZCV),
        flags.writes.intersects(Flags::NZCV),
    );
    if reads || writes {
        all.push((Resource::Flags, writes));
    }
    for u in code.uses() {
        if let Reg::Fixed(reg) = u.operand.reg {
            all.push((Resource::Fixed(reg), u.writes));
        }
    }
    let memory = |place| match place {
        AliasClass::Constant => None,
        AliasClass::Cell(cell) => Some(Resource::Memory(0, cell)),
        AliasClass::Line(line) => Some(Resource::Memory(1, line)),
        AliasClass::Other(other) => Some(Resource::Memory(2, other as u32)),
    };
    match code.access {
        Access::None => {}
        Access::Read(place) => all.extend(memory(place).map(|m| (m, false))),
        Access::Write(place) => all.extend(memory(place).map(|m| (m, true))),
    }
    all
}

fn critical_heights(graph: &Graph) -> Vec<u32> {
    let mut height = vec![1; graph.after.len()];
    for at in (0..graph.after.len()).rev() {
        let below = graph.after[at]
            .iter()
            .map(|(next, wait)| height[*next] + wait);
        height[at] = 1 + below.max().unwrap_or(0);
    }
    height
}
