//! Register roles: what each register of a core means while keys are ticked.
//!
//! Four registers hold addresses, from the entry of `NAME_tick` to its end; the allocator has all
//! others but SP and PC. `state_layout` draws what lies behind each of the four.

/// The state that all keys of the core share.
pub(super) const STATE: u8 = 6;
/// This key's record.
pub(super) const RECORD: u8 = 7;
/// This key's sample words: the sensor word, and the drive word at a constant distance.
pub(super) const SAMPLES: u8 = 10;
/// This key's slot in the current row of the first line's history.
pub(super) const HISTORY: u8 = 11;
/// What the allocator may use; all others have a role.
pub(super) const FREE: [u8; 10] = [0, 1, 2, 3, 4, 5, 8, 9, 12, 14];
/// The same as bits.
pub(super) const ALL_FREE: u32 = {
    let mut all = 0;
    let mut at = 0;
    while at < FREE.len() {
        all |= 1 << FREE[at];
        at += 1;
    }
    all
};

/// Each of these registers but one, all as bits, the lowest first.
pub(super) fn others(registers: u32, own: u32) -> impl Iterator<Item = u32> {
    (0..u32::BITS)
        .map(|reg| 1 << reg)
        .filter(move |reg| registers & !own & reg != 0)
}
