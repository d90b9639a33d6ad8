//! All cores of a whole image: each bounded as if it were alone, and with the other one, if there
//! is one, at work.
//!
//! Who may be where follows from the sections of the image: each core fetches from its own code and
//! accesses its own data. What a core looks up in the other's memory between ticks comes as a
//! number (`Running::visits`).

use whippen_isa::timing::Core;
use whippen_isa::timing::sram::Chip;

use super::NotBounded;
use super::frame::{Frame, OnCore, frames, zone_names};
use super::memory::{Banks, Surroundings};
use super::program::Program;
use whippen_arm::image::{Image, SectionKind};
use whippen_deterministic::parallel;
use whippen_firmware::{Owner, RUNNING, keys_name, owner};

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

/// Bounds the cores of a firmware's image with so many keys each, zone by zone (`Whole::keys`),
/// while it plays the program of that number.
///
/// # Errors
/// What cannot be bounded.
pub fn cores(
    image: &Image,
    program: &Program,
    core: &Core,
    keys: &[Vec<u32>],
    playing: usize,
) -> Result<Vec<Bounded>, NotBounded> {
    let (chip, count) = (Chip::of(core.arch), keys.len());
    let alone = || Surroundings {
        chip,
        ..Surroundings::default()
    };
    let found = parallel::map((0..count).collect(), |number: usize| {
        let surroundings = [alone(), surroundings(image, program, chip, number, count)];
        let (running, keys, surroundings) =
            (&RUNNING[number], &keys[number], surroundings.each_ref());
        let core = OnCore {
            program,
            core,
            running,
            number,
            playing,
            keys,
            surroundings: surroundings[0],
        };
        frames(&core, surroundings).map(|[alone, crowded]| Bounded { alone, crowded })
    });
    found.into_iter().collect()
}

/// Who else is at the banks that a core uses, one of so many.
fn surroundings(
    image: &Image,
    program: &Program,
    chip: Chip,
    core: usize,
    cores: usize,
) -> Surroundings {
    let banks = |core: usize, code: bool| banks(image, chip, core, code);
    let (data, prefetch) = (banks(core, false), chip.fetches_apart());
    if cores == 1 {
        // What is named after another core is there, but this one runs it.
        return Surroundings {
            chip,
            data: data | banks(1, false),
            prefetch,
            ..Surroundings::default()
        };
    }
    let others = vec![banks(1 - core, true), banks(1 - core, false)];
    let visits = RUNNING[core].visits + more_visits(program, core);
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
fn more_visits(program: &Program, core: usize) -> u32 {
    let zones = (0..)
        .map(|number| keys_name(core, number))
        .take_while(|name| program.symbols.contains_key(&format!("{name}_tick")))
        .map(|name| zone_names(program, &name).len() as u32);
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
