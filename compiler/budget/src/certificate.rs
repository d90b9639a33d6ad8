//! The certificate of an image: what is claimed of it, for a checker that believes nothing of this
//! crate (`whippen-audit`).
//!
//! ```text
//!   query --graph, order--> points --explore--> states, by the checker's own steps
//!         --potential--> cycles that remain in each --> whippen_audit::Piece
//! ```
//!
//! The heuristics are here: where points are, which facts are worth keeping, the cycles of a round.
//! Wherever they err the checker refuses; nothing of what is here has to be believed.

mod explore;
mod explored;
mod finish;
mod helped;
mod potential;
mod tighten;
mod wanted;

use std::fmt::{self, Display};

use whippen_arm::thumb::POINTS;
use whippen_audit as audit;
use whippen_audit::{Around, Certificate, Elf, Frame, Function, Helper, Kind, Refusal};
use whippen_board::Board;
use whippen_deterministic::parallel;
use whippen_firmware::{CoreCode, Cut, DEAD, FirmwareImage, RUNNING};
use whippen_keyboard::{CoreId, ProgramId};

use super::calls::Calls;
use super::cores::{dma, neighbour};
use super::memory::{Interference, Lies, Neighbour, Others};
use super::program::Program;
use super::tick_handler::{OnCore, find};
use super::{Annotations, NotBounded, Query};
use explore::Explorer;
use helped::visits_of_legs;
use wanted::Wanted;

/// Why an image has no certificate.
#[derive(Debug)]
pub enum NotCertified {
    /// It has no bound.
    NotBounded(NotBounded),
    /// The checker does not follow.
    Refused(Refusal),
}

impl Display for NotCertified {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotBounded(why) => write!(f, "no bound: {why:?}"),
            Self::Refused(why) => write!(f, "{why}"),
        }
    }
}

impl From<NotBounded> for NotCertified {
    fn from(why: NotBounded) -> Self {
        Self::NotBounded(why)
    }
}

impl From<Refusal> for NotCertified {
    fn from(why: Refusal) -> Self {
        Self::Refused(why)
    }
}

/// The certificate of an image, whose ELF file is given, with the text of its Kernels and the
/// cycles that a frame may take.
///
/// # Errors
/// It has none.
pub fn certificate(
    image: &FirmwareImage,
    program: &Program,
    board: &Board,
    deadline: u64,
    kernels: &str,
    file: &[u8],
) -> Result<Certificate, NotCertified> {
    let mut elf = Elf::read(file).map_err(Refusal::new)?;
    elf.kernels = Some(kernels.to_string());
    let cores = match helps(image) {
        Some(_) => 2,
        None => image.keys_of_cores.len() as u32,
    };
    let mut certificate = of_board(board, deadline, cores);
    certificate.sections = elf.constants();
    certificate.kernels = audit::number_of(kernels);
    certificate.dma = dma(image, board).and_then(|dma| {
        let bus = board.buses.iter().find(|bus| bus.contains(dma.device))?;
        Some(audit::Dma {
            bus: bus.base,
            wait: dma.wait_cycles,
            accesses: dma.in_memory,
        })
    });
    certificate.neighbour = of_neighbours(image, board);
    certificate.dead = find(program, DEAD)?;
    certificate.targets = program.annotations.targets.clone().into_iter().collect();
    certificate.frames = empty_frames(image, program)?;
    let framed = Framed {
        image,
        program,
        board,
        elf: &elf,
        certificate: &certificate,
    };
    let numbers = (0..certificate.frames.len()).collect();
    let frames = parallel::map(numbers, |number| framed.frame(number));
    for (number, frame) in frames.into_iter().enumerate() {
        certificate.frames[number] = frame?;
        let around = Around::new(&certificate, &elf, certificate.frames[number].core)?;
        let core = board.timing().at_worst();
        let (parts, stack) = audit::sums(&around, &core, &certificate.frames[number])?;
        let frame = &mut certificate.frames[number];
        frame.cycles = parts.iter().map(|(_, cycles)| cycles).sum();
        frame.stack = stack;
    }
    // What its own checker does not follow is no certificate.
    let core = audit::check_image(&elf, &certificate)?;
    let frames = certificate.frames.iter().collect();
    let checked = parallel::map(frames, |frame| {
        audit::check_frame(&elf, &certificate, &core, frame).map(|_| ())
    });
    checked.into_iter().collect::<Result<(), _>>()?;
    audit::check_ranges(kernels)?;
    Ok(certificate)
}

/// What core 1 runs parts of, if it does.
fn helps(image: &FirmwareImage) -> Option<&Cut> {
    image.cut().filter(|cut| cut.has_helper())
}

/// The frames of all cores while each program plays, without what they run.
fn empty_frames(image: &FirmwareImage, program: &Program) -> Result<Vec<Frame>, NotCertified> {
    let mut frames = Vec::new();
    let helper = |cut| {
        Ok::<_, NotBounded>(Helper {
            vectors: find(program, RUNNING[1].vectors)?,
            visits: visits_of_legs(cut),
            functions: Vec::new(),
        })
    };
    for id in image.cores() {
        for number in 0..image.programs.len() as u32 {
            frames.push(Frame {
                core: id.index() as u32,
                program: number,
                vectors: find(program, RUNNING[id.index()].vectors)?,
                visits: match (helps(image), image.keys_of_cores.len()) {
                    (Some(cut), _) => cut.crossing_back(image.channels()),
                    (None, 1) => 0,
                    (None, _) => image.visits(id),
                },
                helper: helps(image).map(helper).transpose()?,
                ..Frame::default()
            });
        }
    }
    Ok(frames)
}

/// What the cores wait for each other at a bridge.
fn of_neighbours(image: &FirmwareImage, board: &Board) -> Option<audit::Neighbour> {
    let all = [0, 1].map(|core| neighbour(image, board, core));
    let all: Vec<Neighbour> = all.into_iter().collect::<Option<_>>()?;
    let device = all.first()?.device;
    let bus = board.buses.iter().find(|bus| bus.contains(device))?;
    Some(audit::Neighbour {
        bus: bus.base,
        waits: all.iter().map(|own| own.wait_cycles).collect(),
    })
}

/// What is claimed of a board.
fn of_board(board: &Board, deadline: u64, cores: u32) -> Certificate {
    let core = board.timing().at_worst();
    let cycles = |time: whippen_board::AccessTime| time.extra_cycles().map_or(0, |more| more + 1);
    let memories = board.memory.iter().map(|own| audit::Memory {
        base: own.base,
        size: own.size,
        access: cycles(own.access),
        fetch: cycles(own.fetch),
        striped: own.striped,
        banks: own.banks.clone(),
    });
    let buses = board.buses.iter().map(|own| audit::Bus {
        base: own.base,
        size: own.size,
        read: own.read_cycles,
        write: own.write_cycles,
    });
    Certificate {
        core: core.name.to_string(),
        table: audit::table_of(&core),
        deadline,
        fetches: board.fetches_apart,
        cores,
        memories: memories.collect(),
        buses: buses.collect(),
        ..Certificate::default()
    }
}

/// A frame whose functions are looked for.
struct Framed<'a> {
    image: &'a FirmwareImage,
    program: &'a Program,
    board: &'a Board,
    elf: &'a Elf,
    certificate: &'a Certificate,
}

impl Framed<'_> {
    /// What a core runs while a program plays, and what the other one runs for it.
    fn frame(&self, number: usize) -> Result<Frame, NotCertified> {
        let claimed = &self.certificate.frames[number];
        let mut frame = claimed.clone();
        if frame.helper.is_some() {
            self.add_functions(&mut frame, audit::HELPER)?;
        }
        self.add_functions(&mut frame, claimed.core)?;
        Ok(frame)
    }

    /// The functions of a core in a frame.
    fn add_functions(&self, frame: &mut Frame, core: u32) -> Result<(), NotCertified> {
        let timing = self.board.timing().at_worst();
        let interference = Interference::new(
            self.board,
            &self.program.sections,
            Lies::default(),
            Others::default(),
        );
        // Of a core that helps, the code is with that of the core that it helps.
        let id = CoreId(frame.core);
        let programs: Vec<&CoreCode> = self
            .image
            .programs
            .iter()
            .map(|program| program.core(id))
            .collect();
        let of = OnCore {
            program: self.program,
            core: &timing,
            running: &RUNNING[core as usize],
            number: core as usize,
            playing: programs[ProgramId(frame.program).index()],
            programs: &programs,
            interference: &interference,
            helper: None,
        };
        let wanted = match &of.playing.cut {
            Some(cut) if core != frame.core => self.helping(&of, cut)?,
            _ => self.wanted(&of, &Calls::find(&of)?)?,
        };
        for wanted in wanted {
            self.add_function(&of, frame, wanted)?;
        }
        Ok(())
    }

    fn add_function(
        &self,
        of: &OnCore,
        frame: &mut Frame,
        wanted: Wanted,
    ) -> Result<(), NotCertified> {
        let Wanted {
            name,
            kind,
            until,
            entries,
            mut annotations,
            calls,
        } = wanted;
        annotations.inside = matches!(kind, Kind::Keys | Kind::Legs);
        annotations.ends_apart = matches!(kind, Kind::Legs | Kind::Until);
        let known = calls
            .iter()
            .map(|call| ((Some(call.site), call.callee), super::Known::default()));
        annotations.known = known.collect();
        let signed = |words: &[u32; 2]| words.map(|word| i64::from(word as i32));
        let entered = annotations.entered.iter();
        let mut function = Function {
            name: name.to_string(),
            kind,
            until: until.map(|at| (at, 0)),
            returns: annotations.return_to.map(|to| (to.address, to.wide)),
            entered: entered
                .map(|(register, words)| (*register, signed(words)))
                .collect(),
            bases: self.histories(kind, name),
            contexts: vec![[0, 0, entries[0]]],
            calls,
            ..Function::default()
        };
        if !matches!(kind, Kind::Keys | Kind::Plain) {
            function.entered.clear();
        }
        let mut flows = Vec::new();
        for entry in &entries {
            annotations.stops = audit::ends(&function, &entries, *entry);
            flows.push(self.flow(of, *entry, kind, &mut annotations)?);
        }
        let around = Around::new(self.certificate, self.elf, of.number as u32)?;
        let number = frame.functions_of(of.number as u32).len();
        let costs = audit::costs(&around, frame, number, &function.calls)?;
        let explorer = Explorer {
            core: of.core,
            around: &around,
            certificate: self.certificate,
            costs: &costs,
        };
        let explored = explorer.explore(function, &entries, &flows)?;
        frame.functions_on(of.number as u32).push(explored);
        Ok(())
    }

    /// The register that points into the rings of samples: its word is loaded from memory, so
    /// nothing but an assumption tells where.
    fn histories(&self, kind: Kind, name: &str) -> Vec<(u8, u32)> {
        let at = self.program.symbols.get(&format!("{name}_histories"));
        let section = at.and_then(|at| self.elf.section_at(*at));
        let section = section.filter(|_| kind == Kind::Keys);
        section
            .map(|own| (POINTS.histories, own.base))
            .into_iter()
            .collect()
    }

    /// The graph of a piece and its loops. A head without a bound runs once, where a key begins.
    fn flow(
        &self,
        of: &OnCore,
        entry: u32,
        kind: Kind,
        annotations: &mut Annotations,
    ) -> Result<super::Flow, NotCertified> {
        loop {
            let query = Query {
                core: of.core,
                code: &self.program.code,
                entry,
                annotations,
                interference: None,
            };
            let found = match kind {
                // It goes round for ever.
                Kind::Idle => super::Flow::without_order(&query),
                _ => super::Flow::with_tables(&query),
            };
            match found {
                Err(NotBounded::NoRounds { head })
                    if kind == Kind::Plain && !annotations.loops.contains_key(&head) =>
                {
                    annotations.loops.insert(head, 1);
                }
                found => return Ok(found?),
            }
        }
    }
}
