//! Sinking with duplication: a value scheduled early is computed in the blocks below instead, where
//! its register would otherwise be live all the way down.
//!
//! A value that only blocks below use is sunk if that takes no other register down in its place:
//! what it is made of alone (its cone) rests on values that are live below anyway, or that can be
//! rematerialized. Each path below then has its own copy.

use super::{Needs, Scheduler};
use crate::graph::NodeId;
use crate::tuning;
use rustc_hash::{FxHashMap, FxHashSet};
use whippen_kernel::Op;

/// The nodes scheduled in a block, and who else uses them.
struct Sinking<'a, 'p, 'k> {
    scheduler: &'a Scheduler<'p, 'k>,
    here: FxHashSet<NodeId>,
    /// Who uses each value: nodes that are still to be placed.
    users: FxHashMap<NodeId, Vec<NodeId>>,
    /// What the decision at the end of the block is made of.
    decided: FxHashSet<NodeId>,
}

/// Of what can be scheduled early, in order, what is not sunk.
pub(super) fn without_sunk(
    scheduler: &Scheduler,
    needs: &Needs,
    condition: NodeId,
    schedulable: Vec<NodeId>,
) -> Vec<NodeId> {
    let mut users: FxHashMap<NodeId, Vec<NodeId>> = FxHashMap::default();
    for id in needs
        .by_some
        .iter()
        .filter(|id| !scheduler.placed.contains_key(id))
    {
        scheduler
            .graph
            .args(*id)
            .iter()
            .for_each(|arg| users.entry(*arg).or_default().push(*id));
    }
    let decided = scheduler
        .graph
        .reachable(&[condition])
        .into_iter()
        .collect();
    let mut block = Sinking {
        scheduler,
        here: schedulable.iter().copied().collect(),
        users,
        decided,
    };
    // What is left for below reads what others overwrite.
    while schedulable
        .iter()
        .rev()
        .any(|id| block.leave_overwriting(*id))
    {}
    let mut live = schedulable
        .iter()
        .filter(|id| block.is_live_below(**id))
        .count();
    for id in schedulable.iter().rev() {
        if live <= tuning::LIVE_BELOW {
            break;
        }
        if let Some(cone) = block.cone(*id, false) {
            cone.iter().for_each(|id| _ = block.here.remove(id));
            live -= 1;
        }
    }
    schedulable
        .into_iter()
        .filter(|id| block.here.contains(id))
        .collect()
}

impl Sinking<'_, '_, '_> {
    /// Whether a use is in this block: of a bool, if all uses of the bool are. Of bools of bools
    /// only so many are looked at.
    fn is_here(&self, user: NodeId) -> bool {
        let mut open = vec![user];
        for _ in 0..tuning::BOOL_USES {
            let Some(user) = open.pop() else { return true };
            if self.scheduler.is_made_per_use(user) {
                open.extend(self.users.get(&user).into_iter().flatten());
            } else if !self.here.contains(&user) {
                return false;
            }
        }
        false
    }

    fn used_below(&self, id: NodeId) -> bool {
        self.users
            .get(&id)
            .is_some_and(|users| users.iter().any(|user| !self.is_here(*user)))
    }

    /// Whether it takes a register down to the blocks below.
    fn is_live_below(&self, id: NodeId) -> bool {
        !self.is_rematerializable(id) && self.used_below(id)
    }

    /// Whether blocks below can read it again instead of keeping it in a register.
    fn is_rematerializable(&self, id: NodeId) -> bool {
        match self.scheduler.graph.op(id) {
            Some(Op::Get(cell)) => !self
                .here
                .iter()
                .any(|id| self.scheduler.graph.op(*id) == Some(Op::Set(cell))),
            Some(op) => op.row().is_fixed_in_tick(),
            None => false,
        }
    }

    /// A cell whose old word is used below is not overwritten here: the word would take a register
    /// down. Gives whether that is so, of a cell that was to be overwritten here.
    fn leave_overwriting(&mut self, id: NodeId) -> bool {
        let graph = &self.scheduler.graph;
        let Some(Op::Set(cell)) = graph.op(id).filter(|_| self.here.contains(&id)) else {
            return false;
        };
        let is_old = |id: &&NodeId| graph.op(**id) == Some(Op::Get(cell));
        let old = self
            .here
            .iter()
            .find(is_old)
            .or_else(|| self.scheduler.placed.keys().find(is_old))
            .copied();
        if !old.is_some_and(|old| self.used_below(old)) {
            return false;
        }
        self.here.remove(&id);
        let new = graph.args(id)[0];
        let cone = self.cone(new, true);
        // Without a cone the new word would go down instead.
        let leaves = cone.is_some() || self.is_rematerializable(new) || !self.is_new(new);
        if !leaves {
            self.here.insert(id);
        }
        cone.into_iter()
            .flatten()
            .for_each(|id| _ = self.here.remove(&id));
        leaves
    }

    /// The value with all that only it needs, if it can go down without another value that goes
    /// down in its place. With `overwritten`, words of cells that are overwritten here count as
    /// what can be read again.
    fn cone(&self, top: NodeId, overwritten: bool) -> Option<Vec<NodeId>> {
        let graph = &self.scheduler.graph;
        let pure = |id: NodeId| graph.op(id).is_some_and(|op| op.row().effect.is_pure());
        let goes = |id: NodeId| self.here.contains(&id) && pure(id) && !self.decided.contains(&id);
        let users = self.users.get(&top)?;
        if !goes(top) || users.iter().any(|user| self.is_here(*user)) {
            return None;
        }
        let (mut cone, mut open) = (vec![top], graph.args(top).to_vec());
        while let Some(id) = open.pop() {
            let is_word = overwritten && matches!(graph.op(id), Some(Op::Get(_)));
            if cone.contains(&id) || is_word || self.is_rematerializable(id) {
                continue;
            }
            if self.scheduler.is_made_per_use(id) {
                // It is made anew wherever it is asked for.
                open.extend_from_slice(graph.args(id));
                continue;
            }
            let only_here = self
                .users
                .get(&id)
                .is_some_and(|users| users.iter().all(|user| cone.contains(user)));
            if goes(id) && only_here {
                cone.push(id);
                open.extend_from_slice(graph.args(id));
            } else if !self.used_below(id) && self.is_new(id) {
                return None;
            }
            if cone.len() > tuning::CONE_INSTRUCTIONS {
                return None;
            }
        }
        Some(cone)
    }

    /// Whether it is not alive below yet.
    fn is_new(&self, id: NodeId) -> bool {
        self.here.contains(&id) || self.scheduler.placed.contains_key(&id)
    }
}
