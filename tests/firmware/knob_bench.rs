//! Knobs on a Pico 2 that has power: the image of a program on the emulated chip, with models of
//! sensors, drivers and motors on its pins.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

use whippen_compiler::budget::Bounded;
use whippen_compiler::check::Options;
use whippen_compiler::firmware::{Monitor, Setup, core_block, knob_block};
use whippen_compiler::front::compile_front;
use whippen_compiler::image::Image;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, unobserved};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_emulator::{
    BoardKind, ConverterSetup, DeviceId, Hand, Knob, KnobParts, KnobPins, Machine, MotorParameters,
    Observer, Ports, Stop, build,
};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{self, ImageInstrument};

pub const CYCLES_PER_MS: u64 = 150_000;
pub const PERIOD: u64 = 3400;
/// What the first start takes: looking, raising the field, a turn of it there and back, keeping
/// what was found.
pub const START_MS: u64 = 590;
/// What the next one takes: looking, and trying what is kept.
pub const AGAIN_MS: u64 = 297;
/// Where it is kept, and the bytes of that.
pub const STORE: u32 = 0x103f_f000;
pub const STORED: usize = 256;

/// As the bundled board and device say.
pub const PINS: KnobPins = KnobPins {
    select: 3,
    clock: 2,
    data: 4,
    phases: [6, 7, 8],
    enable: 9,
    fault: 10,
};
pub const PARTS: KnobParts = KnobParts {
    clock_hz: 150e6,
    supply_v: 12.0,
    trip_a: 2.5,
    sensor_delay_s: 5e-6,
    data_delay_cycles: 3,
    motor: MotorParameters {
        resistance_ohm: 5.0,
        inductance_h: 1e-3,
        // 1.5 * 7 * this is 63 mN*m/A.
        flux_v_s: 0.006,
        pole_pairs: 7,
        inertia_kg_m2: 15e-6,
        damping_n_m_s: 0.2e-3,
        friction_n_m: 0.5e-3,
        cogging_n_m: 0.0,
        cogging_per_turn: 84,
        offset_rad: 2.0,
        reversed: false,
    },
    angle_rad: 1.0,
};

/// A program for the bundled board.
pub struct Built {
    pub image: Image,
    /// That it is in time, unless it has the monitor, for which a knob's tick has no room.
    pub bounded: Option<Bounded>,
}

/// Builds the only instrument of a text.
pub fn build_knob(text: &str) -> Built {
    build_knobs("pico2_knob", text, None)
}

/// The same for all knobs of a board, with a monitor or without.
pub fn build_knobs(board: &str, text: &str, monitor: Option<Monitor>) -> Built {
    let mut map = SourceMap::default();
    map.add("knob.whip", text);
    let options = Options {
        rate_hz: Rate::new(750_000, 17),
        ..Options::default()
    };
    let (program, diagnostics) = compile_front(&mut map, &options);
    let program = program.unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let model = program.instruments.into_iter().next().expect("one");
    let device = Device::bundled("gimbal").expect("it is bundled");
    let board = board::bundled(board).expect("it is bundled");
    let knobs = board.knob.as_ref().expect("it has knobs").count();
    let compiled = pipeline::compile(model, device.scales(), false).expect("it lowers");
    let setup = image::setup(&compiled, &device, knobs, board.cores, 21).expect("it is set up");
    let setup = Setup { monitor, ..setup };
    let parts = [
        ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved).expect("it has modes"),
    ];
    let layout = Layout::of_one_instrument("knob", knobs, 21);
    let borrowed = ImageInstrument::borrow_all(&parts);
    let built = pipeline::build(&layout, &borrowed, &setup, &board, &mut unobserved);
    let built = built.unwrap_or_else(|e| panic!("{e}"));
    let bounded = monitor.is_none().then(|| {
        let proof = pipeline::prove(&built, &board, setup.rate_hz, &mut unobserved);
        let mut proof = proof.unwrap_or_else(|e| panic!("{e}"));
        let program = &mut proof.programs[0];
        assert!(program.budget.fits(), "{}", program.budget);
        program.cores.swap_remove(0)
    });
    Built {
        image: built.image,
        bounded,
    }
}

/// The bundled knob, built once.
pub fn bundled() -> Arc<Built> {
    static BUILT: OnceLock<Arc<Built>> = OnceLock::new();
    Arc::clone(BUILT.get_or_init(|| bundled_on("pico2_knob", None)))
}

/// The bundled knob on a board, with a monitor or without.
pub fn bundled_on(board: &str, monitor: Option<Monitor>) -> Arc<Built> {
    let programs = whippen_compiler::bundled::INSTRUMENTS;
    let program = programs.iter().find(|(name, _)| *name == "knob.whip");
    Arc::new(build_knobs(
        board,
        program.expect("it is bundled").1,
        monitor,
    ))
}

/// What a first start of the bundled parts stores.
fn aligned() -> &'static [u8] {
    static STORED: OnceLock<Vec<u8>> = OnceLock::new();
    STORED.get_or_init(|| {
        let mut bench = Bench::new(PARTS);
        bench.pass_ms(START_MS);
        bench.stored()
    })
}

/// Knobs that have power; most benches have one.
pub struct Bench {
    pub machine: Machine,
    pub ports: Ports,
    knobs: Vec<DeviceId>,
    built: Arc<Built>,
}

/// How stiff the hand is that holds a knob (N*m/rad).
pub const STIFFNESS: f64 = 2.0;

/// How large a knob's block is (bytes).
const BLOCK: u32 = 64;

/// A hand that holds a knob there.
pub fn hand(place_rad: f64) -> Hand {
    Hand {
        torque_n_m: 0.0,
        stiffness: STIFFNESS,
        damping: 5e-3,
        place_rad,
    }
}

impl Bench {
    pub fn new(parts: KnobParts) -> Bench {
        Bench::with(bundled(), parts)
    }

    pub fn with(built: Arc<Built>, parts: KnobParts) -> Bench {
        Bench::of(built, [(PINS, parts)])
    }

    /// The bundled image with the bundled parts, which plays: it was aligned at a start before.
    pub fn started() -> Bench {
        Bench::started_with(bundled())
    }

    /// The same of another image.
    pub fn started_with(built: Arc<Built>) -> Bench {
        let mut bench = Bench::with(built, PARTS);
        bench.keep(aligned());
        bench.pass_ms(AGAIN_MS + 30);
        assert!(bench.faults() == 0 && bench.knob().is_driven());
        bench
    }

    /// Puts into flash what another bench has stored.
    pub fn keep(&mut self, stored: &[u8]) {
        let memory = &mut self.machine.bus.memory;
        memory.write(STORE, stored).expect("flash");
    }

    /// What is stored.
    pub fn stored(&self) -> Vec<u8> {
        let mut stored = vec![0; STORED];
        let memory = &self.machine.bus.memory;
        memory.read(STORE, &mut stored).expect("flash");
        stored
    }

    pub fn of(built: Arc<Built>, knobs: impl IntoIterator<Item = (KnobPins, KnobParts)>) -> Bench {
        let kind = BoardKind::Rp2350;
        let (mut machine, ports) =
            build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
        for segment in &built.image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        let attach = |(pins, parts)| Knob::attach(&mut machine.bus, pins, parts);
        let knobs = knobs.into_iter().map(attach).collect();
        machine.reset();
        Bench {
            machine,
            ports,
            knobs,
            built,
        }
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

    fn address(&self, symbol: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter();
        let found = symbols.find(|own| own.name == symbol);
        found.expect("it is there").address
    }

    pub fn set_word(&mut self, symbol: &str, at: u32, value: i32) {
        let address = self.address(symbol) + at;
        let memory = &mut self.machine.bus.memory;
        let bytes = value.to_le_bytes();
        memory.write(address, &bytes).expect("memory");
    }

    pub fn word(&self, symbol: &str, at: u32) -> i32 {
        let mut bytes = [0; 4];
        let memory = &self.machine.bus.memory;
        let address = self.address(symbol) + at;
        memory.read(address, &mut bytes).expect("memory");
        i32::from_le_bytes(bytes)
    }

    pub fn faults(&self) -> i32 {
        self.word("core0", core_block::FAULTS)
    }

    pub fn knob(&mut self) -> &mut Knob {
        self.knob_at(0)
    }

    pub fn knob_at(&mut self, number: usize) -> &mut Knob {
        let id = self.knobs[number];
        self.machine.bus.device_mut(id).expect("a knob")
    }

    pub fn count(&self) -> usize {
        self.knobs.len()
    }

    pub fn angle(&mut self) -> f64 {
        self.knob().motor().angle_rad()
    }

    /// Moves the hand's place to this many radians from another one within 40 ms, and gives what
    /// the hand must hold the knob with there (N*m).
    pub fn held(&mut self, from: f64, angle_rad: f64) -> f64 {
        let begin = self.knob().hand.place_rad;
        for step in 1..=40 {
            self.knob().hand = hand(begin + (from + angle_rad - begin) * f64::from(step) / 40.0);
            self.pass_ms(1);
        }
        self.pass_ms(20);
        STIFFNESS * (from + angle_rad - self.angle())
    }

    /// Which electrical angle the firmware takes the magnet's to be, and which it is.
    pub fn electrical_error(&self, parts: &KnobParts) -> f64 {
        self.electrical_error_at(0, parts)
    }

    pub fn electrical_error_at(&self, number: usize, parts: &KnobParts) -> f64 {
        let at = BLOCK * number as u32;
        let sign = if parts.motor.reversed { -1.0 } else { 1.0 };
        let told = f64::from(self.word("knob", at + knob_block::OFFSET)) / 65_536.0 * TAU - PI;
        assert_eq!(
            self.word("knob", at + knob_block::TURN),
            (sign * 4.0 * f64::from(parts.motor.pole_pairs)) as i32
        );
        let off = told - sign * parts.motor.offset_rad;
        (off + PI).rem_euclid(TAU) - PI
    }
}
