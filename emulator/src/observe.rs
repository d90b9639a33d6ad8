//! Watching a run, instruction by instruction.

use whippen_isa::Inst;

/// One executed instruction.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Which core.
    pub core: usize,
    /// Its address.
    pub address: u32,
    /// The instruction; absent where there was none and a fault was raised.
    pub inst: Option<&'a Inst>,
    /// The cycle it began in.
    pub cycle: u64,
    /// Cycles it took, wait states included.
    pub cycles: u32,
}

/// Whoever watches. The run without one costs nothing for it.
pub trait Observer {
    /// After each instruction.
    fn instruction(&mut self, step: &Step<'_>);

    /// After an exception was taken: its number, and the cycle in which its handler begins.
    fn exception(&mut self, _core: usize, _number: u32, _cycle: u64) {}

    /// After the return from an exception.
    fn exception_return(&mut self, _core: usize, _number: u32, _cycle: u64) {}
}
