//! A whole image: keys of all cores, divided, of every program, and the firmware around them.

use std::fmt;

use whippen_isa::Arch;

use super::{
    CORES, FirmwareError, Midi, Played, RP2040, RP2350, STM32F4, Setup, Support, distance, keys_name, keys_of, objects,
};
use crate::image::{Board, Hint, Image, Input, LinkError, Object, Place, Section, Start, link};
use crate::modes::Modes;
use crate::thumb::{self, Around, Built, Layout, ThumbError, compile_for_frame, record_bytes};

/// An image that starts by itself, and where the states of its keys have what.
#[derive(Debug, Clone)]
pub struct Whole {
    /// Everything with addresses.
    pub image: Image,
    /// By program and core: where things lie in the state.
    pub layouts: Vec<Vec<Layout>>,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum WholeError {
    /// The board has another core, so many of them, or starts otherwise than what the firmware is made for.
    Board(String),
    /// The instrument has so many words in and out for each key, not one each.
    Ports(usize, usize),
    /// The firmware cannot be made so.
    Firmware(FirmwareError),
    /// There is no code for the keys.
    Code(ThumbError),
    /// It cannot be laid out in the board's memory.
    Link(LinkError),
}

impl fmt::Display for WholeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WholeError::Board(name) => write!(
                f,
                "there is no firmware for `{name}`: whole images are made for boards like rp2350 (two Cortex-M33, an \
                 image definition at the start), rp2040 (two Cortex-M0+, a second stage there) and stm32f4 (one Cortex-M4, vectors)"
            ),
            WholeError::Ports(ins, outs) => {
                write!(f, "a key has {ins} words in and {outs} out; the firmware takes one each")
            }
            WholeError::Firmware(error) => error.fmt(f),
            WholeError::Code(error) => error.fmt(f),
            WholeError::Link(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for WholeError {}

/// How keys are divided between so many cores: equal parts, the first cores take what is over.
pub fn divided(keys: u32, cores: u32) -> Vec<u32> {
    (0..cores).map(|core| (keys + cores - 1 - core) / cores.max(1)).collect()
}

/// The firmware of a board, if there is one.
pub fn support(board: &Board) -> Option<Support<'static>> {
    match (board.arch, board.cores, board.start) {
        (Arch::V8M, 2, Start::ImageDef) => Some(RP2350),
        (Arch::V6M, 2, Start::Boot2) => Some(RP2040),
        (Arch::V7EM, 1, Start::Vectors) => Some(STM32F4),
        _ => None,
    }
}

/// A program of a keyboard.
#[derive(Debug, Clone, Copy)]
pub struct Program<'a> {
    /// The modes of its kernel, without probes.
    pub modes: &'a Modes,
    /// Places of the kernel's origins.
    pub places: &'a [Place],
    /// Which events are notes.
    pub midi: &'a Midi,
}

/// Builds the image of a keyboard; it starts with the first program.
///
/// # Errors
/// Board or programs have no firmware, setup or keys are out of range, memory is full; a bug.
pub fn whole(programs: &[Program], setup: &Setup, board: &Board) -> Result<Whole, WholeError> {
    let support = support(board).ok_or_else(|| WholeError::Board(board.name.clone()))?;
    for program in programs {
        let (ins, outs) = (program.modes.kernel.inputs.len(), program.modes.kernel.outputs.len());
        if (ins, outs) != (1, 1) {
            return Err(WholeError::Ports(ins, outs));
        }
    }
    if let Some(&keys) = setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        return Err(WholeError::Firmware(FirmwareError::Keys(keys)));
    }
    let options = |core: usize, number: usize| thumb::Options {
        name: keys_name(core, number),
        keys: setup.keys[core],
        gain: true,
        probes: false,
        arch: board.arch,
    };
    // One size of records for all, so that what runs through the gains need not ask which program plays.
    let records = programs.iter().map(|program| record_bytes(&program.modes.kernel, &options(0, 0)));
    let record = records.max().unwrap_or(0);
    let built = |core: usize, number: usize| {
        let around = Around { distance: distance(setup.keys[core]), record };
        compile_for_frame(programs[number].modes, &options(core, number), &around).map_err(WholeError::Code)
    };
    let of_cores = |number: usize| {
        let mut cores = vec![built(0, number)?];
        for core in 1..setup.keys.len() {
            let same = setup.keys[0] == setup.keys[core];
            let other = if same { renamed(&cores[0], core, number) } else { built(core, number)? };
            cores.push(other.with_keys_of(&keys_of(&programs[number].modes.kernel, &setup.keys, core)));
        }
        Ok(cores)
    };
    let mut keys: Vec<Vec<Built>> = (0..programs.len()).map(of_cores).collect::<Result<_, WholeError>>()?;
    let played = programs.iter().zip(&keys).map(|(program, cores)| Played {
        kernel: &program.modes.kernel,
        layouts: cores.iter().map(|built| &built.layout).collect(),
        midi: program.midi,
    });
    let played: Vec<Played> = played.collect();
    let around = objects(&played, setup, &support).map_err(WholeError::Firmware)?;
    place_near(board, &support, &around, &mut keys);
    let mut inputs: Vec<Input> = around.iter().map(|object| Input { object, places: &[] }).collect();
    for (program, cores) in programs.iter().zip(&keys) {
        inputs.extend(cores.iter().map(|built| Input { object: &built.object, places: program.places }));
    }
    let image = link(board, &inputs, "reset").map_err(WholeError::Link)?;
    for stack in support.stacks {
        has_room(&image, board, *stack).map_err(WholeError::Link)?;
    }
    Ok(Whole {
        image,
        layouts: keys.into_iter().map(|cores| cores.into_iter().map(|built| built.layout).collect()).collect(),
    })
}

/// Bytes kept for the stack of a core: twice what the bound says that it needs.
const STACK_BYTES: u32 = 512;

/// Moves the keys' states into the memory that is near their core, as long as there is room: there nobody fetches and the
/// other core seldom looks, so nothing of a key waits.
fn place_near(board: &Board, support: &Support, around: &[Object], keys: &mut [Vec<Built>]) {
    for (core, name) in CORES.iter().take(support.stacks.len()).enumerate() {
        let Some(memory) = board.memory_for(&format!(".data.near.{name}")) else { continue };
        let stack = support.stacks.iter().any(|stack| (memory.base + 1..=memory.base + memory.size).contains(stack));
        let mut room = memory.size.saturating_sub(if stack { STACK_BYTES } else { 0 });
        let inside = |section: &&Section| board.memory_for(&section.name) == Some(memory);
        let taken: u32 = around.iter().flat_map(|object| &object.sections).filter(inside).map(|s| s.size + 3).sum();
        room = room.saturating_sub(taken);
        for (number, cores) in keys.iter_mut().enumerate() {
            let data = format!(".data.{}", keys_name(core, number));
            let state = cores[core].object.sections.iter_mut().find(|section| section.name == data);
            if let Some(state) = state.filter(|state| state.size <= room) {
                room -= state.size;
                state.name = data.replace(".data.", ".data.near.");
            }
        }
    }
}

/// That nothing lies where a stack grows down to.
fn has_room(image: &Image, board: &Board, stack: u32) -> Result<(), LinkError> {
    let memory = board.memory.iter().find(|memory| (memory.base + 1..=memory.base + memory.size).contains(&stack));
    let Some(memory) = memory else { return Ok(()) };
    let ends = image.sections.iter().filter(|section| section.memory == memory.name);
    let end = ends.map(|section| section.run + section.size).max().unwrap_or(memory.base);
    if end + STACK_BYTES <= stack {
        return Ok(());
    }
    let wanted = u64::from(end - memory.base) + u64::from(STACK_BYTES);
    Err(LinkError::Full { memory: memory.name.clone(), wanted, size: stack - memory.base })
}

/// The same code and state for another core, under its name.
fn renamed(built: &Built, core: usize, program: usize) -> Built {
    let (mut built, [from, to]) = (built.clone(), [0, core].map(|core| keys_name(core, program)));
    let rename = |name: &mut String| *name = name.replacen(&from, &to, 1);
    for section in &mut built.object.sections {
        rename(&mut section.name);
        section.fixups.iter_mut().for_each(|fixup| rename(&mut fixup.symbol));
        for hint in &mut section.hints {
            if let Hint::Targets { symbols, .. } = hint {
                symbols.iter_mut().for_each(rename);
            }
        }
    }
    built.object.symbols.iter_mut().for_each(|symbol| rename(&mut symbol.name));
    built
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::parse;

    /// A renamed object with other keys is the one that would have been compiled.
    #[test]
    fn the_second_core_has_the_code_of_the_first() {
        let text = "kernel direct @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  keyed weight: i32 [0..9] = { 1, 2, 3, 4, 5, 6, 7, 8, 9 }
  event loud(1)
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [32768..32768] = const 32768
    v2: i32 [0..9] = keyed weight
    v3: i32 [-32768..32767] = sub v0 v1
    v4: i32 [-32777..32767] = sub v3 v2
    v5: i32 [-32768..-32768] = const -32768
    v6: i32 [-32768..32767] = max v4 v5
    out f v6
  }
}
";
        let kernel = parse(text).unwrap_or_else(|error| panic!("{error:?}"));
        let keys = [0, 1].map(|core| keys_of(&kernel, &[7, 7], core));
        assert_ne!(keys[0].keyed, keys[1].keyed);
        for program in [0, 3] {
            let compiled = |core: usize| {
                let modes = Modes::single(&keys[core]);
                let options = thumb::Options {
                    name: keys_name(core, program),
                    keys: 7,
                    gain: true,
                    probes: false,
                    arch: Arch::V8M,
                };
                let around = Around { distance: 28, record: 40 };
                compile_for_frame(&modes, &options, &around).unwrap_or_else(|error| panic!("{error}"))
            };
            assert_eq!(renamed(&compiled(0), 1, program).with_keys_of(&keys[1]), compiled(1));
        }
    }
}
