//! `whippen budget`: whether every key's tick is in time, proven on the bytes of the image that
//! `build` writes; and the other budgets (`beyond`).

mod beyond;
mod json;
mod motor;
mod numbers;
mod path;
mod stability;
mod table;

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::budget::{Bound, Bounded, Budget, ZoneBound};
use whippen_compiler::check::note_name;
use whippen_compiler::deadline_diagnostic::{WorstMode, deadline_diagnostic};
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::firmware::FirmwareImage;
use whippen_compiler::keyboard::{self, ZoneId};
use whippen_compiler::mode_names::mode_names;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::{self, Compiled, ProgramProof, unobserved};
use whippen_runtime::files::write_whole;
use whippen_runtime::image::ImageInstrument;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::file_plan::FilePlan;
use super::setup::{Setup, SetupArgs, not_bounded, symbol_prefix};
use super::{command, load};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen budget instruments/grand-piano.whip --board rp2350 --keys 88\n\
                  Example: whippen budget instruments/hammond.whip --most-keys"
)]
pub struct Args {
    #[command(flatten)]
    setup: SetupArgs,
    /// Find the largest number of keys that is proven to fit
    #[arg(long, conflicts_with = "keys")]
    most_keys: bool,
    /// Also write the worst-case path through a key as assembly, for other judges of its cycles
    #[arg(long, value_name = "FILE.s", value_hint = ValueHint::FilePath)]
    path: Option<PathBuf>,
    #[command(flatten)]
    beyond: BeyondArgs,
    /// Also write a page: cores and modes as bars, the map of stability, the current over time
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Print one JSON object a program instead
    #[arg(long)]
    json: bool,
}

/// Everything that is proven of an image.
struct ImageProof<'a> {
    setup: &'a Setup,
    image: FirmwareImage,
    bytes: whippen_compiler::budget::Program,
    keys: u32,
    /// While it plays each of its programs.
    programs: Vec<ProgramReport<'a>>,
}

/// What is proven while one program plays.
struct ProgramReport<'a> {
    program: &'a keyboard::Program,
    /// From the lowest keys up.
    zones: Vec<ZoneReport<'a>>,
    cores: Vec<Bounded>,
    budget: Budget,
}

/// What is shown of a zone besides its bounds.
struct ZoneReport<'a> {
    compiled: &'a Compiled,
    of: &'a keyboard::Zone,
    /// Its keys by their notes, where not all keys play it.
    notes: Option<String>,
    /// The modes of a key, in words.
    modes: Vec<String>,
}

pub fn run(args: &Args) -> Outcome {
    FilePlan::default()
        .reads(&args.setup.files()?)
        .reads(args.beyond.files())
        .writes("--path", &args.path, &["s"])
        .writes("--report", &args.report, &["html"])
        .check()?;
    let setup = args.setup.all_programs()?;
    setup.check_supported()?;
    if let Some(zones) = setup.layout.split_program().filter(|_| args.most_keys) {
        let why = "zones are for the keys of their keyboard: --most-keys counts keys that all play one instrument, so name one";
        return Err(Failure::Usage(format!("`{}`: {why}", zones.name)));
    }
    let beyond = |compiled: &Compiled| {
        Beyond::find(&setup.map, &compiled.model, &setup.device, &args.beyond)
    };
    let (all_beyond, proven) = parallel::both(
        || {
            setup
                .instruments
                .iter()
                .map(beyond)
                .collect::<Result<Vec<_>, _>>()
        },
        || ImageProof::wanted(&setup, args.most_keys),
    );
    let (proof, keys_fitting) = proven?;
    if let Some(path) = &args.path {
        let text = proof.path_as_assembly();
        write_whole(path, |w| w.write_all(text.as_bytes()))
            .map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let (mut shown, all_beyond) = (Vec::new(), all_beyond?);
    for played in &proof.programs {
        // The field `key` is about the slowest zone, and so is what is said beyond time; zones have
        // their own.
        let slowest = played.zone(played.slowest_zone());
        let beyond = &all_beyond[slowest.of.instrument.index()];
        let json = || {
            let mut budget = proof.json(played);
            beyond.add_to(&setup.map, &mut budget);
            played.add_zones(&mut budget, |json, zone| {
                all_beyond[zone.of.instrument.index()].add_to(&setup.map, json)
            });
            budget
        };
        if args.json {
            say!("{}", json());
        } else {
            let mut text = proof.table(played);
            for instrument in played.program.instruments() {
                let instrument = instrument.index();
                all_beyond[instrument].warn(&setup.map);
                if played.program.is_split() {
                    let name = symbol_prefix(&setup.instruments[instrument]);
                    let _ = writeln!(text, "\n{name}");
                }
                text += &all_beyond[instrument].text(&setup.device);
            }
            say::whole(&text);
        }
        if args.report.is_some() {
            let mut budget = json();
            beyond.add_map_to(&slowest.compiled.model, &mut budget);
            shown.push(budget);
        }
    }
    if let Some(path) = &args.report {
        let page = budget_page(&shown, &command::typed());
        write_whole(path, |w| w.write_all(page.as_bytes()))
            .map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let missed: Vec<Diagnostic> = proof
        .programs
        .iter()
        .filter_map(|played| proof.missed(played, keys_fitting))
        .collect();
    load::print(&setup.map, &missed, Severity::Error);
    if missed.is_empty() {
        Ok(())
    } else {
        Err(Failure::Program)
    }
}

impl<'a> ImageProof<'a> {
    /// Of the keys that are wanted, or of as many as fit. How many that are is also found out where
    /// those that are wanted do not, but for zones, whose keys are their keyboard's.
    fn wanted(setup: &'a Setup, most: bool) -> Result<(Self, Option<u32>), Failure> {
        let instruments = setup.image_instruments()?;
        let fitting = |most: &Self| if most.fits() { most.keys } else { 0 };
        if most {
            let found = Self::most_keys(setup, &instruments)?;
            let keys = fitting(&found);
            return Ok((found, Some(keys)));
        }
        let found = Self::find(setup, &instruments, setup.keys)?;
        if found.fits() || setup.layout.split_program().is_some() {
            return Ok((found, None));
        }
        let most = Self::most_keys(setup, &instruments)?;
        Ok((found, Some(fitting(&most))))
    }

    /// Bounds the image of so many keys, while it plays each of its programs.
    fn find(setup: &'a Setup, instruments: &[ImageInstrument], keys: u32) -> Result<Self, Failure> {
        let image = setup.build_to_bound(instruments, keys)?;
        let rate_hz = setup.first().model.rate_hz;
        let proof = pipeline::prove(&image, &setup.board, rate_hz, &mut unobserved)
            .map_err(|error| not_bounded(&error))?;
        let all = setup.layout.programs.iter().zip(proof.programs);
        let programs =
            all.map(|(program, proof)| ProgramReport::new(setup, instruments, program, proof));
        Ok(Self {
            setup,
            programs: programs.collect(),
            bytes: proof.bytes,
            image,
            keys,
        })
    }

    /// The image of as many keys as fit; of the fewest where none fit.
    fn most_keys(setup: &'a Setup, instruments: &[ImageInstrument]) -> Result<Self, Failure> {
        let [least, most] = setup.keys_possible();
        let (mut fits, mut exceeds) = (Self::find(setup, instruments, least)?, most + 1);
        if !fits.fits() {
            return Ok(fits);
        }
        while fits.keys + 1 < exceeds {
            // What is left, in keys: right but for what grows around them.
            let left = |played: &ProgramReport| {
                let cores = played.budget.cores.iter();
                cores.map(|core| core.more_keys).sum::<u32>()
            };
            let more = fits.programs.iter().map(left).min().unwrap_or(0).max(1);
            let next = fits.keys.saturating_add(more).min(exceeds - 1);
            match Self::find(setup, instruments, next) {
                Ok(tried) if tried.fits() => fits = tried,
                Ok(_) | Err(Failure::Usage(_) | Failure::Program) => exceeds = next,
                Err(other) => return Err(other),
            }
        }
        Ok(fits)
    }

    /// Whether every program is in time.
    fn fits(&self) -> bool {
        self.programs.iter().all(|played| played.budget.fits())
    }

    /// A deadline that is missed, with the lines that cost most and what would be enough.
    fn missed(&self, played: &ProgramReport, keys_fitting: Option<u32>) -> Option<Diagnostic> {
        let zone = played.zone(played.slowest_zone());
        let place = (played.program.name.as_str(), zone.compiled.model.span);
        deadline_diagnostic(
            &self.setup.map,
            place,
            &played.budget,
            &self.bytes,
            played.worst_case(),
            keys_fitting,
        )
    }
}

impl<'a> ProgramReport<'a> {
    fn new(
        setup: &'a Setup,
        instruments: &[ImageInstrument],
        program: &'a keyboard::Program,
        proof: ProgramProof,
    ) -> Self {
        let zone = |of: &'a keyboard::Zone| {
            let compiled = &setup.instruments[of.instrument.index()];
            let note = |key: u32| note_name(setup.layout.note_of(key));
            let notes = || format!("{} .. {}", note(of.keys.first), note(of.keys.end - 1));
            let modes = &instruments[of.instrument.index()].modes;
            ZoneReport {
                compiled,
                of,
                notes: program.is_split().then(notes),
                modes: mode_names(&compiled.model, modes),
            }
        };
        ProgramReport {
            program,
            zones: program.zones.iter().map(zone).collect(),
            cores: proof.cores,
            budget: proof.budget,
        }
    }

    /// The mode that costs most, and its bound with nobody else at the bus.
    fn worst_case(&self) -> WorstMode<'_> {
        let id = self.slowest_zone();
        let modes = &self.zone(id).modes;
        let bounds = self
            .bounds(id)
            .flat_map(|(alone, _)| modes.iter().zip(&alone.tick.modes));
        let slowest = bounds.max_by_key(|(_, (_, bound))| bound.cycles_max);
        let (mode, bound) = slowest.map_or(
            ("any state", &self.cores[0].alone.handler),
            |(name, (_, bound))| (name.as_str(), bound),
        );
        WorstMode { mode, bound }
    }

    /// The zone of that number.
    fn zone(&self, id: ZoneId) -> &ZoneReport<'a> {
        &self.zones[id.index()]
    }

    /// All zones with their numbers.
    fn numbered_zones(&self) -> impl DoubleEndedIterator<Item = (ZoneId, &ZoneReport<'a>)> {
        let numbered = self.zones.iter().enumerate();
        numbered.map(|(number, zone)| (ZoneId(number as u32), zone))
    }

    /// The zone whose keys take the most cycles; of equal ones the first.
    fn slowest_zone(&self) -> ZoneId {
        let cycles = |id: ZoneId| {
            let bounds = self.bounds(id);
            bounds.map(|(alone, _)| alone.tick.key_cycles_max()).max()
        };
        let zones = self.numbered_zones().rev().map(|(id, _)| id);
        zones.max_by_key(|id| cycles(*id)).unwrap_or(ZoneId(0))
    }

    /// The bounds of a zone's keys on each core, alone and contended.
    fn bounds(&self, zone: ZoneId) -> impl Iterator<Item = (&ZoneBound, &ZoneBound)> {
        let all = self
            .cores
            .iter()
            .flat_map(|core| core.alone.zones.iter().zip(&core.contended.zones));
        all.filter(move |(alone, _)| alone.of.zone == zone)
    }

    /// The bounds of one mode of a zone on each core, alone and contended.
    fn mode(&self, zone: ZoneId, index: usize) -> impl Iterator<Item = (&Bound, &Bound)> {
        self.bounds(zone).filter_map(move |(alone, contended)| {
            Some((
                &alone.tick.modes.get(index)?.1,
                &contended.tick.modes.get(index)?.1,
            ))
        })
    }
}
