//! A whole image: keys of both cores, divided, and the firmware around them.

use std::fmt;

use whippen_isa::Arch;

use super::{CORES, FirmwareError, RP2350, Setup, Support, distance, keys_of, objects};
use crate::image::{Board, Image, Input, LinkError, Place, Start, link};
use crate::modes::Modes;
use crate::thumb::{self, Layout, ThumbError, compile_for_frame};

/// An image that starts by itself, and where the states of its keys have what.
#[derive(Debug, Clone)]
pub struct Whole {
    /// Everything with addresses.
    pub image: Image,
    /// By core: where things lie in `core0_state`, `core1_state`.
    pub layouts: [Layout; 2],
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
                 image definition at the start)"
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

/// How keys are divided between the cores: the first half to core 0, which takes the odd one.
pub fn divided(keys: u32) -> [u32; 2] {
    [keys.div_ceil(2), keys / 2]
}

/// The firmware of a board, if there is one.
pub fn support(board: &Board) -> Option<Support<'static>> {
    (board.arch == Arch::V8M && board.cores == 2 && board.start == Start::ImageDef).then_some(RP2350)
}

/// Builds the image of a keyboard that plays one instrument. `places` are those of the kernel's origins.
///
/// # Errors
/// Board or instrument have no firmware, setup or keys are out of range, memory is full; a bug.
pub fn whole(modes: &Modes, setup: &Setup, board: &Board, places: &[Place]) -> Result<Whole, WholeError> {
    let support = support(board).ok_or_else(|| WholeError::Board(board.name.clone()))?;
    let kernel = &modes.kernel;
    if (kernel.inputs.len(), kernel.outputs.len()) != (1, 1) {
        return Err(WholeError::Ports(kernel.inputs.len(), kernel.outputs.len()));
    }
    if let Some(&keys) = setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        return Err(WholeError::Firmware(FirmwareError::Keys(keys)));
    }
    let distance = distance(setup.keys);
    let core = |core: usize| {
        let options =
            thumb::Options { name: CORES[core].to_string(), keys: setup.keys[core], gain: true, probes: false };
        compile_for_frame(&keys_of(modes, setup.keys, core), &options, distance).map_err(WholeError::Code)
    };
    let built = [core(0)?, core(1)?];
    let layouts = [&built[0].layout, &built[1].layout];
    let around = objects(kernel, setup, layouts, &support).map_err(WholeError::Firmware)?;
    let firmware = around.iter().map(|object| Input { object, places: &[] });
    let keys = built.iter().map(|built| Input { object: &built.object, places });
    let inputs: Vec<Input> = firmware.chain(keys).collect();
    let image = link(board, &inputs, "reset").map_err(WholeError::Link)?;
    Ok(Whole { image, layouts: built.map(|built| built.layout) })
}
