//! Branch islands: branches of ARMv6-M reach 2 KiB, and those that go further go by way of others.
//!
//! All branches that do not reach take a step at once, then everything is laid out anew. Branches
//! to one place share their steps: else each of them would push the others further apart.

use std::collections::BTreeMap;

use super::{Item, Label, Places, branch_offset, relax_branches};
use crate::thumb::tuning::{ISLAND_DISTANCE, ISLANDS_MAX_PART};
use whippen_isa::Arch;

/// Steps take so much of the code that they push apart what they bring together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooFar;

/// The same items with steps where branches do not reach.
///
/// # Errors
/// There would be too many.
pub(super) fn insert_islands(
    mut items: Vec<Item>,
    mut labels: Label,
    arch: Arch,
) -> Result<Vec<Item>, TooFar> {
    let items_max = items.len() + items.len() / ISLANDS_MAX_PART;
    let mut steps: BTreeMap<Label, Vec<Island>> = BTreeMap::new();
    loop {
        let (sizes, places) = relax_branches(&items, labels, arch);
        let all_far = far_branches(&items, &sizes, &places);
        if all_far.is_empty() {
            return Ok(items);
        }
        for step in steps.values_mut().flatten() {
            step.place = places.labels[step.label].into();
        }
        let mut islands = Vec::new();
        for (index, far) in all_far {
            let Item::Branch { to, .. } = &mut items[index] else {
                continue;
            };
            let from = i64::from(places.items[index]);
            let goal = *to;
            let known = steps.entry(goal).or_default();
            if let Some(step) = shared_step(known, from, far) {
                *to = step;
                continue;
            }
            *to = labels;
            let at = nearest_place(&items, &places, from + ISLAND_DISTANCE * far.signum());
            known.push(Island {
                label: labels,
                place: places.items[at].into(),
            });
            islands.push((at, step_items(&items[at - 1], [labels, labels + 1], goal)));
            labels += 2;
        }
        items = with_islands(items, islands);
        if items.len() > items_max {
            return Err(TooFar);
        }
    }
}

/// The branches that do not reach, with how far they go.
fn far_branches(items: &[Item], sizes: &[u32], places: &Places) -> Vec<(usize, i64)> {
    let far = |(index, item): (usize, &Item)| match item {
        Item::Branch { cond, to } => {
            let around = cond.map_or(0, |_| i64::from(sizes[index] - 2));
            let far = branch_offset(places, index, *to) - around;
            (!(-2048..2048).contains(&far)).then_some((index, far))
        }
        _ => None,
    };
    items.iter().enumerate().filter_map(far).collect()
}

/// A branch on the way to a label.
struct Island {
    label: Label,
    /// Its offset when everything was laid out last.
    place: i64,
}

/// The step that brings a branch furthest, of those that it reaches with some room to spare,
/// because steps move the code behind them.
fn shared_step(steps: &[Island], from: i64, far: i64) -> Option<Label> {
    let ahead = |step: &&Island| (step.place - from) * far.signum();
    let reached = (steps.iter())
        .filter(|step| (ISLAND_DISTANCE / 2..=ISLAND_DISTANCE).contains(&ahead(step)));
    reached.max_by_key(ahead).map(|step| step.label)
}

/// The item in front of which a step comes nearest to an offset: never between a loop's mark and
/// its first instruction.
fn nearest_place(items: &[Item], places: &Places, wanted: i64) -> usize {
    let distance = |at: &usize| (i64::from(places.items[*at]) - wanted).abs();
    let free = |at: &usize| !matches!(items[at - 1], Item::Loop { .. });
    let behind = places.items.partition_point(|at| i64::from(*at) < wanted);
    let before = (1..behind.min(items.len())).rev().find(free);
    let after = (behind.max(1)..items.len()).find(free);
    let places = before.into_iter().chain(after);
    places.min_by_key(distance).unwrap_or(1)
}

/// The items of a step, around which goes whoever comes from the item in front.
fn step_items(before: &Item, [step, over]: [Label; 2], to: Label) -> Vec<Item> {
    let branch = |to| Item::Branch { cond: None, to };
    let leads_on = !matches!(
        before,
        Item::Branch { cond: None, .. } | Item::Indirect { .. }
    );
    let mut items = vec![Item::Label(step), branch(to)];
    if leads_on {
        items.insert(0, branch(over));
        items.push(Item::Label(over));
    }
    items
}

/// The items with others in front of some of them.
fn with_islands(items: Vec<Item>, mut islands: Vec<(usize, Vec<Item>)>) -> Vec<Item> {
    islands.sort_by_key(|(at, _)| *at);
    let mut islands = islands.into_iter().peekable();
    let mut all = Vec::with_capacity(items.len());
    for (at, item) in items.into_iter().enumerate() {
        while let Some((_, island)) = islands.next_if(|(before, _)| *before == at) {
            all.extend(island);
        }
        all.push(item);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thumb::emit::{assemble, initial_sizes};
    use whippen_isa::{ItState, decode};

    const ARCH: Arch = Arch::V6M;

    /// So many instructions of two bytes.
    fn padding(count: usize) -> impl Iterator<Item = Item> {
        let inst = decode(0x1840, 0, ARCH, ItState::OUTSIDE).expect("an instruction");
        let item = Item::Inst {
            inst,
            origin: None,
            address: None,
        };
        std::iter::repeat_n(item, count)
    }

    /// Branches to so many places far behind all of them, one after the other.
    fn far(branches: usize, places: usize, bytes: usize) -> Vec<Item> {
        let branch = |number| Item::Branch {
            cond: None,
            to: number % places,
        };
        let branches = (0..branches).map(branch);
        let labels = (0..places).map(Item::Label);
        (branches.chain(padding(bytes / 2)).chain(labels))
            .chain(padding(1))
            .collect()
    }

    #[test]
    fn branches_to_one_place_share_their_steps() {
        let steps = |branches| {
            let items = far(branches, 1, 20_000);
            let before = items.len();
            let after = insert_islands(items, 1, ARCH).expect("few steps").len();
            after - before
        };
        // The branches themselves are 200 bytes of the way.
        assert!(steps(100) <= steps(1) + 4, "{}", steps(100));
        assert!((4 * 10..4 * 16).contains(&steps(1)), "{}", steps(1));
    }

    #[test]
    fn every_branch_reaches_in_the_end() {
        let items = far(64, 8, 50_000);
        let bytes: u32 = initial_sizes(&items).iter().sum();
        let code = assemble(items, 8, ARCH, "k").expect("branches reach").bytes;
        assert!(code.len() > bytes as usize);
    }

    #[test]
    fn too_many_places_too_far_away_are_refused() {
        assert_eq!(
            insert_islands(far(2000, 2000, 40_000), 2000, ARCH).err(),
            Some(TooFar)
        );
    }
}
