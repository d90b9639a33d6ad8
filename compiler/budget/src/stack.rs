//! Where the stack pointer is at every place, and that every return goes back to its caller.
//!
//! Both are followed symbolically: the distance from the entry, whether LR holds what the call put
//! there, and in which stack slots that was saved. That nobody else writes to those slots is the
//! code's promise (its calling convention), not proven.

use whippen_isa::{Class, Inst, RegSet, Stored, reg};

use super::graph::{Block, ContextId, Control, Destination, Edge, Graph, Item};
use super::{NotBounded, Query};

#[derive(Debug, Clone, PartialEq, Eq)]
struct StackSlot {
    /// Bytes from the stack pointer at the entry, negative below it.
    sp: i32,
    /// LR holds the return address of the present function.
    returns: bool,
    /// Stack slots that hold a return address, and whose: by distance from the entry's stack
    /// pointer.
    saved: Vec<(i32, ContextId)>,
}

/// The stack, in bytes from where it is at the entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stack {
    /// How deep it gets.
    pub deepest: u32,
    /// Where it is at every end: positive above.
    pub left: i32,
}

/// Follows the stack pointer to every place.
pub fn follow(query: &Query, graph: &Graph) -> Result<Stack, NotBounded> {
    let mut search = StackSearch::new(query, graph);
    while let Some(number) = search.open.pop() {
        search.follow_block(number)?;
    }
    Ok(Stack {
        deepest: search.deepest.unsigned_abs(),
        left: search.left.unwrap_or(0),
    })
}

/// Blocks to be followed, by a work list.
struct StackSearch<'a> {
    query: &'a Query<'a>,
    graph: &'a Graph,
    /// What is known where each block begins.
    places: Vec<Option<StackSlot>>,
    /// Where the stack pointer was when each function was entered.
    entered: Vec<Option<i32>>,
    /// Blocks whose place has changed.
    open: Vec<usize>,
    deepest: i32,
    left: Option<i32>,
}

impl<'a> StackSearch<'a> {
    fn new(query: &'a Query, graph: &'a Graph) -> StackSearch<'a> {
        let mut search = StackSearch {
            query,
            graph,
            places: vec![None; graph.blocks.len()],
            entered: vec![None; graph.contexts.len()],
            open: vec![0],
            deepest: 0,
            left: None,
        };
        search.places[0] = Some(StackSlot {
            sp: 0,
            returns: true,
            saved: Vec::new(),
        });
        search.entered[0] = Some(0);
        search
    }

    fn follow_block(&mut self, number: usize) -> Result<(), NotBounded> {
        let block = &self.graph.blocks[number];
        let Some(mut place) = self.places[number].clone() else {
            return Ok(());
        };
        // The last one may branch.
        for item in block
            .items
            .iter()
            .filter(|item| item.control == Control::Next)
        {
            place.execute(item, block.context)?;
            if place.sp > 0 && !self.query.annotations.inside {
                return Err(NotBounded::Stack {
                    address: item.address,
                });
            }
            self.deepest = self.deepest.min(place.sp);
        }
        for edge in &block.edges {
            let arriving = self.follow_edge(block, edge, place.clone())?;
            match edge.to {
                Destination::Block(to) => self.enter_block(block.context, to, arriving)?,
                Destination::Stop => self.leave(block, &arriving)?,
            }
        }
        Ok(())
    }

    /// What a block leaves, behind its branch and what that calls.
    fn follow_edge(
        &mut self,
        block: &Block,
        edge: &Edge,
        mut arriving: StackSlot,
    ) -> Result<StackSlot, NotBounded> {
        let goes = edge.taken.is_some() || edge.leaves;
        if let Some(item) = block
            .last()
            .filter(|item| item.control != Control::Next && goes)
        {
            arriving.branch(self.query, item, block.context, &self.entered)?;
        }
        self.deepest = self.deepest.min(arriving.sp);
        if let Some(known) = edge.known {
            let deepest = arriving.sp.saturating_sub_unsigned(known.stack_bytes);
            self.deepest = self.deepest.min(deepest);
            arriving.returns = false;
        }
        Ok(arriving)
    }

    /// An end: the stack pointer is at the same place at all of them.
    fn leave(&mut self, block: &Block, arriving: &StackSlot) -> Result<(), NotBounded> {
        let apart = self.query.annotations.ends_apart;
        if *self.left.get_or_insert(arriving.sp) == arriving.sp || apart {
            return Ok(());
        }
        let address = block.last().map_or(0, |item| item.address);
        Err(NotBounded::Stack { address })
    }

    /// Another block, perhaps of another function.
    fn enter_block(
        &mut self,
        from: ContextId,
        to: usize,
        mut arriving: StackSlot,
    ) -> Result<(), NotBounded> {
        let context = self.graph.blocks[to].context;
        let address = self.graph.blocks[to].address();
        if self.graph.contexts[context].caller == Some(from) && context != from {
            arriving.returns = true;
            if *self.entered[context].get_or_insert(arriving.sp) != arriving.sp {
                return Err(NotBounded::Stack { address });
            }
        } else if context != from {
            arriving.returns = false;
        }
        if arrive(&mut self.places[to], arriving, address)? {
            self.open.push(to);
        }
        Ok(())
    }
}

/// Joins what arrives with what has; says whether less is known now.
fn arrive(known: &mut Option<StackSlot>, new: StackSlot, address: u32) -> Result<bool, NotBounded> {
    let Some(place) = known else {
        *known = Some(new);
        return Ok(true);
    };
    if place.sp != new.sp {
        return Err(NotBounded::Stack { address });
    }
    let saved: Vec<_> = place
        .saved
        .iter()
        .filter(|slot| new.saved.contains(slot))
        .copied()
        .collect();
    let joined = StackSlot {
        returns: place.returns && new.returns,
        saved,
        ..new
    };
    let changed = *place != joined;
    *place = joined;
    Ok(changed)
}

impl StackSlot {
    /// An instruction that does not branch.
    fn execute(&mut self, item: &Item, context: ContextId) -> Result<(), NotBounded> {
        let inst = &item.inst;
        let (defs, before) = (inst.defs(), self.sp);
        let moves = defs.contains(RegSet::core(reg::SP));
        if moves {
            // What is no word is rounded down.
            let by = inst
                .sp_change_bytes()
                .filter(|by| by % 4 == 0 && !inst.is_conditional())
                .ok_or(NotBounded::Stack {
                    address: item.address,
                })?;
            self.sp = self.sp.checked_add(by).ok_or(NotBounded::Stack {
                address: item.address,
            })?;
        }
        self.store(inst, before, context);
        if defs.contains(RegSet::core(reg::LR)) {
            let slot = inst.loaded_slot(before, reg::LR);
            self.returns = slot.is_some_and(|slot| self.saved.contains(&(slot, context)))
                && !inst.is_conditional();
        }
        // Whatever interrupts writes below the stack pointer.
        let sp = self.sp;
        self.saved.retain(|(at, _)| *at >= sp);
        Ok(())
    }

    /// A store to the stack: of LR, or over what was saved there.
    fn store(&mut self, inst: &Inst, before: i32, context: ContextId) {
        match inst.stored(before) {
            Stored::Nothing => {}
            Stored::Somewhere => self.saved.clear(),
            Stored::Bytes(from, end) => {
                self.saved.retain(|(at, _)| at + 4 <= from || end <= *at);
                let lr = inst.stored_slot(before, reg::LR);
                let saves = self.returns && end - from >= 4 && !inst.is_conditional();
                let slot = lr.filter(|_| saves).map(|slot| (slot, context));
                self.saved.extend(slot);
            }
        }
    }

    /// A branch that is taken.
    fn branch(
        &mut self,
        query: &Query,
        item: &Item,
        context: ContextId,
        entered: &[Option<i32>],
    ) -> Result<(), NotBounded> {
        let (inst, before) = (&item.inst, self.sp);
        if inst.defs().contains(RegSet::core(reg::SP)) {
            self.sp += inst.sp_change_bytes().ok_or(NotBounded::Stack {
                address: item.address,
            })?;
        }
        let returns = item.control == Control::Return
            && !query.annotations.targets.contains_key(&item.address);
        if !returns {
            return Ok(());
        }
        let comes_back = match inst.class() {
            Class::BranchRegister | Class::Move => self.returns,
            _ => inst
                .loaded_slot(before, reg::PC)
                .is_some_and(|slot| self.saved.contains(&(slot, context))),
        };
        let trusted = query.annotations.inside && context == 0;
        if trusted || comes_back && entered[context] == Some(self.sp) {
            self.saved.retain(|(_, owner)| *owner != context);
            return Ok(());
        }
        Err(NotBounded::Return {
            address: item.address,
        })
    }
}

#[cfg(test)]
mod tests;
