//! What does not stand as high as it could, because its result would take a register all the way
//! down.
//!
//! A value that only blocks below use is computed there if that takes no other register down in its
//! place: what it is made of alone (its cone) rests on values that are alive below anyway, or that
//! can be read again. Each way below then has its own copy.

use super::{Needs, Placer};
use crate::graph::NodeId;
use rustc_hash::{FxHashMap, FxHashSet};
use whippen_kernel::Op;

/// So many values may be alive below a block without anything being done about it: not all
/// registers, because blocks need some for what they compute.
const ALIVE: usize = 4;
/// Instructions that are copied, at most, to free one register.
const CONE: usize = 8;
/// Uses of bools that are followed.
const USES: usize = 64;

/// What stands in a block, and who else uses it.
struct Block<'a, 'p, 'k> {
    placer: &'a Placer<'p, 'k>,
    here: FxHashSet<NodeId>,
    /// Who uses each value: nodes that are still to be placed.
    users: FxHashMap<NodeId, Vec<NodeId>>,
    /// What the decision at the end of the block is made of.
    decided: FxHashSet<NodeId>,
}

/// Of what may stand here, in order, what is to stand here.
pub(super) fn stay(placer: &Placer, needs: &Needs, condition: NodeId, may_stand: Vec<NodeId>) -> Vec<NodeId> {
    let mut users: FxHashMap<NodeId, Vec<NodeId>> = FxHashMap::default();
    for id in needs
        .by_some
        .iter()
        .filter(|id| !placer.placed.contains_key(id))
    {
        placer
            .graph
            .args(*id)
            .iter()
            .for_each(|arg| users.entry(*arg).or_default().push(*id));
    }
    let decided = placer.graph.reachable(&[condition]).into_iter().collect();
    let mut block = Block {
        placer,
        here: may_stand.iter().copied().collect(),
        users,
        decided,
    };
    // What is left for below reads what others overwrite.
    while may_stand
        .iter()
        .rev()
        .any(|id| block.leave_overwriting(*id))
    {}
    let mut alive = may_stand.iter().filter(|id| block.is_alive(**id)).count();
    for id in may_stand.iter().rev() {
        if alive <= ALIVE {
            break;
        }
        if let Some(cone) = block.cone(*id, false) {
            cone.iter().for_each(|id| _ = block.here.remove(id));
            alive -= 1;
        }
    }
    may_stand
        .into_iter()
        .filter(|id| block.here.contains(id))
        .collect()
}

impl Block<'_, '_, '_> {
    /// Whether a use is in this block: of a bool, if all uses of the bool are. Of bools of bools
    /// only so many are looked at.
    fn is_here(&self, user: NodeId) -> bool {
        let mut open = vec![user];
        for _ in 0..USES {
            let Some(user) = open.pop() else { return true };
            if self.placer.on_demand(user) {
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

    /// Whether it takes a register down.
    fn is_alive(&self, id: NodeId) -> bool {
        !self.is_read_again(id) && self.used_below(id)
    }

    /// Whether blocks can read it anew.
    fn is_read_again(&self, id: NodeId) -> bool {
        match self.placer.graph.op(id) {
            Some(Op::Const(_) | Op::Live(_) | Op::Tick(_) | Op::Keyed(_) | Op::In(_)) => true,
            Some(Op::Get(cell)) => !self
                .here
                .iter()
                .any(|id| self.placer.graph.op(*id) == Some(Op::Set(cell))),
            _ => false,
        }
    }

    /// A cell whose old word is used below is not overwritten here: the word would take a register
    /// down. Gives whether that is so, of a cell that was to be overwritten here.
    fn leave_overwriting(&mut self, id: NodeId) -> bool {
        let graph = &self.placer.graph;
        let Some(Op::Set(cell)) = graph.op(id).filter(|_| self.here.contains(&id)) else {
            return false;
        };
        let is_old = |id: &&NodeId| graph.op(**id) == Some(Op::Get(cell));
        let old = self
            .here
            .iter()
            .find(is_old)
            .or_else(|| self.placer.placed.keys().find(is_old))
            .copied();
        if !old.is_some_and(|old| self.used_below(old)) {
            return false;
        }
        self.here.remove(&id);
        let new = graph.args(id)[0];
        let cone = self.cone(new, true);
        // Without a cone the new word would go down instead.
        let leaves = cone.is_some() || self.is_read_again(new) || !self.is_new(new);
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
        let graph = &self.placer.graph;
        let pure = |id: NodeId| {
            graph
                .op(id)
                .is_some_and(|op| op.row().effect == whippen_kernel::Effect::Pure)
        };
        let goes = |id: NodeId| self.here.contains(&id) && pure(id) && !self.decided.contains(&id);
        let users = self.users.get(&top)?;
        if !goes(top) || users.iter().any(|user| self.is_here(*user)) {
            return None;
        }
        let (mut cone, mut open) = (vec![top], graph.args(top).to_vec());
        while let Some(id) = open.pop() {
            let is_word = overwritten && matches!(graph.op(id), Some(Op::Get(_)));
            if cone.contains(&id) || is_word || self.is_read_again(id) {
                continue;
            }
            if self.placer.on_demand(id) {
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
            if cone.len() > CONE {
                return None;
            }
        }
        Some(cone)
    }

    /// Whether it is not alive below yet.
    fn is_new(&self, id: NodeId) -> bool {
        self.here.contains(&id) || self.placer.placed.contains_key(&id)
    }
}
