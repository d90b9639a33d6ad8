//! Who watches a run: a count of instructions, and what was asked for besides.

use whippen_emulator::{Observer, Step};

use super::profile::Profile;
use super::trace::Trace;

/// Counts instructions.
#[derive(Default)]
pub struct Count {
    /// Of all cores.
    pub instructions: u64,
}

impl Observer for Count {
    #[inline]
    fn instruction(&mut self, _step: &Step<'_>) {
        self.instructions += 1;
    }
}

/// Counts, and traces and profiles if asked to.
#[derive(Default)]
pub struct Watch<'w> {
    /// How many.
    pub count: Count,
    /// Writes every instruction.
    pub trace: Option<Trace<'w>>,
    /// Adds up cycles.
    pub profile: Option<Profile>,
}

impl Observer for Watch<'_> {
    fn instruction(&mut self, step: &Step<'_>) {
        self.count.instruction(step);
        if let Some(trace) = &mut self.trace {
            trace.instruction(step);
        }
        if let Some(profile) = &mut self.profile {
            profile.instruction(step);
        }
    }

    fn exception(&mut self, core: usize, number: u32, cycle: u64) {
        if let Some(trace) = &mut self.trace {
            trace.exception(core, number, cycle);
        }
    }

    fn exception_return(&mut self, core: usize, number: u32, cycle: u64) {
        if let Some(trace) = &mut self.trace {
            trace.exception_return(core, number, cycle);
        }
    }
}
