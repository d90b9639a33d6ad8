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
use whippen_compiler::budget::{
    Bound, Bounded, Budget, Dearest, NotBounded, Program, Zone, cores, missed, mode_names,
};
use whippen_compiler::check::note_name;
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::firmware::{Segment, Whole};
use whippen_compiler::modes::Modes;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::setup::{PlayingPart, Setup, SetupArgs, name, not_bounded};
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
    /// Also write the dearest way through a key as assembly, for other judges of its cycles
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
struct Proof<'a> {
    setup: &'a Setup,
    whole: Whole,
    program: Program,
    keys: u32,
    /// While it plays each of its programs.
    played: Vec<Played<'a>>,
}

/// What is proven while one program plays.
struct Played<'a> {
    /// Its name.
    name: String,
    /// What its keys play, from the lowest up.
    parts: Vec<Part<'a>>,
    cores: Vec<Bounded>,
    /// By core and zone: which part it is of.
    part_of: Vec<Vec<usize>>,
    budget: Budget,
}

/// Neighbouring keys that play one instrument.
struct Part<'a> {
    compiled: &'a Compiled,
    /// Which of the setup's instruments it is.
    instrument: usize,
    /// Its keys by their notes, where not all keys play it.
    keys: Option<String>,
    /// The modes of a key, in words.
    modes: Vec<String>,
}

pub fn run(args: &Args) -> Outcome {
    let setup = args.setup.all()?;
    setup.supported()?;
    if let Some(zones) = setup.zones().filter(|_| args.most_keys) {
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
        || Proof::wanted(&setup, args.most_keys),
    );
    let (proof, keys_fitting) = proven?;
    if let Some(path) = &args.path {
        let text = proof.path_as_assembly();
        write_whole(path, |w| w.write_all(text.as_bytes()))
            .map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let (mut shown, all_beyond) = (Vec::new(), all_beyond?);
    for (played, playing) in proof.played.iter().zip(&setup.programs) {
        // The field `key` is about the dearest part, and so is what is said beyond time; zones have
        // their own.
        let (_, dearest) = played.dearest_part();
        let beyond = &all_beyond[dearest.instrument];
        let json = || {
            let mut budget = proof.json(played);
            beyond.add_to(&setup.map, &mut budget);
            played.add_zones(&mut budget, |zone, part| {
                all_beyond[part.instrument].add_to(&setup.map, zone)
            });
            budget
        };
        if args.json {
            say!("{}", json());
        } else {
            let mut text = proof.table(played);
            for instrument in playing.instruments() {
                all_beyond[instrument].warn(&setup.map);
                if playing.parts.len() > 1 {
                    let _ = writeln!(text, "\n{}", name(&setup.instruments[instrument]));
                }
                text += &all_beyond[instrument].text(&setup.device);
            }
            say::whole(&text);
        }
        if args.report.is_some() {
            let mut budget = json();
            beyond.add_map_to(&dearest.compiled.model, &mut budget);
            shown.push(budget);
        }
    }
    if let Some(path) = &args.report {
        let page = budget_page(&shown, &command::typed());
        write_whole(path, |w| w.write_all(page.as_bytes()))
            .map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let missed: Vec<Diagnostic> = proof
        .played
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

impl<'a> Proof<'a> {
    /// Of the keys that are wanted, or of as many as fit. How many that are is also found out where
    /// those that are wanted do not, but for zones, whose keys are their keyboard's.
    fn wanted(setup: &'a Setup, most: bool) -> Result<(Self, Option<u32>), Failure> {
        let modes = setup.modes();
        let fitting = |most: &Self| if most.fits() { most.keys } else { 0 };
        if most {
            let found = Self::most(setup, &modes)?;
            let keys = fitting(&found);
            return Ok((found, Some(keys)));
        }
        let found = Self::find(setup, &modes, setup.keys)?;
        if found.fits() || setup.zones().is_some() {
            return Ok((found, None));
        }
        let most = Self::most(setup, &modes)?;
        Ok((found, Some(fitting(&most))))
    }

    /// Bounds the image of so many keys, while it plays each of its programs.
    fn find(setup: &'a Setup, modes: &[Modes], keys: u32) -> Result<Self, Failure> {
        let (whole, _) = setup.whole_to_judge(modes, keys)?;
        let program = Program::of(&whole.image);
        let played = setup.programs.iter().enumerate().map(|(number, playing)| {
            let cores = cores(
                &whole.image,
                &program,
                &setup.board,
                &whole.keys(number),
                number,
            )
            .map_err(|error: NotBounded| not_bounded(&error))?;
            let part = |part: &PlayingPart| {
                let compiled = &setup.instruments[part.instrument];
                let keys = part
                    .notes
                    .map(|(low, high)| format!("{} .. {}", note_name(low), note_name(high)));
                let modes = mode_names(&compiled.model, &modes[part.instrument]);
                Part {
                    compiled,
                    instrument: part.instrument,
                    keys,
                    modes,
                }
            };
            let parts: Vec<Part> = playing.parts.iter().map(part).collect();
            let budget = Budget::of(
                &cores,
                setup.board.clock_hz,
                parts[0].compiled.model.rate_hz,
            );
            let segments = |core: &Vec<Segment>| core.iter().map(|segment| segment.part).collect();
            let part_of = whole.programs[number].iter().map(segments).collect();
            Ok(Played {
                name: playing.name.clone(),
                parts,
                cores,
                part_of,
                budget,
            })
        });
        let played = played.collect::<Result<_, Failure>>()?;
        Ok(Self {
            setup,
            whole,
            program,
            keys,
            played,
        })
    }

    /// The image of as many keys as fit; of the fewest where none fit.
    fn most(setup: &'a Setup, modes: &[Modes]) -> Result<Self, Failure> {
        let [least, most] = setup.keys_possible();
        let (mut fits, mut exceeds) = (Self::find(setup, modes, least)?, most + 1);
        if !fits.fits() {
            return Ok(fits);
        }
        while fits.keys + 1 < exceeds {
            // What is left, in keys: right but for what grows around them.
            let left = |played: &Played| {
                played
                    .budget
                    .cores
                    .iter()
                    .map(|core| core.more_keys)
                    .sum::<u32>()
            };
            let more = fits.played.iter().map(left).min().unwrap_or(0).max(1);
            let next = fits.keys.saturating_add(more).min(exceeds - 1);
            match Self::find(setup, modes, next) {
                Ok(tried) if tried.fits() => fits = tried,
                Ok(_) | Err(Failure::Usage(_) | Failure::Program) => exceeds = next,
                Err(other) => return Err(other),
            }
        }
        Ok(fits)
    }

    /// Whether every program is in time.
    fn fits(&self) -> bool {
        self.played.iter().all(|played| played.budget.fits())
    }

    /// A deadline that is missed, with the lines that cost most and what would be enough.
    fn missed(&self, played: &Played, keys_fitting: Option<u32>) -> Option<Diagnostic> {
        let (_, part) = played.dearest_part();
        let place = (played.name.as_str(), part.compiled.model.span);
        missed(
            &self.setup.map,
            place,
            &played.budget,
            &self.program,
            played.dearest(),
            keys_fitting,
        )
    }
}

impl<'a> Played<'a> {
    /// The mode that costs most, and its bound with nobody else at the bus.
    fn dearest(&self) -> Dearest<'_> {
        let (number, part) = self.dearest_part();
        let bounds = self
            .zones(number)
            .flat_map(|(alone, _)| part.modes.iter().zip(&alone.tick.modes));
        let dearest = bounds.max_by_key(|(_, (_, bound))| bound.cycles_max);
        let (mode, bound) = dearest.map_or(
            ("any state", &self.cores[0].alone.handler),
            |(name, (_, bound))| (name.as_str(), bound),
        );
        Dearest { mode, bound }
    }

    /// The part that has it, by its number.
    fn dearest_part(&self) -> (usize, &Part<'a>) {
        let cycles = |number: usize| {
            self.zones(number)
                .map(|(alone, _)| alone.tick.key_cycles_max())
                .max()
        };
        let number = (0..self.parts.len())
            .rev()
            .max_by_key(|&number| cycles(number))
            .unwrap_or(0);
        (number, &self.parts[number])
    }

    /// The keys of a part on each core, alone and crowded.
    fn zones(&self, part: usize) -> impl Iterator<Item = (&Zone, &Zone)> {
        self.cores
            .iter()
            .zip(&self.part_of)
            .flat_map(move |(core, parts)| {
                let zones = core
                    .alone
                    .zones
                    .iter()
                    .zip(&core.contended.zones)
                    .zip(parts);
                zones
                    .filter(move |(_, of)| **of == part)
                    .map(|(zones, _)| zones)
            })
    }

    /// The bounds of one mode of a part on each core, alone and crowded.
    fn mode(&self, part: usize, index: usize) -> impl Iterator<Item = (&Bound, &Bound)> {
        self.zones(part).filter_map(move |(alone, crowded)| {
            Some((
                &alone.tick.modes.get(index)?.1,
                &crowded.tick.modes.get(index)?.1,
            ))
        })
    }
}
