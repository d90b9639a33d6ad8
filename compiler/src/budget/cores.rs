//! Both cores of a whole image: each bounded as if it were alone, and with the other one at work.
//!
//! Who may be where follows from the sections of the image: each core fetches from its own code and accesses its own data. What a core looks up in the other's memory between ticks comes as a number (`Running::visits`).

use whippen_isa::timing::Core;

use super::NotBounded;
use super::frame::{Frame, OnCore, frame};
use super::memory::{Banks, Surroundings};
use super::program::Program;
use crate::firmware::{Owner, RUNNING, owner};
use crate::image::{Image, SectionKind};
use crate::parallel;

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
        self.crowded.cycles_max.saturating_sub(self.alone.cycles_max)
    }
}

/// Bounds both cores of a firmware's image with so many keys each, while it plays the program of that number.
///
/// # Errors
/// What cannot be bounded.
pub fn cores(
    image: &Image,
    program: &Program,
    core: &Core,
    keys: [u32; 2],
    playing: usize,
) -> Result<[Bounded; 2], NotBounded> {
    let questions = [0, 1].map(|number| [(number, Surroundings::default()), (number, surroundings(image, number))]);
    let found = parallel::map(questions.into_iter().flatten().collect(), |(number, surroundings)| {
        let (running, keys, surroundings) = (&RUNNING[number], keys[number], &surroundings);
        frame(&OnCore { program, core, running, number, playing, keys, surroundings })
    });
    let [alone0, crowded0, alone1, crowded1] = found.try_into().unwrap_or_else(|_| unreachable!("four questions"));
    Ok([Bounded { alone: alone0?, crowded: crowded0? }, Bounded { alone: alone1?, crowded: crowded1? }])
}

/// Who else is at the banks that a core uses.
fn surroundings(image: &Image, core: usize) -> Surroundings {
    let other = 1 - core;
    let others = vec![banks(image, other, true), banks(image, other, false)];
    Surroundings { data: banks(image, core, false), prefetch: true, others, visits: RUNNING[core].visits }
}

/// The banks of a core's code, or of its data.
fn banks(image: &Image, core: usize, code: bool) -> Banks {
    let is = |name: &str| match owner(name) {
        Owner::Core(own) => own == core,
        Owner::Start => false,
    };
    let wanted =
        image.sections.iter().filter(|section| (section.kind == SectionKind::Code) == code && is(&section.name));
    wanted.fold(0, |set, section| set | Surroundings::banks(section.run, section.size))
}
