//! The image of an instrument in parts, and a board that plays it.

use whippen_compiler::board::Board;
use whippen_compiler::budget::{Bounded, Program, cores};
use whippen_compiler::firmware::{FirmwareImage, build_divided, core_block, drive_offset_bytes};
use whippen_compiler::keyboard::{Layout, ProgramId};
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{Compiled, build, unobserved};
use whippen_compiler::rate::Rate;
use whippen_emulator::{BoardKind, Converter, ConverterSetup, Machine, Ports, build as board_of};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup};

/// An image on its board.
pub struct Image {
    pub built: FirmwareImage,
    pub board: Board,
    kind: BoardKind,
    rate_hz: Rate,
    words: usize,
}

/// Words in and out.
pub fn words_of(compiled: &Compiled) -> [usize; 2] {
    let kernel = &compiled.lowered.kernel;
    [kernel.inputs.len(), kernel.outputs.len()]
}

impl Image {
    /// As `whippen build` makes it.
    pub fn of(compiled: &Compiled, kind: BoardKind) -> Image {
        Image::made(compiled, kind, None)
    }

    /// With this division of its parts.
    pub fn divided(compiled: &Compiled, kind: BoardKind, division: &[usize]) -> Image {
        Image::made(compiled, kind, Some(division))
    }

    fn made(compiled: &Compiled, kind: BoardKind, division: Option<&[usize]>) -> Image {
        let board = board::bundled(kind.name()).expect("a board");
        let device = Device::of(&compiled.model);
        let setup = setup(compiled, &device, 1, board.cores, 21).expect("a motor");
        let layout = Layout::of_one_instrument(&compiled.model.name, 1, 21);
        let own = ImageInstrument::new(compiled, INSTRUCTIONS, None, &mut unobserved);
        let own = [own.expect("modes")];
        let borrowed = ImageInstrument::borrow_all(&own);
        let built = match division {
            None => build(&layout, &borrowed, &setup, &board, &mut unobserved)
                .unwrap_or_else(|error| panic!("{error}")),
            Some(division) => build_divided(&layout, &borrowed, &setup, &board, division)
                .unwrap_or_else(|error| panic!("{error}")),
        };
        Image {
            built,
            board,
            kind,
            rate_hz: setup.rate_hz,
            words: words_of(compiled).into_iter().max().unwrap_or(1),
        }
    }

    /// The bound of its frame.
    pub fn bounded(&self) -> Bounded {
        let bytes = Program::of(&self.built.image);
        let found = cores(&self.built, &bytes, &self.board, ProgramId(0));
        found
            .unwrap_or_else(|error| panic!("{error}"))
            .swap_remove(0)
    }

    /// The address of a symbol.
    pub fn symbol(&self, name: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == name);
        found.unwrap_or_else(|| panic!("no {name}")).address & !1
    }
}

/// A board that plays an image.
pub struct Rig<'a> {
    image: &'a Image,
    pub machine: Machine,
    ports: Ports,
}

impl<'a> Rig<'a> {
    /// Reset, with halfwords of the image changed: where, from what, to what.
    pub fn new(image: &'a Image, changed: &[(u32, [u16; 2])]) -> Rig<'a> {
        let converter = ConverterSetup {
            keys: 1,
            rate: image.rate_hz.fraction(),
        };
        let (mut machine, ports) =
            board_of(image.kind, image.kind.board(), converter).expect("a board");
        let mut left = changed.to_vec();
        for segment in &image.built.image.segments {
            let mut bytes = segment.bytes.clone();
            left.retain(|(at, [old, new])| {
                let offset = at.wrapping_sub(segment.run) as usize;
                let Some(own) = bytes.get_mut(offset..offset.saturating_add(2)) else {
                    return true;
                };
                assert_eq!(own, old.to_le_bytes(), "at {at:x}");
                own.copy_from_slice(&new.to_le_bytes());
                false
            });
            machine
                .bus
                .memory
                .write(segment.load, &bytes)
                .expect("memory");
        }
        assert_eq!(left, [], "not in the image");
        machine.reset();
        Rig {
            image,
            machine,
            ports,
        }
    }

    fn converter(&mut self) -> &mut Converter {
        let found = self.machine.bus.device_mut(self.ports.converter);
        found.expect("a converter")
    }

    pub fn word(&self, at: u32) -> u32 {
        let mut bytes = [0; 4];
        self.machine
            .bus
            .memory
            .read(at, &mut bytes)
            .expect("memory");
        u32::from_le_bytes(bytes)
    }

    /// Writes a word of memory.
    pub fn set(&mut self, at: u32, word: u32) {
        let memory = &mut self.machine.bus.memory;
        memory.write(at, &word.to_le_bytes()).expect("memory");
    }

    /// A word of core 0's block.
    pub fn block(&self, offset: u32) -> u32 {
        self.word(self.image.symbol("core0") + offset)
    }

    /// Plays rows of words, one a tick, after as many of the first as it takes until the first tick
    /// is served; the drive words behind each.
    pub fn play(&mut self, rows: impl Iterator<Item = Vec<u16>>) -> Vec<Vec<i16>> {
        let mut rows = rows.peekable();
        let first = rows.peek().cloned().unwrap_or_default();
        while self.block(core_block::TICK) == 0 {
            self.tick(first.clone());
        }
        rows.map(|row| self.tick(row)).collect()
    }

    /// The cycle of the core that is ahead: core 0 sleeps at times.
    fn cycle(&self) -> u64 {
        let cycles = (0..self.machine.cores()).map(|core| self.machine.cycle(core));
        cycles.max().unwrap_or(0)
    }

    /// Gives the words of the next tick.
    pub fn next(&mut self, row: Vec<u16>) {
        self.converter().samples.extend(row);
    }

    /// Cycles until a word is another one, looked at after so many each.
    pub fn looks(&mut self, at: u32, known: u32, every_cycles: u64) -> u64 {
        let began = self.cycle();
        while self.word(at) == known {
            self.machine.run(self.cycle() + every_cycles);
        }
        self.cycle() - began
    }

    /// One tick, and most of what is left until the next one.
    fn tick(&mut self, row: Vec<u16>) -> Vec<i16> {
        let words = self.image.words;
        let period = self.image.rate_hz.cycles_min(self.image.board.clock_hz);
        let row = row.into_iter().chain(std::iter::repeat(0)).take(words);
        let row: Vec<u16> = row.collect();
        self.converter().samples.extend(row);
        let tick = self.converter().ticks();
        // The converter begins some time after the start.
        for _ in 0..1000 {
            if self.converter().ticks() != tick {
                break;
            }
            self.machine.run(self.cycle() + period / 16);
        }
        self.machine.run(self.cycle() + 7 * period / 8);
        let row = self.block(core_block::ROW);
        if row == 0 {
            return vec![0; words];
        }
        let at = row + drive_offset_bytes(words as u32);
        let drive = (0..words as u32).map(|port| {
            let at = at + 2 * port;
            (self.word(at & !3) >> (8 * (at & 2))) as i16
        });
        drive.collect()
    }
}
