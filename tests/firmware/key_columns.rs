//! Columns of converters that have power: the image of a program on the emulated chip, with models
//! of ADCs, DACs, amplifiers, coils and keys on its pins.

use whippen_compiler::board::Board;
use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_emulator::{
    BenchKey, BoardKind, Column, ColumnKeyParts, ColumnKeys, ColumnParts, ColumnPins, Columns,
    ColumnsPins, ConverterSetup, DeviceId, Machine, Observer, Stop, build,
};
use whippen_runtime::board;

use crate::key_bench::{Built, CYCLES_PER_MS, PARTS, PERIOD, build_keys};

/// Keys of a column.
pub const COLUMN: usize = 8;
/// What the start takes: words that are looked at, amplifiers that wake.
pub const START_MS: u64 = 107;
/// And force that comes up.
pub const RAMP_MS: u64 = 23;

/// As the bundled device says, with an amplifier of 8 kHz.
pub const KEY_PARTS: ColumnKeyParts = ColumnKeyParts {
    key: PARTS,
    full_a: 2.0,
    lag_s: 20e-6,
    sensed_v: [0.0, 10.24],
};

/// The bundled board with so many columns.
pub fn board_of(columns: usize) -> Board {
    let mut board = board::bundled("rp2350_columns").expect("it is bundled");
    let own = board.columns.as_mut().expect("columns");
    let first = own.columns[0];
    own.columns = (0..columns as u32)
        .map(|column| whippen_compiler::board::ColumnWires {
            to_dac: first.to_dac + 2 * column,
            from_adc: first.from_adc + 2 * column,
        })
        .collect();
    // Sound has pins of the seventh column.
    board.i2s = board.i2s.filter(|_| columns < 7);
    assert_eq!(board.contradiction(), None);
    board
}

/// So many keys of a bundled instrument on just as many columns as they need.
pub fn built(file: &str, keys: usize) -> Built {
    let board = board_of(keys.div_ceil(COLUMN));
    build_keys(file, keys as u32, board, OwnTexts::default())
}

/// Columns that have power.
pub struct ColumnBench<'a> {
    pub machine: Machine,
    columns: DeviceId,
    pub built: &'a Built,
}

impl<'a> ColumnBench<'a> {
    pub fn new(built: &'a Built, parts: ColumnKeyParts) -> ColumnBench<'a> {
        let kind = BoardKind::Rp2350;
        let (mut machine, _) =
            build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
        for segment in &built.image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        let wired = built.board.columns.as_ref().expect("columns");
        let pins = wired.columns.iter().map(|own| ColumnPins {
            to_dac: own.to_dac,
            from_adc: own.from_adc,
        });
        let pins = ColumnsPins {
            clock: wired.clock,
            select: wired.select,
            command: wired.command,
            enable: Some(wired.enable),
            columns: pins.collect(),
        };
        let converters = ColumnParts {
            clock_hz: 150e6,
            data_delay_cycles: 2,
            // Not what the start shall make of it.
            resets_to: 0x9000,
            loads_at_once: true,
        };
        let columns = Columns::attach(&mut machine.bus, pins, converters);
        machine.reset();
        let mut bench = ColumnBench {
            machine,
            columns,
            built,
        };
        for column in 0..wired.columns.len() {
            bench.column(column).keys = Some(ColumnKeys::new(parts, 0));
        }
        bench
    }

    /// After its start, with force up.
    pub fn started(built: &'a Built, parts: ColumnKeyParts) -> ColumnBench<'a> {
        let mut bench = ColumnBench::new(built, parts);
        bench.pass_ms(START_MS + RAMP_MS);
        assert_eq!((bench.faults(), bench.all().is_enabled()), (0, true));
        bench
    }

    pub fn pass(&mut self, cycles: u64) {
        let until = self.machine.cycle(0) + cycles;
        assert_eq!(self.machine.run(until), Stop::Limit);
    }

    pub fn pass_ms(&mut self, ms: u64) {
        self.pass(ms * CYCLES_PER_MS);
    }

    /// As [`ColumnBench::pass`], observed.
    pub fn pass_observed(&mut self, cycles: u64, observer: &mut impl Observer) {
        let until = self.machine.cycle(0) + cycles;
        assert_eq!(self.machine.run_observed(until, observer), Stop::Limit);
    }

    /// To shortly before the next tick: all frames are over.
    pub fn between_ticks(&mut self) {
        for in_tick in [true, false] {
            while (self.machine.cpu(0).exception() != 0) == in_tick {
                self.pass(20);
            }
        }
        self.pass(PERIOD - 30);
    }

    fn address(&self, symbol: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter();
        let found = symbols.find(|own| own.name == symbol);
        found.unwrap_or_else(|| panic!("{symbol} is there")).address
    }

    pub fn word(&self, symbol: &str, at: u32) -> i32 {
        let mut bytes = [0; 4];
        let memory = &self.machine.bus.memory;
        let address = self.address(symbol) + at;
        memory.read(address, &mut bytes).expect("memory");
        i32::from_le_bytes(bytes)
    }

    pub fn key_count(&self) -> usize {
        self.block(core_block::KEYS) as usize
    }

    fn halves(&self, at: u32) -> Vec<u16> {
        let half = |key: usize| {
            let word = self.word("words0", at + ((2 * key as u32) & !3)) as u32;
            (word >> (16 * (key % 2))) as u16
        };
        (0..self.key_count()).map(half).collect()
    }

    /// The sensor words of the last tick.
    pub fn sensed(&self) -> Vec<u16> {
        self.halves(0)
    }

    /// Its drive words.
    pub fn driven(&self) -> Vec<i16> {
        let row = (2 * self.key_count() as u32).next_multiple_of(4);
        let words = self.halves(row);
        words.into_iter().map(|word| word as i16).collect()
    }

    /// What each key's drive word is multiplied by, of 65536.
    pub fn gains(&self) -> Vec<i32> {
        let gain = |key: usize| {
            let at = self.built.layout.gain(key as u32).expect("it has a gain");
            self.word("core0_state", at)
        };
        (0..self.key_count()).map(gain).collect()
    }

    pub fn block(&self, at: u32) -> i32 {
        self.word("core0", at)
    }

    pub fn faults(&self) -> i32 {
        self.block(core_block::FAULTS)
    }

    pub fn all(&self) -> &Columns {
        self.machine.bus.device(self.columns).expect("columns")
    }

    pub fn column(&mut self, column: usize) -> &mut Column {
        let all: &mut Columns = self.machine.bus.device_mut(self.columns).expect("columns");
        all.column_mut(column).expect("a column")
    }

    pub fn key(&mut self, key: usize) -> &mut BenchKey {
        let keys = self.column(key / COLUMN).keys.as_mut();
        &mut keys.expect("keys").keys[key % COLUMN]
    }

    /// What every key's channel of a DAC puts out, with 0 for no force.
    pub fn put_out(&self) -> Vec<i32> {
        let codes = self.all().columns().iter().flat_map(Column::outputs);
        codes.map(|code| i32::from(code) - 0x8000).collect()
    }
}
