//! Which exceptions are pending, active and enabled, and their priorities.
//!
//! Exceptions 1 to 15 and interrupts share one numbering: interrupt n is exception 16 + n.

use crate::lines::WORDS;

/// Exception numbers.
pub(crate) const RESET: u32 = 1;
pub(crate) const NMI: u32 = 2;
pub(crate) const HARD_FAULT: u32 = 3;
pub(crate) const MEM_MANAGE: u32 = 4;
pub(crate) const BUS_FAULT: u32 = 5;
pub(crate) const USAGE_FAULT: u32 = 6;
pub(crate) const SV_CALL: u32 = 11;
pub(crate) const PEND_SV: u32 = 14;
pub(crate) const SYS_TICK: u32 = 15;
/// The first interrupt.
pub(crate) const FIRST: u32 = 16;

/// A bit per exception.
pub(crate) type Bits = [u64; WORDS];

/// The interrupt controller, system exceptions included.
#[derive(Clone)]
pub(crate) struct Nvic {
    /// How many exceptions there are: 16 more than interrupts.
    pub count: u32,
    pub pending: Bits,
    pub active: Bits,
    pub enabled: Bits,
    /// Priority by exception; the architecture's negative ones are not here.
    pub priority: Vec<u8>,
}

impl Nvic {
    pub fn new(interrupts: usize) -> Self {
        let count = FIRST + interrupts.min(WORDS * 64 - FIRST as usize) as u32;
        let mut nvic = Self {
            count,
            pending: [0; WORDS],
            active: [0; WORDS],
            enabled: [0; WORDS],
            priority: vec![0; count as usize],
        };
        // System exceptions have no enable of this kind.
        (RESET..FIRST).for_each(|number| set(&mut nvic.enabled, number, true));
        nvic
    }

    pub fn is_pending(&self, number: u32) -> bool {
        get(&self.pending, number)
    }

    pub fn is_active(&self, number: u32) -> bool {
        get(&self.active, number)
    }

    pub fn set_pending(&mut self, number: u32, pending: bool) {
        if number < self.count {
            set(&mut self.pending, number, pending);
        }
    }

    pub fn set_active(&mut self, number: u32, active: bool) {
        if number < self.count {
            set(&mut self.active, number, active);
        }
    }

    /// The priority of an exception: negative for those that cannot be set.
    pub fn priority_of(&self, number: u32) -> i32 {
        match number {
            RESET => -4,
            NMI => -2,
            HARD_FAULT => -1,
            _ => self
                .priority
                .get(number as usize)
                .map_or(256, |p| i32::from(*p)),
        }
    }

    /// The pending, enabled exception that comes first: lowest priority value, then lowest number.
    pub fn next(&self) -> Option<(u32, i32)> {
        let candidates = members(&self.pending, &self.enabled);
        candidates
            .map(|number| (number, self.priority_of(number)))
            .min_by_key(|(number, priority)| (*priority, *number))
    }

    /// The priority values of all active exceptions.
    pub fn active_priorities(&self) -> impl Iterator<Item = i32> + '_ {
        members(&self.active, &self.active).map(|number| self.priority_of(number))
    }
}

pub(crate) fn get(bits: &Bits, number: u32) -> bool {
    bits.get(number as usize / 64)
        .is_some_and(|word| word >> (number % 64) & 1 != 0)
}

fn set(bits: &mut Bits, number: u32, value: bool) {
    if let Some(word) = bits.get_mut(number as usize / 64) {
        *word = *word & !(1 << (number % 64)) | u64::from(value) << (number % 64);
    }
}

/// The numbers in both sets.
fn members<'a>(a: &'a Bits, b: &'a Bits) -> impl Iterator<Item = u32> + 'a {
    (0..WORDS).flat_map(move |word| {
        let mut bits = a[word] & b[word];
        std::iter::from_fn(move || {
            let place = bits.trailing_zeros();
            bits &= bits.wrapping_sub(1);
            (place < 64).then_some(word as u32 * 64 + place)
        })
    })
}
