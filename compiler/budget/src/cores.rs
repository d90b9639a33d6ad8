//! All cores of a whole image: each bounded as if it were alone, and with the other one, if there
//! is one, at work.
//!
//! Who may be where follows from the sections of the image: each core fetches from its own code and
//! accesses its own data. What a core looks up in the other's memory between ticks comes as a
//! number (`Running::visits`).

use whippen_isa::timing::Core;
use whippen_isa::timing::sram::Chip;

use super::NotBounded;
use super::frame::{Frame, OnCore, frames};
use super::memory::{Banks, Surroundings};
use super::program::Program;
use whippen_arm::image::{Image, SectionKind};
use whippen_deterministic::parallel;
use whippen_firmware::{CoreCode, FirmwareImage, Owner, RUNNING, owner};
use whippen_keyboard::{CoreId, ProgramId};

/// One core.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bounded {
    /// With nobody else at the bus.
    pub alone: Frame,
    /// With the other core at work, and with its own fetches in the way of its data.
    pub crowded: Frame,
}

impl Bounded {
    /// Cycles of a frame that go to waiting for the other core and for own fetches, at most.
    pub fn contention_cycles_max(&self) -> u64 {
        self.crowded
            .cycles_max
            .saturating_sub(self.alone.cycles_max)
    }
}

/// Bounds the cores of a firmware's image while it plays one of its programs; `program` is what the
/// image's bytes say.
///
/// # Errors
/// What cannot be bounded.
pub fn cores(
    image: &FirmwareImage,
    program: &Program,
    core: &Core,
    playing: ProgramId,
) -> Result<Vec<Bounded>, NotBounded> {
    let chip = Chip::of(core.arch);
    let alone = Surroundings {
        chip,
        ..Surroundings::default()
    };
    let found = parallel::map(image.cores().collect(), |id: CoreId| {
        let of_program = image.programs.iter().map(|program| program.core(id));
        let programs: Vec<&CoreCode> = of_program.collect();
        let crowded = surroundings(image, chip, id, &programs);
        let core = OnCore {
            program,
            core,
            running: &RUNNING[id.index()],
            playing: programs[playing.index()],
            programs: &programs,
            surroundings: &alone,
        };
        frames(&core, [&alone, &crowded]).map(|[alone, crowded]| Bounded { alone, crowded })
    });
    found.into_iter().collect()
}

/// Who else is at the banks that a core uses, which has this code of each program.
fn surroundings(
    image: &FirmwareImage,
    chip: Chip,
    core: CoreId,
    programs: &[&CoreCode],
) -> Surroundings {
    let core = core.index();
    let banks = |core: usize, code: bool| banks(&image.image, chip, core, code);
    let (data, prefetch) = (banks(core, false), chip.fetches_apart());
    if image.keys_of_cores.len() == 1 {
        // What is named after another core is there, but this one runs it.
        return Surroundings {
            chip,
            data: data | banks(1, false),
            prefetch,
            ..Surroundings::default()
        };
    }
    let others = vec![banks(1 - core, true), banks(1 - core, false)];
    let visits = RUNNING[core].visits + more_visits(core, programs);
    Surroundings {
        chip,
        data,
        prefetch,
        others,
        visits,
    }
}

/// What core 1 looks up besides in the memory of core 0 where that has several zones: head and tail
/// of each further ring, in two rounds.
fn more_visits(core: usize, programs: &[&CoreCode]) -> u32 {
    let zones = programs.iter().map(|code| code.zones.len() as u32);
    if core == 0 {
        4 * (zones.max().unwrap_or(1) - 1)
    } else {
        0
    }
}

/// The banks of a core's code, or of its data.
fn banks(image: &Image, chip: Chip, core: usize, code: bool) -> Banks {
    let is = |name: &str| match owner(name) {
        Owner::Core(own) => own == core,
        Owner::Start => false,
    };
    let wanted = image
        .sections
        .iter()
        .filter(|section| (section.kind == SectionKind::Code) == code && is(&section.name));
    wanted.fold(0, |set, section| {
        set | Surroundings::banks(chip, section.run, section.size)
    })
}
