//! The builder of whole images: keys' code of every program on every core, the firmware around it,
//! memory, addresses.
//!
//! ```text
//!   Layout, division --> zones of each core --code--> objects of keys --.
//!   Setup, Support ---------------------objects--> objects of firmware --+--place_near--> link --> FirmwareImage
//! ```
//!
//! Not here: which division is cheapest (the pipeline), the texts of the firmware (`lib`).

use whippen_arm::image::{Board, Image, Input, LinkError, Object, Place, link};
use whippen_arm::thumb::ThumbError;
use whippen_ids::IdMap;
use whippen_keyboard::{CoreId, InstrumentId, Layout, ProgramId};
use whippen_modes::Modes;

use std::fmt;

use super::code::{ProgramCode, compile_keys, is_latched};
use super::monitor;
use super::near::{check_stack, place_near};
use super::parts::{Cut, InParts};
use super::ports::Guards;
use super::sound::channels;
use super::{FirmwareError, Midi, RUNNING, Setup, Unsupported, objects, support_with};

/// An image that starts by itself, and where the states of its keys have what.
#[derive(Debug, Clone)]
pub struct FirmwareImage {
    /// Everything with addresses.
    pub image: Image,
    /// Keys of each core.
    pub keys_of_cores: Vec<u32>,
    /// The code of each program.
    pub programs: IdMap<ProgramId, ProgramCode>,
    /// Whether it answers a monitor.
    pub monitored: bool,
    /// Whether it sends on the MIDI that arrives.
    pub passes_midi: bool,
    /// Whether its start lets the cores go before a DMA wherever both want memory.
    pub yields_dma: bool,
    /// Whether its cores play columns of converters, of which core 0 says to core 1 what is new.
    pub has_columns: bool,
}

impl FirmwareImage {
    /// The code of a program.
    pub fn program(&self, id: ProgramId) -> &ProgramCode {
        &self.programs[id]
    }

    /// What is in parts, if something is.
    pub fn cut(&self) -> Option<&Cut> {
        let mut cores = self.programs.iter().flat_map(|program| &program.cores);
        cores.find_map(|core| core.cut.as_ref())
    }

    /// Channels of what is heard.
    pub fn channels(&self) -> u32 {
        channels(&self.programs)
    }

    /// What the other core reads and writes between two ticks of a core in memory that is otherwise
    /// this core's (words).
    pub fn visits(&self, core: CoreId) -> u32 {
        let running = &RUNNING[core.index()];
        let own = match self.monitored {
            true => running.visits_monitored,
            false if self.passes_midi => running.visits + running.visits_passing,
            false => running.visits,
        };
        // The alarm once more; the next tick in three words, and the last one that is finished. In
        // each of two ticks.
        let own = match (self.has_columns, core) {
            (false, _) => own,
            (true, CoreId(0)) => own + 2,
            (true, _) => own + 2 * (3 + 1),
        };
        match core {
            // Head and tail of the ring of each further zone, in two rounds.
            CoreId(0) => {
                let zones = (self.programs.iter()).map(|program| program.core(core).zones.len());
                own + 4 * (zones.max().unwrap_or(1) as u32 - 1)
            }
            // Whether a live value waits, then its word and itself, in two rounds; its tick. Such
            // a round looks for no program, and that is two words less. A sum of samples and its
            // tick, in two ticks.
            _ => {
                let live_values = if is_latched(&self.programs) { 2 + 1 } else { 0 };
                let sound = match channels(&self.programs) {
                    0 => 0,
                    channels => 2 * (1 + 2 * channels),
                };
                own + live_values + sound
            }
        }
    }

    /// Its cores.
    pub fn cores(&self) -> impl Iterator<Item = CoreId> {
        (0..self.keys_of_cores.len() as u32).map(CoreId)
    }
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageError {
    /// The board has no firmware.
    Board(Unsupported),
    /// The instrument has so many words in and out, and what is guarded is that of other ports.
    Ports(usize, usize),
    /// An instrument of several ports shall be played so many times, or beside others.
    Once(u32),
    /// The firmware cannot be made so.
    Firmware(FirmwareError),
    /// There is no code for the keys.
    Code(ThumbError),
    /// It cannot be laid out in the board's memory.
    Link(LinkError),
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImageError::Board(why) => why.fmt(f),
            ImageError::Ports(ins, outs) => write!(
                f,
                "the instrument has {ins} words in and {outs} out; the firmware takes one each of a key, or of each port \
                 of an instrument that is played once (code for other projects, .o and .c, takes any)"
            ),
            ImageError::Once(keys) => write!(
                f,
                "{keys} keys of an instrument with several ports; it is played once, and is the only program"
            ),
            ImageError::Firmware(error) => error.fmt(f),
            ImageError::Code(error) => error.fmt(f),
            ImageError::Link(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ImageError {}

/// Equal parts for so many cores; the first cores take what is over.
pub fn divide_equally(keys: u32, cores: u32) -> Vec<u32> {
    (0..cores)
        .map(|core| (keys + cores - 1 - core) / cores.max(1))
        .collect()
}

/// An instrument, to be built.
#[derive(Debug, Clone, Copy)]
pub struct Instrument<'a> {
    /// The modes of its kernel, without probes; its values per key are those of all keys of the
    /// keyboard.
    pub modes: &'a Modes,
    /// Places of the kernel's origins.
    pub places: &'a [Place],
    /// Which events are notes.
    pub midi: &'a Midi,
    /// The instrument in parts, if it is one that is played once and is to run so.
    pub parts: Option<&'a InParts>,
}

/// Builds the image of a keyboard; it starts with the first program. The cores' keys are those of
/// the setup.
///
/// # Errors
/// Board or programs have no firmware, setup or keys are out of range, memory is full; a bug.
pub fn build_image(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<FirmwareImage, ImageError> {
    let in_parts = instruments.iter().find_map(|instrument| instrument.parts);
    let division = in_parts.map_or_else(Vec::new, |parts| {
        let cycles = |part: usize| parts.parts.parts[part].cycles();
        parts.divided(board.stacks.len(), cycles)
    });
    build_divided(layout, instruments, setup, board, &division)
}

/// As [`build_image`], with the core of every part of an instrument in parts.
///
/// # Errors
/// As [`build_image`].
pub fn build_divided(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
    division: &[usize],
) -> Result<FirmwareImage, ImageError> {
    let support = support_with(board, &setup.own_texts).map_err(ImageError::Board)?;
    check_ports(layout, instruments, setup)?;
    check_keys(layout, setup).map_err(ImageError::Firmware)?;
    let mut programs =
        compile_keys(layout, instruments, setup, board.arch, division).map_err(ImageError::Code)?;
    let mut firmware =
        objects(&programs, instruments, setup, &support).map_err(ImageError::Firmware)?;
    place_near(board, &mut firmware, &mut programs);
    let mut image = link_all(board, &firmware, &programs, instruments).map_err(ImageError::Link)?;
    if setup.monitor.is_some() {
        monitor::identify(&mut image);
    }
    let helpers = usize::from(has_helper(&programs));
    for stack in &board.stacks[..setup.keys.len() + helpers] {
        check_stack(&image, board, *stack).map_err(ImageError::Link)?;
    }
    Ok(FirmwareImage {
        image,
        keys_of_cores: setup.keys.clone(),
        programs,
        monitored: setup.monitor.is_some(),
        passes_midi: setup.passes_midi,
        yields_dma: support.yields_dma(),
        has_columns: board.columns.is_some() && setup.keys.len() > 1,
    })
}

/// Whether core 1 runs parts of an instrument that core 0 plays.
pub(super) fn has_helper(programs: &[ProgramCode]) -> bool {
    let mut cores = programs.iter().flat_map(|program| &program.cores);
    cores.any(|core| core.cut.as_ref().is_some_and(Cut::has_helper))
}

/// That every instrument that is played has the words that are guarded: one in and one out of a
/// key, or those of the ports of the only instrument.
fn check_ports(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
) -> Result<(), ImageError> {
    let ins = setup.ports.len();
    let outs = setup
        .ports
        .iter()
        .filter(|port| port.drive.is_some())
        .count();
    for InstrumentId(number) in layout.instruments() {
        let kernel = &instruments[number as usize].modes.kernel;
        let found = (kernel.inputs.len(), kernel.outputs.len());
        if found != (ins, outs) || ins == 0 {
            return Err(ImageError::Ports(found.0, found.1));
        }
    }
    let is_once = setup.keys == [1] && layout.keys == 1 && layout.programs.len() == 1;
    let in_parts = instruments
        .iter()
        .any(|instrument| instrument.parts.is_some());
    if (setup.guards() == Guards::Ports || in_parts) && !is_once {
        return Err(ImageError::Once(layout.keys));
    }
    Ok(())
}

/// That programs and cores have the same keys, and no core too many or none.
fn check_keys(layout: &Layout, setup: &Setup) -> Result<(), FirmwareError> {
    let all: u32 = setup.keys.iter().sum();
    let other = layout.programs.iter().map(|program| program.keys());
    if let Some(keys) = other.into_iter().find(|keys| *keys != all) {
        return Err(FirmwareError::Parts(keys, all));
    }
    match setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        Some(&keys) => Err(FirmwareError::Keys(keys)),
        None => Ok(()),
    }
}

/// Gives everything its addresses.
fn link_all(
    board: &Board,
    firmware: &[Object],
    programs: &[ProgramCode],
    instruments: &[Instrument],
) -> Result<Image, LinkError> {
    let of_firmware = firmware.iter().map(|object| Input {
        object,
        places: &[],
    });
    let of_keys = programs.iter().flat_map(|program| {
        let of_zone = |zone| instruments[program.instrument_of(zone).index()].places;
        // Parts are of the only instrument.
        let places = program.zones().next().map_or(&[][..], of_zone);
        let zones = program
            .zones()
            .map(move |zone| (&zone.built, of_zone(zone)));
        let parts = program.parts().map(move |part| (&part.built, places));
        zones.chain(parts).map(|(built, places)| Input {
            object: &built.object,
            places,
        })
    });
    let inputs: Vec<Input> = of_firmware.chain(of_keys).collect();
    link(board, &inputs, "reset")
}
