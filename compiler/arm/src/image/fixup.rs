//! An address, put into an instruction or a word (Arm IHI 0044, ELF for the Arm architecture).

use std::fmt;

use super::object::FixupKind;

/// Why an address cannot be put there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FixupError {
    /// The target is too far away, or odd.
    Reach {
        /// How far, in bytes.
        distance: i64,
    },
    /// The place leaves its section.
    Outside,
}

impl fmt::Display for FixupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FixupError::Reach { distance } => {
                write!(f, "is {distance} bytes away, further than a branch reaches")
            }
            FixupError::Outside => f.write_str("is to be put outside of its section"),
        }
    }
}

impl FixupKind {
    /// Its number in the ABI.
    pub(super) fn elf_number(self) -> u32 {
        match self {
            FixupKind::Abs32 => 2,
            FixupKind::Rel32 => 3,
            FixupKind::ThumbCall => 10,
            FixupKind::ThumbJump24 => 30,
            FixupKind::MovwAbs => 47,
            FixupKind::MovtAbs => 48,
        }
    }
}

/// Fills in `value` (the symbol's address, bit 0 set for a function, plus addend) for the place at
/// `offset` of a section, which has address `place`.
pub(super) fn apply(
    bytes: &mut [u8],
    offset: u32,
    kind: FixupKind,
    value: u32,
    place: u32,
) -> Result<(), FixupError> {
    let at = offset as usize;
    let slot: &mut [u8; 4] = bytes
        .get_mut(at..at.saturating_add(4))
        .and_then(|s| s.try_into().ok())
        .ok_or(FixupError::Outside)?;
    match kind {
        FixupKind::Abs32 => *slot = value.to_le_bytes(),
        FixupKind::Rel32 => *slot = value.wrapping_sub(place).to_le_bytes(),
        FixupKind::ThumbCall | FixupKind::ThumbJump24 => {
            let distance = i64::from(value & !1) - i64::from(place) - 4;
            branch(slot, distance).ok_or(FixupError::Reach { distance })?;
        }
        FixupKind::MovwAbs => immediate(slot, value as u16),
        FixupKind::MovtAbs => immediate(slot, (value >> 16) as u16),
    }
    Ok(())
}

/// Puts the addend of a relocation where a linker finds it: the ABI keeps addends in the place
/// itself.
pub(super) fn put_addend(
    bytes: &mut [u8],
    offset: u32,
    kind: FixupKind,
    addend: i32,
) -> Result<(), FixupError> {
    let at = offset as usize;
    let slot: &mut [u8; 4] = bytes
        .get_mut(at..at.saturating_add(4))
        .and_then(|s| s.try_into().ok())
        .ok_or(FixupError::Outside)?;
    match kind {
        FixupKind::Abs32 | FixupKind::Rel32 => *slot = addend.to_le_bytes(),
        // Branches count from 4 behind themselves.
        FixupKind::ThumbCall | FixupKind::ThumbJump24 => {
            let distance = i64::from(addend) - 4;
            branch(slot, distance).ok_or(FixupError::Reach { distance })?;
        }
        FixupKind::MovwAbs | FixupKind::MovtAbs => immediate(slot, addend as u16),
    }
    Ok(())
}

fn halves(slot: &[u8; 4]) -> (u16, u16) {
    (
        u16::from_le_bytes([slot[0], slot[1]]),
        u16::from_le_bytes([slot[2], slot[3]]),
    )
}

fn set_halves(slot: &mut [u8; 4], first: u16, second: u16) {
    slot[..2].copy_from_slice(&first.to_le_bytes());
    slot[2..].copy_from_slice(&second.to_le_bytes());
}

/// Encoding T1 of BL and T4 of B: `S imm10`, `J1 J2 imm11` with `I = not (J xor S)`.
fn branch(slot: &mut [u8; 4], distance: i64) -> Option<()> {
    let reach = 1 << 24;
    if distance % 2 != 0 || !(-reach..reach).contains(&distance) {
        return None;
    }
    let bits = distance as u32;
    let sign = bits >> 24 & 1;
    let j = |at: u32| (bits >> at & 1 ^ 1 ^ sign) as u16;
    let (first, second) = halves(slot);
    let first = first & 0xf800 | (sign << 10) as u16 | (bits >> 12 & 0x3ff) as u16;
    let second = second & 0xd000 | j(23) << 13 | j(22) << 11 | (bits >> 1 & 0x7ff) as u16;
    set_halves(slot, first, second);
    Some(())
}

/// `i imm4`, `imm3 imm8` of MOVW and MOVT.
fn immediate(slot: &mut [u8; 4], value: u16) {
    let (first, second) = halves(slot);
    let first = first & 0xfbf0 | (value >> 11 & 1) << 10 | value >> 12;
    let second = second & 0x8f00 | (value >> 8 & 7) << 12 | value & 0xff;
    set_halves(slot, first, second);
}
