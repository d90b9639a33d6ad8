//! What an instruction costs behind others, each case counted once by `isa::timing` and looked up
//! after that.
//!
//! An instruction behind another is reached in sequence, so where it lies does not matter: only a
//! branch's target does, and what a block begins with.

use rustc_hash::FxHashMap;
use whippen_isa::timing::{Core, Outcome, Pipe, Timed};

/// The states of the pipeline that some instructions can leave.
pub(super) struct PipelineStates {
    core: Core,
    insts: Vec<Timed>,
    states: Vec<Pipe>,
    numbers: FxHashMap<Pipe, u16>,
    /// By state and instruction: the state behind it, and its cycles; [`UNKNOWN`] until somebody
    /// asks.
    behind: Vec<(u16, u16)>,
}

/// The state in which nothing is under way.
pub(super) const START: u16 = 0;

const UNKNOWN: (u16, u16) = (u16::MAX, 0);

impl PipelineStates {
    pub fn new(core: &Core, insts: Vec<Timed>) -> PipelineStates {
        let mut pipes = PipelineStates {
            core: *core,
            insts,
            states: Vec::new(),
            numbers: FxHashMap::default(),
            behind: Vec::new(),
        };
        pipes.number(Pipe::default());
        pipes
    }

    /// The state behind an instruction, by its number, and its cycles.
    pub fn issue(&mut self, state: u16, inst: u16) -> (u16, u16) {
        let at = usize::from(state) * self.insts.len() + usize::from(inst);
        if self.behind[at] == UNKNOWN {
            let pipe = self.states[usize::from(state)];
            let (pipe, cost) =
                self.core
                    .issue(pipe, &self.insts[usize::from(inst)], 0, &Outcome::NEXT);
            self.behind[at] = (self.number(pipe), cost.cycles() as u16);
        }
        self.behind[at]
    }

    /// Cycles of an instruction of which more is known.
    pub fn cycles(&self, state: u16, inst: u16, outcome: &Outcome) -> u32 {
        self.core
            .issue(
                self.states[usize::from(state)],
                &self.insts[usize::from(inst)],
                0,
                outcome,
            )
            .1
            .cycles()
    }

    fn number(&mut self, pipe: Pipe) -> u16 {
        let (states, behind) = (&mut self.states, &mut self.behind);
        *self.numbers.entry(pipe).or_insert_with(|| {
            states.push(pipe);
            behind.resize(states.len() * self.insts.len(), UNKNOWN);
            states.len() as u16 - 1
        })
    }
}
