//! The three architectures of the table.

/// An architecture, with the extensions of the core it stands for.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[repr(u8)]
pub enum Arch {
    /// ARMv6-M: Cortex-M0+.
    V6M,
    /// ARMv7E-M with FPv4-SP: Cortex-M4 with its FPU.
    V7EM,
    /// ARMv8-M Mainline with the DSP and Security extensions and FPv5-SP: Cortex-M33 as in RP2350.
    V8M,
}

impl Arch {
    /// All architectures, oldest first. Each has every encoding of the one before.
    pub const ALL: [Self; 3] = [Self::V6M, Self::V7EM, Self::V8M];
}
