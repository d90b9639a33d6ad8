//! Machines to test with, and programs written with the instruction table.

use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Step};

/// Where code is put.
pub const CODE: u32 = 0x2000_0000;
/// Plain data.
pub const DATA: u32 = 0x2001_0000;
/// The top of the stack.
pub const STACK: u32 = 0x2002_0000;

/// A machine of one kind with 256 KiB of RAM and `words` of code as halfwords at [`CODE`].
pub fn machine(core: CoreKind, halfwords: &[u16]) -> Machine {
    let board = Board {
        regions: vec![Region::ram("ram", CODE, 0x4_0000)],
        vector_table: CODE,
        ..Board::generic(core)
    };
    let mut machine = Machine::new(board).expect("a board");
    let bytes: Vec<u8> = halfwords.iter().flat_map(|h| h.to_le_bytes()).collect();
    machine.bus.memory.write(CODE, &bytes).expect("code fits");
    machine
        .cpu_mut(0)
        .set(whippen_emulator::Register::SP, STACK);
    machine
}

/// xorshift64*.
pub struct Random(pub u64);

impl Random {
    pub fn word(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32) as u32
    }
}

/// Counts instructions and their cycles.
#[derive(Default)]
pub struct Count {
    pub instructions: u64,
    pub cycles: u64,
}

impl Observer for Count {
    fn instruction(&mut self, step: &Step<'_>) {
        self.instructions += 1;
        self.cycles += u64::from(step.cost.cycles());
    }
}
