//! No translation: Cranelift does not know this computer, so all blocks are interpreted.

use crate::block::Block;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::Flow;

/// Where memory accesses of translated code would be made.
#[derive(Clone, Copy)]
pub(crate) enum Mode {
    Alone,
    Apart,
}

/// There is none.
#[derive(Clone, Copy)]
pub(crate) enum Native {}

impl Native {
    pub fn run(self, _: &mut Cpu, _: &mut Bus) -> (Flow, usize) {
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
    pub fn code(&self, _: Mode) -> Option<Native> {
        None
    }

    pub fn is_due(&mut self, _: Mode, _: usize) -> bool {
        false
    }
}

pub(crate) fn translate(_: &mut Host, _: &mut Block, _: Mode) {}
