//! The relocations that a compiler leaves in a Thumb object file.
//!
//! Source: ELF for the Arm Architecture (IHI 0044), "Relocation". S is the symbol, A the addend
//! that the place holds, P the place, T 1 for a Thumb function.

use super::{ElfError, corrupt};
use whippen_isa::is_wide;

/// One relocation, with everything it needs.
pub(super) struct Relocation {
    /// Its number.
    pub kind: u32,
    /// P
    pub place: u32,
    /// S
    pub symbol: u32,
    /// T
    pub thumb: bool,
}

const NONE: u32 = 0;
const ABS32: u32 = 2;
const REL32: u32 = 3;
const THM_CALL: u32 = 10;
const THM_JUMP24: u32 = 30;
/// For constructors; the same as ABS32 on bare metal.
const TARGET1: u32 = 38;
const V4BX: u32 = 40;
const PREL31: u32 = 42;
const THM_MOVW_ABS_NC: u32 = 47;
const THM_MOVT_ABS: u32 = 48;
const THM_JUMP19: u32 = 51;
const THM_JUMP11: u32 = 102;

/// Changes what stands at `offset`.
pub(super) fn apply(bytes: &mut [u8], offset: u32, r: &Relocation) -> Result<(), ElfError> {
    let size = if r.kind == THM_JUMP11 { 2 } else { 4 };
    let from = offset as usize;
    let place = from
        .checked_add(size)
        .and_then(|end| bytes.get_mut(from..end));
    let place = place.ok_or_else(|| corrupt("a relocation lies outside of its section"))?;
    let code = r.symbol | u32::from(r.thumb);
    match r.kind {
        NONE | V4BX => Ok(()),
        ABS32 | TARGET1 => set_word(
            place,
            word(place).wrapping_add(r.symbol) | u32::from(r.thumb),
        ),
        REL32 => set_word(
            place,
            (word(place).wrapping_add(r.symbol) | u32::from(r.thumb)).wrapping_sub(r.place),
        ),
        PREL31 => {
            let value = word(place).wrapping_add(code).wrapping_sub(r.place);
            set_word(place, word(place) & 1 << 31 | value & !(1 << 31))
        }
        THM_MOVW_ABS_NC => set_mov(place, |addend| {
            r.symbol.wrapping_add(addend) | u32::from(r.thumb)
        }),
        THM_MOVT_ABS => set_mov(place, |addend| r.symbol.wrapping_add(addend) >> 16),
        THM_CALL | THM_JUMP24 => set_branch(place, r, 25),
        THM_JUMP19 => set_conditional(place, r),
        THM_JUMP11 => set_short_branch(place, r),
        other => Err(ElfError::NeedsLinker(format!(
            "a relocation of type {other}"
        ))),
    }
}

fn word(place: &[u8]) -> u32 {
    place
        .iter()
        .rev()
        .fold(0, |word, byte| word << 8 | u32::from(*byte))
}

fn set_word(place: &mut [u8], value: u32) -> Result<(), ElfError> {
    place
        .iter_mut()
        .zip(value.to_le_bytes())
        .for_each(|(to, from)| *to = from);
    Ok(())
}

/// The two halfwords of a 32-bit instruction, the first one in the high half.
fn wide(place: &[u8]) -> Result<u32, ElfError> {
    let instruction = word(place).rotate_left(16);
    let plausible = is_wide((instruction >> 16) as u16);
    plausible
        .then_some(instruction)
        .ok_or_else(|| corrupt("a relocation of no 32-bit instruction"))
}

/// The 16-bit immediate of MOVW and MOVT is imm4:i:imm3:imm8.
fn set_mov(place: &mut [u8], value: impl FnOnce(u32) -> u32) -> Result<(), ElfError> {
    let inst = wide(place)?;
    let addend = inst >> 4 & 0xf000 | inst >> 15 & 0x800 | inst >> 4 & 0x700 | inst & 0xff;
    let v = value((addend as u16 as i16) as u32) & 0xffff;
    let bits = (v & 0xf000) << 4 | (v & 0x800) << 15 | (v & 0x700) << 4 | v & 0xff;
    set_word(place, (inst & 0xfbf0_8f00 | bits).rotate_left(16))
}

/// The distance to a branch's target, which must lie within `bits` signed bits.
fn distance(r: &Relocation, addend: i32, bits: u32) -> Result<u32, ElfError> {
    let distance = r.symbol.wrapping_add(addend as u32).wrapping_sub(r.place) as i32;
    let reach = 1 << (bits - 1);
    match (-reach..reach).contains(&distance) {
        true => Ok(distance as u32),
        false => Err(ElfError::NeedsLinker(
            "a branch that does not reach its target".into(),
        )),
    }
}

fn sign_extended(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)) as i32 >> (32 - bits)
}

/// BL and B.W: S:I1:I2:imm10:imm11:0, with J = not (I xor S).
fn set_branch(place: &mut [u8], r: &Relocation, bits: u32) -> Result<(), ElfError> {
    let inst = wide(place)?;
    let (s, j1, j2) = (inst >> 26 & 1, inst >> 13 & 1, inst >> 11 & 1);
    let (i1, i2) = (!(j1 ^ s) & 1, !(j2 ^ s) & 1);
    let addend = s << 24 | i1 << 23 | i2 << 22 | (inst >> 16 & 0x3ff) << 12 | (inst & 0x7ff) << 1;
    let d = distance(r, sign_extended(addend, bits), bits)?;
    let s = d >> 24 & 1;
    let (j1, j2) = (!(d >> 23 ^ s) & 1, !(d >> 22 ^ s) & 1);
    let value = s << 26 | (d >> 12 & 0x3ff) << 16 | j1 << 13 | j2 << 11 | d >> 1 & 0x7ff;
    set_word(place, (inst & 0xf800_d000 | value).rotate_left(16))
}

/// B<c>.W: S:J2:J1:imm6:imm11:0.
fn set_conditional(place: &mut [u8], r: &Relocation) -> Result<(), ElfError> {
    let inst = wide(place)?;
    let addend = (inst >> 26 & 1) << 20
        | (inst >> 11 & 1) << 19
        | (inst >> 13 & 1) << 18
        | (inst >> 16 & 63) << 12
        | (inst & 0x7ff) << 1;
    let d = distance(r, sign_extended(addend, 21), 21)?;
    let value = (d >> 20 & 1) << 26
        | (d >> 12 & 63) << 16
        | (d >> 18 & 1) << 13
        | (d >> 19 & 1) << 11
        | d >> 1 & 0x7ff;
    set_word(place, (inst & 0xfbc0_d000 | value).rotate_left(16))
}

/// B: imm11:0.
fn set_short_branch(place: &mut [u8], r: &Relocation) -> Result<(), ElfError> {
    let inst = word(place);
    let d = distance(r, sign_extended((inst & 0x7ff) << 1, 12), 12)?;
    set_word(place, inst & 0xf800 | d >> 1 & 0x7ff)
}
