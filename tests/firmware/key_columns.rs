//! Columns of converters that have power: the image of a program on the emulated chip, with models
//! of ADCs, DACs, amplifiers, coils and keys on its pins.

use whippen_compiler::board::Board;
use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_emulator::{
    BenchKey, BoardKind, Column, ColumnKeyParts, ColumnKeys, ColumnParts, ColumnPins, Columns,
    ColumnsPins, ConverterSetup, DeviceId, Machine, Observer, Register, Stop, build,
};
use whippen_runtime::board;

use crate::key_bench::{Built, CYCLES_PER_MS, PARTS, PERIOD, build_keys};

/// Keys of a column.
pub const COLUMN: usize = 8;
/// What the start takes: words that are looked at, amplifiers that wake.
pub const START_MS: u64 = 107;
/// And force that comes up.
pub const RAMP_MS: u64 = 23;

/// CTR of slice 8.
const TICK_COUNTER: u32 = 0x400a_8000 + 20 * 8 + 8;

/// Cycles from [`ColumnBench::before_tick`] to the tick.
pub const TICK_COMES: u64 = 20;

/// Bytes of a column's ring, and a word that no ADC makes here.
const RING_BYTES: u32 = 1 << 13;
const MARK: [u8; 2] = [0xfe, 0xff];

/// As the bundled device says, with an amplifier of 8 kHz.
pub const KEY_PARTS: ColumnKeyParts = ColumnKeyParts {
    key: PARTS,
    full_a: 2.0,
    lag_s: 20e-6,
    sensed_v: [0.0, 10.24],
};

/// The bundled board for so many cores, with so many columns.
pub fn board_of(columns: usize, cores: usize) -> Board {
    let name = ["rp2350_columns", "rp2350_seven_columns"][cores - 1];
    let mut board = board::bundled(name).expect("it is bundled");
    let own = board.columns.as_mut().expect("columns");
    let first = own.columns[0];
    own.columns = (0..columns as u32)
        .map(|column| whippen_compiler::board::ColumnWires {
            to_dac: first.to_dac + 2 * column,
            from_adc: first.from_adc + 2 * column,
        })
        .collect();
    // On one core sound has pins of the seventh column.
    board.i2s = board.i2s.filter(|_| columns < 7 || cores > 1);
    assert_eq!(board.contradiction(), None);
    board
}

/// So many keys of a bundled instrument on just as many columns as they need, of so many cores.
pub fn built(file: &str, keys: usize, cores: usize) -> Built {
    let board = board_of(keys.div_ceil(COLUMN), cores);
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

    /// The cycle in which the chip is: a core that sleeps is behind.
    pub fn now(&self) -> u64 {
        let cycles = (0..self.cores()).map(|core| self.machine.cycle(core));
        cycles.max().unwrap_or(0)
    }

    pub fn pass(&mut self, cycles: u64) {
        let until = self.now() + cycles;
        assert_eq!(self.machine.run(until), Stop::Limit);
    }

    pub fn pass_ms(&mut self, ms: u64) {
        self.pass(ms * CYCLES_PER_MS);
    }

    /// As [`ColumnBench::pass`], observed.
    pub fn pass_observed(&mut self, cycles: u64, observer: &mut impl Observer) {
        let until = self.now() + cycles;
        assert_eq!(self.machine.run_observed(until, observer), Stop::Limit);
    }

    /// To where the next tick begins: all frames are over, and of its instructions none has run.
    pub fn between_ticks(&mut self) {
        self.before_tick();
        self.pass(TICK_COMES + 2);
    }

    /// To shortly before the next tick.
    pub fn before_tick(&mut self) {
        for in_tick in [true, false] {
            while (self.machine.cpu(0).exception() != 0) == in_tick {
                self.pass(20);
            }
        }
        // From the wrap that asked for this tick.
        let cycle = self.now();
        let since = self.machine.bus.read(TICK_COUNTER, 4, cycle).expect("CTR");
        self.pass(PERIOD - TICK_COMES - u64::from(since));
    }

    pub fn cores(&self) -> usize {
        self.built.layouts.len()
    }

    /// Of the code that plays, where the start has its own of that name.
    pub fn address(&self, symbol: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter().rev();
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

    /// Keys of each core.
    pub fn keys_of(&self, core: usize) -> usize {
        self.block_of(core, core_block::KEYS) as usize
    }

    pub fn key_count(&self) -> usize {
        (0..self.cores()).map(|core| self.keys_of(core)).sum()
    }

    /// Sensor words of all keys, or drive words.
    fn halves(&self, drive: bool) -> Vec<u16> {
        let half = |core: usize, key: usize| {
            let row = (2 * self.keys_of(core) as u32).next_multiple_of(4);
            let at = u32::from(drive) * row + ((2 * key as u32) & !3);
            let word = self.word(&format!("words{core}"), at) as u32;
            (word >> (16 * (key % 2))) as u16
        };
        let of_core = |core| (0..self.keys_of(core)).map(move |key| half(core, key));
        (0..self.cores()).flat_map(of_core).collect()
    }

    /// The sensor words of the last tick.
    pub fn sensed(&self) -> Vec<u16> {
        self.halves(false)
    }

    /// Its drive words.
    pub fn driven(&self) -> Vec<i16> {
        let words = self.halves(true);
        words.into_iter().map(|word| word as i16).collect()
    }

    /// What each key's drive word is multiplied by, of 65536.
    pub fn gains(&self) -> Vec<i32> {
        let gain = |core: usize, key: usize| {
            let at = self.built.layouts[core].gain(key as u32);
            self.word(&format!("core{core}_state"), at.expect("it has a gain"))
        };
        let of_core = |core| (0..self.keys_of(core)).map(move |key| gain(core, key));
        (0..self.cores()).flat_map(of_core).collect()
    }

    pub fn block_of(&self, core: usize, at: u32) -> i32 {
        self.word(&format!("core{core}"), at)
    }

    pub fn block(&self, at: u32) -> i32 {
        self.block_of(0, at)
    }

    /// Of all cores.
    pub fn faults(&self) -> i32 {
        let own = |core| self.block_of(core, core_block::FAULTS);
        (0..self.cores()).fold(0, |faults, core| faults | own(core))
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

    /// As an instruction of a core would: no interrupt is taken until it is unmasked.
    pub fn mask_interrupts(&mut self, core: usize, masked: bool) {
        let primask = Register::named("primask").expect("a register");
        self.machine.cpu_mut(core).set(primask, masked.into());
    }

    /// Writes a mark to where the coming word of the last frame goes, of each column, and says
    /// where that is.
    pub fn mark_last_words(&mut self) -> Vec<u32> {
        let columns = self.all().columns().len() as u32;
        let of_core0 = columns / self.cores() as u32;
        let behind = (self.word("columns", 0) as u32 + 2 * (COLUMN as u32 - 1)) % RING_BYTES;
        let ring = |column: u32| match column.checked_sub(of_core0) {
            None => self.address("samples") + column * RING_BYTES,
            Some(own) => self.address("samples1") + own * RING_BYTES,
        };
        let last: Vec<u32> = (0..columns).map(|column| ring(column) + behind).collect();
        for at in &last {
            let memory = &mut self.machine.bus.memory;
            memory.write(*at, &MARK).expect("memory");
        }
        last
    }

    /// Whether one of them is still there.
    pub fn has_marks(&self, last: &[u32]) -> bool {
        let memory = &self.machine.bus.memory;
        last.iter().any(|at| {
            let mut word = [0; 2];
            memory.read(*at, &mut word).expect("memory");
            word == MARK
        })
    }
}
