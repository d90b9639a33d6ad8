//! A whole firmware on the emulated board: built, linked, started, fed with sensor words.

use whippen_compiler::firmware::{
    CORES, CoreCode, GuardedDrive, GuardedPort, Instrument, Midi, Motor, OwnTexts, ProgramCode,
    Setup, Velocities, build_image, core_block, key_guard,
};
use whippen_compiler::front::compile_front;
use whippen_compiler::image::Image;
use whippen_compiler::kernel::Kernel;
use whippen_compiler::keyboard::{CoreId, InstrumentId, Layout, Program};
use whippen_compiler::modes::{Modes, specialize};
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_compiler::thumb::StateLayout;
use whippen_emulator::{BoardKind, Converter, ConverterSetup, Machine, Ports, Stop, Uart, build};
use whippen_runtime::board;
use whippen_runtime::device::Device;

pub const KEYS: usize = 88;
/// Ticks per second, fewer than a keyboard has: what is tested here is not whether 88 keys fit.
pub const RATE_HZ: u32 = 11_025;
/// Words of 1 N, of the rated and of the peak current on `mikey`.
pub const NEWTON: u32 = 1024;
pub const RATED: u32 = 8192;

/// An instrument's kernel.
pub fn kernel(file: &str) -> Kernel {
    let programs = whippen_compiler::bundled::INSTRUMENTS;
    let text = programs
        .iter()
        .find(|(name, _)| *name == file)
        .expect("a bundled instrument")
        .1;
    kernel_of(file, text)
}

/// The kernel of a text.
pub fn kernel_of(file: &str, text: &str) -> Kernel {
    let mut map = SourceMap::default();
    map.add(file, text);
    let (program, _) = compile_front(&mut map, &Default::default());
    let model = program.expect("it is correct").instruments.remove(0);
    compile(model, Device::mikey().scales(), false)
        .expect("it lowers")
        .lowered
        .kernel
}

/// The port of a key with this motor.
pub fn guarded(motor: Motor) -> GuardedPort {
    GuardedPort {
        mid_travel: [6000, 60_000],
        rails: [true; 2],
        update_ticks: 1,
        drive: Some(GuardedDrive { word: 0, motor }),
    }
}

/// What `mikey` stands.
pub fn setup() -> Setup {
    Setup {
        keys: vec![44, 44],
        rate_hz: RATE_HZ.into(),
        ports: vec![guarded(Motor {
            rated: RATED,
            peak_ms: 100,
            newton: NEWTON,
        })],
        first_note: 21,
        coil: None,
        passivity: None,
        tuning: None,
        fine_velocity: false,
        passes_midi: false,
        monitor: None,
        own_texts: OwnTexts::default(),
    }
}

/// How events of a kernel are notes.
pub fn midi(kernel: &Kernel) -> Midi {
    let event = |name: &str| {
        kernel
            .events
            .iter()
            .position(|event| event.name == name)
            .map(|index| index as u32)
    };
    let velocities = Velocities {
        speed_shift: 8,
        table: std::array::from_fn(|index| (128 * index).clamp(128, 16_383) as u16),
    };
    let release = event("release");
    let has_speed = release.is_some_and(|index| kernel.events[index as usize].args > 0);
    Midi {
        note: event("note"),
        release,
        release_velocities: has_speed.then(|| velocities.clone()),
        velocities,
    }
}

/// A keyboard of 88 keys.
pub struct Rig {
    pub machine: Machine,
    pub ports: Ports,
    pub image: Image,
    /// By program and core.
    pub programs: Vec<ProgramCode>,
}

impl Rig {
    /// Built with the usual setup.
    pub fn new(kernel: &Kernel, leaves: usize) -> Rig {
        Rig::with(&[kernel], leaves, &setup())
    }

    /// Built from all modes of the kernels, or (0 leaves) from the one that knows nothing.
    pub fn with(kernels: &[&Kernel], leaves: usize, setup: &Setup) -> Rig {
        let modes = |kernel: &&Kernel| {
            if leaves == 0 {
                Modes::single(kernel)
            } else {
                specialize(kernel, leaves)
            }
        };
        let modes: Vec<Modes> = kernels.iter().map(modes).collect();
        let midi: Vec<Midi> = kernels.iter().map(|kernel| midi(kernel)).collect();
        let instruments: Vec<Instrument> = modes
            .iter()
            .zip(&midi)
            .map(|(modes, midi)| Instrument {
                modes,
                places: &[],
                midi,
                parts: None,
            })
            .collect();
        let programs = (0..kernels.len() as u32)
            .map(|number| Program::of_zones("all", [(KEYS as u32, InstrumentId(number))]));
        Rig::of_programs(programs.collect(), &instruments, setup)
    }

    /// Built from programs.
    pub fn of_programs(programs: Vec<Program>, instruments: &[Instrument], setup: &Setup) -> Rig {
        Rig::on(BoardKind::Rp2350, programs, instruments, setup)
    }

    /// Built for a board with two cores.
    pub fn on(
        kind: BoardKind,
        programs: Vec<Program>,
        instruments: &[Instrument],
        setup: &Setup,
    ) -> Rig {
        let board = board::bundled(kind.name()).expect("it is bundled");
        let layout = Layout {
            first_note: 21,
            keys: KEYS as u32,
            programs: programs.into(),
        };
        let whole =
            build_image(&layout, instruments, setup, &board).unwrap_or_else(|e| panic!("{e}"));
        let (image, programs) = (whole.image, whole.programs.into_iter().collect());
        let converter = ConverterSetup {
            keys: KEYS as u32,
            rate: setup.rate_hz.fraction(),
        };
        let (mut machine, ports) = build(kind, kind.board(), converter).expect("the board can be");
        for segment in &image.segments {
            machine
                .bus
                .memory
                .write(segment.load, &segment.bytes)
                .expect("memory");
        }
        machine.reset();
        let mut rig = Rig {
            machine,
            ports,
            programs,
            image,
        };
        rig.converter().recording = true;
        rig
    }

    /// A core's code of a program.
    pub fn code(&self, program: usize, core: usize) -> &CoreCode {
        self.programs[program].core(CoreId(core as u32))
    }

    /// Where a core's keys have what, of a program that has one instrument.
    pub fn layout(&self, program: usize, core: usize) -> &StateLayout {
        self.code(program, core).zones[0].layout()
    }

    pub fn converter(&mut self) -> &mut Converter {
        self.machine
            .bus
            .device_mut(self.ports.converter)
            .expect("the converter")
    }

    /// What the serial port has sent.
    pub fn sent(&mut self) -> Vec<u8> {
        let uart: &mut Uart = self
            .machine
            .bus
            .device_mut(self.ports.uarts[0])
            .expect("the port");
        std::mem::take(&mut uart.output)
    }

    /// Gives the words of so many ticks and runs until they are used up; the drive words since the
    /// last call, from the tick before on.
    pub fn play(&mut self, words: impl IntoIterator<Item = u16>) -> Vec<i16> {
        self.converter().samples.extend(words);
        let ticks = self.converter().samples.len() / KEYS;
        self.run(ticks)
    }

    /// Runs so many ticks.
    pub fn run(&mut self, ticks: usize) -> Vec<i16> {
        let last = self.converter().ticks() + ticks as u32;
        while self.converter().ticks() < last {
            let stop = self.step();
            assert!(matches!(stop, Stop::Limit), "{stop:?}");
        }
        // Both cores between two ticks: no count is half done.
        while [0, 1]
            .iter()
            .any(|&core| self.machine.cpu(core).exception() != 0)
        {
            let until = self.machine.cycle(0).max(self.machine.cycle(1)) + 10;
            let stop = self.machine.run(until);
            assert!(matches!(stop, Stop::Limit), "{stop:?}");
        }
        std::mem::take(&mut self.converter().drives)
    }

    /// Runs for a thousand cycles.
    pub fn step(&mut self) -> Stop {
        let until = self.machine.cycle(0).max(self.machine.cycle(1)) + 1000;
        self.machine.run(until)
    }

    pub fn symbol(&self, name: &str) -> u32 {
        let found = self.image.symbols.iter().find(|symbol| symbol.name == name);
        found.unwrap_or_else(|| panic!("{name} is there")).address
    }

    pub fn word(&self, address: u32) -> u32 {
        let mut bytes = [0; 4];
        self.machine
            .bus
            .memory
            .read(address, &mut bytes)
            .expect("memory");
        u32::from_le_bytes(bytes)
    }

    pub fn set(&mut self, address: u32, word: u32) {
        self.machine
            .bus
            .memory
            .write(address, &word.to_le_bytes())
            .expect("memory");
    }

    /// A word of a core's block.
    pub fn block(&self, core: usize, at: u32) -> u32 {
        self.word(self.symbol(CORES[core]) + at)
    }

    /// The ceiling of a key's gain: 65536, less when it is hot, 0 when it is free.
    pub fn ceiling(&self, key: usize) -> u32 {
        let (core, key) = (key / 44, key as u32 % 44);
        self.word(self.block(core, core_block::GUARDS) + 16 * key + key_guard::CEILING)
    }
}
