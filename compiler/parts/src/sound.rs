//! What is heard, apart from what is felt: a part that another core can do beside the tail.
//!
//! Drive words are as late as the tail, but nobody takes samples before the next tick.
//!
//! Where there are members, what is heard of them comes behind them. Where there are none, all that
//! leads to samples alone can be apart, with memory and delay lines of its own: the head has what
//! is felt and heard, and what no sensor leads to is early.

use std::collections::BTreeSet;

use whippen_kernel::Kernel;

use crate::Role;
use crate::classes::Classes;
use crate::nodes::Place;

/// About the cycles that what is heard takes at least, where there are no members: below, two cores
/// that meet cost more than it is worth.
pub const SOUND_CYCLES_MIN: u64 = 200;

/// The parts of a Kernel without members: what leads to samples alone is apart from the rest, if it
/// takes so many cycles, and what of it no sensor leads to is early, if that takes so many.
pub fn without_members(
    kernel: &Kernel,
    classes: &Classes,
    [sound_cycles_min, early_cycles_min]: [u64; 2],
) -> Option<Vec<Role>> {
    let all = &classes.classes;
    let leads = |from: usize, to: usize| all[from].leads_to.contains(&to);
    let heard: Vec<usize> = (kernel.channels().into_iter())
        .filter_map(|cell| classes.of_place.get(&Place::Cell(cell as u32)).copied())
        .collect();
    let is_apart = |class: usize| {
        let mut to = all[class].leads_to.iter();
        !to.any(|to| all[*to].leaves || all[*to].senses)
    };
    if heard.is_empty() || !heard.iter().all(|class| is_apart(*class)) {
        return None;
    }
    let mut sound: Vec<bool> = Vec::new();
    for class in 0..all.len() {
        let is_heard = heard.iter().any(|heard| leads(class, *heard));
        // What follows from it alone stays with it.
        let follows = (0..class).any(|from| sound[from] && leads(from, class));
        sound.push(is_apart(class) && is_heard || follows);
    }
    let cycles = |wanted: &dyn Fn(usize) -> bool| -> u64 {
        let own = (0..all.len()).filter(|class| wanted(*class));
        own.map(|class| all[class].cycles).sum()
    };
    if cycles(&|class| sound[class]) < sound_cycles_min {
        return None;
    }
    let mut early: Vec<bool> = Vec::new();
    for (class, sounds) in sound.iter().enumerate() {
        let comes_first = (0..class).all(|from| early[from] || !leads(from, class));
        early.push(*sounds && comes_first && !heard.contains(&class));
    }
    if cycles(&|class| early[class]) < early_cycles_min {
        early.fill(false);
    }
    let live = live_classes(classes);
    let role = |class: usize| match sound[class] {
        _ if early[class] => Role::Early,
        true if !live.contains(&class) => Role::Sound,
        true => Role::Head,
        false if (0..all.len()).any(|to| sound[to] && leads(class, to)) => Role::Head,
        false => Role::Tail,
    };
    let roles: Vec<Role> = (0..all.len()).map(role).collect();
    // Events and drive words are the tail's.
    let is_head = |class: usize| roles[class] == Role::Head;
    let leaves_early = (0..all.len()).any(|class| is_head(class) && all[class].leaves);
    let is_sound = |class: &usize| roles[*class] == Role::Sound;
    (!leaves_early && heard.iter().all(is_sound)).then_some(roles)
}

/// The classes that have live values.
fn live_classes(classes: &Classes) -> BTreeSet<usize> {
    let places = classes.of_place.iter();
    let live = places.filter(|(place, _)| matches!(place, Place::Live(_)));
    live.map(|(_, class)| *class).collect()
}

/// Has what is heard, and what of the tail that depends on or leads to it, run beside the tail;
/// none where drive words or events come of the same, or where nothing is heard in the tail.
///
/// A live value is the head's then: whoever sets one does so when the tail is done, and what is
/// heard may not be.
pub fn take_sound(kernel: &Kernel, classes: &Classes, roles: [&mut [Role]; 2]) -> Option<()> {
    let all = &classes.classes;
    let [own, apart] = roles;
    let heard: Vec<usize> = (kernel.channels().into_iter())
        .filter_map(|cell| classes.of_place.get(&Place::Cell(cell as u32)).copied())
        .collect();
    let leads = |from: usize, to: usize| from != to && all[from].leads_to.contains(&to);
    let live = live_classes(classes);
    let is_tail = |class: usize| own[class] == Role::Tail;
    // What comes of live values and constants alone.
    let is_set = |class: usize| {
        let is_behind = |from| matches!(own[from], Role::Tail | Role::Member(_));
        let mut before = (0..class).filter(|from| leads(*from, class));
        live.contains(&class) && !all[class].senses && !before.any(is_behind)
    };
    let set: Vec<usize> = (0..all.len())
        .filter(|class| is_tail(*class) && is_set(*class))
        .collect();
    let is_free = |class: &usize| is_tail(*class) && !set.contains(class);
    let mut sound: BTreeSet<usize> = heard.iter().copied().filter(is_free).collect();
    if heard.is_empty() || heard.iter().any(|class| !sound.contains(class)) {
        return None;
    }
    let mut open: Vec<usize> = sound.iter().copied().collect();
    while let Some(at) = open.pop() {
        let ties = |class: &usize| leads(*class, at) || leads(at, *class);
        let tied = (0..all.len()).filter(is_free).filter(ties);
        open.extend(tied.filter(|class| sound.insert(*class)));
    }
    let stays = |class: &usize| all[*class].leaves || all[*class].senses || live.contains(class);
    if sound.iter().any(stays) {
        return None;
    }
    let of_head = |class: &usize| sound.iter().any(|to| leads(*class, *to));
    for class in set.into_iter().filter(of_head) {
        own[class] = Role::Head;
        apart[class] = Role::Head;
    }
    for class in sound {
        own[class] = Role::Sound;
        apart[class] = Role::Sound;
    }
    Some(())
}
