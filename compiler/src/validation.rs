//! Translation validation of an image: the question for each piece of code of keys, from what the
//! build says of it.
//!
//! What is taken from the compiler is where things are (symbols, the layout of the state) and what
//! is computed at a tick's entry; whether the bytes do it is the question.

use std::collections::BTreeMap;
use std::fmt;

use whippen_arm::image::SectionKind;
use whippen_arm::thumb::{SharedValues, StateLayout, shared_values};
use whippen_firmware::{FirmwareImage, Instrument, Role};
use whippen_keyboard::{InstrumentId, ProgramId};
use whippen_modes::{ModeId, Modes};
use whippen_validate::{Called, Code, LinePlace, Places, Question, Reason, Report, RingPlace};
use whippen_validate::{Routine, Shared, Symbols, Verdict, validate};

/// An address at which there is nothing.
const NOWHERE: u32 = u32::MAX - 1;

/// What is known of the code of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Validation {
    /// Each zone of each core in each program; of an instrument in parts, each part.
    pub zones: Vec<ZoneReport>,
}

/// What is known of the code of keys of one zone on one core, or of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneReport {
    /// The prefix of its symbols.
    pub name: String,
    /// While which program it runs.
    pub program: ProgramId,
    /// What it is of.
    pub instrument: InstrumentId,
    /// What it is of an instrument in parts, but for the tail.
    pub part: Option<Role>,
    /// Each piece.
    pub report: Report,
}

/// What is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// A mode.
    Mode(ModeId),
    /// What prepares keys.
    Routine(Routine),
}

/// A piece of code that is not validated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotValidated<'a> {
    /// Whose it is.
    pub zone: &'a ZoneReport,
    /// Which.
    pub piece: Piece,
    /// The kind of reason.
    pub reason: Reason,
    /// Why.
    pub why: String,
}

impl Validation {
    /// While one program plays.
    pub fn of_program(&self, program: ProgramId) -> Validation {
        let zones = self.zones.iter().filter(|zone| zone.program == program);
        Validation {
            zones: zones.cloned().collect(),
        }
    }

    /// How many modes there are; equal ones of several cores count for each.
    pub fn modes(&self) -> usize {
        self.zones.iter().map(|zone| zone.report.modes.len()).sum()
    }

    /// How many routines there are that prepare keys, counted in the same way.
    pub fn routines(&self) -> usize {
        Routine::ALL.len() * self.zones.len()
    }

    /// How many modes and routines are validated.
    pub fn validated(&self) -> [usize; 2] {
        let not = self.not_validated();
        let modes = not.iter().filter(|one| matches!(one.piece, Piece::Mode(_)));
        let modes = modes.count();
        [self.modes() - modes, self.routines() - (not.len() - modes)]
    }

    /// Every mode and every routine that is not validated.
    pub fn not_validated(&self) -> Vec<NotValidated<'_>> {
        self.zones
            .iter()
            .flat_map(ZoneReport::not_validated)
            .collect()
    }

    /// The first piece of code that does something else than it should; there is none but for a
    /// defect.
    pub fn refuted(&self) -> Option<String> {
        self.zones.iter().find_map(ZoneReport::refuted)
    }
}

impl fmt::Display for Validation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let not = self.not_validated();
        let [modes, routines] = self.validated();
        write!(f, "validated: {modes} of {} modes, ", self.modes())?;
        write!(f, "{routines} of {} routines", self.routines())?;
        if not.is_empty() {
            return Ok(());
        }
        let mut counts: BTreeMap<Reason, usize> = BTreeMap::new();
        for one in &not {
            *counts.entry(one.reason).or_default() += 1;
        }
        let counts: Vec<String> = counts
            .iter()
            .map(|(reason, count)| format!("{reason} {count}"))
            .collect();
        write!(f, "; not validated: {} ({})", not.len(), counts.join(", "))
    }
}

impl ZoneReport {
    /// The symbol of a piece, as map and listing have it.
    pub fn symbol(&self, piece: Piece) -> String {
        match piece {
            Piece::Mode(mode) => format!("{}.mode.{}", self.name, mode.0),
            Piece::Routine(routine) => format!("{}_{routine}", self.name),
        }
    }

    /// A mode may read any table and any word that the entry computes, so it is not validated where
    /// one of these is not.
    fn not_validated(&self) -> Vec<NotValidated<'_>> {
        let shared = self.report.shared.iter().enumerate();
        let mut shared = shared.filter_map(|(word, verdict)| match verdict {
            Verdict::Unproven { reason, why } => {
                Some((*reason, format!("word {word} of the tick's entry: {why}")))
            }
            _ => None,
        });
        let tables = match &self.report.tables {
            Verdict::Unproven { reason, why } => Some((*reason, why.clone())),
            _ => None,
        };
        let of_entry = tables.or_else(|| shared.next());
        let of_piece = |(piece, verdict): (Piece, &Verdict)| {
            let (reason, why) = match (piece, verdict) {
                (_, Verdict::Unproven { reason, why }) => (*reason, why.clone()),
                (Piece::Mode(_), Verdict::Validated { .. }) => of_entry.clone()?,
                _ => return None,
            };
            Some(NotValidated {
                zone: self,
                piece,
                reason,
                why,
            })
        };
        self.pieces().filter_map(of_piece).collect()
    }

    /// Each mode, then each routine.
    fn pieces(&self) -> impl Iterator<Item = (Piece, &Verdict)> {
        let modes = (0..).map(|mode| Piece::Mode(ModeId(mode)));
        let routines = Routine::ALL.into_iter().map(Piece::Routine);
        let report = &self.report;
        modes
            .zip(&report.modes)
            .chain(routines.zip(&report.routines))
    }

    fn refuted(&self) -> Option<String> {
        let why = |what: String, verdict: &Verdict| match verdict {
            Verdict::Refuted { why } => Some(format!("{what} of {}: {why}", self.name)),
            _ => None,
        };
        let report = &self.report;
        let words = report.shared.iter().enumerate();
        let words = words.map(|(word, own)| why(format!("word {word} of the entry"), own));
        let pieces = self.pieces().map(|(piece, own)| match piece {
            Piece::Mode(mode) => why(format!("mode {mode}"), own),
            Piece::Routine(routine) => why(format!("`{routine}`"), own),
        });
        let before = [
            why("the tables".to_string(), &report.tables),
            why("the tick's entry or end".to_string(), &report.entry),
        ];
        let mut all = before.into_iter().chain(words).chain(pieces).flatten();
        all.next()
    }
}

/// What a piece of code belongs to.
#[derive(Clone, Copy)]
struct Of {
    program: ProgramId,
    instrument: InstrumentId,
    part: Option<Role>,
}

/// Everything that a question is made of.
pub struct Asked<'a> {
    /// The prefix of its symbols.
    pub name: String,
    program: ProgramId,
    instrument: InstrumentId,
    part: Option<Role>,
    modes: &'a Modes,
    shared: Shared,
    symbols: Symbols,
    places: Places,
}

impl<'a> Asked<'a> {
    /// About the keys, or the part, whose symbols begin with a name.
    fn new(
        image: &FirmwareImage,
        of: Of,
        name: &str,
        layout: &StateLayout,
        modes: &'a Modes,
    ) -> Self {
        let shares = layout.live_param(modes.kernel.lives.len()).is_some();
        let shared = if shares {
            shared_values(modes)
        } else {
            SharedValues::default()
        };
        Asked {
            name: name.to_string(),
            program: of.program,
            instrument: of.instrument,
            part: of.part,
            symbols: symbols(image, name, modes),
            places: places(layout, modes),
            shared: Shared {
                values: shared.values,
                insts: shared.insts,
                results: shared.results,
            },
            modes,
        }
    }

    /// The question to these bytes.
    pub fn question<'q>(&'q self, image: &FirmwareImage, code: &'q Code) -> Question<'q> {
        Question {
            modes: self.modes,
            shared: &self.shared,
            code,
            symbols: &self.symbols,
            places: &self.places,
            arch: image.image.arch,
        }
    }

    /// Its modes.
    pub fn modes(&self) -> &'a Modes {
        self.modes
    }

    /// Where the code of a mode begins.
    pub fn code_of_mode(&self, mode: ModeId) -> u32 {
        self.symbols.modes[mode.0 as usize]
    }
}

/// The bytes of an image where they run.
pub fn code_of(image: &FirmwareImage) -> Code {
    let of = |is_data: bool| {
        let sections = image.image.sections.iter();
        let own = sections.filter(|section| (section.kind == SectionKind::Data) == is_data);
        let filled = own.filter(|section| !section.bytes.is_empty());
        filled
            .map(|section| (section.run, section.bytes.clone()))
            .collect()
    };
    Code {
        pieces: of(false),
        data: of(true),
    }
}

/// What can be asked of an image: each zone of each core in each program, and each part. Equal code
/// of several keyboards is asked of once for each.
pub fn questions<'a>(
    image: &'a FirmwareImage,
    instruments: &'a [Instrument<'a>],
) -> Vec<Asked<'a>> {
    let mut all = Vec::new();
    for (number, program) in (0..).zip(&image.programs) {
        for core in &program.cores {
            let parts = core.cut.iter().flat_map(|cut| {
                let parts = cut.parts.iter().zip(&cut.modes);
                parts.map(|(part, modes)| (&part.name, &part.built.layout, modes, Some(part.role)))
            });
            let tail = core.cut.as_ref().and_then(|cut| cut.modes.last());
            let zones = core.zones.iter().map(|zone| {
                let whole = instruments[program.instrument_of(zone).index()].modes;
                (&zone.name, zone.layout(), tail.unwrap_or(whole), None)
            });
            let Some(first) = core.zones.first() else {
                continue;
            };
            for (at, (name, layout, modes, part)) in zones.chain(parts).enumerate() {
                let zone = core.zones.get(at).unwrap_or(first);
                let of = Of {
                    program: ProgramId(number),
                    instrument: program.instrument_of(zone),
                    part,
                };
                all.push(Asked::new(image, of, name, layout, modes));
            }
        }
    }
    all
}

/// Validates everything in an image.
pub fn validate_image(image: &FirmwareImage, instruments: &[Instrument]) -> Validation {
    let code = code_of(image);
    let questions = questions(image, instruments);
    let report = |asked: &Asked| ZoneReport {
        name: asked.name.clone(),
        program: asked.program,
        instrument: asked.instrument,
        part: asked.part,
        report: validate(&asked.question(image, &code)),
    };
    Validation {
        zones: questions.iter().map(report).collect(),
    }
}

/// Where what begins; what the image does not name begins where there is no code.
fn symbols(image: &FirmwareImage, name: &str, modes: &Modes) -> Symbols {
    let found = |of: String| {
        let mut symbols = image.image.symbols.iter();
        symbols
            .find(|symbol| symbol.name == of)
            .map(|own| own.address)
    };
    let address = |of: String| found(of).unwrap_or(NOWHERE);
    let numbered = |what: &str, count: usize| {
        let all = (0..count).map(|number| address(format!("{name}.{what}.{number}")));
        all.collect::<Vec<u32>>()
    };
    Symbols {
        tick: address(format!("{name}_tick")),
        modes: numbered("mode", modes.modes.len()),
        end: address(format!("{name}.end")),
        init: address(format!("{name}_init")),
        begin: address(format!("{name}_begin")),
        called: Called::ALL
            .into_iter()
            .filter_map(|called| Some((called, found(format!("{name}.{}", called.name()))?)))
            .collect(),
        tables: numbered("table", modes.kernel.tables.len()),
        state: address(format!("{name}_state")),
    }
}

fn places(layout: &StateLayout, modes: &Modes) -> Places {
    let kernel = &modes.kernel;
    let record = layout.record(0);
    let in_record = |at: Option<u32>| at.map(|at| at - record);
    let lives = (0..).map_while(|live| layout.live_param(live));
    let lines = layout.lines().into_iter().map(|line| LinePlace {
        narrow: line.narrow,
        scale: line.scale,
        pointers: line.pointers,
        len: line.len,
        row: line.row,
        ring: line.ring,
        at: line.at,
    });
    let cells = (0..kernel.cells.len()).filter_map(|cell| in_record(layout.cell(0, cell)));
    let keyed = (0..kernel.keyed.len()).filter_map(|keyed| in_record(layout.keyed(0, keyed)));
    Places {
        keys: layout.keys(),
        cells: cells.collect(),
        keyed: keyed.collect(),
        number: in_record(layout.number(0)),
        gain: in_record(layout.gain(0)),
        record_bytes: layout.record_bytes(),
        records: record,
        literals: layout.constants().start,
        lives: lives.collect(),
        tick: layout.tick(),
        row: layout.row(),
        next_event: layout.next_event(),
        event_bytes: layout.events().map_or(0, |ring| ring.event),
        events: layout.events().map(|ring| RingPlace {
            head: ring.head,
            tail: ring.tail,
            lost: ring.lost,
            start: ring.start,
            bytes: ring.bytes,
            spare: ring.spare,
            tick_bytes: ring.tick_bytes_max,
        }),
        apart: layout.apart(),
        words: layout.words(),
        first_line: layout.first_line(),
        stride: layout.stride(),
        drive: layout.output(0, 0) - layout.input(0, 0),
        history_bytes: layout.history_bytes(),
        lines: lines.collect(),
    }
}
