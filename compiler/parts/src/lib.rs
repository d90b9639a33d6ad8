//! Program partitioning by data dependence (as of decoupled software pipelining, with acyclic
//! stages): one Kernel becomes several, which together do what it does in a tick.
//!
//! ```text
//!            .-> member 0 -.
//!   head ----+-> member 1 -+--> tail        what crosses is a wire: a word that a part leaves for others
//!            '-> ..       -'
//! ```
//!
//! | part | what it has |
//! | --- | --- |
//! | early | what no sensor leads to and several parts need, where another core can do it meanwhile |
//! | head | the sensor words, and what more than one member needs |
//! | member | memory that evolves on its own and costs much, such as a string, and what is only for it |
//! | sound | what is heard of all members, where another core can do it beside the tail |
//! | tail | everything else: what several members lead to, drive words, events |
//!
//! Nothing goes by names. Instructions that touch the same memory stay together, and so does what
//! lies on a way from memory back to itself (`nodes`, `classes`). Of these classes the most
//! expensive that do not depend on each other are members (`choose`). So members may run in any
//! order and at the same time.
//!
//! Each part is a Kernel of its own (`cut`): it is verified, specialised, compiled and bounded as
//! any other. A wire is a word of a cell of the part that makes it and a live value of each part
//! that takes it; whoever runs the parts copies them in between. Every live value of the whole is
//! read by one part alone, so no two parts can see different ones in a tick.
//!
//! [`Running`] runs parts by the interpreter, and is what tests compare with the whole.
//!
//! Not here: which core runs what, and how words cross (`whippen-firmware`).

mod choose;
mod classes;
mod cut;
mod early;
mod nodes;
mod run;
mod sound;

use std::fmt;

use whippen_kernel::{Kernel, Op};

use choose::Roles;

pub use choose::MEMBER_CYCLES_MIN;
pub use early::EARLY_CYCLES_MIN;
pub use run::Running;

/// What a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Runs first, at the same time as the head.
    Early,
    /// Runs before all members.
    Head,
    /// Runs after the head, in any order with the other members.
    Member(u32),
    /// Runs after all members, at the same time as the tail: what is heard.
    Sound,
    /// Runs last.
    Tail,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Role::Early => f.write_str("early"),
            Role::Head => f.write_str("head"),
            Role::Member(number) => write!(f, "member {number}"),
            Role::Sound => f.write_str("sound"),
            Role::Tail => f.write_str("tail"),
        }
    }
}

/// A part of a Kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub role: Role,
    /// What it does. Only the head has words that come in during a tick, only the tail those that
    /// go out, and events; their numbers are those of the whole.
    pub kernel: Kernel,
}

impl Part {
    /// About the cycles of its tick.
    pub fn cycles(&self) -> u64 {
        let insts = self.kernel.tick.insts.iter();
        insts.map(|inst| classes::cycles(&self.kernel, inst)).sum()
    }
}

/// Something of a part: a cell or a live value, by number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Of {
    /// Which part.
    pub part: usize,
    /// Its number there.
    pub number: u32,
}

/// A word that a part leaves for others in every tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// The cell that it is left in: a grid of all wires that the part makes.
    pub from: Of,
    /// Which word of it.
    pub word: u32,
    /// The live values that it becomes, each of a later part.
    pub to: Vec<Of>,
}

/// A Kernel in parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// In the order in which they may run: early, if there is one, head, members,
    /// sound, if there is one, tail.
    pub parts: Vec<Part>,
    /// What crosses.
    pub wires: Vec<Wire>,
    /// Of each live value of the whole, where it is read.
    pub lives: Vec<Of>,
    /// Of each cell of the whole, where it is.
    pub cells: Vec<Of>,
}

impl Parts {
    /// Whether some run between head and tail.
    pub fn has_members(&self) -> bool {
        let is_member = |part: &Part| matches!(part.role, Role::Member(_));
        self.parts.iter().any(is_member)
    }

    /// The part that has what is heard.
    pub fn heard(&self) -> Option<usize> {
        let sound = self.parts.iter().position(|part| part.role == Role::Sound);
        sound.or(self.parts.len().checked_sub(1))
    }
}

/// What another core does beside the head and beside the tail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Beside {
    /// What no sensor leads to is a part of its own beside the head, if it takes so many cycles.
    pub early_cycles_min: Option<u64>,
    /// What is heard is a part of its own beside the tail: none is cut where it cannot be.
    pub sound: bool,
}

/// A Kernel in parts, if at least two members are worth it: each of [`MEMBER_CYCLES_MIN`] cycles or
/// more, as the target's table estimates them. It has no probes.
pub fn split(kernel: &Kernel) -> Option<Parts> {
    let apart = |member| Some(member as u32);
    split_by(kernel, choose::most_expensive, apart, Beside::default())
}

/// As [`split`], with some members together: of each, the number of that which it becomes one of.
/// What these alone need is theirs; what was the tail's stays there, but for what another core does
/// meanwhile.
pub fn split_together(kernel: &Kernel, together: &[u32], beside: Beside) -> Option<Parts> {
    let number = |member: usize| together.get(member).copied();
    split_by(kernel, choose::most_expensive, number, beside)
}

/// As [`split_together`], with members that lie around these instructions of the tick (by their
/// places), as far as they do not depend on each other: at least one. For tests.
pub fn split_around(
    kernel: &Kernel,
    insts: &[usize],
    together: impl Fn(usize) -> u32,
    beside: Beside,
) -> Option<Parts> {
    let choose = |classes: &classes::Classes| {
        let own = insts.iter().filter_map(|at| classes.of_inst(*at));
        choose::independent(classes, own)
    };
    split_by(kernel, choose, |member| Some(together(member)), beside)
}

/// A Kernel without members in parts for two cores: what leads to samples alone is apart from the
/// rest, if that is worth it. It has no probes.
pub fn split_sound(kernel: &Kernel) -> Option<Parts> {
    split_sound_from(kernel, [sound::SOUND_CYCLES_MIN, EARLY_CYCLES_MIN])
}

/// As [`split_sound`], where what is heard, and what is early, take at least so many cycles.
fn split_sound_from(kernel: &Kernel, cycles_min: [u64; 2]) -> Option<Parts> {
    let mut kernel = without_probes(kernel)?;
    let nodes = nodes::Nodes::of(&mut kernel);
    let classes = classes::Classes::of(&kernel, &nodes);
    let own = sound::without_members(&kernel, &classes, cycles_min)?;
    let roles = Roles {
        apart: own.clone(),
        own,
    };
    cut::cut(&kernel, &nodes, &classes, &roles, 0)
}

/// A copy to be cut; none of a Kernel with probes.
fn without_probes(kernel: &Kernel) -> Option<Kernel> {
    let mut insts = kernel.all_insts();
    let has_probes = insts.any(|inst| matches!(inst.op, Op::Probe(_)));
    (!has_probes).then(|| kernel.clone())
}

fn split_by(
    kernel: &Kernel,
    choose: impl FnOnce(&classes::Classes) -> Vec<usize>,
    number: impl Fn(usize) -> Option<u32>,
    beside: Beside,
) -> Option<Parts> {
    let mut kernel = without_probes(kernel)?;
    let nodes = nodes::Nodes::of(&mut kernel);
    let classes = classes::Classes::of(&kernel, &nodes);
    let chosen = choose(&classes);
    let numbered = |number: &dyn Fn(usize) -> Option<u32>| -> Option<Vec<(usize, u32)>> {
        let members = chosen.iter().enumerate();
        let members = members.map(|(member, class)| Some((*class, number(member)?)));
        members.collect()
    };
    let together = numbered(&number)?;
    let last = together.iter().map(|(_, number)| *number).max()?;
    let apart = numbered(&|member| Some(member as u32))?;
    let mut apart = choose::roles(&classes, &apart);
    let mut own = choose::roles(&classes, &together);
    for (own, apart) in own.iter_mut().zip(&apart) {
        // What is heard is looked for in the tail.
        if *apart == Role::Tail {
            *own = Role::Tail;
        }
    }
    if let Some(least) = beside.early_cycles_min {
        early::take_early(&classes, least, [&mut own, &mut apart]);
    }
    if beside.sound {
        sound::take_sound(&kernel, &classes, [&mut own, &mut apart])?;
    }
    let roles = Roles { own, apart };
    cut::cut(&kernel, &nodes, &classes, &roles, last as usize + 1)
}

#[cfg(test)]
mod tests;
