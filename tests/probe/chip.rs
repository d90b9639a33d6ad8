//! An emulated chip behind its debug port: what SWD transfers do, by Arm's Debug Interface
//! Architecture Specifications ADIv5.2 and ADIv6.0.
//!
//! ```text
//!   sequences, transfers --> wires --> debug port --> memory port --> memory of the machine
//! ```
//!
//! The cores go on meanwhile, and what a monitor must not do is kept in [`Chip::misdeeds`].

use std::path::Path;

use whippen_emulator::elf::Elf;
use whippen_emulator::{BoardKind, ConverterSetup, Machine, Stop, build};

/// Keys of the images.
pub const KEYS: u32 = 4;
/// Cycles that pass in a transfer of 50 bits at 1 MHz, about.
const TRANSFER_CYCLES: u64 = 7_000;
/// Peripherals begin here, and a core's own registers come behind them.
const MEMORY_END: u32 = 0x4000_0000;
/// Where a memory port has its registers, from its base on (ADIv6.0 C2.6).
const REGISTERS: u64 = 0xd00;

/// Requests for power, and one bit above each its answer; a request to reset the debug logic; an
/// error that stays (CTRL/STAT).
const POWER: u32 = 0x5000_0000;
const RESET_REQUEST: u32 = 1 << 26;
const STICKY: u32 = 1 << 5;

/// Why a transfer is not done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoAck {
    /// Nobody drives the wire.
    Silent,
    /// The port refuses until ABORT is written.
    Fault,
}

/// How a chip differs from others.
struct Wired {
    dpidr: u32,
    /// What selects core 0 where several ports share the wires.
    target: Option<u32>,
    /// The base of core 0's memory port, or its number.
    port: u64,
    idr: u32,
}

fn wired(kind: BoardKind) -> Wired {
    match kind {
        BoardKind::Rp2350 => Wired {
            dpidr: 0x4c01_3477,
            target: None,
            port: 0x2000,
            idr: 0x3477_0008,
        },
        BoardKind::Rp2040 => Wired {
            dpidr: 0x0bc1_2477,
            target: Some(0x0100_2927),
            port: 0,
            idr: 0x0477_0031,
        },
        BoardKind::Stm32f4 => Wired {
            dpidr: 0x2ba0_1477,
            target: None,
            port: 0,
            idr: 0x2477_0011,
        },
    }
}

/// What the port makes of the wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    /// It waits for the alert.
    Dormant,
    /// It waits for a reset of the line, or for its number.
    Deaf,
    /// It was reset: its identification must be read first.
    Reset,
    /// It answers.
    Awake,
}

/// The chip.
pub struct Chip {
    pub machine: Machine,
    /// What was done that a monitor must not do.
    pub misdeeds: Vec<String>,
    /// Words that were read of memory, and words that were written, with their addresses.
    pub reads: usize,
    pub writes: Vec<(u32, u32)>,
    wired: Wired,
    line: Line,
    heard: Vec<bool>,
    select: u32,
    select_high: u32,
    control: u32,
    csw: u32,
    tar: u32,
    result: u32,
}

impl Chip {
    /// With this image, from reset on, for so many cycles.
    pub fn started(kind: BoardKind, image: &Path, cycles: u64) -> Chip {
        let elf = Elf::parse(&std::fs::read(image).expect("an image"), false).expect("an image");
        let rate = [11_025, 1];
        let converter = ConverterSetup { keys: KEYS, rate };
        let (mut machine, ports) = build(kind, kind.board(), converter).expect("the board can be");
        elf.load(&mut machine.bus.memory, false).expect("it fits");
        let converter: &mut whippen_emulator::Converter =
            machine.bus.device_mut(ports.converter).expect("there");
        converter.samples.extend([20_000; KEYS as usize]);
        machine.reset();
        let wired = wired(kind);
        let line = match wired.target {
            Some(_) => Line::Dormant,
            None => Line::Deaf,
        };
        let mut chip = Chip {
            machine,
            misdeeds: Vec::new(),
            reads: 0,
            writes: Vec::new(),
            wired,
            line,
            heard: Vec::new(),
            select: 0,
            select_high: 0,
            control: 0,
            csw: 0x0380_0042,
            tar: 0,
            result: 0,
        };
        chip.run(cycles);
        chip
    }

    /// The cores go on.
    pub fn run(&mut self, cycles: u64) {
        let until = self.machine.cycle(0) + cycles;
        let stop = self.machine.run(until);
        assert!(matches!(stop, Stop::Limit), "{stop:?}");
    }

    /// Whether a probe has it powered for debugging.
    pub fn is_powered(&self) -> bool {
        self.control & POWER != 0
    }

    /// A word of its memory.
    pub fn word(&self, address: u32) -> u32 {
        let mut bytes = [0; 4];
        let memory = &self.machine.bus.memory;
        memory.read(address, &mut bytes).expect("memory");
        u32::from_le_bytes(bytes)
    }

    /// Writes a word of its memory.
    pub fn set(&mut self, address: u32, word: u32) {
        let memory = &mut self.machine.bus.memory;
        memory.write(address, &word.to_le_bytes()).expect("memory");
    }

    /// Bits on the wire that are no transfer, the first one lowest.
    pub fn sequence(&mut self, bits: u64, count: usize) {
        self.heard.extend((0..count).map(|at| bits >> at & 1 != 0));
        let heard = &self.heard;
        let ends = |all: &[(u64, usize)]| {
            let wanted: Vec<bool> = (all.iter())
                .flat_map(|&(bits, count)| (0..count).map(move |at| bits >> at & 1 != 0))
                .collect();
            heard.ends_with(&wanted)
        };
        // ADIv5.2 B5.3: the alert, then the code of SWD.
        let alert = [
            (0x8685_2d95_6209_f392, 64),
            (0x19bc_0ea2_e3dd_afe9, 64),
            (0x1a0, 12),
        ];
        if self.line == Line::Dormant {
            if ends(&alert) {
                self.line = Line::Deaf;
            }
            return;
        }
        let low = heard.iter().rev().take_while(|bit| !**bit).count();
        let high = heard.iter().rev().skip(low).take_while(|bit| **bit).count();
        if high >= 50 && low >= 2 {
            self.line = match self.wired.target {
                Some(_) => Line::Deaf,
                None => Line::Reset,
            };
            self.heard.clear();
            self.select = 0;
            return;
        }
        // A write of TARGETSEL behind the reset: eight bits, five for an answer that nobody gives,
        // then its word and parity.
        if let (Some(target), 48) = (self.wired.target, heard.len()) {
            let parity = u64::from(target.count_ones() % 2);
            let wanted = parity << 45 | u64::from(target) << 13 | 0x1f99;
            if ends(&[(wanted, 48)]) {
                self.line = Line::Reset;
            }
        }
    }

    /// A transfer: to a register of the memory port (`ap`), or of the debug port; what it reads.
    pub fn transfer(
        &mut self,
        ap: bool,
        register: u32,
        write: Option<u32>,
    ) -> Result<Option<u32>, NoAck> {
        self.heard.clear();
        self.run(TRANSFER_CYCLES);
        let identifies = (ap, register, write) == (false, 0, None);
        match self.line {
            Line::Awake => {}
            Line::Reset if identifies => self.line = Line::Awake,
            _ => return Err(NoAck::Silent),
        }
        match (ap, write) {
            (false, None) => Ok(Some(self.read_debug_port(register))),
            (false, Some(word)) => {
                self.write_debug_port(register, word);
                Ok(None)
            }
            (true, _) if self.control & POWER != POWER || self.control & STICKY != 0 => {
                self.control |= STICKY;
                Err(NoAck::Fault)
            }
            // What a read gives comes with the next one.
            (true, None) => {
                let before = self.result;
                self.result = self.port(register, None)?;
                Ok(Some(before))
            }
            (true, Some(word)) => self.port(register, Some(word)).map(|_| None),
        }
    }

    fn version(&self) -> u32 {
        self.wired.dpidr >> 12 & 0xf
    }

    fn read_debug_port(&mut self, register: u32) -> u32 {
        match (register, self.select & 0xf) {
            (0x0, 0) => self.wired.dpidr,
            (0x0, _) if self.version() < 3 => self.wired.dpidr,
            (0x4, 0) => self.control | (self.control & POWER) << 1,
            (0x4, 2) => self.wired.target.unwrap_or(0),
            (0x4, 3) => 1,
            (0xc, _) => self.result,
            other => {
                self.misdeeds.push(format!("a read of {other:x?}"));
                0
            }
        }
    }

    fn write_debug_port(&mut self, register: u32, word: u32) {
        match (register, self.select & 0xf) {
            (0x0, _) => self.control &= !STICKY,
            (0x4, 0) => {
                if word & RESET_REQUEST != 0 {
                    self.misdeeds.push("the debug logic is reset".to_string());
                }
                self.control = word & POWER | self.control & STICKY;
            }
            (0x4, 5) if self.version() >= 3 => self.select_high = word,
            (0x8, _) => self.select = word,
            other => self.misdeeds.push(format!("a write of {other:x?}")),
        }
    }

    /// A register of the selected port.
    fn port(&mut self, register: u32, write: Option<u32>) -> Result<u32, NoAck> {
        let (port, offset) = match self.version() {
            3 => {
                let address = u64::from(self.select_high) << 32 | u64::from(self.select & !0xf);
                let offset = (address & 0xfff).wrapping_sub(REGISTERS);
                (address & !0xfff, offset + u64::from(register))
            }
            _ => {
                let offset = self.select & 0xf0 | register;
                (u64::from(self.select >> 24), offset.into())
            }
        };
        if port != self.wired.port {
            self.misdeeds.push(format!("the port {port:#x}"));
            return Err(NoAck::Fault);
        }
        match (offset, write) {
            (0x00, None) => Ok(self.csw),
            (0x04, None) => Ok(self.tar),
            (0x0c, _) => self.memory(write),
            (0xf4, None) => Ok(0),
            (0xf8, None) => Ok(0xe00f_f003),
            (0xfc, None) => Ok(self.wired.idr),
            (0x00, Some(word)) => {
                self.csw = word;
                Ok(0)
            }
            (0x04, Some(word)) => {
                self.tar = word;
                Ok(0)
            }
            other => {
                self.misdeeds
                    .push(format!("the port's register {other:x?}"));
                Err(NoAck::Fault)
            }
        }
    }

    /// A word of memory at TAR, which goes on by a word, in its lower ten bits alone.
    fn memory(&mut self, write: Option<u32>) -> Result<u32, NoAck> {
        assert_eq!(self.csw & 0x37, 0x12, "whole words, one after the other");
        let at = self.tar;
        self.tar = at & !0x3ff | (at + 4) & 0x3ff;
        if at >= MEMORY_END {
            self.misdeeds.push(format!("{at:#010x}: {write:x?}"));
            return Ok(0);
        }
        let mut bytes = write.unwrap_or(0).to_le_bytes();
        let memory = &mut self.machine.bus.memory;
        let done = match write {
            Some(word) => {
                self.writes.push((at, word));
                memory.write(at, &bytes)
            }
            None => {
                self.reads += 1;
                memory.read(at, &mut bytes)
            }
        };
        match done {
            Ok(()) => Ok(u32::from_le_bytes(bytes)),
            Err(_) => {
                self.control |= STICKY;
                Err(NoAck::Fault)
            }
        }
    }
}
