//! All cores of a whole image: each bounded as if it were alone, and with the other one, if there
//! is one, at work.
//!
//! Who may be where follows from the sections of the image: each core fetches from its own code and
//! accesses its own data. What a core looks up in the other's memory between ticks comes as a
//! number (`FirmwareImage::visits`).

use super::core_stack::stack_memory;
use super::memory::{Dma, Extent, Interference, Lies, Neighbour, Others, Reach};
use super::program::Program;
use super::tick_handler::{OnCore, TickHandlerBound, tick_handlers};
use super::waiting::{WaitCause, Waited};
use super::{ByContention, NotBounded};
use whippen_arm::image::{Image, Linked as LinkedSection, SectionKind};
use whippen_board::{BankSet, Board};
use whippen_deterministic::parallel;
use whippen_firmware::{CoreCode, Cut, FirmwareImage, Owner, RUNNING, owner};
use whippen_keyboard::{CoreId, ProgramId};

/// One core.
pub type Bounded = ByContention<TickHandlerBound>;

impl Bounded {
    /// Cycles of a frame that go to waiting for the other core and for own fetches, at most.
    pub fn contention_cycles_max(&self) -> u64 {
        self.contended
            .cycles_max
            .saturating_sub(self.alone.cycles_max)
    }

    /// What these cycles are for.
    pub fn waiting(&self) -> Vec<Waited> {
        let mut waiting = self.contended.waiting.clone();
        let listed: i64 = waiting.iter().map(|waited| waited.cycles).sum();
        let rest = self.contention_cycles_max() as i64 - listed;
        if rest != 0 {
            waiting.push(Waited {
                cause: WaitCause::OtherPath,
                data: "",
                cycles: rest,
            });
        }
        waiting
    }
}

/// Bounds the cores of a firmware's image for a board while it plays one of its programs; `program`
/// is what the image's bytes say.
///
/// # Errors
/// What cannot be bounded.
pub fn cores(
    image: &FirmwareImage,
    program: &Program,
    board: &Board,
    playing: ProgramId,
) -> Result<Vec<Bounded>, NotBounded> {
    cores_of(image, program, board, playing, image.cores().collect())
}

/// As [`cores`], of some cores.
///
/// # Errors
/// As [`cores`].
pub fn cores_of(
    image: &FirmwareImage,
    program: &Program,
    board: &Board,
    playing: ProgramId,
    wanted: Vec<CoreId>,
) -> Result<Vec<Bounded>, NotBounded> {
    let timing = board.timing().at_worst();
    let found = parallel::map(wanted, |id: CoreId| {
        let of_program = image.programs.iter().map(|program| program.core(id));
        let programs: Vec<&CoreCode> = of_program.collect();
        let contended = around(image, program, board, id.index());
        let alone = Interference::new(
            board,
            &program.sections,
            contended.lies(),
            Others::default(),
        );
        let helper = image.cut().is_some_and(Cut::has_helper).then(|| {
            let contended = around(image, program, board, 1);
            let alone = Interference::new(
                board,
                &program.sections,
                contended.lies(),
                Others::default(),
            );
            ByContention { alone, contended }
        });
        let core = OnCore {
            program,
            core: &timing,
            number: id.index(),
            running: &RUNNING[id.index()],
            playing: programs[playing.index()],
            programs: &programs,
            interference: &alone,
            helper: helper.as_ref().map(|helper| ByContention {
                alone: &helper.alone,
                contended: &helper.contended,
            }),
        };
        let interferences = ByContention {
            alone: &alone,
            contended: &contended,
        };
        tick_handlers(&core, interferences)
    });
    found.into_iter().collect()
}

/// Who else is at the banks that a core uses.
fn around<'a>(
    whole: &FirmwareImage,
    program: &'a Program,
    board: &'a Board,
    core: usize,
) -> Interference<'a> {
    let image = &whole.image;
    let cores = whole.keys_of_cores.len();
    let mut others = Others {
        fetches: board.fetches_apart,
        ..Others::default()
    };
    if cores > 1 {
        let other = 1 - core;
        others.contenders = vec![
            code_banks(image, board, other),
            data_banks(image, program, board, other),
        ];
        others.remote_accesses = whole.visits(CoreId(core as u32));
    }
    let cut = whole.cut().filter(|cut| cut.has_helper());
    if let Some(cut) = cut {
        let other = 1 - core;
        others.contenders = vec![
            code_banks(image, board, other),
            data_banks(image, program, board, other),
        ];
        // What core 0 writes to core 1's memory is charged to the legs that this runs (`parts`).
        if core == 0 {
            others.remote_accesses = cut.crossing_back(whole.channels());
        }
    }
    others.dma = dma(whole, board);
    others.neighbour = neighbour(whole, board, core);
    let is_only = cores == 1 && cut.is_none();
    let own_code = code_banks(image, board, core);
    // A single core also runs what is named after another one.
    let code = match is_only {
        true => own_code | code_banks(image, board, 1),
        false => own_code,
    };
    let lies = Lies {
        code,
        data: data(image, board, core, is_only),
        stack: stack_memory(program, board, core).map_or(Reach::default(), |(_, reach)| reach),
    };
    Interference::new(board, &program.sections, lies, others)
}

/// What a DMA does in a tick, if the board has one at work. Behind a bridge each access of a core
/// is taken to meet one of its reads and one of its writes, however many there are.
pub(super) fn dma(whole: &FirmwareImage, board: &Board) -> Option<Dma> {
    let traffic = board.dma_traffic()?;
    Some(Dma {
        device: board.device(traffic.device)?,
        wait_cycles: 2 * traffic.cycles,
        in_memory: if whole.yields_dma {
            0
        } else {
            traffic.in_memory
        },
    })
}

/// The other core at the bridge to the peripherals, where ticks of both begin at once. Each access
/// waits for one of the other core's that is under way. Where a start sets priorities, as that of
/// columns does, core 1 may wait for two besides: BUS_PRIORITY is mis-wired at bridges (erratum E27
/// of RP2350), core 0 goes first, and its texts make no more than two accesses in a row.
pub(super) fn neighbour(whole: &FirmwareImage, board: &Board, core: usize) -> Option<Neighbour> {
    if whole.keys_of_cores.len() < 2 && !whole.cut().is_some_and(Cut::has_helper) {
        return None;
    }
    let (name, in_a_row) = match whole.has_columns {
        true => ("pwm", 2),
        false => ("converter", 0),
    };
    let device = board.device(name)?;
    let bus = board.buses.iter().find(|bus| bus.contains(device))?;
    let accesses = if core == 0 { 1 } else { 1 + in_a_row };
    Some(Neighbour {
        device,
        wait_cycles: accesses * bus.read_cycles.max(bus.write_cycles),
    })
}

/// Where a core's data lie.
fn data(image: &Image, board: &Board, core: usize, is_only: bool) -> Reach {
    // A single core also runs what is named after another one.
    let own = |section: &&LinkedSection| {
        section.kind != SectionKind::Code
            && match owner(&section.name) {
                Owner::Core(of) => of == core || is_only,
                Owner::Start => false,
            }
    };
    let sections = image.sections.iter().filter(own);
    let reaches = sections.map(|section| Extent::of(section).reach(board));
    reaches.fold(Reach::default(), Reach::and)
}

/// The banks of a core's code.
fn code_banks(image: &Image, board: &Board, core: usize) -> BankSet {
    let sections = image.sections.iter().filter(|section| {
        section.kind == SectionKind::Code && owner(&section.name) == Owner::Core(core)
    });
    sections.fold(0, |set, section| set | Extent::of(section).banks(board))
}

/// The banks of a core's data and of its stack.
fn data_banks(image: &Image, program: &Program, board: &Board, core: usize) -> BankSet {
    let sections = image.sections.iter().filter(|section| {
        section.kind != SectionKind::Code && owner(&section.name) == Owner::Core(core)
    });
    let stack = stack_memory(program, board, core).map_or(0, |(_, reach)| reach.banks);
    sections.fold(stack, |set, section| set | Extent::of(section).banks(board))
}

#[cfg(test)]
pub(crate) mod tests;
