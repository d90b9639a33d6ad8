//! `whippen budget`: whether every key's tick is in time, proven on the bytes of the image that `build` writes; and the other
//! budgets (`beyond`).

mod beyond;
mod json;
mod motor;
mod numbers;
mod path;
mod stability;
mod table;

use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::budget::{Bound, Bounded, Budget, Dearest, NotBounded, Program, cores, missed, mode_names};
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::firmware::Whole;
use whippen_compiler::modes::Modes;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::setup::{Setup, SetupArgs};
use super::{command, load};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen budget instruments/grand-piano.whip --board rp2350 --keys 88\n\
                  Example: whippen budget instruments/hammond.whip --most-keys")]
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
    compiled: &'a Compiled,
    /// The modes of a key, in words.
    modes: Vec<String>,
    cores: Vec<Bounded>,
    budget: Budget,
}

pub fn run(args: &Args) -> Outcome {
    let setup = args.setup.all()?;
    setup.supported()?;
    let beyond = |compiled: &Compiled| Beyond::find(&setup.map, &compiled.model, &setup.device, &args.beyond);
    let (all_beyond, proof) = parallel::both(
        || setup.programs.iter().map(beyond).collect::<Vec<_>>(),
        || {
            let modes = setup.modes();
            if args.most_keys { Proof::most(&setup, &modes) } else { Proof::find(&setup, &modes, setup.keys) }
        },
    );
    let proof = proof?;
    if let Some(path) = &args.path {
        let text = proof.path_as_assembly();
        write_whole(path, |w| w.write_all(text.as_bytes())).map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let mut shown = Vec::new();
    for (played, beyond) in proof.played.iter().zip(all_beyond) {
        let beyond = beyond?;
        let json = || {
            let mut budget = proof.json(played);
            beyond.add_to(&setup.map, &mut budget);
            budget
        };
        if args.json {
            say!("{}", json());
        } else {
            beyond.warn(&setup.map);
            say::whole(&(proof.table(played) + &beyond.text(&setup.device)));
        }
        if args.report.is_some() {
            let mut budget = json();
            beyond.add_map_to(&played.compiled.model, &mut budget);
            shown.push(budget);
        }
    }
    if let Some(path) = &args.report {
        let page = budget_page(&shown, &command::typed());
        write_whole(path, |w| w.write_all(page.as_bytes())).map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let missed: Vec<Diagnostic> = proof.played.iter().filter_map(|played| proof.missed(played)).collect();
    load::print(&setup.map, &missed, Severity::Error);
    if missed.is_empty() { Ok(()) } else { Err(Failure::Program) }
}

impl<'a> Proof<'a> {
    /// Bounds the image of so many keys, while it plays each of its programs.
    fn find(setup: &'a Setup, modes: &[Modes], keys: u32) -> Result<Self, Failure> {
        let (whole, of_core) = setup.whole_to_judge(modes, keys)?;
        let program = Program::of(&whole.image);
        let timing = setup.board.timing();
        let played = setup.programs.iter().zip(modes).enumerate().map(|(number, (compiled, modes))| {
            let cores = cores(&whole.image, &program, &timing, &of_core, number)
                .map_err(|error: NotBounded| Failure::Defect(format!("no bound: {error}")))?;
            let budget = Budget::of(&cores, setup.board.clock_hz, compiled.model.rate_hz);
            Ok(Played { compiled, modes: mode_names(&compiled.model, modes), cores, budget })
        });
        let played = played.collect::<Result<_, Failure>>()?;
        Ok(Self { setup, whole, program, keys, played })
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
            let left = |played: &Played| played.budget.cores.iter().map(|core| core.more_keys).sum::<u32>();
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
    fn missed(&self, played: &Played) -> Option<Diagnostic> {
        let model = &played.compiled.model;
        missed(&self.setup.map, (&model.name, model.span), &played.budget, &self.program, played.dearest())
    }
}

impl Played<'_> {
    /// The mode that costs most, and its bound with nobody else at the bus.
    fn dearest(&self) -> Dearest<'_> {
        let bounds = self.cores.iter().flat_map(|core| self.modes.iter().zip(&core.alone.tick.modes));
        let dearest = bounds.max_by_key(|(_, (_, bound))| bound.cycles_max);
        let (mode, bound) =
            dearest.map_or(("any state", &self.cores[0].alone.handler), |(name, (_, bound))| (name.as_str(), bound));
        Dearest { mode, bound }
    }

    /// The bounds of one mode on each core, alone and crowded.
    fn mode(&self, index: usize) -> impl Iterator<Item = (&Bound, &Bound)> {
        self.cores.iter().filter_map(move |core| {
            Some((&core.alone.tick.modes.get(index)?.1, &core.crowded.tick.modes.get(index)?.1))
        })
    }
}
