//! Which addresses are looked at one by one; what an emulated core accesses is
//! in `executed`.

use whippen_isa::{Arch, Inst, parse};

use super::{RANGE, addresses};
use crate::facts::Facts;

fn inst(text: &str) -> Inst {
    parse(text, Arch::V8M, None).expect("an instruction")
}

/// The address of a literal is from the word of the instruction on, up or down.
#[test]
fn a_literal_is_at_an_address_that_is_known() {
    for (text, at, word) in [
        ("ldr r0, [pc, #8]", 0x100, 0x10c),
        ("ldr r0, [pc, #8]", 0x102, 0x10c),
        ("ldr.w r0, [pc, #-8]", 0x100, 0xfc),
    ] {
        assert_eq!(
            addresses(&inst(text), at, &Facts::default()),
            Some([word; 2])
        );
    }
    // By PC as it is, no literal: it is not told where.
    let dual = addresses(&inst("ldrd r0, r1, [pc, #8]"), 0x100, &Facts::default());
    assert_eq!(dual, Some([0x10c; 2]));
}

#[test]
fn so_many_addresses_are_looked_at_one_by_one_and_no_more() {
    let from = |low: i64, high: i64| {
        let mut facts = Facts::default();
        facts.set(1, [low, high]);
        addresses(&inst("ldr r0, [r1, #4]"), 0x100, &facts)
    };
    assert_eq!(from(0x1000, 0xfff + RANGE), Some([0x1004, 0x1003 + RANGE]));
    assert_eq!(from(0x1000, 0x1000 + RANGE), None);
    // Around where signed words begin again.
    assert_eq!(
        from(0x7fff_fff8, 0x7fff_fffb),
        Some([0x7fff_fffc, 0x7fff_ffff])
    );
    assert_eq!(from(0x7fff_fff8, 0x7fff_fffc), None);
}
