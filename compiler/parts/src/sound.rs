//! What is heard, apart from what is felt: a part that another core can do beside the tail.
//!
//! Drive words are as late as the tail, but nobody takes samples before the next tick.

use std::collections::BTreeSet;

use whippen_kernel::Kernel;

use crate::Role;
use crate::classes::Classes;
use crate::nodes::Place;

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
    let places = classes.of_place.iter();
    let live: BTreeSet<usize> = places
        .filter(|(place, _)| matches!(place, Place::Live(_)))
        .map(|(_, class)| *class)
        .collect();
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
