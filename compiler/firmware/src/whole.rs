//! A whole image: keys of all cores, divided, of every program, and the firmware around them.

use std::fmt;

use super::{
    CORES, FirmwareError, Midi, Played, Segment, Setup, Unsupported, distance, keys_name, keys_of,
    objects, support, zone_name,
};
use whippen_arm::image::{
    Board, Hint, Image, Input, LinkError, Object, Place, Section, SectionKind, link,
};
use whippen_arm::thumb::{self, Built, ThumbError, TickAbi, compile_for_frame, record_bytes};
use whippen_modes::Modes;

/// An image that starts by itself, and where the states of its keys have what.
#[derive(Debug, Clone)]
pub struct Whole {
    /// Everything with addresses.
    pub image: Image,
    /// By program and core: its keys from the first on.
    pub programs: Vec<Vec<Vec<Segment>>>,
}

impl Whole {
    /// How many keys each segment of each core has, in a program.
    pub fn keys(&self, program: usize) -> Vec<Vec<u32>> {
        self.programs[program]
            .iter()
            .map(|core| core.iter().map(|segment| segment.keys).collect())
            .collect()
    }
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum WholeError {
    /// The board has no firmware.
    Board(Unsupported),
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
            WholeError::Board(why) => why.fmt(f),
            WholeError::Ports(ins, outs) => {
                write!(
                    f,
                    "a key has {ins} words in and {outs} out; the firmware takes one each"
                )
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
    (0..cores)
        .map(|core| (keys + cores - 1 - core) / cores.max(1))
        .collect()
}

/// An instrument, to be built.
#[derive(Debug, Clone, Copy)]
pub struct Instrument<'a> {
    /// The modes of its kernel, without probes.
    pub modes: &'a Modes,
    /// Places of the kernel's origins.
    pub places: &'a [Place],
    /// Which events are notes.
    pub midi: &'a Midi,
}

/// Neighbouring keys of a keyboard that play one instrument.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// How many.
    pub keys: u32,
    /// Which of the kernel's values per key is that of the first.
    pub values_from: u32,
    /// What they play.
    pub instrument: Instrument<'a>,
}

/// A program of a keyboard: by rising key, all of them.
#[derive(Debug, Clone)]
pub struct Program<'a> {
    /// What its keys play.
    pub parts: Vec<Part<'a>>,
}

impl<'a> Program<'a> {
    /// One instrument on all keys of a setup.
    pub fn on_all(instrument: Instrument<'a>, setup: &Setup) -> Program<'a> {
        Program {
            parts: vec![Part {
                keys: setup.keys.iter().sum(),
                values_from: 0,
                instrument,
            }],
        }
    }

    /// How the cores have its keys, one run of the parts each.
    fn divided(&self, of_core: &[u32]) -> Vec<Vec<Piece>> {
        let mut begin = 0;
        let pieces = |&keys: &u32| {
            let (from, to) = (begin, begin + keys);
            begin = to;
            let mut first = 0;
            let pieces = self
                .parts
                .iter()
                .enumerate()
                .filter_map(|(part, &Part { keys, .. })| {
                    let (low, high) = (first.max(from), (first + keys).min(to));
                    let of_part = low - first;
                    first += keys;
                    (low < high).then(|| Piece {
                        part,
                        of_part,
                        of_core: low - from,
                        keys: high - low,
                    })
                });
            pieces.collect()
        };
        of_core.iter().map(pieces).collect()
    }
}

/// A segment before it is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Piece {
    part: usize,
    /// Its first key, counted from that of the part and of the core.
    of_part: u32,
    of_core: u32,
    keys: u32,
}

/// Builds the image of a keyboard; it starts with the first program.
///
/// # Errors
/// Board or programs have no firmware, setup or keys are out of range, memory is full; a bug.
pub fn whole(programs: &[Program], setup: &Setup, board: &Board) -> Result<Whole, WholeError> {
    let support = support(board).map_err(WholeError::Board)?;
    let all: u32 = setup.keys.iter().sum();
    for program in programs {
        for part in &program.parts {
            let kernel = &part.instrument.modes.kernel;
            let (ins, outs) = (kernel.inputs.len(), kernel.outputs.len());
            if (ins, outs) != (1, 1) {
                return Err(WholeError::Ports(ins, outs));
            }
        }
        let keys: u32 = program.parts.iter().map(|part| part.keys).sum();
        if keys != all {
            return Err(WholeError::Firmware(FirmwareError::Parts(keys, all)));
        }
    }
    if let Some(&keys) = setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        return Err(WholeError::Firmware(FirmwareError::Keys(keys)));
    }
    let pieces: Vec<Vec<Vec<Piece>>> = programs
        .iter()
        .map(|program| program.divided(&setup.keys))
        .collect();
    let zoned = pieces.iter().flatten().any(|pieces| pieces.len() > 1);
    let options = |name: String, keys: u32| thumb::Options {
        name,
        keys,
        gain: true,
        probes: false,
        arch: board.arch,
    };
    // One size of records for all, so that what runs through the gains need not ask which program
    // plays; or a table of them.
    let kernels = programs
        .iter()
        .flat_map(|program| &program.parts)
        .map(|part| &part.instrument.modes.kernel);
    let records =
        kernels.map(|kernel| record_bytes(kernel, &options(keys_name(0, 0), setup.keys[0])));
    let record = if zoned { 0 } else { records.max().unwrap_or(0) };
    let mut keys: Vec<Vec<Vec<Built>>> = Vec::new();
    let mut segments: Vec<Vec<Vec<Segment>>> = Vec::new();
    for (number, (program, pieces)) in programs.iter().zip(&pieces).enumerate() {
        // Cores that have as many keys of an instrument share its code.
        let mut made: Vec<(u32, usize, String, Built)> = Vec::new();
        let (mut built, mut named) = (Vec::new(), Vec::new());
        for (core, pieces) in pieces.iter().enumerate() {
            let (mut own, mut names) = (Vec::new(), Vec::new());
            for (zone, piece) in pieces.iter().enumerate() {
                let whole = keys_name(core, number);
                let name = if pieces.len() > 1 {
                    zone_name(&whole, zone)
                } else {
                    whole
                };
                let modes = program.parts[piece.part].instrument.modes;
                let abi = TickAbi {
                    drive_offset: distance(setup.keys[core]),
                    record_bytes_min: record,
                };
                let same = |other: &&(u32, usize, String, Built)| {
                    other.0 == abi.drive_offset
                        && other.1 == piece.part
                        && other.3.keys() == piece.keys
                };
                let of_piece = match made.iter().find(same) {
                    Some((_, _, from, built)) => renamed(built, from, &name),
                    None => compile_for_frame(modes, &options(name.clone(), piece.keys), &abi)
                        .map_err(WholeError::Code)?,
                };
                made.push((abi.drive_offset, piece.part, name.clone(), of_piece.clone()));
                let values = keys_of(
                    &modes.kernel,
                    program.parts[piece.part].values_from + piece.of_part,
                );
                let of_piece = of_piece.with_keys_of(&values, piece.of_core);
                let (part, first, keys) = (piece.part, piece.of_core, piece.keys);
                names.push(Segment {
                    name,
                    part,
                    first,
                    keys,
                    layout: of_piece.layout.clone(),
                });
                own.push(of_piece);
            }
            built.push(own);
            named.push(names);
        }
        keys.push(built);
        segments.push(named);
    }
    let played = programs
        .iter()
        .zip(&segments)
        .map(|(program, cores)| Played {
            parts: program
                .parts
                .iter()
                .map(|part| (&part.instrument.modes.kernel, part.instrument.midi))
                .collect(),
            cores,
        });
    let played: Vec<Played> = played.collect();
    let mut around = objects(&played, setup, &support).map_err(WholeError::Firmware)?;
    place_near(board, &mut around, &mut keys);
    let mut inputs: Vec<Input> = around
        .iter()
        .map(|object| Input {
            object,
            places: &[],
        })
        .collect();
    for ((program, cores), segments) in programs.iter().zip(&keys).zip(&segments) {
        for (built, segment) in cores.iter().flatten().zip(segments.iter().flatten()) {
            inputs.push(Input {
                object: &built.object,
                places: program.parts[segment.part].instrument.places,
            });
        }
    }
    let image = link(board, &inputs, "reset").map_err(WholeError::Link)?;
    for stack in &board.stacks {
        has_room(&image, board, *stack).map_err(WholeError::Link)?;
    }
    Ok(Whole {
        image,
        programs: segments,
    })
}

/// Bytes kept for the stack of a core: twice what the bound says that it needs.
const STACK_BYTES: u32 = 512;

/// Moves what a core uses at every turn into the memory that is near it, as long as there is room:
/// there nobody fetches and the other core seldom looks, so nothing waits. First the keys' states,
/// then their histories, then what the frame keeps of them.
fn place_near(board: &Board, around: &mut [Object], keys: &mut [Vec<Vec<Built>>]) {
    for (core, name) in CORES.iter().take(board.stacks.len()).enumerate() {
        let Some(memory) = board.memory_for(&format!(".data.near.{name}")) else {
            continue;
        };
        let stack = board
            .stacks
            .iter()
            .any(|stack| (memory.base + 1..=memory.base + memory.size).contains(stack));
        let mut room = memory
            .size
            .saturating_sub(if stack { STACK_BYTES } else { 0 });
        let inside = |section: &&Section| board.memory_for(&section.name) == Some(memory);
        let taken: u32 = around
            .iter()
            .flat_map(|object| &object.sections)
            .filter(inside)
            .map(|s| s.size + 3)
            .sum();
        room = room.saturating_sub(taken);
        let of_keys: Vec<&mut Built> = keys.iter_mut().flat_map(|cores| &mut cores[core]).collect();
        let (mut states, mut histories) = (Vec::new(), Vec::new());
        for built in of_keys {
            let mut sections = built
                .object
                .sections
                .iter_mut()
                .filter(|section| section.kind == SectionKind::Data);
            states.extend(sections.next());
            histories.extend(sections.next());
        }
        let guards = around.iter_mut().flat_map(|object| &mut object.sections);
        let guards = guards.filter(|section| section.name == format!(".bss.{name}.guards"));
        for section in states.into_iter().chain(histories).chain(guards) {
            let near = section
                .name
                .replacen(&format!(".{name}"), &format!(".near.{name}"), 1);
            let bytes = section.size.next_multiple_of(4);
            if bytes <= room && board.memory_for(&near) == Some(memory) {
                room -= bytes;
                section.name = near;
            }
        }
    }
}

/// That nothing lies where a stack grows down to.
fn has_room(image: &Image, board: &Board, stack: u32) -> Result<(), LinkError> {
    let memory = board
        .memory
        .iter()
        .find(|memory| (memory.base + 1..=memory.base + memory.size).contains(&stack));
    let Some(memory) = memory else { return Ok(()) };
    let ends = image
        .sections
        .iter()
        .filter(|section| section.memory == memory.name);
    let end = ends
        .map(|section| section.run + section.size)
        .max()
        .unwrap_or(memory.base);
    if end + STACK_BYTES <= stack {
        return Ok(());
    }
    let wanted = u64::from(end - memory.base) + u64::from(STACK_BYTES);
    Err(LinkError::Full {
        memory: memory.name.clone(),
        wanted,
        size: stack - memory.base,
    })
}

/// The same code and state under another name.
fn renamed(built: &Built, from: &str, to: &str) -> Built {
    let mut built = built.clone();
    let rename = |name: &mut String| *name = name.replacen(from, to, 1);
    for section in &mut built.object.sections {
        rename(&mut section.name);
        section
            .fixups
            .iter_mut()
            .for_each(|fixup| rename(&mut fixup.symbol));
        for hint in &mut section.hints {
            if let Hint::Targets { symbols, .. } = hint {
                symbols.iter_mut().for_each(rename);
            }
        }
    }
    built
        .object
        .symbols
        .iter_mut()
        .for_each(|symbol| rename(&mut symbol.name));
    built
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::Arch;
    use whippen_kernel::parse;

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
        let keys = [0, 7].map(|first| keys_of(&kernel, first));
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
                let abi = TickAbi {
                    drive_offset: 28,
                    record_bytes_min: 40,
                };
                compile_for_frame(&modes, &options, &abi).unwrap_or_else(|error| panic!("{error}"))
            };
            let [from, to] = [0, 1].map(|core| keys_name(core, program));
            assert_eq!(
                renamed(&compiled(0), &from, &to).with_keys_of(&keys[1], 0),
                compiled(1)
            );
        }
    }
}
