//! What no sensor leads to, such as live values that glide and what is computed of them: a part
//! that another core can do while the head maps sensors.
//!
//! The head takes nothing of it, nor it of the head, so both may run at the same time.

use crate::Role;
use crate::classes::Classes;

/// About the cycles that it takes at least: below, that two cores meet costs more than it is worth.
pub const EARLY_CYCLES_MIN: u64 = 50;

/// About the cycles of what only the tail needs, at least: below, a wire costs as much.
const OF_TAIL_CYCLES_MIN: u64 = 8;

/// Has what no sensor leads to run early, if it takes so many cycles: what was the head's, but for
/// what the rest of the head needs, and the tail's.
pub fn take_early(classes: &Classes, least: u64, roles: [&mut [Role]; 2]) {
    let all = &classes.classes;
    let [own, apart] = roles;
    let leads = |from: usize, to: usize| from != to && all[from].leads_to.contains(&to);
    let is_sensed = |class: usize| {
        (0..=class).any(|from| all[from].senses && all[from].leads_to.contains(&class))
    };
    let is_head = |class: usize| own[class] == Role::Head;
    let sensed_head: Vec<usize> = (0..all.len())
        .filter(|class| is_head(*class) && is_sensed(*class))
        .collect();
    let mut early: Vec<bool> = Vec::new();
    // Classes are numbered so that ways lead to higher numbers.
    for (class, known) in all.iter().enumerate() {
        let is_wanted = match own[class] {
            Role::Head => !sensed_head.iter().any(|head| leads(class, *head)),
            Role::Tail => !known.leaves && known.cycles >= OF_TAIL_CYCLES_MIN,
            _ => false,
        };
        let comes_first = (0..class).all(|from| early[from] || !leads(from, class));
        early.push(is_wanted && comes_first && !is_sensed(class));
    }
    let taken = || (0..all.len()).filter(|class| early[*class]);
    if taken().map(|class| all[class].cycles).sum::<u64>() < least {
        return;
    }
    for class in taken() {
        own[class] = Role::Early;
        apart[class] = Role::Early;
    }
}
