//! State machines by programs of the datasheets' kind, on a board's bus.

use super::*;
use crate::boards::{BoardKind, ConverterSetup, build};
use crate::machine::Machine;

const PIO: u32 = 0x5020_0000;
const CLKDIV: u32 = PIO + 0xc8;
const EXECCTRL: u32 = PIO + 0xcc;
const SHIFTCTRL: u32 = PIO + 0xd0;
const INSTR: u32 = PIO + 0xd8;
const PINCTRL: u32 = PIO + 0xdc;
/// From one machine's registers to the next.
const STRIDE: u32 = 0x18;

/// A chip whose cores stand still: the block and its pins at work.
struct Bench {
    machine: Machine,
    cycle: u64,
}

impl Bench {
    fn new(kind: BoardKind) -> Self {
        let (machine, _) = build(kind, kind.board(), ConverterSetup::default()).expect("a board");
        let mut bench = Self { machine, cycle: 0 };
        let (io, pads) = match kind {
            BoardKind::Rp2040 => (0x4001_4000, 0x4001_c000),
            _ => (0x4002_8000, 0x4003_8000),
        };
        for pin in 0..30 {
            bench.write(io + 8 * pin + 4, 6);
            bench.write(pads + 4 * pin + 4, 0x46);
        }
        bench.machine.bus.pins.record();
        bench
    }

    /// The first block.
    fn pio(&self) -> DeviceId {
        self.machine.bus.at(PIO).expect("a block")
    }

    /// Its first machine.
    fn machine0(&self) -> &machine::StateMachine {
        let pio = self.machine.bus.device::<Pio>(self.pio());
        &pio.expect("a block").machines[0]
    }

    fn write(&mut self, address: u32, value: u32) {
        let cycle = self.cycle;
        self.machine.bus.attend(cycle);
        let write = self.machine.bus.device_write(address, 4, value, 0, cycle);
        write.expect("a register");
    }

    fn read(&mut self, address: u32) -> u32 {
        self.machine.bus.attend(self.cycle);
        let read = self.machine.bus.device_read(address, 4, 0, self.cycle);
        read.expect("a register").0
    }

    fn program(&mut self, words: &[u16]) {
        for (i, word) in (0..).zip(words) {
            self.write(PIO + 0x48 + 4 * i, u32::from(*word));
        }
    }

    /// Lets time pass, until the end of a cycle.
    fn run(&mut self, until: u64) {
        self.cycle = until;
        self.machine.bus.attend(until);
    }

    /// Cycles from which on pins of a mask had other levels, and these.
    fn changes(&mut self, mask: u64) -> Vec<(u64, u64)> {
        let all = self.machine.bus.pins.take_changes();
        let mut changes: Vec<(u64, u64)> = all.iter().map(|c| (c.cycle, c.levels & mask)).collect();
        changes.dedup_by_key(|(_, levels)| *levels);
        changes
    }
}

mod forms;
mod judged;
mod programs;
