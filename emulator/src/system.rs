//! What every core has for itself at 0xE0000000.

use crate::board::CoreKind;

/// The private peripherals of a core.
#[derive(Clone)]
pub(crate) struct System {
    pub kind: CoreKind,
    pub interrupts: usize,
    pub vtor: u32,
}

impl System {
    pub fn new(kind: CoreKind, interrupts: usize) -> Self {
        Self { kind, interrupts, vtor: 0 }
    }
}
