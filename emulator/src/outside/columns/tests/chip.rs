//! A chip with columns on its pins: programs of its state machines, its DMA and a slice of PWM.

use super::super::*;
use crate::boards::{BoardKind, ConverterSetup, build};
use crate::machine::Machine;

use super::driven;

/// Select and clock by side-set (pins 2 and 3), commands on pin 4; a word is a frame.
///
/// ```text
///      pull block      side 0b10
///      set x, 31       side 0b00 [5]
/// bit: out pins, 1     side 0b01 [3]
///      nop             side 0b00 [3]
///      jmp x-- bit     side 0b00
/// ```
const MASTER: [u16; 5] = [0x90a0, 0xe53f, 0x6b01, 0xa342, 0x0042];
/// A word out and one in at each frame, whoever makes it; without a word it sends X.
///
/// ```text
///      wait 1 gpio 3
///      wait 0 gpio 3
///      pull noblock
///      set y, 31
/// bit: out pins, 1     [4]
///      in pins, 1      [2]
///      jmp y-- bit
///      push noblock
/// ```
const COLUMN: [u16; 8] = [
    0x2083, 0x2003, 0x8080, 0xe05f, 0x6401, 0x4201, 0x0084, 0x8000,
];
/// Where it begins, behind the master.
const COLUMN_AT: u32 = 5;
/// What a column sends without a word: update channel 0 with what it has.
pub const IDLE: u32 = 0x0100_0000;

pub const PIO: u32 = 0x5020_0000;
pub const BLOCK: u32 = 0x10_0000;
const DMA: u32 = 0x5000_0000;
pub const PWM: u32 = 0x400a_8000;
/// DMA: start these channels.
const START: u32 = DMA + 0x450;
/// Where the DMA's words lie: commands, then a ring in and words out for each column.
const COMMANDS: u32 = 0x2000_0000;
const RINGS: u32 = 0x2000_0400;
const WORDS: u32 = 0x2000_0800;

/// A frame each 425 cycles, eight to a tick.
pub const PACE: u64 = 425;
pub const TICK: u64 = 8 * PACE;
/// From a wrap of the slice to the fall of the select, and on to the DAC's 32nd falling edge.
pub const TO_SELECT: u64 = 5;
pub const TO_UPDATE: u64 = 289;

fn pins(columns: usize) -> ColumnsPins {
    let column = |c: u32| ColumnPins {
        to_dac: 6 + 2 * c,
        from_adc: 7 + 2 * c,
    };
    ColumnsPins {
        clock: 2,
        select: 3,
        command: 4,
        enable: None,
        columns: (0..columns as u32).map(column).collect(),
    }
}

pub const PARTS: ColumnParts = ColumnParts {
    clock_hz: 150e6,
    data_delay_cycles: 2,
    resets_to: 0x8000,
    loads_at_once: true,
};

/// The state machine of a column: its block and its number there.
pub fn machine_of(column: usize) -> [u32; 2] {
    let at = column as u32 + 1;
    [at / 4, at % 4]
}

pub struct Bench {
    pub machine: Machine,
    columns: DeviceId,
    pub cycle: u64,
    /// When the slice began to count.
    pub begun: u64,
}

impl Bench {
    pub fn new(columns: usize, parts: ColumnParts) -> Bench {
        let mut bench = Bench::without_pace(columns, parts);
        bench.start_dma(columns);
        bench
    }

    /// Machines that wait for words.
    pub fn without_pace(columns: usize, parts: ColumnParts) -> Bench {
        let kind = BoardKind::Rp2350;
        let (mut machine, _) =
            build(kind, kind.board(), ConverterSetup::default()).expect("a board");
        let id = Columns::attach(&mut machine.bus, pins(columns), parts);
        let mut bench = Bench {
            machine,
            columns: id,
            cycle: 10,
            begun: 0,
        };
        bench.start_pins(columns);
        bench.start_machines(columns);
        bench
    }

    fn start_pins(&mut self, columns: usize) {
        let mut functions = vec![(2, 6), (3, 6), (4, 6)];
        for (column, pins) in pins(columns).columns.iter().enumerate() {
            let [block, _] = machine_of(column);
            functions.extend([(pins.to_dac, 6 + block), (pins.from_adc, 6 + block)]);
        }
        for (pin, function) in functions {
            self.write(0x4002_8000 + 8 * pin + 4, function);
            // An input, pulled down.
            self.write(0x4003_8000 + 4 * pin + 4, 1 << 6 | 1 << 2);
        }
    }

    fn start_machines(&mut self, columns: usize) {
        for block in 0..3 {
            let moved = |word: u16| match word >> 13 {
                0 => word + COLUMN_AT as u16,
                _ => word,
            };
            let program = MASTER.into_iter().chain(COLUMN.map(moved));
            for (i, word) in (0..).zip(program) {
                self.write(PIO + BLOCK * block + 0x48 + 4 * i, u32::from(word));
            }
        }
        // Directions of pins 2 to 4, and the level of an idle select.
        let side = 2 << 29 | 1 << 20 | 2 << 10 | 4;
        self.configure([0, 0], [4 << 12, 3 << 26 | 2 << 5 | side]);
        self.execute([0, 0], &[0xe087, 0xe002]);
        for column in 0..columns {
            let pins = pins(columns).columns[column];
            let [block, number] = machine_of(column);
            let wrap = (COLUMN_AT + 7) << 12 | COLUMN_AT << 7;
            let led = 1 << 26 | 1 << 20 | pins.from_adc << 15 | pins.to_dac << 5 | pins.to_dac;
            self.configure([block, number], [wrap, led]);
            self.write(PIO + BLOCK * block + 0x10 + 4 * number, IDLE);
            self.execute([block, number], &[0xe081, 0x80a0, 0xa027, COLUMN_AT as u16]);
        }
        for block in 0..3 {
            self.write(PIO + BLOCK * block, 0xf);
        }
    }

    fn configure(&mut self, [block, number]: [u32; 2], [control, pins]: [u32; 2]) {
        let at = PIO + BLOCK * block + 0x18 * number;
        self.write(at + 0xcc, control);
        self.write(at + 0xd0, 0);
        self.write(at + 0xdc, pins);
    }

    fn execute(&mut self, [block, number]: [u32; 2], words: &[u16]) {
        for word in words {
            self.write(PIO + BLOCK * block + 0x18 * number + 0xd8, u32::from(*word));
            self.run(2);
        }
    }

    /// Channel 0 sends a command at each wrap of slice 8; two channels a column follow.
    fn start_dma(&mut self, columns: usize) {
        for i in 0..8 {
            let command = if i == 7 { 0xa000_0000 } else { 0 };
            self.write_memory(COMMANDS + 4 * i, command);
        }
        for column in 0..columns as u32 {
            let [block, number] = machine_of(column as usize);
            let queue = PIO + BLOCK * block + 4 * number;
            let (taken, sent) = (1 + 2 * column, 2 + 2 * column);
            let request = 8 * block + number;
            // Halves into a ring of 32 bytes, for ever.
            let halves = (request + 4) << 17 | taken << 13 | 1 << 12 | 5 << 8 | 1 << 6 | 1 << 2 | 1;
            self.channel(
                taken,
                [queue + 0x20, RINGS + 32 * column, 0xf000_0001],
                halves,
            );
            let words = request << 17 | sent << 13 | 5 << 8 | 1 << 4 | 2 << 2 | 1;
            let at = DMA + 0x40 * sent;
            self.write(at, WORDS + 32 * column);
            self.write(at + 4, queue + 0x10);
            self.write(at + 8, 8);
            self.write(at + 0x10, words);
        }
        let paced = 40 << 17 | 5 << 8 | 1 << 4 | 2 << 2 | 1;
        self.channel(0, [COMMANDS, PIO + 0x10, 0xf000_0001], paced);
        let slice = PWM + 20 * 8;
        self.write(slice + 4, 16);
        self.write(slice + 0x10, PACE as u32 - 1);
        self.write(slice, 1);
        self.begun = self.cycle;
    }

    fn channel(&mut self, channel: u32, places: [u32; 3], control: u32) {
        let at = DMA + 0x40 * channel;
        for (i, place) in (0..).zip(places) {
            self.write(at + 4 * i, place);
        }
        self.write(at + 0xc, control);
    }

    pub fn write(&mut self, address: u32, value: u32) {
        let cycle = self.cycle;
        self.machine.bus.attend(cycle);
        let write = self.machine.bus.device_write(address, 4, value, 0, cycle);
        write.expect("a register");
    }

    pub fn read(&mut self, address: u32) -> u32 {
        self.machine.bus.attend(self.cycle);
        let read = self.machine.bus.device_read(address, 4, 0, self.cycle);
        read.expect("a register").0
    }

    fn write_memory(&mut self, address: u32, value: u32) {
        let cycle = self.cycle;
        let write = self.machine.bus.write(address, 4, value, cycle);
        write.expect("memory");
    }

    pub fn run(&mut self, cycles: u64) {
        self.cycle += cycles;
        self.machine.bus.attend(self.cycle);
    }

    /// To shortly before the first frame of a tick; ticks are counted from the slice's start.
    pub fn run_to_tick(&mut self, tick: u64) {
        let at = self.begun + PACE + TICK * tick - 50;
        self.run(at - self.cycle);
    }

    pub fn column(&mut self, column: usize) -> &mut Column {
        let columns: &mut Columns = self.machine.bus.device_mut(self.columns).expect("columns");
        columns.column_mut(column).expect("a column")
    }

    pub fn errors(&self) -> ColumnErrors {
        let columns: &Columns = self.machine.bus.device(self.columns).expect("columns");
        columns.errors()
    }

    /// What a tick left in a column's ring.
    pub fn received(&mut self, column: usize, tick: u64) -> [u16; 8] {
        let at = RINGS + 32 * column as u32 + 16 * (tick as u32 % 2);
        std::array::from_fn(|key| {
            let word = self.machine.bus.read(at + 2 * key as u32, 2, self.cycle);
            word.expect("memory") as u16
        })
    }

    /// Where a column's ring will be written next.
    pub fn ring_at(&mut self, column: usize) -> u32 {
        self.read(DMA + 0x40 * (1 + 2 * column as u32) + 4) & 31
    }

    /// The first column's DAC gets its reference, in the next frame.
    pub fn reference(&mut self) {
        let [block, number] = machine_of(0);
        self.write(PIO + BLOCK * block + 0x10 + 4 * number, 0x0800_0001);
    }

    /// The words of the coming tick for some columns.
    pub fn send(&mut self, tick: u64, columns: std::ops::Range<usize>) {
        for column in columns {
            self.send_codes(column, std::array::from_fn(|key| driven(tick, column, key)));
        }
    }

    /// These words for a column.
    pub fn send_codes(&mut self, column: usize, codes: [u16; 8]) {
        for (key, code) in (0..).zip(codes) {
            let at = WORDS + 32 * column as u32 + 4 * key;
            self.write_memory(at, 0x0300_0000 | key << 20 | u32::from(code) << 4);
        }
        self.write(START, 4 << (2 * column));
    }
}
