//! Who watches a run, when a trace or a profile was asked for.

use whippen_emulator::{Observer, Step};

use super::profile::Profile;
use super::trace::Trace;

/// Traces and profiles, if asked to.
#[derive(Default)]
pub struct Watch<'w> {
    /// Writes every instruction.
    pub trace: Option<Trace<'w>>,
    /// Adds up cycles.
    pub profile: Option<Profile>,
}

impl Observer for Watch<'_> {
    fn instruction(&mut self, step: &Step<'_>) {
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
