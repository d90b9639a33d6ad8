//! Translation validation of an image: the question for each piece of code of keys, from what the
//! build says of it.
//!
//! What is taken from the compiler is where things are (symbols, the layout of the state) and what
//! is computed at a tick's entry; whether the bytes do it is the question.

use whippen_arm::image::SectionKind;
use whippen_arm::thumb::{SharedValues, StateLayout, shared_values};
use whippen_firmware::{FirmwareImage, Instrument};
use whippen_modes::{ModeId, Modes};
use whippen_validate::{Code, LinePlace, Places, Question, Report, Shared, Symbols, validate};

/// What is known of the code of keys of one zone on one core.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZoneReport {
    /// The prefix of its symbols.
    pub name: String,
    /// Each piece.
    pub report: Report,
}

/// Everything that a question is made of.
pub struct Asked<'a> {
    /// The prefix of its symbols.
    pub name: String,
    modes: &'a Modes,
    shared: Shared,
    symbols: Symbols,
    places: Places,
}

impl<'a> Asked<'a> {
    /// About the keys whose symbols begin with a name; none where the image lacks one of them.
    fn new(
        image: &FirmwareImage,
        name: &str,
        layout: &StateLayout,
        modes: &'a Modes,
    ) -> Option<Self> {
        let shares = layout.live_param(modes.kernel.lives.len()).is_some();
        let shared = if shares {
            shared_values(modes)
        } else {
            SharedValues::default()
        };
        Some(Asked {
            name: name.to_string(),
            symbols: symbols(image, name, modes)?,
            places: places(layout, modes),
            shared: Shared {
                values: shared.values,
                insts: shared.insts,
                results: shared.results,
            },
            modes,
        })
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

/// What can be asked of an image: each zone of each core in each program. Equal code of several
/// keyboards is asked of once for each.
pub fn questions<'a>(image: &FirmwareImage, instruments: &'a [Instrument<'a>]) -> Vec<Asked<'a>> {
    let mut all = Vec::new();
    for program in &image.programs {
        for core in program.cores.iter().filter(|core| core.cut.is_none()) {
            for zone in &core.zones {
                let modes = instruments[program.instrument_of(zone).index()].modes;
                all.extend(Asked::new(image, &zone.name, zone.layout(), modes));
            }
        }
    }
    all
}

/// Validates everything in an image that can be asked of.
pub fn validate_image(image: &FirmwareImage, instruments: &[Instrument]) -> Vec<ZoneReport> {
    let code = code_of(image);
    let questions = questions(image, instruments);
    let report = |asked: &Asked| ZoneReport {
        name: asked.name.clone(),
        report: validate(&asked.question(image, &code)),
    };
    questions.iter().map(report).collect()
}

fn symbols(image: &FirmwareImage, name: &str, modes: &Modes) -> Option<Symbols> {
    let address = |of: String| {
        let symbols = image.image.symbols.iter();
        symbols
            .clone()
            .find(|symbol| symbol.name == of)
            .map(|symbol| symbol.address)
    };
    let numbered = |what: &str, count: usize| {
        let all = (0..count).map(|number| address(format!("{name}.{what}.{number}")));
        all.collect::<Option<Vec<u32>>>()
    };
    Some(Symbols {
        tick: address(format!("{name}_tick"))?,
        modes: numbered("mode", modes.modes.len())?,
        end: address(format!("{name}.end"))?,
        tables: numbered("table", modes.kernel.tables.len())?,
        state: address(format!("{name}_state"))?,
    })
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
    });
    let cells = (0..kernel.cells.len()).filter_map(|cell| in_record(layout.cell(0, cell)));
    let keyed = (0..kernel.keyed.len()).filter_map(|keyed| in_record(layout.keyed(0, keyed)));
    Places {
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
        stride: layout.stride(),
        drive: layout.output(0, 0) - layout.input(0, 0),
        history_bytes: layout.history_bytes(),
        lines: lines.collect(),
    }
}
