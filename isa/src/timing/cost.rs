//! What one instruction cost, cycle by cycle with the reason.

use crate::reg::{RegSet, core_name};
use core::fmt;

macro_rules! reasons {
    ($($(#[doc = $doc:literal])+ $reason:ident $text:literal,)+) => {
        /// Why a cycle was spent, or saved.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
        #[repr(u8)]
        pub enum Reason { $($(#[doc = $doc])+ $reason,)+ }

        impl Reason {
            /// All reasons, in the order of printing.
            pub const ALL: &[Self] = &[$(Self::$reason),+];
        }

        const TEXTS: &[&str] = &[$($text),+];
    };
}

reasons! {
    /// The instruction's own cycles; of a load or store, one per register.
    Issue "issue",
    /// The cycle of an instruction whose condition failed.
    Skipped "skipped",
    /// Cycles of a division beyond its shortest.
    Divide "divide",
    /// Saved: it shared a cycle with the 16-bit instruction before it.
    Folded "folded",
    /// Saved: it started under the load before it.
    Pipelined "pipelined",
    /// Saved: what it accessed is one cycle away.
    Near "near",
    /// A source register was not there yet.
    LateResult "late",
    /// The flags were not there yet.
    LateFlags "late flags",
    /// The floating-point unit was busy.
    FloatBusy "fpu busy",
    /// Fetching from the target of a taken branch.
    Refill "refill",
    /// The target of the branch came from memory.
    LoadedTarget "loaded target",
    /// The target is a 32-bit instruction that straddles two words.
    SplitTarget "split target",
    /// At worst: a 32-bit instruction that is not word aligned was not fetched yet.
    Misaligned "misaligned",
    /// At worst: a load right after a store.
    AfterStore "after a store",
    /// At worst: a load from an address that the load before it made.
    DependentLoad "dependent load",
    /// Memory was not ready: wait states, contention.
    Bus "bus",
}

impl Reason {
    /// How many there are.
    pub const COUNT: usize = Self::ALL.len();

    /// As in a trace.
    pub const fn text(self) -> &'static str {
        TEXTS[self as usize]
    }
}

/// The cycles of one instruction, by reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cost {
    parts: [i32; Reason::COUNT],
    waited_for: RegSet,
}

impl Cost {
    /// All cycles: the sum of the parts. 0 for an instruction that was folded.
    pub fn cycles(&self) -> u32 {
        self.parts.iter().sum::<i32>().max(0) as u32
    }

    /// The cycles for one reason; negative where a reason saves.
    pub fn part(&self, reason: Reason) -> i32 {
        self.parts[reason as usize]
    }

    /// The parts that are not zero.
    pub fn parts(&self) -> impl Iterator<Item = (Reason, i32)> + '_ {
        Reason::ALL
            .iter()
            .map(|&reason| (reason, self.part(reason)))
            .filter(|(_, cycles)| *cycles != 0)
    }

    /// The late registers it waited for.
    pub fn waited_for(&self) -> RegSet {
        self.waited_for
    }

    pub(super) fn add(&mut self, reason: Reason, cycles: i32) {
        self.parts[reason as usize] += cycles;
    }

    pub(super) fn wait_for(&mut self, registers: RegSet, cycles: u8) {
        self.add(Reason::LateResult, i32::from(cycles));
        self.waited_for = self.waited_for.union(registers);
    }
}

/// As in `2: 1 issue, 1 late r0`.
impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.cycles())?;
        for (i, (reason, cycles)) in self.parts().enumerate() {
            f.write_str(if i == 0 { ": " } else { ", " })?;
            write!(f, "{cycles} {}", reason.text())?;
            if reason == Reason::LateResult {
                fmt_registers(self.waited_for, f)?;
            }
        }
        Ok(())
    }
}

fn fmt_registers(set: RegSet, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for n in (0..16).filter(|n| set.core_bits() >> n & 1 != 0) {
        write!(f, " {}", core_name(n))?;
    }
    for n in (0..32).filter(|n| set.single_bits() >> n & 1 != 0) {
        write!(f, " s{n}")?;
    }
    Ok(())
}
