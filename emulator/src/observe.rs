//! Watching a run, instruction by instruction.

use whippen_isa::Inst;
use whippen_isa::timing::Cost;

use crate::cpu::Cpu;

/// One executed instruction.
#[derive(Clone, Copy)]
pub struct Step<'a> {
    /// Which core.
    pub core: usize,
    /// Its address.
    pub address: u32,
    /// The instruction.
    pub inst: &'a Inst,
    /// The cycle it began in.
    pub cycle: u64,
    /// Cycles it took, by reason, wait states included.
    pub cost: Cost,
    /// The core behind it: its registers, and where it goes on.
    pub cpu: &'a Cpu,
}

/// Whoever watches. The run without one costs nothing for it.
pub trait Observer {
    /// Whether it looks at instructions. Who looks at exceptions alone leaves a run as fast as it
    /// is without observers.
    const INSTRUCTIONS: bool = true;

    /// After each instruction that was executed or skipped; not one that raised a fault.
    fn instruction(&mut self, step: &Step<'_>);

    /// After an exception was taken: its number, and the cycle in which its handler begins.
    fn exception(&mut self, _core: usize, _number: u32, _cycle: u64) {}

    /// After the return from an exception, before registers are restored or the next is taken.
    fn exception_return(&mut self, _core: usize, _number: u32, _cycle: u64) {}

    /// After an exception was left: the cycle in which the code goes on that it interrupted.
    fn resumed(&mut self, _core: usize, _cycle: u64) {}

    /// Whether the run ends here, with [`Stop::Limit`](crate::Stop::Limit): asked after each
    /// exception that was left, and some instructions.
    fn stops(&self) -> bool {
        false
    }
}
