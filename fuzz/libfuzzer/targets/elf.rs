//! Any bytes as an ELF: read, loaded and run for a while.
#![no_main]

use libfuzzer_sys::fuzz_target;
use whippen_emulator::elf::{Elf, vector_table};
use whippen_emulator::{Board, CoreKind, Machine};

const CYCLES: u64 = 20_000;

fuzz_target!(|bytes: &[u8]| {
    let Ok(elf) = Elf::parse(bytes, true) else { return };
    let board = Board::generic(CoreKind::CortexM33);
    let vector_table = vector_table(&elf).unwrap_or(board.vector_table);
    let Ok(mut machine) = Machine::new(Board { vector_table, ..board }) else { return };
    machine.semihosting.enabled = true;
    // An image that does not fit this board runs as far as it was loaded.
    let _ = elf.load(&mut machine.bus.memory, true);
    machine.reset();
    machine.run(CYCLES);
});
