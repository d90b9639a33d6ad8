//! No translation: Cranelift does not know this computer, so all blocks are interpreted.

use crate::apart::Before;
use crate::block::Block;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::Flow;

/// Where memory accesses of translated code would be made.
#[derive(Clone, Copy)]
pub(crate) enum RunMode {
    Alone,
    Apart,
}

/// A block in a state of the pipeline.
pub(crate) struct Node {
    pub block: usize,
    pub pipe: u16,
}

/// Time, for translated code.
pub(crate) struct Time {
    pub left: u64,
    pub instructions: u64,
    pub end: u64,
    pub before: Before,
}

impl Time {
    pub fn new(left: u64, instructions: u64) -> Self {
        Self {
            left,
            instructions,
            end: 0,
            before: Before::default(),
        }
    }
}

/// How translated code would have ended.
pub(crate) struct Exit {
    pub block: usize,
    pub pipe: u16,
    pub flow: Option<Flow>,
    pub done: usize,
}

/// There is none.
#[derive(Clone, Copy)]
pub(crate) enum Native {}

impl Native {
    pub fn run(self, _: &mut Cpu, _: &mut Bus, _: &mut Time) -> Exit {
        match self {}
    }

    pub fn run_apart(self, _: &mut Cpu, _: &mut Bus, _: &mut Time) -> Exit {
        match self {}
    }
}

/// Holds nothing.
#[derive(Default)]
pub(crate) struct Host;

impl Host {
    pub fn clear(&mut self) {}
}

/// Is never due.
#[derive(Default)]
pub(crate) struct Translated;

impl Translated {
    pub fn code(&self, _: RunMode, _: u16) -> Option<Native> {
        None
    }

    #[cfg(test)]
    pub fn count(&self, _: RunMode) -> usize {
        0
    }

    pub fn is_due(&mut self, _: usize) -> bool {
        false
    }
}

pub(crate) fn translate(_: &mut Host, _: &mut [Block], _: Node, _: RunMode) {}
