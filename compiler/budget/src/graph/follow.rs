//! Following every path, instruction by instruction, and gathering what was found into blocks.

use rustc_hash::FxHashMap;
use smallvec::{SmallVec, smallvec};
use whippen_arm::control::{Control, falls_through};
use whippen_isa::timing::Target;
use whippen_isa::{Class, Inst, ItState, NotDecoded, Op};

use super::super::memory::SOMEWHERE;
use super::{Block, Context, ContextId, Destination, Edge, Graph, Item, Tables};
use crate::{Known, NotBounded, Query};

/// Instructions, calls written out, at most.
const NODES_MAX: usize = 1 << 18;
/// Calls inside calls at most.
const DEPTH_MAX: usize = 64;

/// An instruction in a context.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct ContextAddress {
    context: ContextId,
    address: u32,
    it: ItState,
}

/// Where one instruction leads; the numbers are of nodes.
#[derive(Default)]
struct NodeEdge {
    taken: Option<Target>,
    indices: Vec<u32>,
    known: Option<Known>,
    leaves: bool,
    to: Option<usize>,
}

impl NodeEdge {
    /// Whether both end at words with instructions of one size: then they cost the same.
    fn ends_like(&self, other: &NodeEdge) -> bool {
        let word = |edge: &NodeEdge| {
            edge.taken
                .filter(|target| edge.to.is_none() && target.address & 3 == 0)
        };
        word(self)
            .zip(word(other))
            .is_some_and(|(own, other)| own.wide == other.wide)
    }
}

struct Node {
    context: ContextId,
    item: Item,
    edges: NodeEdges,
}

/// Most instructions lead to one place.
type NodeEdges = SmallVec<[NodeEdge; 1]>;

/// Everything that was found.
pub struct Followed<'a> {
    query: &'a Query<'a>,
    tables: &'a Tables,
    /// Of the first places.
    nodes: Vec<Node>,
    places: Vec<ContextAddress>,
    numbers: FxHashMap<ContextAddress, usize>,
    contexts: Vec<Context>,
}

impl<'a> Followed<'a> {
    /// Follows every path from the entry.
    pub fn from(query: &'a Query<'a>, tables: &'a Tables) -> Result<Self, NotBounded> {
        let root = Context {
            caller: None,
            callee: query.entry,
            return_address: 0,
        };
        let mut followed = Self {
            query,
            tables,
            nodes: Vec::new(),
            places: Vec::new(),
            numbers: FxHashMap::default(),
            contexts: vec![root],
        };
        followed.number(ContextAddress {
            context: 0,
            address: query.entry,
            it: ItState::OUTSIDE,
        });
        while let Some(&place) = followed.places.get(followed.nodes.len()) {
            if followed.nodes.len() >= NODES_MAX {
                return Err(NotBounded::TooLarge {
                    instructions_max: NODES_MAX,
                });
            }
            let node = followed.node(place)?;
            followed.nodes.push(node);
        }
        Ok(followed)
    }

    fn number(&mut self, place: ContextAddress) -> usize {
        *self.numbers.entry(place).or_insert_with(|| {
            self.places.push(place);
            self.places.len() - 1
        })
    }

    fn node(&mut self, place: ContextAddress) -> Result<Node, NotBounded> {
        let ContextAddress {
            context,
            address,
            it,
        } = place;
        let inst = self.decode(address, it)?;
        let item = Item {
            address,
            inst,
            timed: self.query.core.prepare(&inst),
            control: Control::of(&inst, address),
        };
        let control = match item.control {
            Control::Return if self.query.annotations.targets.contains_key(&address) => {
                Control::Indirect
            }
            Control::Waits if self.query.annotations.sleeps && inst.class() == Class::Wait => {
                Control::Next
            }
            other => other,
        };
        let item = Item { control, ..item };
        let mut edges = self.branches(context, &item)?;
        if !item.control.branches() || falls_through(&inst) {
            let it = inst.it_behind(it).unwrap_or_default();
            edges.push(self.edge_to(None, context, address.wrapping_add(inst.size()), it));
        }
        Ok(Node {
            context,
            item,
            edges,
        })
    }

    fn decode(&self, address: u32, it: ItState) -> Result<Inst, NotBounded> {
        let decoded = self
            .query
            .code
            .decode(address, self.query.core.arch, it)
            .ok_or(NotBounded::NoCode { address })?;
        decoded.map_err(|why: NotDecoded| NotBounded::NoInstruction { address, why })
    }

    /// An edge to an address, or to the end if it is one.
    fn edge_to(
        &mut self,
        taken: Option<Target>,
        context: ContextId,
        address: u32,
        it: ItState,
    ) -> NodeEdge {
        let stops = self.query.annotations.stops.contains(&address);
        let to = (!stops).then(|| {
            self.number(ContextAddress {
                context,
                address,
                it,
            })
        });
        NodeEdge {
            taken,
            to,
            ..NodeEdge::default()
        }
    }

    /// A branch that is taken.
    fn taken(&mut self, context: ContextId, address: u32) -> NodeEdge {
        let address = address & !1;
        let target = Target {
            address,
            wide: self.query.code.is_wide_at(address),
        };
        self.edge_to(Some(target), context, address, ItState::OUTSIDE)
    }

    fn branches(&mut self, context: ContextId, item: &Item) -> Result<NodeEdges, NotBounded> {
        let (at, query) = (item.address, self.query);
        let targets = query.annotations.targets.get(&at);
        let untold = || NotBounded::NoTargets {
            address: at,
            text: item.inst.to_string(),
        };
        Ok(match (item.control, targets) {
            (Control::Next, _) => NodeEdges::new(),
            (Control::Jump(to), _) => smallvec![self.taken(context, to)],
            (Control::Call(to), _) => smallvec![self.call(context, item, to)?],
            (Control::CallIndirect, Some(targets)) => targets
                .iter()
                .map(|&to| self.call(context, item, to))
                .collect::<Result<_, _>>()?,
            (Control::Table | Control::Indirect, Some(targets)) => {
                let mut edges = NodeEdges::new();
                for &to in targets {
                    let edge = self.taken(context, to);
                    if !edges.iter().any(|known| known.ends_like(&edge)) {
                        edges.push(edge);
                    }
                }
                edges
            }
            (Control::Return, _) => smallvec![self.comes_back(context)],
            (Control::Table, None) => self.table(context, item)?,
            (Control::CallIndirect | Control::Indirect, None) => return Err(untold()),
            (Control::Waits, _) => {
                return Err(NotBounded::Waits {
                    address: at,
                    text: item.inst.to_string(),
                });
            }
        })
    }

    fn call(
        &mut self,
        caller: ContextId,
        item: &Item,
        callee: u32,
    ) -> Result<NodeEdge, NotBounded> {
        let (callee, return_address) = (callee & !1, item.address.wrapping_add(item.inst.size()));
        let known = |at: Option<u32>| self.query.annotations.known.get(&(at, callee));
        if let Some(&known) = known(Some(item.address)).or_else(|| known(None)) {
            let target = Target {
                address: callee,
                wide: self.query.code.is_wide_at(callee),
            };
            let edge = self.edge_to(Some(target), caller, return_address, ItState::OUTSIDE);
            return Ok(NodeEdge {
                known: Some(known),
                ..edge
            });
        }
        let mut chain = Some(caller);
        let mut depth = 0;
        while let Some(context) = chain.map(|c| self.contexts[c]) {
            depth += 1;
            if context.callee == callee || depth > DEPTH_MAX {
                return Err(NotBounded::Recursive {
                    address: item.address,
                });
            }
            chain = context.caller;
        }
        let context = Context {
            caller: Some(caller),
            callee,
            return_address,
        };
        let number = self
            .contexts
            .iter()
            .position(|c| *c == context)
            .unwrap_or_else(|| {
                self.contexts.push(context);
                self.contexts.len() - 1
            });
        Ok(self.taken(number, callee))
    }

    fn comes_back(&mut self, context: ContextId) -> NodeEdge {
        let Context {
            caller,
            return_address,
            ..
        } = self.contexts[context];
        match caller {
            Some(caller) => self.taken(caller, return_address),
            None if self.query.annotations.handler => NodeEdge {
                leaves: true,
                ..NodeEdge::default()
            },
            None => {
                let worst = Target {
                    address: SOMEWHERE,
                    wide: true,
                };
                let target = self.query.annotations.return_to.unwrap_or(worst);
                NodeEdge {
                    taken: Some(target),
                    ..NodeEdge::default()
                }
            }
        }
    }

    /// The entries of a table that can be reached, as far as is known; a table lies behind its
    /// instruction.
    fn table(&mut self, context: ContextId, item: &Item) -> Result<NodeEdges, NotBounded> {
        let (at, inst, code) = (item.address, &item.inst, self.query.code);
        let untold = || NotBounded::NoTargets {
            address: at,
            text: inst.to_string(),
        };
        if inst.n != whippen_isa::reg::PC {
            return Err(untold());
        }
        let base = at.wrapping_add(4);
        let mut edges = NodeEdges::new();
        for index in 0..self.tables.entries_of(at) {
            let entry = match inst.op() {
                Op::TBB => code.byte(base.wrapping_add(index)).map(u32::from),
                _ => code.halfword(base.wrapping_add(2 * index)).map(u32::from),
            };
            let to = base.wrapping_add(2 * entry.ok_or_else(untold)?);
            match edges
                .iter_mut()
                .find(|edge| edge.taken.is_some_and(|target| target.address == to))
            {
                Some(edge) => edge.indices.push(index),
                None => edges.push(NodeEdge {
                    indices: vec![index],
                    ..self.taken(context, to)
                }),
            }
        }
        Ok(edges)
    }

    /// Blocks begin at the entry, where paths meet and behind branches.
    pub fn gather(self) -> Graph {
        let nodes = self.nodes;
        let mut entered = vec![0_u32; nodes.len()];
        for edge in nodes.iter().flat_map(|node| &node.edges) {
            edge.to.into_iter().for_each(|to| entered[to] += 1);
        }
        let continues = |node: &Node| match node.edges.as_slice() {
            [
                NodeEdge {
                    taken: None,
                    leaves: false,
                    to: Some(to),
                    ..
                },
            ] if entered[*to] == 1 && *to != 0 => Some(*to),
            _ => None,
        };
        let mut begins = vec![true; nodes.len()];
        nodes
            .iter()
            .filter_map(continues)
            .for_each(|to| begins[to] = false);
        let mut number = vec![usize::MAX; nodes.len()];
        begins
            .iter()
            .enumerate()
            .filter(|(_, begins)| **begins)
            .zip(0..)
            .for_each(|((node, _), block)| number[node] = block);
        let finished = |edge: &NodeEdge| Edge {
            taken: edge.taken,
            indices: edge.indices.clone(),
            known: edge.known,
            leaves: edge.leaves,
            to: edge
                .to
                .map_or(Destination::Stop, |to| Destination::Block(number[to])),
        };
        let block = |first: usize| {
            let run = std::iter::successors(Some(first), |&at| continues(&nodes[at]));
            let run: Vec<&Node> = run.map(|at| &nodes[at]).collect();
            let edges = run
                .last()
                .map(|node| node.edges.iter().map(finished).collect())
                .unwrap_or_default();
            Block {
                context: nodes[first].context,
                items: run.iter().map(|node| node.item).collect(),
                edges,
            }
        };
        let blocks = (0..nodes.len())
            .filter(|&node| begins[node])
            .map(block)
            .collect();
        Graph {
            blocks,
            contexts: self.contexts,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Annotations, Code};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    #[test]
    fn ends_are_one_where_words_with_instructions_of_one_size_follow() {
        let end = |address, wide| NodeEdge {
            taken: Some(Target { address, wide }),
            ..NodeEdge::default()
        };
        let block = || NodeEdge {
            to: Some(0),
            ..end(8, true)
        };
        assert!(end(8, true).ends_like(&end(12, true)));
        assert!(end(8, false).ends_like(&end(4, false)));
        for (one, other) in [
            (end(8, true), end(12, false)),
            (end(8, true), end(14, true)),
            (end(10, true), end(10, true)),
            (end(8, true), block()),
            (block(), block()),
        ] {
            assert!(!one.ends_like(&other) && !other.ends_like(&one));
        }
    }

    /// The instructions of each block, by their addresses.
    fn blocks(texts: &[&str], entry: u32) -> Vec<Vec<u32>> {
        let query = Query {
            core: &Core::cortex_m33(),
            code: &Code::new(0, assembled(texts, Arch::V8M)),
            entry,
            annotations: &Annotations::default(),
            interference: None,
        };
        let tables = Tables::default();
        let followed = Followed::from(&query, &tables).expect("paths");
        let blocks = followed.gather().blocks.into_iter();
        let items = |block: Block| block.items.iter().map(|item| item.address).collect();
        blocks.map(items).collect()
    }

    #[test]
    fn instructions_in_a_row_are_a_block() {
        let add = "adds r1, #1";
        assert_eq!(blocks(&[add, add, "bx lr"], 0), [vec![0, 2, 4]]);
        // Both ways of a branch, and where they meet.
        assert_eq!(
            blocks(&[add, "cbz r1, .+4", add, add, "bx lr"], 0),
            [vec![0, 2], vec![6, 8], vec![4]]
        );
        // The entry, to which one instruction alone goes on.
        assert_eq!(
            blocks(&[add, add, add, "bne .-6", "bx lr"], 2),
            [vec![2, 4, 6], vec![0], vec![8]]
        );
    }
}
