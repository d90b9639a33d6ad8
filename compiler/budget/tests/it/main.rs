//! The static bound against the emulator, which counts the same cycles in another way: by running.

mod called;
mod compiled;
mod followed;
mod forced;
mod image;
mod images;
mod loops;
mod program;
mod random;
mod refused;
mod sound;
mod together;

use std::collections::BTreeMap;

use whippen_budget::{Annotations, Bound, Code, NotBounded, Query, bound};
use whippen_emulator::{Board, CoreKind, Machine, Register, Stop};
use whippen_isa::timing::{Core, Target};

/// Where programs lie: not word aligned by themselves.
const CODE: u32 = 0x2000_0100;
/// Where R8 points.
const DATA: u32 = 0x2004_0000;

/// Functions return to where there is no memory: not to a 32-bit instruction.
fn returning() -> Annotations {
    Annotations {
        return_to: Some(Target {
            address: 0,
            wide: false,
        }),
        ..Annotations::default()
    }
}

fn bound_of(code: &Code, entry: u32, annotations: &Annotations) -> Result<Bound, NotBounded> {
    bound(&Query {
        core: &Core::cortex_m33(),
        code,
        entry,
        annotations,
        interference: None,
    })
}

fn machine(code: &[u8]) -> Machine {
    let mut machine = Machine::new(Board::generic(CoreKind::CortexM33)).expect("a board");
    machine.bus.memory.write(CODE, code).expect("RAM");
    machine
}

/// Cycles from the entry to the return, with these values in registers.
fn observed(machine: &mut Machine, entry: u32, registers: &BTreeMap<u8, u32>) -> u64 {
    for (&register, &value) in registers {
        machine.cpu_mut(0).set(Register::core(register), value);
    }
    machine.cpu_mut(0).set(Register::core(13), 0x2008_0000);
    let argument = |register| registers.get(&register).copied().unwrap_or(0);
    let stop = machine.call(entry | 1, [0, 1, 2, 3].map(argument), 1_000_000);
    let Stop::Returned { cycles, .. } = stop else {
        panic!("{stop}")
    };
    cycles
}
