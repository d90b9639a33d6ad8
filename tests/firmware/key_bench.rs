//! A bench of keys that has power: the image of a program on the emulated chip, with models of
//! sensors, bridges, coils and keys on its pins.

use whippen_compiler::board::Board;
use whippen_compiler::budget::Bounded;
use whippen_compiler::check::Options;
use whippen_compiler::firmware::{FirmwareImage, OwnText, OwnTexts, core_block};
use whippen_compiler::front::compile_front;
use whippen_compiler::image::Image;
use whippen_compiler::kernel::Kernel;
use whippen_compiler::keyboard::{CoreId, Layout};
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, Compiled, unobserved};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_compiler::thumb::StateLayout;
use whippen_emulator::{
    BenchKey, BenchPins, BoardKind, ConverterSetup, DeviceId, KeyBench, KeyParts, KeyPins, Machine,
    Observer, Step, Stop, build,
};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{self, ImageInstrument};

pub const CYCLES_PER_MS: u64 = 150_000;
pub const PERIOD: u64 = 3400;
pub const KEYS: usize = 8;
pub const FAULT: u32 = 9;
pub const SLEEP: u32 = 8;
/// What the start takes: words that are looked at, bridges that wake.
pub const START_MS: u64 = 107;
/// And force that comes up.
pub const RAMP_MS: u64 = 23;

/// As the bundled device says, without dry friction.
pub const PARTS: KeyParts = KeyParts {
    clock_hz: 150e6,
    supply_v: 12.0,
    trip_a: 3.5,
    resistance_ohm: 4.0,
    inductance_h: 1e-3,
    // 0.007 N*m/A at an arm of 30 mm.
    force_n_per_a: 0.007 / 0.03,
    mass_kg: 0.06,
    damping_n_s_m: 0.2,
    friction_n: 0.0,
    stops_m: [0.0, 0.01],
    stop_n_m: 20e3,
    stop_n_s_m: 20.0,
    sensed_m: [-0.5e-3, 10.5e-3],
};

/// A program for a board that is in time.
pub struct Built {
    pub image: Image,
    pub board: Board,
    pub kernel: Kernel,
    /// Its bound on each core.
    pub bounded: Vec<Bounded>,
    /// Where the state of each core's keys has what.
    pub layouts: Vec<StateLayout>,
}

/// The bundled board.
pub fn bundled_board() -> Board {
    board::bundled("rp2350b_bench").expect("it is bundled")
}

/// A text of one's own in the place of a bundled one.
pub fn own_text(name: &str, text: String) -> OwnTexts {
    let path = format!("own/{name}");
    let own = OwnTexts::new([(name.to_string(), OwnText { path, text })]);
    own.unwrap_or_else(|e| panic!("{e}"))
}

/// The whole image of so many keys of a bundled instrument, what it is compiled of, and its rate.
pub fn whole_keys(
    file: &str,
    keys: u32,
    board: &Board,
    own_texts: OwnTexts,
) -> (FirmwareImage, Compiled, Rate) {
    let programs = whippen_compiler::bundled::INSTRUMENTS;
    let program = programs.iter().find(|(name, _)| *name == file);
    let mut map = SourceMap::default();
    map.add(file, program.expect("it is bundled").1);
    let options = Options {
        rate_hz: Rate::new(750_000, 17),
        ..Options::default()
    };
    let (program, diagnostics) = compile_front(&mut map, &options);
    let program = program.unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let model = program.instruments.into_iter().next().expect("one");
    let device = Device::bundled("voice_coil").expect("it is bundled");
    let compiled = pipeline::compile(model, device.scales(), false).expect("it lowers");
    let mut setup = image::setup(&compiled, &device, keys, board.cores, 21).expect("it is set up");
    setup.own_texts = own_texts;
    let parts = [
        ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved).expect("it has modes"),
    ];
    let layout = Layout::of_one_instrument("bench", keys, 21);
    let borrowed = ImageInstrument::borrow_all(&parts);
    let built = pipeline::build(&layout, &borrowed, &setup, board, &mut unobserved);
    let built = built.unwrap_or_else(|e| panic!("{e}"));
    (built, compiled, setup.rate_hz)
}

/// Builds eight keys of a bundled instrument, which are in time.
pub fn build_bench(file: &str, board: Board, own_texts: OwnTexts) -> Built {
    build_keys(file, KEYS as u32, board, own_texts)
}

/// Builds so many keys of a bundled instrument, which are in time.
pub fn build_keys(file: &str, keys: u32, board: Board, own_texts: OwnTexts) -> Built {
    let (built, compiled, rate_hz) = whole_keys(file, keys, &board, own_texts);
    let proof = pipeline::prove(&built, &board, rate_hz, &mut unobserved);
    let mut proof = proof.unwrap_or_else(|e| panic!("{e}"));
    let program = &mut proof.programs[0];
    assert!(program.budget.fits(), "{}", program.budget);
    let first = built.programs.into_iter().next().expect("a program");
    let layout = |core| first.core(CoreId(core)).zones[0].layout().clone();
    Built {
        image: built.image,
        layouts: (0..board.cores).map(layout).collect(),
        bounded: std::mem::take(&mut program.cores),
        kernel: compiled.lowered.kernel,
        board,
    }
}

/// A bench that has power.
pub struct Bench<'a> {
    pub machine: Machine,
    keys: DeviceId,
    built: &'a Built,
}

impl<'a> Bench<'a> {
    pub fn new(built: &'a Built, parts: KeyParts) -> Bench<'a> {
        let kind = BoardKind::Rp2350;
        let (mut machine, _) =
            build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
        for segment in &built.image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        let bench = built.board.bench.as_ref().expect("a bench");
        let pins = bench.sensors.iter().zip(&bench.bridges);
        let pins = BenchPins {
            keys: pins
                .map(|(sensor, bridge)| KeyPins {
                    sensor: *sensor,
                    bridge: *bridge,
                })
                .collect(),
            sleep: bench.sleep,
            fault: bench.fault,
        };
        let keys = KeyBench::attach(&mut machine.bus, pins, parts);
        machine.reset();
        Bench {
            machine,
            keys,
            built,
        }
    }

    /// After its start, with force up.
    pub fn started(built: &'a Built, parts: KeyParts) -> Bench<'a> {
        let mut bench = Bench::new(built, parts);
        bench.pass_ms(START_MS + RAMP_MS);
        assert_eq!((bench.faults(), bench.keys().is_awake()), (0, true));
        bench
    }

    pub fn pass(&mut self, cycles: u64) {
        let until = self.machine.cycle(0) + cycles;
        assert_eq!(self.machine.run(until), Stop::Limit);
    }

    pub fn pass_ms(&mut self, ms: u64) {
        self.pass(ms * CYCLES_PER_MS);
    }

    /// As [`Bench::pass`], observed.
    pub fn pass_observed(&mut self, cycles: u64, observer: &mut impl Observer) {
        let until = self.machine.cycle(0) + cycles;
        assert_eq!(self.machine.run_observed(until, observer), Stop::Limit);
    }

    /// To where a tick has been done and the next one has not begun.
    pub fn between_ticks(&mut self) {
        for in_tick in [true, false] {
            while (self.machine.cpu(0).exception() != 0) == in_tick {
                self.pass(20);
            }
        }
        self.pass(PERIOD - 500);
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

    fn halves(&self, at: u32) -> [u16; KEYS] {
        std::array::from_fn(|key| {
            let word = self.word("words0", at + ((2 * key as u32) & !3)) as u32;
            (word >> (16 * (key % 2))) as u16
        })
    }

    /// The sensor words of the last tick.
    pub fn sensed(&self) -> [u16; KEYS] {
        self.halves(0)
    }

    /// Its drive words.
    pub fn driven(&self) -> [i16; KEYS] {
        self.halves(2 * KEYS as u32).map(|word| word as i16)
    }

    /// What each key's drive word is multiplied by, of 65536.
    pub fn gains(&self) -> [i32; KEYS] {
        std::array::from_fn(|key| {
            let at = self.built.layouts[0]
                .gain(key as u32)
                .expect("it has a gain");
            self.word("core0_state", at)
        })
    }

    pub fn block(&self, at: u32) -> i32 {
        self.word("core0", at)
    }

    pub fn faults(&self) -> i32 {
        self.block(core_block::FAULTS)
    }

    pub fn keys(&self) -> &KeyBench {
        self.machine.bus.device(self.keys).expect("a bench")
    }

    pub fn keys_mut(&mut self) -> &mut KeyBench {
        self.machine.bus.device_mut(self.keys).expect("a bench")
    }

    pub fn key(&mut self, key: usize) -> &mut BenchKey {
        self.keys_mut().key_mut(key).expect("a key")
    }
}

/// From where a handler begins to where the code goes on that it interrupted, on each core. One
/// that had begun before is counted, and how long it was is not known.
#[derive(Default)]
pub struct Frames {
    begins: [Option<u64>; 2],
    pub longest: [u64; 2],
    pub count: [u64; 2],
}

impl Observer for Frames {
    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, core: usize, _: u32, cycle: u64) {
        self.begins[core] = Some(cycle);
    }

    fn resumed(&mut self, core: usize, cycle: u64) {
        let took = self.begins[core].map_or(0, |begun| cycle - begun);
        self.longest[core] = self.longest[core].max(took);
        self.count[core] += 1;
    }
}
