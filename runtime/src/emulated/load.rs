//! What a board took: the longest ticks, load, missed ticks, faults.

use whippen_emulator::{Observer, Step};

/// What the firmware told of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CoreLoad {
    /// Its keys.
    pub keys: u32,
    /// The longest tick (cycles), from the converter's request to the code that it interrupts.
    pub frame_cycles_max: u64,
    /// All ticks (cycles).
    pub frame_cycles: u64,
    /// Ticks that came before the one before was served.
    pub missed: u32,
    /// Faults, as docs/firmware.md numbers them.
    pub faults: u32,
}

/// What a run took.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Load {
    /// Ticks since the keys began.
    pub ticks: u64,
    /// Cycles of a tick.
    pub period_cycles: u64,
    /// By core.
    pub cores: Vec<CoreLoad>,
}

impl CoreLoad {
    /// The part of all cycles that its ticks took.
    pub fn utilisation(&self, load: &Load) -> f64 {
        self.frame_cycles as f64 / (load.ticks * load.period_cycles).max(1) as f64
    }
}

/// Measures frames: from the converter's request, which comes before the interrupt is entered, to
/// the code that goes on.
#[derive(Debug, Clone, Default)]
pub(super) struct Frames {
    /// The cycle in which each core went on.
    resumed: [u64; 2],
    /// Whether one went on since somebody looked.
    pub has_resumed: bool,
    /// The longest of each core (cycles).
    pub longest: [u64; 2],
    /// All of each core (cycles).
    pub total: [u64; 2],
}

impl Observer for Frames {
    const INSTRUCTIONS: bool = false;

    fn instruction(&mut self, _: &Step<'_>) {}

    fn resumed(&mut self, core: usize, cycle: u64) {
        self.resumed[core & 1] = cycle;
        self.has_resumed = true;
    }

    fn stops(&self) -> bool {
        self.has_resumed
    }
}

impl Frames {
    /// Counts the frame that a core has just left, which was requested in this cycle. Gives its
    /// cycles.
    pub fn served(&mut self, core: usize, request: u64) -> u64 {
        let took = self.resumed[core].saturating_sub(request);
        self.longest[core] = self.longest[core].max(took);
        self.total[core] += took;
        took
    }
}
