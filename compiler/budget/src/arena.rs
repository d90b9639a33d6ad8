//! Paths into states, as a tree of links to their predecessors: what begins alike is shared.

use super::Step;

/// The end of a path; [`START`] for the empty one.
pub type Chain = u32;

/// The empty path.
pub const START: Chain = u32::MAX;

#[derive(Debug, Clone, Copy)]
enum What {
    Step(Step),
    /// A whole path, as one piece: a round of a loop.
    Segment(Chain),
}

/// All links.
#[derive(Debug, Default)]
pub struct Arena {
    links: Vec<(Chain, What)>,
}

impl Arena {
    /// One more instruction.
    pub fn step(&mut self, before: Chain, step: Step) -> Chain {
        self.push(before, What::Step(step))
    }

    /// One more round.
    pub fn segment(&mut self, before: Chain, segment: Chain) -> Chain {
        self.push(before, What::Segment(segment))
    }

    fn push(&mut self, before: Chain, what: What) -> Chain {
        self.links.push((before, what));
        (self.links.len() - 1) as Chain
    }

    /// The instructions of a path, in order.
    pub fn steps(&self, chain: Chain) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut open = vec![chain];
        while let Some(chain) = open.pop() {
            let Some(&(before, what)) = self.links.get(chain as usize) else {
                continue;
            };
            open.push(before);
            match what {
                What::Step(step) => steps.push(step),
                What::Segment(segment) => open.push(segment),
            }
        }
        steps.reverse();
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Accessed, Waits};

    #[test]
    fn a_segment_stands_where_it_was_added() {
        let step = |address| Step {
            address,
            cycles: 1,
            waits: Waits::default(),
            accessed: Accessed::Nothing,
            times: 1,
        };
        let mut arena = Arena::default();
        let inner = arena.step(START, step(2));
        let inner = arena.step(inner, step(3));
        let outer = arena.step(START, step(1));
        let outer = arena.segment(outer, inner);
        let outer = arena.segment(outer, inner);
        let outer = arena.step(outer, step(4));
        let addresses: Vec<u32> = arena.steps(outer).iter().map(|step| step.address).collect();
        assert_eq!(addresses, [1, 2, 3, 2, 3, 4]);
        assert!(arena.steps(START).is_empty());
    }
}
