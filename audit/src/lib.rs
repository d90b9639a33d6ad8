//! The checker of certificates: re-checks the bound of an image from its ELF file alone.
//!
//! ```text
//!   ELF file --elf--> sections, certificate's text --certificate--> claims
//!      frame   what a frame is summed from: functions, exception, visits
//!      legs    two cores that run parts of one instrument, and wait for each other
//!      piece   potentials: each state of the certificate against everything that may follow it
//!      ranges  intervals of the Kernels' values, from their text
//!      step    one instruction: outcomes, cycles by isa::timing, facts, stack, waiting for memory
//! ```
//!
//! It searches nothing and has no heuristics; whoever writes certificates has them. It depends on
//! the instruction set alone: decoding, and the cycles of each instruction. `docs/audit.md` says
//! what is checked and what is not.

mod access;
mod certificate;
#[cfg(test)]
mod changed;
mod effect;
mod elf;
#[cfg(test)]
mod executed;
mod explain;
mod facts;
mod frame;
mod legs;
#[cfg(test)]
mod made;
mod memory;
mod overlap;
mod piece;
mod place;
mod ranges;
mod step;
#[cfg(test)]
mod tests;

use std::fmt::{self, Display};

use whippen_isa::timing::Core;

pub use certificate::{
    Bus, Call, Certificate, Dma, Frame, Function, Helper, Kind, Memory, Neighbour, Piece, Point,
};
pub use elf::{CERTIFICATE, Elf, KERNELS, Section};
pub use explain::{NOT_CHECKED, assumptions, explain};
pub use facts::{ALL, Facts, Interval, NONE, PLACES};
pub use frame::{Checked, Sums, costs, sums};
pub use legs::{HELPER, ROUNDS};
pub use memory::{Around, Banks, owner};
pub use overlap::Last;
pub use piece::{Arrival, NEVER, ends, node_of, walk};
pub use place::{Place, Tag};
pub use ranges::{Ranges, check_ranges};
pub use step::{Cost, Node, Room, Seen, State, Stepper, Steps, To};

/// Why a certificate is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Where, if it is somewhere.
    pub at: Option<u32>,
    /// In which function.
    pub function: Option<String>,
    /// What is wrong.
    pub why: String,
}

impl Refusal {
    /// Of the whole.
    pub fn new(why: String) -> Self {
        Self {
            at: None,
            function: None,
            why,
        }
    }

    /// At an address.
    pub fn at(at: u32, why: impl Into<String>) -> Self {
        Self {
            at: Some(at),
            function: None,
            why: why.into(),
        }
    }

    fn in_function(self, name: &str) -> Self {
        let function = self.function.or_else(|| Some(name.to_string()));
        Self { function, ..self }
    }
}

impl Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(function) = &self.function {
            write!(f, "in `{function}`: ")?;
        }
        if let Some(at) = self.at {
            write!(f, "{at:#010x} ")?;
        }
        f.write_str(&self.why)
    }
}

/// The core of that name, with what its sources leave open at its worst.
pub fn core_of(name: &str) -> Option<Core> {
    let all = [Core::cortex_m0plus(), Core::cortex_m4(), Core::cortex_m33()];
    all.into_iter()
        .find(|core| core.name == name)
        .map(Core::at_worst)
}

/// A number that stands for a core's table of cycles: another one where a number of it is changed.
pub fn table_of(core: &Core) -> u64 {
    hash(format!("{core:?}").as_bytes())
}

/// FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// A number that stands for the text of Kernels.
pub fn number_of(kernels: &str) -> u64 {
    hash(kernels.as_bytes())
}

/// Checks everything that a certificate claims of the bytes of an image, and that its Kernels are
/// those of the certificate; their ranges are [`check_ranges`]'s.
///
/// # Errors
/// The first claim that does not hold.
pub fn audit(elf: &Elf, certificate: &Certificate) -> Result<Vec<Checked>, Refusal> {
    let core = check_image(elf, certificate)?;
    let frames = certificate.frames.iter();
    frames
        .map(|frame| check_frame(elf, certificate, &core, frame))
        .collect()
}

/// Checks what a certificate claims of a whole image; gives its core.
///
/// # Errors
/// The first claim that does not hold.
pub fn check_image(elf: &Elf, certificate: &Certificate) -> Result<Core, Refusal> {
    let core = core_of(&certificate.core);
    let core = core.ok_or_else(|| Refusal::new(format!("`{}` is no core", certificate.core)))?;
    if table_of(&core) != certificate.table {
        let why = "the cycles of the core are not those that it is proven with";
        return Err(Refusal::new(why.into()));
    }
    if elf.constants() != certificate.sections {
        let why = "code or constants are not those that the certificate is of";
        return Err(Refusal::new(why.into()));
    }
    if number_of(elf.kernels.as_deref().unwrap_or_default()) != certificate.kernels {
        let why = "the Kernels are not those that the certificate is of";
        return Err(Refusal::new(why.into()));
    }
    certificate
        .is_well_formed()
        .map_err(|why| Refusal::new(why.into()))?;
    Ok(core)
}

/// Checks what a certificate claims of a frame.
///
/// # Errors
/// The first claim that does not hold.
pub fn check_frame(
    elf: &Elf,
    certificate: &Certificate,
    core: &Core,
    frame: &Frame,
) -> Result<Checked, Refusal> {
    let around = Around::new(certificate, elf, frame.core)?;
    frame::check_frame(certificate, &around, core, frame)
}
