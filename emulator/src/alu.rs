//! The arithmetic that the manual names: `AddWithCarry`, `Shift_C`, `SignedSatQ`, `UnsignedSatQ`.

use whippen_isa::ShiftType;

/// `AddWithCarry`: result, carry and overflow.
#[inline(always)]
pub(crate) fn add_with_carry(x: u32, y: u32, carry: bool) -> (u32, bool, bool) {
    let wide = u64::from(x) + u64::from(y) + u64::from(carry);
    let result = wide as u32;
    (
        result,
        wide >> 32 != 0,
        ((x ^ result) & (y ^ result)) >> 31 != 0,
    )
}

/// `Shift_C` by an amount of 0 to 255 (`RRX` always by 1): result and carry; the carry stays when
/// the amount is 0.
#[inline(always)]
pub(crate) fn shift_c(value: u32, shift: ShiftType, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match shift {
        ShiftType::LSL => lsl_c(value, amount),
        ShiftType::LSR => lsr_c(value, amount),
        ShiftType::ASR => asr_c(value, amount),
        ShiftType::ROR => (
            value.rotate_right(amount % 32),
            value.rotate_right(amount % 32) >> 31 != 0,
        ),
        ShiftType::RRX => (u32::from(carry) << 31 | value >> 1, value & 1 != 0),
    }
}

/// `LSL_C`, amount at least 1.
fn lsl_c(value: u32, amount: u32) -> (u32, bool) {
    let wide = if amount > 32 {
        0
    } else {
        u64::from(value) << amount
    };
    (wide as u32, wide >> 32 & 1 != 0)
}

/// `LSR_C`, amount at least 1.
fn lsr_c(value: u32, amount: u32) -> (u32, bool) {
    let before = value.checked_shr(amount - 1).unwrap_or(0);
    (before >> 1, before & 1 != 0)
}

/// `ASR_C`, amount at least 1.
fn asr_c(value: u32, amount: u32) -> (u32, bool) {
    let before = value as i32 >> (amount - 1).min(31);
    ((before >> 1) as u32, before & 1 != 0)
}

/// `SignedSatQ` to `bits` (1 to 32): the value, and whether it was saturated.
pub(crate) fn signed_sat_q(value: i64, bits: u32) -> (i32, bool) {
    let top = (1_i64 << (bits - 1)) - 1;
    let saturated = value.clamp(-top - 1, top);
    (saturated as i32, saturated != value)
}

/// `UnsignedSatQ` to `bits` (0 to 32): the value, and whether it was saturated.
pub(crate) fn unsigned_sat_q(value: i64, bits: u32) -> (u32, bool) {
    let saturated = value.clamp(0, (1_i64 << bits) - 1);
    (saturated as u32, saturated != value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addition_gives_carry_and_overflow() {
        assert_eq!(add_with_carry(u32::MAX, 0, true), (0, true, false));
        assert_eq!(
            add_with_carry(0x7fff_ffff, 1, false),
            (0x8000_0000, false, true)
        );
        assert_eq!(add_with_carry(5, !5, true), (0, true, false));
        assert_eq!(
            add_with_carry(0x8000_0000, !1, true),
            (0x7fff_ffff, true, true)
        );
    }

    #[test]
    fn shifts_by_a_word_and_more() {
        let v = 0x8000_0001;
        assert_eq!(shift_c(v, ShiftType::LSL, 32, false), (0, true));
        assert_eq!(shift_c(v, ShiftType::LSL, 33, true), (0, false));
        assert_eq!(shift_c(v, ShiftType::LSR, 32, false), (0, true));
        assert_eq!(shift_c(v, ShiftType::LSR, 255, true), (0, false));
        assert_eq!(shift_c(v, ShiftType::ASR, 200, false), (u32::MAX, true));
        assert_eq!(shift_c(v, ShiftType::ROR, 64, false), (v, true));
        assert_eq!(shift_c(v, ShiftType::RRX, 1, true), (0xc000_0000, true));
    }

    #[test]
    fn saturation_says_so() {
        assert_eq!(signed_sat_q(128, 8), (127, true));
        assert_eq!(signed_sat_q(-1, 1), (-1, false));
        assert_eq!(unsigned_sat_q(-1, 32), (0, true));
        assert_eq!(unsigned_sat_q(1, 0), (0, true));
    }
}
