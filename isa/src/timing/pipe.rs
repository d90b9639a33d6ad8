//! What the pipeline remembers between two instructions.

/// The state of the pipeline in front of an instruction. `default()` is that after a branch, with
/// nothing under way.
///
/// Canonical: what can no longer matter is zero, so that blocks are entered in few distinct states.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Pipe {
    /// Single-precision registers that are not there yet, bit n for Sn.
    pub(super) late_singles: u32,
    /// Core registers that are one cycle late, bit n for Rn.
    pub(super) late: u16,
    /// Who has to wait for those: a set of [`Takers`](super::Takers).
    pub(super) late_for: u8,
    /// Cycles until the late single-precision registers are there.
    pub(super) singles_in: u8,
    /// Cycles until the floating-point unit takes another instruction.
    pub(super) float_busy: u8,
    /// A set of the constants below.
    pub(super) about: u16,
}

/// Small enough to be a key.
const _: () = assert!(size_of::<Pipe>() <= 16);

impl Pipe {
    /// The instruction was reached from the one before it in memory, not by a branch.
    pub(super) const SEQUENTIAL: u16 = 1;
    /// The instruction before can take a folded branch, NOP or IT.
    pub(super) const HOST: u16 = 2;
    /// It was a NOP or IT that any 16-bit instruction may join.
    pub(super) const EMPTY: u16 = 4;
    /// It set the flags, outside an IT block. Only remembered with `HOST`.
    pub(super) const FLAGS: u16 = 8;
    /// It was PUSH or POP.
    pub(super) const STACK: u16 = 16;
    /// The flags are one cycle late.
    pub(super) const LATE_FLAGS: u16 = 32;
    /// The late single-precision registers come from a multiply-add, whose result another one may
    /// add to a cycle early.
    pub(super) const FLOAT_SUM: u16 = 64;
    /// It was a load that the next access may start under.
    pub(super) const OVERLAPPED: u16 = 128;
    /// The flags of FPSCR come when the late single-precision registers do.
    pub(super) const LATE_FPSCR: u16 = 256;
    /// All that is said of the late single-precision registers.
    pub(super) const OF_SINGLES: u16 = Self::FLOAT_SUM | Self::LATE_FPSCR;
    /// It was a store, and what loads behind it may have to wait.
    pub(super) const STORED: u16 = 512;

    /// Whether no instruction costs more behind it than behind nothing.
    pub const fn delays_nobody(&self) -> bool {
        let late = self.late != 0 || self.singles_in != 0 || self.float_busy != 0;
        !late && !self.is(Self::LATE_FLAGS | Self::STORED)
    }

    /// All that it remembers, as one number: of equal states the same.
    pub const fn to_bits(&self) -> u128 {
        self.late_singles as u128
            | (self.late as u128) << 32
            | (self.about as u128) << 48
            | (self.late_for as u128) << 64
            | (self.singles_in as u128) << 72
            | (self.float_busy as u128) << 80
    }

    /// The state that a number is of.
    pub const fn from_bits(bits: u128) -> Self {
        Self {
            late_singles: bits as u32,
            late: (bits >> 32) as u16,
            about: (bits >> 48) as u16,
            late_for: (bits >> 64) as u8,
            singles_in: (bits >> 72) as u8,
            float_busy: (bits >> 80) as u8,
        }
    }

    pub(super) const fn is(&self, about: u16) -> bool {
        self.about & about != 0
    }
}
