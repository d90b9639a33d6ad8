//! The interface of the flash chip (QMI, RP2350 datasheet 12.14): direct mode, in which a program
//! moves bytes to the chip and back. While it is on, accesses to flash as memory are bus errors.
//!
//! ```text
//!   DIRECT_TX --byte--> chip --byte--> DIRECT_RX        eight of CLKDIV cycles later
//! ```
//!
//! Not here: transfers of 16 bits or over several lines, and what the other registers say of reads;
//! they hold what is written.

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;
use crate::device::registers::{Registers, Row, words};
use crate::outside::FlashChip;

/// Of DIRECT_CSR.
const ENABLE: u32 = 1 << 0;
const BUSY: u32 = 1 << 1;
const SELECT: u32 = 1 << 2;
const NOTHING_TO_SEND: u32 = 1 << 11;
const NOTHING_RECEIVED: u32 = 1 << 16;
const DIVISOR_SHIFT: u32 = 22;
/// What is kept: enable, selects, divisor, delay.
const KEPT: u32 = 0xffc0_00cd;
/// After reset: a sixth of the clock.
const RESET: u32 = 6 << DIVISOR_SHIFT;
/// Of DIRECT_TX: nothing is received.
const NO_PUSH: u32 = 1 << 20;

const ROWS: &[Row] = &[words(0, 32)];

/// See the module.
pub(crate) struct Qmi {
    registers: Registers,
    /// Where memory shows the chip.
    flash: u32,
    chip: FlashChip,
    control: u32,
    received: VecDeque<u8>,
    /// The cycle in which the last byte has arrived.
    arrives: u64,
}

impl Qmi {
    pub(crate) fn new(flash: u32, bytes: u32, clock_hz: u32) -> Self {
        Self {
            registers: Registers::new(ROWS),
            flash,
            chip: FlashChip::new(flash, bytes, clock_hz),
            control: RESET,
            received: VecDeque::new(),
            arrives: 0,
        }
    }

    fn status(&self, cycle: u64) -> u32 {
        let moves = cycle < self.arrives;
        let mut word = self.control | NOTHING_TO_SEND;
        if moves {
            word |= BUSY;
        }
        if moves || self.received.is_empty() {
            word |= NOTHING_RECEIVED;
        }
        word
    }

    fn is_selected(&self) -> bool {
        self.control & ENABLE != 0 && self.control & SELECT != 0
    }

    fn set(&mut self, control: u32, cycle: u64, bus: &mut Bus) {
        let was_selected = self.is_selected();
        let changed = self.control ^ control;
        self.control = control & KEPT;
        if was_selected && !self.is_selected() {
            self.chip.deselect(cycle, &mut bus.memory);
        }
        if changed & ENABLE != 0 {
            let absent = self.control & ENABLE != 0;
            bus.memory.set_absent(absent.then_some(self.flash));
        }
    }

    fn send(&mut self, word: u32, cycle: u64, bus: &Bus) {
        if self.control & ENABLE == 0 {
            return;
        }
        let answer = match self.is_selected() {
            true => self.chip.exchange(word as u8, cycle, &bus.memory),
            false => 0xff,
        };
        if word & NO_PUSH == 0 {
            self.received.push_back(answer);
        }
        let divisor = match self.control >> DIVISOR_SHIFT & 0xff {
            0 => 256,
            divisor => u64::from(divisor),
        };
        self.arrives = self.arrives.max(cycle) + 8 * divisor;
    }
}

impl Device for Qmi {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        let word = match alias::plain(access.offset) & !3 {
            0 => self.status(access.cycle),
            4 => 0,
            8 => self.received.pop_front().unwrap_or(0).into(),
            _ => return self.registers.read(access, bus),
        };
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        match alias::plain(access.offset) & !3 {
            0 => {
                let control = alias::written(access, value, self.control);
                self.set(control, access.cycle, bus);
            }
            4 => self.send(alias::written(access, value, 0), access.cycle, bus),
            8 => {}
            _ => return self.registers.write(access, value, bus),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boards::{BoardKind, ConverterSetup, build};
    use crate::machine::Machine;

    const QMI: u32 = 0x400d_0000;
    const FLASH: u32 = 0x1000_0000;
    const PLACE: u32 = FLASH + 0x3000;

    /// A chip whose registers are written as by a core.
    struct Bench {
        machine: Machine,
        cycle: u64,
    }

    impl Bench {
        fn new() -> Self {
            let kind = BoardKind::Rp2350;
            let (machine, _) = build(kind, kind.board(), ConverterSetup::default()).unwrap();
            let mut bench = Self { machine, cycle: 0 };
            let all = [0; 8192];
            bench.machine.bus.memory.write(PLACE, &all).unwrap();
            bench
        }

        fn set(&mut self, at: u32, word: u32) {
            let bus = &mut self.machine.bus;
            bus.write(QMI + at, 4, word, self.cycle).unwrap();
        }

        fn word(&mut self, at: u32) -> u32 {
            let bus = &mut self.machine.bus;
            bus.read(QMI + at, 4, self.cycle).unwrap()
        }

        /// A frame of bytes; the last one that comes back.
        fn frame(&mut self, bytes: &[u8]) -> u8 {
            self.set(0, RESET | ENABLE | SELECT);
            let mut answer = 0;
            for byte in bytes {
                self.set(4, u32::from(*byte));
                assert_ne!(self.word(0) & (BUSY | NOTHING_RECEIVED), 0);
                self.cycle += 48;
                assert_eq!(self.word(0) & (BUSY | NOTHING_RECEIVED), 0);
                answer = self.word(8) as u8;
            }
            self.set(0, RESET | ENABLE);
            answer
        }

        fn is_busy(&mut self) -> bool {
            self.frame(&[0x05, 0]) & 1 != 0
        }

        /// Lets it write, gives it a command, and waits; how long that took (us).
        fn carry_out(&mut self, bytes: &[u8]) -> u64 {
            self.frame(&[0x06]);
            self.frame(bytes);
            let from = self.cycle;
            while self.is_busy() {
                self.cycle += 15_000;
            }
            (self.cycle - from) / 150
        }

        fn bytes<const N: usize>(&self, at: u32) -> [u8; N] {
            let mut bytes = [0; N];
            self.machine.bus.memory.read(at, &mut bytes).unwrap();
            bytes
        }
    }

    #[test]
    fn flash_answers_no_core_in_direct_mode() {
        let mut bench = Bench::new();
        let answers = |bench: &Bench| {
            let memory = &bench.machine.bus.memory;
            let reads = memory.slow_read(PLACE, 4).is_some();
            assert_eq!(memory.fast_read::<4>(PLACE).is_some(), reads);
            assert_eq!(memory.halfword(PLACE).is_some(), reads);
            assert!(memory.halfword(0x2000_0000).is_some());
            reads
        };
        assert!(answers(&bench));
        bench.set(0, RESET | ENABLE);
        assert!(!answers(&bench));
        bench.set(0, RESET);
        assert!(answers(&bench));
    }

    #[test]
    fn a_sector_is_erased_and_a_page_written() {
        let mut bench = Bench::new();
        // It reads ahead until it is told ones alone.
        bench.frame(&[0x06]);
        bench.frame(&[0x20, 0, 0x30, 0]);
        assert_eq!(bench.frame(&[0x05, 0]), 0xff);
        bench.frame(&[0xff, 0xff]);
        assert_eq!(bench.frame(&[0x9f, 0]), 0xef);
        // Not without leave, which one command uses up.
        bench.frame(&[0x20, 0, 0x30, 0]);
        assert_eq!(bench.bytes(PLACE), [0; 4]);
        let takes = bench.carry_out(&[0x20, 0, 0x30, 5]);
        assert!((45_000..45_200).contains(&takes), "{takes}");
        assert_eq!(bench.bytes(PLACE + 4094), [0xff, 0xff, 0, 0]);
        bench.frame(&[0x02, 0, 0x30, 0, 0x12]);
        assert_eq!(bench.bytes(PLACE), [0xff; 4]);
        // Over the end of the page, and bits go down alone.
        bench.carry_out(&[0x02, 0, 0x30, 0xfe, 0x12, 0x34, 0x56]);
        assert_eq!(bench.bytes(PLACE + 0xfe), [0x12, 0x34, 0xff, 0xff]);
        bench.carry_out(&[0x02, 0, 0x30, 0, 0xf0]);
        assert_eq!(bench.bytes(PLACE), [0x50, 0xff]);
        assert_eq!(bench.frame(&[0x03, 0, 0x30, 0, 0]), 0x50);
        // While it is busy it takes nothing.
        bench.frame(&[0x06]);
        bench.frame(&[0x20, 0, 0x40, 0]);
        bench.frame(&[0x06]);
        bench.frame(&[0x02, 0, 0x30, 0, 0]);
        assert!(bench.is_busy());
        assert_eq!(bench.bytes(PLACE), [0x50, 0xff]);
    }
}
