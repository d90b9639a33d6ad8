//! Loops, and an order in which every block comes after those that lead to it, but for the edges
//! back to the head of a loop.
//!
//! Strongly connected components, outermost first: a component with more than one block, or a block
//! that leads to itself, is a loop; the only block of it that is entered from outside is its head;
//! without the edges back to the head, what is left is ordered in the same manner.

use super::graph::{BlockId, Graph};
use super::{NotBounded, Query};

/// A block, or a loop of such.
#[derive(Debug)]
pub enum Element {
    Block(BlockId),
    Loop(Loop),
}

/// A loop.
#[derive(Debug)]
pub struct Loop {
    pub head: BlockId,
    /// How often the head runs at most, each time the loop is entered.
    pub rounds_max: u32,
    /// All its blocks, by number.
    pub members: Vec<BlockId>,
    /// The head first.
    pub body: Vec<Element>,
}

/// All blocks in order.
#[derive(Debug)]
pub struct Order {
    pub elements: Vec<Element>,
}

impl Order {
    /// Finds the loops of a graph.
    pub fn of(query: &Query, graph: &Graph) -> Result<Self, NotBounded> {
        let mut finder = Finder {
            query,
            graph,
            before: predecessors(graph),
            member: vec![0; graph.blocks.len()],
            level: 0,
        };
        let all: Vec<BlockId> = (0..graph.blocks.len()).collect();
        Ok(Self {
            elements: finder.elements(&all, None)?,
        })
    }
}

fn predecessors(graph: &Graph) -> Vec<Vec<BlockId>> {
    let mut before = vec![Vec::new(); graph.blocks.len()];
    for block in 0..graph.blocks.len() {
        graph
            .successors(block)
            .for_each(|to| before[to].push(block));
    }
    before
}

struct Finder<'a> {
    query: &'a Query<'a>,
    graph: &'a Graph,
    before: Vec<Vec<BlockId>>,
    /// Which set each block is in at present, as a number that is never used again.
    member: Vec<u32>,
    level: u32,
}

impl Finder<'_> {
    /// The blocks of a set in order, without the edges to `head`.
    fn elements(
        &mut self,
        set: &[BlockId],
        head: Option<BlockId>,
    ) -> Result<Vec<Element>, NotBounded> {
        let components = self.components(set, head);
        components
            .into_iter()
            .map(|component| self.element(component))
            .collect()
    }

    fn element(&mut self, mut component: Vec<BlockId>) -> Result<Element, NotBounded> {
        component.sort_unstable();
        let first = component[0];
        let leads_to_itself = self.graph.successors(first).any(|to| to == first);
        if component.len() == 1 && !leads_to_itself {
            return Ok(Element::Block(first));
        }
        let head = self.head(&component)?;
        let address = self.graph.blocks[head].address();
        let rounds_max = *self
            .query
            .annotations
            .loops
            .get(&address)
            .ok_or(NotBounded::NoRounds { head: address })?;
        let body = if component.len() == 1 {
            vec![Element::Block(head)]
        } else {
            self.elements(&component, Some(head))?
        };
        Ok(Element::Loop(Loop {
            head,
            rounds_max: rounds_max.max(1),
            members: component,
            body,
        }))
    }

    /// The only block that is entered from outside.
    fn head(&self, component: &[BlockId]) -> Result<BlockId, NotBounded> {
        let inside = |block: &BlockId| component.binary_search(block).is_ok();
        let entered = |block: &&BlockId| {
            **block == 0 || self.before[**block].iter().any(|from| !inside(from))
        };
        let mut entries = component.iter().filter(entered).copied();
        let head = entries.next().unwrap_or(component[0]);
        match entries.next() {
            None => Ok(head),
            Some(other) => Err(NotBounded::Irreducible {
                entries: [head, other].map(|block| self.graph.blocks[block].address()),
            }),
        }
    }

    /// Strongly connected components in topological order: blocks in the order in which a search
    /// leaves them, last first, and from each whatever reaches it and is not yet taken.
    fn components(&mut self, set: &[BlockId], head: Option<BlockId>) -> Vec<Vec<BlockId>> {
        self.level += 1;
        let level = self.level;
        set.iter().for_each(|&block| self.member[block] = level);
        let mut left: Vec<BlockId> = Vec::new();
        let mut seen = Seen::new(self.graph.blocks.len());
        for &root in head.iter().chain(set) {
            self.search(root, level, head, &mut seen, &mut left);
        }
        let mut taken = Seen::new(self.graph.blocks.len());
        let mut components = Vec::new();
        for &root in left.iter().rev() {
            let component = self.reaching(root, level, head, &mut taken);
            if !component.is_empty() {
                components.push(component);
            }
        }
        components
    }

    fn search(
        &self,
        root: BlockId,
        level: u32,
        head: Option<BlockId>,
        seen: &mut Seen,
        left: &mut Vec<BlockId>,
    ) {
        if !seen.first_time(root) {
            return;
        }
        let successors = |block| {
            let inside = move |to: &BlockId| self.member[*to] == level && Some(*to) != head;
            self.graph.successors(block).filter(inside)
        };
        let mut open = vec![(root, successors(root))];
        while let Some((block, ways_left)) = open.last_mut() {
            match ways_left.find(|&to| seen.first_time(to)) {
                Some(to) => open.push((to, successors(to))),
                None => {
                    left.push(*block);
                    open.pop();
                }
            }
        }
    }

    fn reaching(
        &self,
        root: BlockId,
        level: u32,
        head: Option<BlockId>,
        taken: &mut Seen,
    ) -> Vec<BlockId> {
        let mut component = Vec::new();
        let mut open = vec![root];
        while let Some(block) = open.pop() {
            if !taken.first_time(block) {
                continue;
            }
            component.push(block);
            if Some(block) != head {
                let before = self.before[block].iter();
                open.extend(before.filter(|&&from| self.member[from] == level));
            }
        }
        component
    }
}

/// A set of blocks.
struct Seen(Vec<bool>);

impl Seen {
    fn new(blocks: usize) -> Self {
        Self(vec![false; blocks])
    }

    fn first_time(&mut self, block: BlockId) -> bool {
        !std::mem::replace(&mut self.0[block], true)
    }
}
