//! The relocatable file, in the memory of a core by itself.

use whippen_compiler::board::{AccessTime, timing};
use whippen_compiler::budget::{
    Program as Bytes, calling_tick_without_waiting, tick_without_waiting,
};
use whippen_compiler::firmware::with_values_from;
use whippen_compiler::firmware::{SAFETY_WORDS, Setup, core_block, safe_tick_name, safety_object};
use whippen_compiler::image::{
    Board as LinkBoard, Image, Input, Memory, MemoryKind, Placement, Start, link,
};
use whippen_compiler::modes::{Modes, specialize};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::thumb::{Built, Options, compile};
use whippen_emulator::{Board, CoreKind, Machine, Register, Stop};

use super::{Fault, OWN, Played, Story};

/// The relocatable file, linked into a memory, on a core by itself.
pub struct Linked {
    machine: Machine,
    image: Image,
    built: Built,
    core: CoreKind,
}

const RAM: u32 = 0x2000_0000;
const RAM_BYTES: u32 = 0x4_0000;

impl Linked {
    pub fn new(core: CoreKind, compiled: &Compiled, setup: &Setup, leaves: usize) -> Linked {
        let kernel = &compiled.lowered.kernel;
        let modes = match leaves {
            0 => Modes::single(kernel),
            _ => specialize(kernel, leaves),
        };
        let options = Options {
            name: "k".into(),
            keys: OWN as u32,
            gain: true,
            probes: false,
            arch: core.arch(),
        };
        let built = compile(&modes, &options).unwrap_or_else(|e| panic!("{e}"));
        let built = built.with_keys_of(&with_values_from(kernel, 0), 0);
        let safety = safety_object("k", &built.layout, setup, core.arch());
        let safety = safety.unwrap_or_else(|e| panic!("{e}"));
        let inputs = [&built.object, &safety].map(|object| Input {
            object,
            places: &[],
        });
        let image = link(&memory(core), &inputs, "k_safe_tick").unwrap_or_else(|e| panic!("{e}"));
        let mut board = Board::generic(core);
        let ram = board.regions.iter_mut().filter(|own| own.base == RAM);
        ram.for_each(|own| own.bytes = RAM_BYTES);
        let mut machine = Machine::new(board).expect("a board");
        for section in &image.sections {
            let memory = &mut machine.bus.memory;
            memory.write(section.run, &section.bytes).expect("memory");
        }
        let stack = Register::named("sp").expect("a register");
        machine.cpu_mut(0).set(stack, RAM + RAM_BYTES);
        Linked {
            machine,
            image,
            built,
            core,
        }
    }

    fn symbol(&self, name: &str) -> u32 {
        let found = self.image.symbols.iter().find(|symbol| symbol.name == name);
        found.unwrap_or_else(|| panic!("{name} is there")).address
    }

    fn write(&mut self, at: u32, bytes: &[u8]) {
        self.machine.bus.memory.write(at, bytes).expect("memory");
    }

    fn word(&self, at: u32) -> u32 {
        let mut bytes = [0; 4];
        self.machine
            .bus
            .memory
            .read(at, &mut bytes)
            .expect("memory");
        u32::from_le_bytes(bytes)
    }

    /// Calls a function of the file; its cycles.
    fn call(&mut self, name: &str, argument: u32) -> u64 {
        let kept = |machine: &Machine| {
            ["r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "sp"].map(|name| {
                machine
                    .cpu(0)
                    .get(Register::named(name).expect("a register"))
            })
        };
        let (at, before) = (self.symbol(name), kept(&self.machine));
        let stop = self.machine.call(at, [argument, 0, 0, 0], 10_000_000);
        assert_eq!(before, kept(&self.machine), "what belongs to the caller");
        match stop {
            Stop::Returned { cycles, .. } => cycles,
            other => panic!("{name}: {other:?}"),
        }
    }

    /// Plays a story from a tick on; also the most cycles of a tick.
    pub fn play(&mut self, story: &Story, first: u32) -> (Played, u64) {
        let (state, safety) = (self.symbol("k_state"), self.symbol("k_safety"));
        let layout = self.built.layout.clone();
        let (mut drives, mut most) = (Vec::new(), 0);
        for (number, (words, fault)) in (1..).zip(story) {
            for (key, word) in (0..).zip(words) {
                self.write(state + layout.input(key, 0), &word.to_le_bytes());
            }
            if number == 1 {
                self.call("k_safe_init", 0);
            }
            if number < first {
                continue;
            }
            match *fault {
                Fault::Missed => self.write(safety + core_block::TICK, &(number - 2).to_le_bytes()),
                Fault::Live(value) => self.write(
                    state + layout.live_param(0).expect("it is live"),
                    &value.to_le_bytes(),
                ),
                Fault::None => {}
            }
            most = most.max(self.call("k_safe_tick", number));
            drives.push(std::array::from_fn(|key| {
                self.word((state + layout.output(key as u32, 0)) & !3)
                    .wrapping_shr(8 * ((state + layout.output(key as u32, 0)) & 2))
                    as i16
            }));
        }
        let told = [1, 2, 3].map(|nth| self.word(safety + SAFETY_WORDS[nth]));
        (Played { drives, told }, most)
    }

    /// Cycles of a tick at most, by the static bound of the bytes that run.
    pub fn cycles_max(&self) -> u64 {
        let (bytes, core) = (Bytes::of(&self.image), timing(self.core.arch()).at_worst());
        let tick = tick_without_waiting(&bytes, "k", &core).unwrap_or_else(|e| panic!("{e}"));
        let called = ("k", &tick, OWN as u32);
        calling_tick_without_waiting(&bytes, &safe_tick_name("k"), called, &core)
            .unwrap_or_else(|e| panic!("{e}"))
            .cycles_max
    }
}

/// Memory without waiting, of which nobody else takes anything.
fn memory(core: CoreKind) -> LinkBoard {
    let ram = Memory {
        name: "ram".to_string(),
        base: RAM,
        size: RAM_BYTES - 0x1000,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        banks: vec![0],
        striped: false,
    };
    LinkBoard {
        name: "target".to_string(),
        arch: core.arch(),
        cores: 1,
        clock_hz: 150_000_000,
        start: Start::Vectors,
        uf2_family: None,
        places: vec![Placement {
            pattern: "*".to_string(),
            memory: ram.name.clone(),
        }],
        knob: None,
        bench: None,
        columns: None,
        i2s: None,
        fetches_apart: core != CoreKind::CortexM0Plus,
        banks: vec!["RAM".to_string()],
        memory: vec![ram],
        buses: Vec::new(),
        devices: Vec::new(),
        converter_interrupt: 0,
        stacks: vec![RAM + RAM_BYTES],
    }
}
