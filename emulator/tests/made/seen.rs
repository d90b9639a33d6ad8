//! What can be seen of a machine with two cores, to compare it with another one.

use std::fmt::Debug;

use whippen_emulator::{Machine, Register};

/// Of its cores: registers, cycles, what was counted.
pub fn cores(machine: &Machine) -> impl PartialEq + Debug + use<> {
    let cores = [0, 1].map(|core| {
        let registers = Register::all().map(|register| machine.cpu(core).get(register));
        (machine.cycle(core), registers.collect::<Vec<_>>())
    });
    (cores, machine.instructions(), machine.waited_cycles())
}

/// The first bytes of RAM.
pub fn ram(machine: &Machine, size: usize) -> Vec<u8> {
    let mut bytes = vec![0; size];
    let memory = &machine.bus.memory;
    memory.read(0x2000_0000, &mut bytes).expect("RAM");
    bytes
}
