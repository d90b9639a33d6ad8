//! Alignment of 32-bit instructions to words, where the core may wait for the second half of one
//! that is not (Cortex-M4): a 16-bit instruction in front takes its 32-bit encoding, which costs no
//! cycle.

use super::{Item, Places};
use whippen_isa::{Arch, Op};

/// Moves item `index`, which is 32 bits long and not word aligned, up by a halfword: one of the
/// 16-bit instructions between it and the last 32-bit one grows. Whether one could.
pub(super) fn align_item(
    items: &[Item],
    sizes: &mut [u32],
    places: &mut Places,
    index: usize,
    arch: Arch,
) -> bool {
    let Some(grown) = item_to_widen(items, sizes, places, index, arch) else {
        return false;
    };
    sizes[grown] = 4;
    let moved = grown + 1..index;
    for (place, item) in places.items[moved.clone()].iter_mut().zip(&items[moved]) {
        *place += 2;
        if let Item::Label(label) = item {
            places.labels[*label] += 2;
        }
    }
    true
}

/// The nearest item in front that may grow; if possible none that an IT is folded into.
fn item_to_widen(
    items: &[Item],
    sizes: &[u32],
    places: &Places,
    index: usize,
    arch: Arch,
) -> Option<usize> {
    let here = |at: &usize| sizes[*at] != 4 && !matches!(items[*at], Item::Function { .. });
    let narrow = (0..index).rev().take_while(here);
    let may_grow = |at: &usize| places.items[*at] & 2 == 0 && has_long_form(&items[*at], arch);
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

fn has_long_form(item: &Item, arch: Arch) -> bool {
    match item {
        Item::Inst { inst, .. } => inst.wide(arch).is_some(),
        Item::Branch { .. } => true,
        Item::Indirect { .. } | Item::Label(_) | Item::Function { .. } | Item::Loop { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use super::super::assemble;
    use super::*;
    use whippen_isa::{ItState, decode, is_wide};

    fn inst(word: u32, arch: Arch) -> Item {
        let (first, second) = match word >> 16 {
            0 => (word as u16, 0),
            first => (first as u16, word as u16),
        };
        Item::Inst {
            inst: decode(first, second, arch, ItState::OUTSIDE).expect("an instruction"),
            origin: None,
            address: None,
        }
    }

    /// Offsets of the 32-bit instructions of some code.
    fn long_ones(words: &[u32], arch: Arch) -> Vec<usize> {
        let items = words.iter().map(|word| inst(*word, arch)).collect();
        let code = assemble(items, 0, arch, "k").expect("code").bytes;
        let halfword = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
        let (mut at, mut long) = (0, Vec::new());
        while at < code.len() {
            let wide = is_wide(halfword(at));
            long.extend(wide.then_some(at));
            at += if wide { 4 } else { 2 };
        }
        long
    }

    const ADDS: u32 = 0x1840;
    const SMULL: u32 = 0xfb82_0103;
    const IT: u32 = 0xbf08;

    #[test]
    fn a_narrow_instruction_grows_in_front_of_a_long_one() {
        let code = [ADDS, SMULL, ADDS, ADDS, SMULL, ADDS, ADDS, ADDS, SMULL];
        assert_eq!(long_ones(&code, Arch::V7EM), [0, 4, 12, 20, 24]);
        assert_eq!(long_ones(&code, Arch::V8M), [2, 10, 20]);
    }

    #[test]
    fn an_it_in_front_stays_as_it_is() {
        assert_eq!(long_ones(&[IT, SMULL], Arch::V7EM), [2]);
    }
}
