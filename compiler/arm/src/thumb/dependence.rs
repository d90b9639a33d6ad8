//! Dependence graph of a basic block: definitions before uses, and the order of accesses to flags,
//! registers and memory.
//!
//! The same before and after allocation. Virtual registers are written once; an instruction that
//! changes one in place comes behind all that read it so far, which saves the allocator a copy.

use super::minst::{Access, AliasClass, MInst, Register};
use rustc_hash::FxHashMap;

/// Dependences of the instructions of a block, by their places in it.
pub(super) struct Dependences {
    /// Who must come before each.
    pub before: Vec<Vec<usize>>,
    /// Who must come behind each.
    pub after: Vec<Vec<usize>>,
}

/// What instructions read and write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Resource<R> {
    Flags,
    Register(R),
    Memory(AliasClass),
}

/// What an instruction does to a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Touch {
    Read,
    /// Behind whoever read it, but what it was is not gone: the allocator copies it if need be.
    Replace,
    Write,
}

/// Whoever touched a resource since it was written last.
#[derive(Default)]
struct Touched {
    writer: Option<usize>,
    readers: Vec<usize>,
}

/// Builds the graph of a block's code.
pub(super) fn build_dependences<R: Register>(code: &[MInst<R>]) -> Dependences {
    let mut graph = Dependences {
        before: vec![Vec::new(); code.len()],
        after: vec![Vec::new(); code.len()],
    };
    let mut touched: FxHashMap<Resource<R>, Touched> = FxHashMap::default();
    let mut call = None;
    for (at, inst) in code.iter().enumerate() {
        if inst.convention().is_some() {
            // Registers that it does not keep are nobody's operands, so all stays on its side.
            (0..at).for_each(|before| graph.add_edge(before, at));
            call = Some(at);
        } else if let Some(call) = call {
            graph.add_edge(call, at);
        }
        for (resource, touch) in list_resources(inst) {
            graph.add_touch(touched.entry(resource).or_default(), at, touch);
        }
    }
    graph
}

impl Dependences {
    fn add_touch(&mut self, touched: &mut Touched, at: usize, touch: Touch) {
        touched
            .writer
            .into_iter()
            .for_each(|writer| self.add_edge(writer, at));
        if touch != Touch::Read {
            touched
                .readers
                .iter()
                .for_each(|reader| self.add_edge(*reader, at));
        }
        if touch == Touch::Write {
            touched.readers.clear();
            touched.writer = Some(at);
        } else {
            touched.readers.push(at);
        }
    }

    fn add_edge(&mut self, from: usize, to: usize) {
        if from != to && self.after[from].last() != Some(&to) {
            self.after[from].push(to);
            self.before[to].push(from);
        }
    }
}

/// What an instruction touches, reads first.
fn list_resources<R: Register>(inst: &MInst<R>) -> Vec<(Resource<R>, Touch)> {
    let mut all = Vec::new();
    match inst.touches_flags() {
        (_, true) => all.push((Resource::Flags, Touch::Write)),
        (true, false) => all.push((Resource::Flags, Touch::Read)),
        (false, false) => {}
    }
    let register = |touch| move |reg| (Resource::Register(reg), touch);
    all.extend(inst.registers_read().map(register(Touch::Read)));
    all.extend(inst.registers_replaced().map(register(Touch::Replace)));
    all.extend(inst.registers_written().map(register(Touch::Write)));
    match inst.access {
        // What no tick writes; results that only other functions read.
        Access::None | Access::Read(AliasClass::Constant) | Access::Write(AliasClass::Constant) => {
        }
        Access::Read(class) => all.push((Resource::Memory(class), Touch::Read)),
        Access::Write(class) => all.push((Resource::Memory(class), Touch::Write)),
        Access::Update(cells) => {
            let cells = cells.map(|cell| Resource::Memory(AliasClass::Cell(cell)));
            all.extend(cells.map(|cell| (cell, Touch::Write)));
        }
    }
    all
}
