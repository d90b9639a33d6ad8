//! Addresses of an instruction: where it accesses memory.

#[cfg(test)]
mod tests;

use whippen_isa::{Inst, reg};

use crate::facts::{ALL, Facts, Interval, holds};

/// Addresses that are looked at one by one, at most.
pub(crate) const RANGE: i64 = 4096;

/// The first address that an instruction accesses, where it is one of a few.
pub(crate) fn addresses(inst: &Inst, at: u32, facts: &Facts) -> Option<Interval> {
    let offset = i64::from(inst.first_offset()?);
    let base = match inst.base() {
        reg::PC => [i64::from((at.wrapping_add(4) & !3) as i32); 2],
        base => facts.of(base),
    };
    let moved = base.map(|end| end + offset);
    (holds(ALL, moved) && moved[1] - moved[0] < RANGE).then_some(moved)
}
