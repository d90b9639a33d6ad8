//! Immediates and shifts: from the bits of an encoding to the value they stand for, and back.
//!
//! The names are the manual's: `ThumbExpandImm`, `DecodeImmShift`, `VFPExpandImm`. Each pair
//! inverts exactly; a value without an encoding gives `None`.

/// `ThumbExpandImm`: the value of `i:imm3:imm8`. The three replicating forms of 0 are UNPREDICTABLE
/// and give 0.
pub const fn thumb_expand_imm(imm12: u32) -> u32 {
    let imm8 = imm12 & 0xff;
    match imm12 >> 8 & 0xf {
        0 => imm8,
        1 => imm8 * 0x0001_0001,
        2 => imm8 * 0x0100_0100,
        3 => imm8 * 0x0101_0101,
        _ => (0x80 | imm12 & 0x7f).rotate_right(imm12 >> 7 & 31),
    }
}

/// The `i:imm3:imm8` whose [`thumb_expand_imm`] is `value`. At most one is not UNPREDICTABLE.
pub const fn thumb_shrink_imm(value: u32) -> Option<u32> {
    let imm8 = value & 0xff;
    if value == imm8 {
        return Some(imm8);
    }
    if value == imm8 * 0x0001_0001 {
        return Some(1 << 8 | imm8);
    }
    let second = value >> 8 & 0xff;
    if value == second * 0x0100_0100 {
        return Some(2 << 8 | second);
    }
    if value == imm8 * 0x0101_0101 {
        return Some(3 << 8 | imm8);
    }
    // 1bcdefgh rotated right by 8 to 31: its top bit is the value's top bit.
    let rotation = value.leading_zeros() + 8;
    if rotation > 31 {
        return None;
    }
    let unrotated = value.rotate_left(rotation);
    if unrotated > 0xff {
        None
    } else {
        Some(rotation << 7 | unrotated & 0x7f)
    }
}

/// The carry out of `ThumbExpandImm_C`: nothing when the carry flag stays as it is. Also tells the
/// constants that need the shifter (`Some`) from those that do not.
pub const fn thumb_imm_carry(value: u32) -> Option<bool> {
    match thumb_shrink_imm(value) {
        Some(imm12) if imm12 >> 10 != 0 => Some(value >> 31 != 0),
        _ => None,
    }
}

/// `VFPExpandImm` for single precision: the bits of the float that the 8 bits `abcdefgh` stand for,
/// +-(16 to 31)/16 * 2^(-3 to 4).
pub const fn vfp_expand_imm(imm8: u32) -> u32 {
    let exponent = if imm8 >> 6 & 1 == 0 { 0x80 } else { 0x7c } | imm8 >> 4 & 3;
    (imm8 >> 7 & 1) << 31 | exponent << 23 | (imm8 & 0xf) << 19
}

/// The 8 bits whose [`vfp_expand_imm`] is the float with these `bits`.
pub const fn vfp_shrink_imm(bits: u32) -> Option<u32> {
    let imm8 = bits >> 24 & 0x80 | (bits >> 29 & 1) << 6 | bits >> 19 & 0x3f;
    if vfp_expand_imm(imm8) == bits {
        Some(imm8)
    } else {
        None
    }
}

/// The type of a shift; `RRX` has amount 1.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[repr(u8)]
pub enum ShiftType {
    /// Logical left, amount 0 to 31.
    #[default]
    LSL,
    /// Logical right, amount 1 to 32.
    LSR,
    /// Arithmetic right, amount 1 to 32.
    ASR,
    /// Rotate right, amount 1 to 31.
    ROR,
    /// Rotate right by one through the carry flag.
    RRX,
}

impl ShiftType {
    /// The mnemonic.
    pub const fn name(self) -> &'static str {
        ["lsl", "lsr", "asr", "ror", "rrx"][self as usize]
    }
}

/// `DecodeImmShift`: the shift of a 2-bit type and a 5-bit amount.
pub const fn decode_imm_shift(kind: u32, imm5: u32) -> (ShiftType, u8) {
    match (kind, imm5) {
        (0, _) => (ShiftType::LSL, imm5 as u8),
        (1, 0) => (ShiftType::LSR, 32),
        (1, _) => (ShiftType::LSR, imm5 as u8),
        (2, 0) => (ShiftType::ASR, 32),
        (2, _) => (ShiftType::ASR, imm5 as u8),
        (_, 0) => (ShiftType::RRX, 1),
        _ => (ShiftType::ROR, imm5 as u8),
    }
}

/// The 2-bit type and 5-bit amount of a shift; the inverse of [`decode_imm_shift`] on its range.
pub const fn encode_imm_shift(shift: ShiftType, amount: u8) -> (u32, u32) {
    match shift {
        ShiftType::RRX => (3, 0),
        _ => (shift as u32, (amount & 31) as u32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_modified_immediate_shrinks_to_itself() {
        for imm12 in 0..0x1000 {
            let replicated_zero = (1..4).contains(&(imm12 >> 8)) && imm12 & 0xff == 0;
            let want = if replicated_zero { 0 } else { imm12 };
            assert_eq!(
                thumb_shrink_imm(thumb_expand_imm(imm12)),
                Some(want),
                "{imm12:#x}"
            );
        }
    }

    #[test]
    fn no_other_value_shrinks() {
        let mut x = 1_u32;
        for _ in 0..100_000 {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if let Some(imm12) = thumb_shrink_imm(x) {
                assert_eq!(thumb_expand_imm(imm12), x);
            }
        }
        assert_eq!(thumb_shrink_imm(0x101), None);
        assert_eq!(thumb_shrink_imm(0x8000_0001), None);
    }

    #[test]
    fn carry_comes_only_from_a_rotation() {
        assert_eq!(thumb_imm_carry(0xff), None);
        assert_eq!(thumb_imm_carry(0xff00_ff00), None);
        assert_eq!(thumb_imm_carry(0x8000_0000), Some(true));
        assert_eq!(thumb_imm_carry(0x100), Some(false));
    }

    #[test]
    fn every_float_immediate_shrinks_to_itself() {
        for imm8 in 0..256 {
            let value = f32::from_bits(vfp_expand_imm(imm8));
            assert!((0.125..=31.0).contains(&value.abs()));
            assert_eq!(vfp_shrink_imm(value.to_bits()), Some(imm8));
        }
        assert_eq!(vfp_shrink_imm(0), None);
        assert_eq!(f32::from_bits(vfp_expand_imm(0x70)), 1.0);
    }

    #[test]
    fn shifts_encode_back() {
        for kind in 0..4 {
            for imm5 in 0..32 {
                let (shift, amount) = decode_imm_shift(kind, imm5);
                assert_eq!(encode_imm_shift(shift, amount), (kind, imm5));
            }
        }
    }
}
