//! An object in the memory of an emulated core, run tick by tick.

use whippen_compiler::board::{AccessTime, timing};
use whippen_compiler::budget::{Program, tick_without_waiting};
use whippen_compiler::image::{
    Board as LinkBoard, Image, Input, Memory, MemoryKind, Placement, Start, link,
};
use whippen_compiler::kernel::{Happened, Kernel, Type};
use whippen_compiler::modes::Modes;
use whippen_compiler::thumb::{EVENT_MARK, Options, StateLayout, compile};
use whippen_emulator::{Board, CoreKind, Machine, Register, Stop};
use whippen_isa::Arch;

/// Where everything lies.
const RAM: u32 = 0x2000_0000;
/// At most.
const RAM_BYTES: u32 = 0x80_0000;
const STACK_BYTES: u32 = 0x1_0000;
/// No tick takes longer.
const CYCLES_MAX: u64 = 20_000_000;

/// The cores that code is made for.
pub const CORES: [CoreKind; 3] = [
    CoreKind::CortexM33,
    CoreKind::CortexM4,
    CoreKind::CortexM0Plus,
];

/// One core with the keys of a kernel.
pub struct Target {
    machine: Machine,
    layout: StateLayout,
    /// Where the state is.
    state: u32,
    image: Image,
    kernel: Kernel,
    keys: u32,
    arch: Arch,
    /// Cycles of the last tick.
    pub cycles: u64,
}

impl Target {
    /// Code for so many keys, loaded into a core of that kind.
    pub fn new(modes: &Modes, keys: u32, core: CoreKind) -> Target {
        let options = Options {
            name: "k".into(),
            keys,
            gain: true,
            probes: true,
            arch: core.arch(),
        };
        let built = compile(modes, &options)
            .unwrap_or_else(|error| panic!("{}: {error}", modes.kernel.name));
        let mut board = Board::generic(core);
        let input = Input {
            object: &built.object,
            places: &[],
        };
        let image = link(&memory(core.arch()), &[input], "k_tick")
            .unwrap_or_else(|error| panic!("{}: {error}", modes.kernel.name));
        // As much as is used, and a stack: a machine begins with all of it cleared.
        let end = image
            .sections
            .iter()
            .map(|section| section.run + section.size)
            .max()
            .unwrap_or(RAM);
        let bytes = (end - RAM).next_multiple_of(0x1000) + STACK_BYTES;
        board
            .regions
            .iter_mut()
            .filter(|r| r.base == RAM)
            .for_each(|r| r.bytes = bytes);
        let mut machine = Machine::new(board).expect("a board");
        for section in &image.sections {
            machine
                .bus
                .memory
                .write(section.run, &section.bytes)
                .expect("memory");
        }
        machine.cpu_mut(0).set(named("sp"), RAM + bytes);
        let state = address(&image, "k_state");
        Target {
            machine,
            layout: built.layout,
            state,
            image,
            kernel: modes.kernel.clone(),
            keys,
            arch: core.arch(),
            cycles: 0,
        }
    }

    /// Cycles of a tick at most, by the static bound of the very bytes that run.
    pub fn cycles_max(&self) -> u64 {
        let core = timing(self.arch).at_worst();
        let tick = tick_without_waiting(&Program::of(&self.image), "k", &core)
            .unwrap_or_else(|error| panic!("{}: {error}", self.kernel.name));
        tick.cycles_max(self.keys)
    }

    fn write(&mut self, at: u32, bytes: &[u8]) {
        self.machine
            .bus
            .memory
            .write(self.state + at, bytes)
            .expect("memory");
    }

    fn read<const N: usize>(&self, at: u32) -> [u8; N] {
        let mut bytes = [0; N];
        self.machine
            .bus
            .memory
            .read(self.state + at, &mut bytes)
            .expect("memory");
        bytes
    }

    fn word(&self, at: u32) -> u32 {
        u32::from_le_bytes(self.read(at))
    }

    fn call(&mut self, symbol: &str) {
        let (function, state) = (address(&self.image, symbol), self.state);
        let saved = self.kept();
        match self.machine.call(function, [state, 0, 0, 0], CYCLES_MAX) {
            Stop::Returned { cycles, .. } => self.cycles = cycles,
            stop => panic!("{}: {stop:?}", self.kernel.name),
        }
        assert_eq!(
            saved,
            self.kept(),
            "{}: what belongs to the caller",
            self.kernel.name
        );
    }

    /// The registers that a function must leave as they are.
    fn kept(&self) -> [u32; 9] {
        let names = ["r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "sp"];
        names.map(|name| self.machine.cpu(0).get(named(name)))
    }

    fn feed(&mut self, inputs: &[u16]) {
        let ports = self.kernel.inputs.len();
        for (index, word) in inputs.iter().enumerate() {
            let at = self
                .layout
                .input((index / ports) as u32, (index % ports) as u32);
            self.write(at, &word.to_le_bytes());
        }
    }

    pub fn init(&mut self, inputs: &[u16]) {
        self.feed(inputs);
        self.call("k_init");
    }

    pub fn set_live(&mut self, live: usize, value: i32) {
        let at = self.layout.live_param(live).expect("is live");
        self.write(at, &value.to_le_bytes());
    }

    pub fn tick(&mut self, inputs: &[u16]) -> Vec<i16> {
        self.feed(inputs);
        self.call("k_tick");
        let ports = self.kernel.outputs.len() as u32;
        let places = (0..self.keys).flat_map(|key| (0..ports).map(move |port| (key, port)));
        places
            .map(|(key, port)| i16::from_le_bytes(self.read(self.layout.output(key, port))))
            .collect()
    }

    /// What is exported, as the interpreter has it.
    pub fn probes(&self) -> Vec<i64> {
        let places = (0..self.keys)
            .flat_map(|key| (0..self.kernel.probes.len()).map(move |probe| (key, probe)));
        places
            .map(|(key, probe)| {
                let at = self.layout.probe(key, probe).expect("a probe");
                self.value(self.kernel.probes[probe].ty, at)
            })
            .collect()
    }

    fn value(&self, ty: Type, at: u32) -> i64 {
        if ty == Type::I64 {
            i64::from_le_bytes(self.read(at))
        } else {
            i32::from_le_bytes(self.read(at)).into()
        }
    }

    /// A word of a cell.
    pub fn cell(&self, key: u32, cell: usize, word: u32) -> i64 {
        let ty = self.kernel.cells[cell].ty;
        let size = if ty == Type::I64 { 8 } else { 4 };
        self.value(
            ty,
            self.layout.cell(key, cell).expect("a cell") + word * size,
        )
    }

    /// The events since the last call, and how many were lost.
    pub fn drain_events(&mut self) -> (Vec<Happened>, u32) {
        let Some(ring) = self.layout.events() else {
            return (Vec::new(), 0);
        };
        let (head, mut tail) = (self.word(ring.head), self.word(ring.tail));
        let mut events = Vec::new();
        while tail != head {
            let at = ring.start + tail % ring.bytes;
            let about = self.word(at + 4);
            if about == EVENT_MARK {
                tail = ring.behind_mark(tail);
                continue;
            }
            let event = about >> 16;
            let args = self.kernel.events[event as usize].args;
            events.push(Happened {
                tick: self.word(at).into(),
                key: about & 0xffff,
                event,
                args: (0..args)
                    .map(|arg| self.word(at + 8 + 4 * arg) as i32)
                    .collect(),
            });
            tail = tail.wrapping_add(ring.event);
        }
        self.write(ring.tail, &tail.to_le_bytes());
        (events, self.word(ring.lost))
    }
}

fn address(image: &Image, symbol: &str) -> u32 {
    let found = image.symbols.iter().find(|known| known.name == symbol);
    found.unwrap_or_else(|| panic!("no `{symbol}`")).address
}

fn named(name: &str) -> Register {
    Register::named(name).expect("a register")
}

/// Memory enough for any kernel; what is above it is for the stack.
fn memory(arch: Arch) -> LinkBoard {
    let ram = Memory {
        name: "ram".to_string(),
        base: RAM,
        size: RAM_BYTES - STACK_BYTES,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        banks: vec![0],
        striped: false,
    };
    LinkBoard {
        name: "target".to_string(),
        arch,
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
        fetches_apart: arch != Arch::V6M,
        banks: vec!["RAM".to_string()],
        memory: vec![ram],
        buses: Vec::new(),
        devices: Vec::new(),
        converter_interrupt: 0,
        stacks: vec![RAM + RAM_BYTES],
    }
}
