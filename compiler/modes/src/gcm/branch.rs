//! Short-circuit evaluation: a compound condition is decided part by part, each by a branch.

use super::{Scheduler, empty_block};
use crate::graph::NodeId;
use crate::{BlockId, End, Target, tuning};
use whippen_kernel::{Op, Value};

/// Where a part of a condition leads.
#[derive(Debug, Clone, Copy)]
enum Destination {
    Block(BlockId),
    Yes,
    No,
}

impl Scheduler<'_, '_> {
    /// Ends the block by a decision; gives the blocks of both sides.
    pub(super) fn branch(&mut self, condition: NodeId) -> Option<(BlockId, BlockId)> {
        let mut ends = Vec::new();
        self.branch_ends(condition, &mut ends)?;
        let sides = (
            self.blocks.push(empty_block()),
            self.blocks.push(empty_block()),
        );
        for (block, condition, yes, no) in ends {
            let side = |to: Destination| match to {
                Destination::Block(block) => block,
                Destination::Yes => sides.0,
                Destination::No => sides.1,
            };
            let target = |to| Target {
                block: side(to),
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

    fn branch_ends(
        &mut self,
        condition: NodeId,
        ends: &mut Vec<(BlockId, Value, Destination, Destination)>,
    ) -> Option<()> {
        self.branch_to(condition, Destination::Yes, Destination::No, ends)
    }

    /// A compound condition is decided part by part.
    fn branch_to(
        &mut self,
        condition: NodeId,
        yes: Destination,
        no: Destination,
        ends: &mut Vec<(BlockId, Value, Destination, Destination)>,
    ) -> Option<()> {
        if self.blocks.len() > tuning::BLOCKS || self.depth > tuning::BOOLS_DEEP {
            return None;
        }
        self.depth += 1;
        let decided = self.branch_on_part(condition, yes, no, ends);
        self.depth -= 1;
        decided
    }

    fn branch_on_part(
        &mut self,
        condition: NodeId,
        yes: Destination,
        no: Destination,
        ends: &mut Vec<(BlockId, Value, Destination, Destination)>,
    ) -> Option<()> {
        let args = self.graph.args(condition).to_vec();
        match (self.graph.op(condition), &args[..]) {
            (Some(Op::Not), [inner]) => self.branch_to(*inner, no, yes, ends),
            (Some(Op::And), [a, b]) => {
                let next = self.blocks.push(empty_block());
                self.branch_to(*a, Destination::Block(next), no, ends)?;
                self.enter_block(next);
                self.branch_to(*b, yes, no, ends)
            }
            (Some(Op::Or), [a, b]) => {
                let next = self.blocks.push(empty_block());
                self.branch_to(*a, yes, Destination::Block(next), ends)?;
                self.enter_block(next);
                self.branch_to(*b, yes, no, ends)
            }
            _ => {
                let value = self.value(condition)?;
                ends.push((self.at, value, yes, no));
                Some(())
            }
        }
    }
}
