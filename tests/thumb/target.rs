//! An object in the memory of an emulated core, run tick by tick.

use whippen_compiler::image::{FixupKind, Object, SectionKind};
use whippen_compiler::kernel::{Happened, Kernel, Type};
use whippen_compiler::modes::Modes;
use whippen_compiler::thumb::{Built, Options, compile};
use whippen_emulator::{Board, CoreKind, Machine, Register, Stop};

/// Where code and constants begin.
const CODE: u32 = 0x2000_0000;
/// Where the state begins.
const DATA: u32 = 0x2004_0000;
/// No tick takes longer.
const CYCLES_MAX: u64 = 20_000_000;

/// One core with the keys of a kernel.
pub struct Target {
    machine: Machine,
    built: Built,
    kernel: Kernel,
    keys: u32,
    /// Address of each section.
    sections: Vec<u32>,
    /// Cycles of the last tick.
    pub cycles: u64,
}

impl Target {
    /// Code for so many keys, loaded.
    pub fn new(modes: &Modes, keys: u32) -> Target {
        let options = Options { name: "k".into(), keys, gain: true, probes: true };
        let built = compile(modes, &options).unwrap_or_else(|error| panic!("{}: {error}", modes.kernel.name));
        let mut board = Board::generic(CoreKind::CortexM33);
        board.regions.iter_mut().filter(|r| r.base == CODE).for_each(|r| r.bytes = 0x80_0000);
        let mut machine = Machine::new(board).expect("a board");
        let sections = place(&built.object);
        for (section, at) in built.object.sections.iter().zip(&sections) {
            machine.bus.memory.write(*at, &linked(&built.object, section, &sections)).expect("memory");
        }
        machine.cpu_mut(0).set(named("sp"), CODE + 0x80_0000);
        Target { machine, built, kernel: modes.kernel.clone(), keys, sections, cycles: 0 }
    }

    fn address(&self, symbol: &str) -> u32 {
        address(&self.built.object, symbol, &self.sections)
    }

    fn write(&mut self, at: u32, bytes: &[u8]) {
        let state = self.address("k_state");
        self.machine.bus.memory.write(state + at, bytes).expect("memory");
    }

    fn read<const N: usize>(&self, at: u32) -> [u8; N] {
        let mut bytes = [0; N];
        self.machine.bus.memory.read(self.address("k_state") + at, &mut bytes).expect("memory");
        bytes
    }

    fn word(&self, at: u32) -> u32 {
        u32::from_le_bytes(self.read(at))
    }

    fn call(&mut self, symbol: &str) {
        let (function, state) = (self.address(symbol), self.address("k_state"));
        let saved = self.kept();
        match self.machine.call(function, [state, 0, 0, 0], CYCLES_MAX) {
            Stop::Returned { cycles, .. } => self.cycles = cycles,
            stop => panic!("{}: {stop:?}", self.kernel.name),
        }
        assert_eq!(saved, self.kept(), "{}: what belongs to the caller", self.kernel.name);
    }

    /// The registers that a function must leave as they are.
    fn kept(&self) -> [u32; 9] {
        let names = ["r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "sp"];
        names.map(|name| self.machine.cpu(0).get(named(name)))
    }

    fn feed(&mut self, inputs: &[u16]) {
        let ports = self.kernel.inputs.len();
        for (index, word) in inputs.iter().enumerate() {
            let at = self.built.layout.input((index / ports) as u32, (index % ports) as u32);
            self.write(at, &word.to_le_bytes());
        }
    }

    pub fn init(&mut self, inputs: &[u16]) {
        self.feed(inputs);
        self.call("k_init");
    }

    pub fn tick(&mut self, inputs: &[u16]) -> Vec<i16> {
        self.feed(inputs);
        self.call("k_tick");
        let ports = self.kernel.outputs.len() as u32;
        let places = (0..self.keys).flat_map(|key| (0..ports).map(move |port| (key, port)));
        places.map(|(key, port)| i16::from_le_bytes(self.read(self.built.layout.output(key, port)))).collect()
    }

    /// What is exported, as the interpreter has it.
    pub fn probes(&self) -> Vec<i64> {
        let places = (0..self.keys).flat_map(|key| (0..self.kernel.probes.len()).map(move |probe| (key, probe)));
        places
            .map(|(key, probe)| {
                let at = self.built.layout.probe(key, probe).expect("a probe");
                self.value(self.kernel.probes[probe].ty, at)
            })
            .collect()
    }

    fn value(&self, ty: Type, at: u32) -> i64 {
        if ty == Type::I64 { i64::from_le_bytes(self.read(at)) } else { i32::from_le_bytes(self.read(at)).into() }
    }

    /// A word of a cell.
    pub fn cell(&self, key: u32, cell: usize, word: u32) -> i64 {
        let ty = self.kernel.cells[cell].ty;
        let size = if ty == Type::I64 { 8 } else { 4 };
        self.value(ty, self.built.layout.cell(key, cell).expect("a cell") + word * size)
    }

    /// The events since the last call, and how many were lost.
    pub fn drain_events(&mut self) -> (Vec<Happened>, u32) {
        let ring = self.built.layout.events();
        let (head, mut tail) = (self.word(ring.head), self.word(ring.tail));
        let mut events = Vec::new();
        while tail != head {
            let at = ring.start + tail % ring.bytes;
            let about = self.word(at + 4);
            let event = about >> 16;
            let args = self.kernel.events[event as usize].args;
            events.push(Happened {
                tick: self.word(at).into(),
                key: about & 0xffff,
                event,
                args: (0..args).map(|arg| self.word(at + 8 + 4 * arg) as i32).collect(),
            });
            tail = tail.wrapping_add(ring.event);
        }
        self.write(ring.tail, &tail.to_le_bytes());
        (events, self.word(ring.lost))
    }
}

fn named(name: &str) -> Register {
    Register::named(name).expect("a register")
}

fn place(object: &Object) -> Vec<u32> {
    let mut next = CODE;
    let place = |section: &whippen_compiler::image::Section| {
        if section.kind == SectionKind::Data {
            return DATA;
        }
        let at = next.next_multiple_of(section.align);
        next = at + section.size;
        at
    };
    object.sections.iter().map(place).collect()
}

/// The address of a symbol, odd for a function.
fn address(object: &Object, name: &str, sections: &[u32]) -> u32 {
    let symbol = object.symbols.iter().find(|symbol| symbol.name == name).unwrap_or_else(|| panic!("no `{name}`"));
    let thumb = u32::from(symbol.kind == whippen_compiler::image::SymbolKind::Function);
    sections[symbol.section.expect("defined")] + symbol.offset + thumb
}

/// The bytes of a section with addresses filled in.
fn linked(object: &Object, section: &whippen_compiler::image::Section, sections: &[u32]) -> Vec<u8> {
    let mut bytes = section.bytes.clone();
    for fixup in &section.fixups {
        let value = address(object, &fixup.symbol, sections).wrapping_add_signed(fixup.addend);
        let at = fixup.at as usize;
        match fixup.kind {
            FixupKind::Abs32 => bytes[at..at + 4].copy_from_slice(&value.to_le_bytes()),
            FixupKind::MovwAbs => immediate(&mut bytes[at..at + 4], value & 0xffff),
            FixupKind::MovtAbs => immediate(&mut bytes[at..at + 4], value >> 16),
            other => panic!("{other:?}"),
        }
    }
    bytes
}

/// Puts 16 bits into MOVW or MOVT.
fn immediate(bytes: &mut [u8], k: u32) {
    let first =
        u16::from_le_bytes([bytes[0], bytes[1]]) & !0x040f | (k >> 12) as u16 & 15 | ((k >> 11 & 1) << 10) as u16;
    let second = u16::from_le_bytes([bytes[2], bytes[3]]) & !0x70ff | ((k >> 8 & 7) << 12) as u16 | (k & 0xff) as u16;
    bytes[..2].copy_from_slice(&first.to_le_bytes());
    bytes[2..].copy_from_slice(&second.to_le_bytes());
}
