//! Decisions as branches: a compound condition is decided part by part.

use super::{BLOCKS, DEPTH, Placer, open_block};
use crate::graph::NodeId;
use crate::{End, Target};
use whippen_kernel::{Op, Value};

/// Where a part of a condition leads.
#[derive(Debug, Clone, Copy)]
enum Way {
    Block(usize),
    Yes,
    No,
}

impl Placer<'_, '_> {
    /// Ends the block by a decision; gives the blocks of both sides.
    pub(super) fn branch(&mut self, condition: NodeId) -> Option<(usize, usize)> {
        let mut ends = Vec::new();
        self.decide(condition, &mut ends)?;
        let sides = (self.blocks.len(), self.blocks.len() + 1);
        self.blocks.extend([open_block(), open_block()]);
        for (block, condition, yes, no) in ends {
            let side = |way: Way| match way {
                Way::Block(block) => block,
                Way::Yes => sides.0,
                Way::No => sides.1,
            };
            let target = |way| Target {
                block: side(way),
                args: Vec::new(),
            };
            self.blocks[block].end = End::Branch {
                condition,
                yes: target(yes),
                no: target(no),
                likely: None,
            };
        }
        Some(sides)
    }

    fn decide(&mut self, condition: NodeId, ends: &mut Vec<(usize, Value, Way, Way)>) -> Option<()> {
        self.decide_to(condition, Way::Yes, Way::No, ends)
    }

    /// A compound condition is decided part by part.
    fn decide_to(
        &mut self,
        condition: NodeId,
        yes: Way,
        no: Way,
        ends: &mut Vec<(usize, Value, Way, Way)>,
    ) -> Option<()> {
        if self.blocks.len() > BLOCKS || self.depth > DEPTH {
            return None;
        }
        self.depth += 1;
        let decided = self.decide_part(condition, yes, no, ends);
        self.depth -= 1;
        decided
    }

    fn decide_part(
        &mut self,
        condition: NodeId,
        yes: Way,
        no: Way,
        ends: &mut Vec<(usize, Value, Way, Way)>,
    ) -> Option<()> {
        let args = self.graph.args(condition).to_vec();
        match (self.graph.op(condition), &args[..]) {
            (Some(Op::Not), [inner]) => self.decide_to(*inner, no, yes, ends),
            (Some(Op::And), [a, b]) => {
                let next = self.blocks.len();
                self.blocks.push(open_block());
                self.decide_to(*a, Way::Block(next), no, ends)?;
                self.go_to(next);
                self.decide_to(*b, yes, no, ends)
            }
            (Some(Op::Or), [a, b]) => {
                let next = self.blocks.len();
                self.blocks.push(open_block());
                self.decide_to(*a, yes, Way::Block(next), ends)?;
                self.go_to(next);
                self.decide_to(*b, yes, no, ends)
            }
            _ => {
                let value = self.value(condition)?;
                ends.push((self.at, value, yes, no));
                Some(())
            }
        }
    }
}
