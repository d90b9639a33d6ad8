//! Alignment of 32-bit instructions to words, where the core may wait for the second half of one
//! that is not (Cortex-M4): a 16-bit instruction in front takes its 32-bit encoding, which costs no
//! cycle.

use super::{Item, Places};
use whippen_isa::{Arch, Op};

/// Whether instructions of 32 bits are to be aligned.
pub(super) fn aligns(arch: Arch) -> bool {
    arch == Arch::V7EM
}

/// Moves item `index`, which is 32 bits long and not word aligned, up by a halfword: one of the
/// 16-bit instructions between it and the last 32-bit one grows. Whether one could.
pub(super) fn align_item(
    items: &[Item],
    sizes: &mut [u32],
    places: &mut Places,
    index: usize,
) -> bool {
    let Some(grown) = item_to_widen(items, sizes, places, index) else {
        return false;
    };
    sizes[grown] = 4;
    for moved in grown + 1..index {
        places.items[moved] += 2;
        if let Item::Label(label) = items[moved] {
            places.labels[label] += 2;
        }
    }
    true
}

/// The nearest item in front that may grow; if possible none that an IT is folded into.
fn item_to_widen(items: &[Item], sizes: &[u32], places: &Places, index: usize) -> Option<usize> {
    let here = |at: &usize| sizes[*at] != 4 && !matches!(items[*at], Item::Function { .. });
    let narrow = (0..index).rev().take_while(here);
    let may_grow = |at: &usize| places.items[*at] & 2 == 0 && has_long_form(&items[*at]);
    let candidates: Vec<usize> = narrow
        .take_while(|at| !is_padded(sizes, places, *at, index))
        .filter(may_grow)
        .collect();
    let takes_no_it = |at: &&usize| !matches!(items.get(**at + 1), Some(item) if is_it(item));
    candidates
        .iter()
        .find(takes_no_it)
        .or(candidates.first())
        .copied()
}

/// Whether padding stands between an item and the next: then growing moves nothing behind it.
fn is_padded(sizes: &[u32], places: &Places, at: usize, index: usize) -> bool {
    at + 1 < index && places.items[at + 1] != places.items[at] + sizes[at]
}

fn is_it(item: &Item) -> bool {
    matches!(item, Item::Inst { inst, .. } if inst.op() == Op::IT)
}

fn has_long_form(item: &Item) -> bool {
    match item {
        Item::Inst { inst, .. } => inst.wide(Arch::V7EM).is_some(),
        Item::Branch { .. } => true,
        Item::Indirect { .. } | Item::Label(_) | Item::Function { .. } | Item::Loop { .. } => false,
    }
}
