//! Where an instruction accesses memory, as far as is known.

use whippen_isa::{Inst, reg};

use crate::facts::{Facts, Interval};

/// Addresses that are looked at one by one, at most.
const RANGE_BYTES_MAX: i64 = 4096;

/// The first address that an instruction accesses, where it is known or one of a few.
pub(super) fn addresses(inst: &Inst, at: u32, facts: &Facts) -> Option<Interval> {
    let offset = i64::from(inst.first_offset()?);
    let base = match inst.base() {
        reg::PC => Interval::point((at.wrapping_add(4) & !3) as i32),
        base => facts.interval(base),
    };
    let moved = Interval::of(base.low + offset, base.high + offset);
    (moved.high - moved.low < RANGE_BYTES_MAX).then_some(moved)
}

/// Where an access begins that adds a register to a base which is known; or is near, where the base
/// is the index.
pub(super) fn roughly(inst: &Inst, facts: &Facts) -> Option<Interval> {
    if !inst.is_by_register() || inst.n == reg::PC {
        return None;
    }
    let base = facts.interval(inst.n);
    (base.high - base.low < RANGE_BYTES_MAX).then_some(base)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use whippen_isa::{Arch, parse};

    fn inst(text: &str) -> Inst {
        parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("`{text}`: {why:?}"))
    }

    /// The address, and the base, with R1 from one word to another.
    fn of(text: &str, at: u32, ends: [u32; 2]) -> [Option<[i64; 2]>; 2] {
        let facts = Facts::of_registers(&BTreeMap::from([(1, ends)]));
        let found = [
            addresses(&inst(text), at, &facts),
            roughly(&inst(text), &facts),
        ];
        found.map(|found| found.map(|found| [found.low, found.high]))
    }

    #[test]
    fn addresses_are_base_and_offset() {
        let base = Some([0x200, 0x210]);
        for (text, address) in [
            ("ldr r0, [r1, #4]", Some([0x204, 0x214])),
            ("str r0, [r1, #-4]", Some([0x1fc, 0x20c])),
            ("ldr r0, [r1], #4", base),
            ("strd r0, r2, [r1, #8]", Some([0x208, 0x218])),
            ("ldr r0, [r1, r2]", None),
            ("ldm r1!, {r2, r3}", base),
            ("ldmdb r1!, {r2, r3}", Some([0x1f8, 0x208])),
            ("vldr s0, [r1, #-8]", Some([0x1f8, 0x208])),
            ("stl r0, [r1]", base),
            ("tbb [r1, r2]", None),
        ] {
            let roughly = base.filter(|_| address.is_none());
            assert_eq!(
                of(text, 0x100, [0x200, 0x210]),
                [address, roughly],
                "{text}"
            );
        }
    }

    #[test]
    fn literals_are_known() {
        let of = |text, at| of(text, at, [0, 0]);
        assert_eq!(of("ldr r0, [pc, #8]", 0x100), [Some([0x10c; 2]), None]);
        assert_eq!(of("ldr r0, [pc, #8]", 0x102), [Some([0x10c; 2]), None]);
        assert_eq!(of("ldr.w r0, [pc, #-8]", 0x100), [Some([0xfc; 2]), None]);
        assert_eq!(of("tbb [pc, r1]", 0x100), [None, None]);
    }

    #[test]
    fn so_many_addresses_are_looked_at_one_by_one_and_no_more() {
        let most = 0x200 + RANGE_BYTES_MAX as u32;
        for (text, known) in [
            ("ldr r0, [r1]", [true, false]),
            ("ldr r0, [r1, r2]", [false, true]),
        ] {
            let of = |high| of(text, 0x100, [0x200, high]).map(|found| found.is_some());
            let nothing = [false; 2];
            let found = [of(most - 1), of(most), of(most + 1)];
            assert_eq!(found, [known, nothing, nothing], "{text}");
        }
    }
}
