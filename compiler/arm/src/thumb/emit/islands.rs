//! Branch islands: branches of ARMv6-M reach 2 KiB, and those that go further go by way of others.

use super::{Item, Label, branch_offset, relax_branches};
use crate::thumb::tuning::ISLAND_DISTANCE;
use whippen_isa::Arch;

/// The same items with steps where branches do not reach.
pub(super) fn insert_islands(mut items: Vec<Item>, mut labels: Label, arch: Arch) -> Vec<Item> {
    loop {
        let (sizes, places) = relax_branches(&items, labels, arch);
        let far = |(index, item): (usize, &Item)| match item {
            Item::Branch { cond, to } => {
                let far = branch_offset(&places, index, *to)
                    - if cond.is_some() {
                        i64::from(sizes[index] - 2)
                    } else {
                        0
                    };
                (!(-2048..2048).contains(&far)).then_some((index, far))
            }
            _ => None,
        };
        let Some((index, far)) = items.iter().enumerate().find_map(far) else {
            return items;
        };
        let wanted = i64::from(places.items[index]) + ISLAND_DISTANCE * far.signum();
        let distance = |at: &usize| (i64::from(places.items[*at]) - wanted).abs();
        // Never between a loop's mark and its first instruction.
        let free = |at: &usize| !matches!(items[at - 1], Item::Loop { .. });
        let Some(at) = (1..items.len()).filter(free).min_by_key(distance) else {
            return items;
        };
        let (step, over) = (labels, labels + 1);
        labels += 2;
        let Item::Branch { to, .. } = &mut items[index] else {
            return items;
        };
        let to = std::mem::replace(to, step);
        let leads_on = !matches!(
            items[at - 1],
            Item::Branch { cond: None, .. } | Item::Indirect { .. }
        );
        let mut between = vec![Item::Label(step), Item::Branch { cond: None, to }];
        if leads_on {
            between.insert(
                0,
                Item::Branch {
                    cond: None,
                    to: over,
                },
            );
            between.push(Item::Label(over));
        }
        items.splice(at..at, between);
    }
}
