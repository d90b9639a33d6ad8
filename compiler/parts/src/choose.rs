//! Which classes are members, and what part every class belongs to.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use crate::Role;
use crate::classes::Classes;

/// About the cycles that a member takes at least: below, the calls and words of a part of its own
/// cost more than it is worth.
pub const MEMBER_CYCLES_MIN: u64 = 200;

/// The most expensive classes that do not depend on each other, if there are two.
pub fn most_expensive(classes: &Classes) -> Vec<usize> {
    let all = &classes.classes;
    let mut dear: Vec<usize> = (0..all.len())
        .filter(|class| all[*class].cycles >= MEMBER_CYCLES_MIN)
        .collect();
    dear.sort_by_key(|class| (Reverse(all[*class].cycles), *class));
    let mut members = independent(classes, dear.into_iter());
    members.sort_unstable();
    if members.len() < 2 {
        members.clear();
    }
    members
}

/// Of these classes those that may be members: each in turn, if it depends on none that was taken,
/// nor any of those on it. What takes sensor words is none, nor what gives drive words or events or
/// comes behind such a thing.
pub fn independent(classes: &Classes, wanted: impl Iterator<Item = usize>) -> Vec<usize> {
    let all = &classes.classes;
    let leads = |from: usize, to: usize| all[from].leads_to.contains(&to);
    let mut members: Vec<usize> = Vec::new();
    for class in wanted {
        let is_behind = |other: usize| all[other].leaves && leads(other, class);
        let own = !all[class].senses && !(0..all.len()).any(is_behind);
        let is_free = |other: &usize| !leads(class, *other) && !leads(*other, class);
        if own && members.iter().all(is_free) {
            members.push(class);
        }
    }
    members
}

/// The part of every class.
#[derive(Debug)]
pub struct Roles {
    /// As it is cut.
    pub own: Vec<Role>,
    /// As it would be if no members were together.
    pub apart: Vec<Role>,
}

/// The part of every class; each of these is in the member of that number.
pub fn roles(classes: &Classes, members: &[(usize, u32)]) -> Vec<Role> {
    let all = &classes.classes;
    let leads = |from: usize, to: usize| all[from].leads_to.contains(&to);
    let mut roles: Vec<Role> = Vec::new();
    // Classes are numbered so that ways lead to higher numbers.
    for (class, own) in all.iter().enumerate() {
        let reached = members.iter().filter(|(member, _)| leads(class, *member));
        let to: BTreeSet<u32> = reached.map(|(_, number)| *number).collect();
        let role = match (to.len(), to.first()) {
            (1, Some(only)) if !own.senses => Role::Member(*only),
            (1.., _) => Role::Head,
            _ if own.leaves || own.senses => Role::Tail,
            _ => behind(
                (0..class)
                    .filter(|from| leads(*from, class))
                    .map(|from| roles[from]),
            ),
        };
        roles.push(role);
    }
    // What the head needs is the head's.
    let leads_to_head = |class: usize| {
        let mut to = all[class].leads_to.iter();
        to.any(|to| roles[*to] == Role::Head)
    };
    let settled = (0..all.len()).map(|class| match leads_to_head(class) {
        true => Role::Head,
        false => roles[class],
    });
    settled.collect()
}

/// The part of what no member needs, by what it comes from: with a single member that one's, so
/// that its cycles are divided with it.
fn behind(from: impl Iterator<Item = Role>) -> Role {
    let mut only = None;
    for role in from {
        match (role, only) {
            (Role::Early | Role::Head, _) => {}
            (Role::Member(_), None) => only = Some(role),
            (Role::Member(_), Some(known)) if known == role => {}
            _ => return Role::Tail,
        }
    }
    only.unwrap_or(Role::Tail)
}
