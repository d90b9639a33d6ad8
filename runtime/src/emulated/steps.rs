//! What a board does instruction by instruction: a trace of some ticks, with registers, and the
//! cycles of all.
//!
//! ```text
//!   request of a tick --cycles--> handlers: instructions, in the machine's order --> goes on
//! ```
//!
//! Kept are the instructions of exceptions, which is where a tick is served; what they interrupt
//! is not.

use std::ops::Range;

use whippen_compiler::image::Segment;
use whippen_emulator::{Observer, Register};
use whippen_isa::timing::Cost;

use super::load::Frames;

/// The registers that are kept: R0 to R12, SP, LR, PC, XPSR.
pub const REGISTERS: usize = 17;

/// An instruction that was executed or skipped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoardStep {
    /// The tick, counted from the first of the keys.
    pub tick: u64,
    /// The core.
    pub core: usize,
    /// The cycle in which it began, since the converter's request.
    pub cycle: u64,
    /// Where it stands.
    pub address: u32,
    /// Its cycles, by reason.
    pub cost: Cost,
    /// The registers it changed (those of [`Register::all`], by number) and what they are behind
    /// it; all of them at a core's first instruction of a tick.
    pub changes: Vec<(u8, u32)>,
}

/// What was kept.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BoardSteps {
    /// Of every tick the cycles of each core, from the converter's request to the code that it
    /// interrupts.
    pub ticks: Vec<Vec<u64>>,
    /// The ticks whose instructions are kept.
    pub of: Range<u64>,
    /// In the order in which the machine ran them.
    pub all: Vec<BoardStep>,
    /// What ran.
    pub segments: Vec<Segment>,
}

/// Keeps them.
#[derive(Debug)]
pub(super) struct StepRecorder {
    pub steps: BoardSteps,
    /// The tick that is served.
    tick: u64,
    /// The cycle in which it was requested.
    request: u64,
    /// By core: its registers behind the last instruction of this tick.
    registers: Vec<Option<[u32; REGISTERS]>>,
}

impl StepRecorder {
    pub fn new(of: Range<u64>, cores: usize) -> StepRecorder {
        StepRecorder {
            steps: BoardSteps {
                of,
                ..BoardSteps::default()
            },
            tick: 0,
            request: 0,
            registers: vec![None; cores],
        }
    }

    /// A tick of the keys begins.
    pub fn begin(&mut self, tick: u64, request: u64) {
        (self.tick, self.request) = (tick, request);
        self.registers.fill(None);
    }

    /// It is over, and took each core so many cycles.
    pub fn end(&mut self, took: Vec<u64>) {
        if self.steps.ticks.len() as u64 == self.tick {
            self.steps.ticks.push(took);
        }
    }

    /// Whether the instructions of this tick are kept.
    pub fn is_recording(&self) -> bool {
        self.steps.of.contains(&self.tick)
    }

    /// It and the measure of frames.
    pub fn with<'r>(&'r mut self, frames: &'r mut Frames) -> FramesAndSteps<'r> {
        FramesAndSteps {
            recorder: self,
            frames,
        }
    }

    fn keep(&mut self, step: &whippen_emulator::Step<'_>) {
        let mut now = [0; REGISTERS];
        for (value, register) in now.iter_mut().zip(Register::all()) {
            *value = step.cpu.get(register);
        }
        let Some(last) = self.registers.get_mut(step.core) else {
            return;
        };
        let last = last.replace(now);
        let numbered = (0..).zip(now);
        let changed = numbered.filter(|(number, value)| {
            let number = usize::from(*number);
            last.is_none_or(|last| last[number] != *value)
        });
        self.steps.all.push(BoardStep {
            tick: self.tick,
            core: step.core,
            cycle: step.cycle.saturating_sub(self.request),
            address: step.address,
            cost: step.cost,
            changes: changed.collect(),
        });
    }
}

/// Watches a tick whose instructions are kept.
pub(super) struct FramesAndSteps<'r> {
    recorder: &'r mut StepRecorder,
    frames: &'r mut Frames,
}

impl Observer for FramesAndSteps<'_> {
    fn instruction(&mut self, step: &whippen_emulator::Step<'_>) {
        // What serves a tick is an exception.
        if step.cpu.exception() != 0 {
            self.recorder.keep(step);
        }
    }

    fn resumed(&mut self, core: usize, cycle: u64) {
        self.frames.resumed(core, cycle);
    }

    fn stops(&self) -> bool {
        self.frames.stops()
    }
}
