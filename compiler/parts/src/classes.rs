//! Classes of nodes that stay together: strongly connected components of the dependence graph in
//! which nodes that touch the same memory are one.
//!
//! A way from a cell's word to its next one leads through that cell, so all on it are one class:
//! memory that evolves together, with what it evolves by.

use std::collections::{BTreeMap, BTreeSet};

use whippen_kernel::{Inst, Kernel, Op};
use whippen_target_info as target;

use crate::nodes::{Nodes, Place};

/// About the cycles of a point of a string on a Cortex-M33.
const POINT_CYCLES: u64 = 13;

/// All classes, numbered from 0.
#[derive(Debug)]
pub struct Classes {
    /// The class of each node; none of what may stand in several parts.
    pub of_node: Vec<Option<usize>>,
    /// The class of each place.
    pub of_place: BTreeMap<Place, usize>,
    /// Each class.
    pub classes: Vec<Class>,
    /// The class of each instruction of the tick.
    of_inst: BTreeMap<usize, usize>,
}

/// One class.
#[derive(Debug, Clone, Default)]
pub struct Class {
    /// About the cycles of its nodes.
    pub cycles: u64,
    /// Sensor words come in.
    pub senses: bool,
    /// Events or drive words go out.
    pub leaves: bool,
    /// The classes that it leads to, itself among them.
    pub leads_to: BTreeSet<usize>,
}

impl Classes {
    /// The classes of nodes.
    pub fn of(kernel: &Kernel, nodes: &Nodes) -> Classes {
        let merged = merge(nodes);
        let edges = |at: usize| nodes.nodes[at].needs.iter().map(move |from| (*from, at));
        let ways: BTreeSet<(usize, usize)> = (0..nodes.nodes.len())
            .filter(|at| !nodes.nodes[*at].copied)
            .flat_map(edges)
            .map(|(from, to)| (merged.nodes[from], merged.nodes[to]))
            .collect();
        let number = components(merged.count, &ways);
        let count = number.iter().max().map_or(0, |last| last + 1);
        let mut all = Classes {
            of_node: Vec::new(),
            of_place: BTreeMap::new(),
            classes: vec![Class::default(); count],
            of_inst: BTreeMap::new(),
        };
        for (node, group) in nodes.nodes.iter().zip(&merged.nodes) {
            let class = number[*group];
            all.of_node.push((!node.copied).then_some(class));
            if !node.copied {
                let own = &mut all.classes[class];
                own.cycles += cycles(kernel, &node.inst);
                own.senses |= node.senses;
                own.leaves |= node.leaves;
                all.of_inst.insert(node.at, class);
            }
        }
        let of_place = merged.places.iter();
        all.of_place = of_place
            .map(|(place, group)| (*place, number[*group]))
            .collect();
        let ways = ways.iter().map(|(from, to)| (number[*from], number[*to]));
        all.lead(&ways.collect());
        all
    }

    /// The class of an instruction of the tick.
    pub fn of_inst(&self, at: usize) -> Option<usize> {
        self.of_inst.get(&at).copied()
    }

    /// Finds where classes lead.
    fn lead(&mut self, ways: &BTreeSet<(usize, usize)>) {
        for start in 0..self.classes.len() {
            self.classes[start].leads_to = reached(start, ways);
        }
    }
}

/// What can be reached, the start among it.
fn reached(start: usize, ways: &BTreeSet<(usize, usize)>) -> BTreeSet<usize> {
    let mut reached = BTreeSet::from([start]);
    let mut open = vec![start];
    while let Some(from) = open.pop() {
        let next = ways.range((from, 0)..=(from, usize::MAX));
        open.extend(next.map(|(_, to)| *to).filter(|to| reached.insert(*to)));
    }
    reached
}

/// Groups that touch the same memory.
struct Merged {
    nodes: Vec<usize>,
    places: BTreeMap<Place, usize>,
    count: usize,
}

fn merge(nodes: &Nodes) -> Merged {
    let mut places: BTreeMap<Place, usize> = BTreeMap::new();
    let all = nodes.nodes.iter().map(|node| &node.places);
    for place in all.chain(&nodes.together).flatten() {
        let next = nodes.nodes.len() + places.len();
        places.entry(*place).or_insert(next);
    }
    let mut parents: Vec<usize> = (0..nodes.nodes.len() + places.len()).collect();
    let mut join = |a: usize, b: usize| {
        let (a, b) = (root(&parents, a), root(&parents, b));
        parents[a] = b;
    };
    for (at, node) in nodes.nodes.iter().enumerate() {
        node.places.iter().for_each(|place| join(at, places[place]));
        if !node.copied {
            node.stays_with.iter().for_each(|other| join(at, *other));
        }
    }
    for own in &nodes.together {
        let mut own = own.iter().map(|place| places[place]);
        if let Some(first) = own.next() {
            own.for_each(|other| join(first, other));
        }
    }
    let find = |at: usize| root(&parents, at);
    Merged {
        nodes: (0..nodes.nodes.len()).map(find).collect(),
        places: places
            .iter()
            .map(|(place, at)| (*place, find(*at)))
            .collect(),
        count: parents.len(),
    }
}

fn root(parents: &[usize], mut at: usize) -> usize {
    while parents[at] != at {
        at = parents[at];
    }
    at
}

/// The number of the strongly connected component of each of so many (Kosaraju and Sharir).
fn components(count: usize, ways: &BTreeSet<(usize, usize)>) -> Vec<usize> {
    let back: BTreeSet<(usize, usize)> = ways.iter().map(|(from, to)| (*to, *from)).collect();
    let mut left = Vec::new();
    let mut seen = vec![false; count];
    for start in 0..count {
        let mut open = vec![(start, false)];
        while let Some((at, done)) = open.pop() {
            if done {
                left.push(at);
            } else if !std::mem::replace(&mut seen[at], true) {
                open.push((at, true));
                let next = ways.range((at, 0)..=(at, usize::MAX));
                open.extend(next.map(|(_, to)| (*to, false)));
            }
        }
    }
    let mut number = vec![usize::MAX; count];
    let mut next = 0;
    for start in left.into_iter().rev() {
        let mut open = vec![start];
        let before = number[start];
        while let Some(at) = open.pop() {
            if number[at] == usize::MAX {
                number[at] = next;
                open.extend(back.range((at, 0)..=(at, usize::MAX)).map(|(_, to)| *to));
            }
        }
        next += usize::from(before == usize::MAX);
    }
    number
}

/// About the cycles of an instruction and those inside it.
pub fn cycles(kernel: &Kernel, inst: &Inst) -> u64 {
    let of_inst = |inst: &Inst| match inst.op {
        Op::Wave(u, _) => POINT_CYCLES * u64::from(kernel.cells[u as usize].len),
        op => target::row(op).cycles[0].into(),
    };
    inst.all_insts().map(of_inst).sum()
}
