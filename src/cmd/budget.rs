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
use whippen_compiler::pipeline::Compiled;
use whippen_isa::Arch;
use whippen_runtime::files::write_whole;

use self::beyond::{Beyond, BeyondArgs};
use super::load;
use super::setup::{Setup, SetupArgs};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

/// Keys that an image can have, at least and at most.
const KEYS: (u32, u32) = (2, 510);

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
    /// Print one JSON object a program instead
    #[arg(long)]
    json: bool,
}

/// Everything that is proven of one program's image.
struct Proof<'a> {
    setup: &'a Setup,
    /// Which of the image's programs it is about.
    compiled: &'a Compiled,
    name: String,
    /// The modes of a key, in words.
    modes: Vec<String>,
    whole: Whole,
    program: Program,
    cores: [Bounded; 2],
    budget: Budget,
}

pub fn run(args: &Args) -> Outcome {
    let mut fits = true;
    let setup = args.setup.all()?;
    let modes = possible(&setup)?.modes();
    for number in 0..setup.programs.len() {
        let proof = match args.most_keys {
            true => Proof::most(&setup, &modes, number)?,
            false => Proof::find(&setup, &modes, number, setup.keys)?,
        };
        let beyond = Beyond::find(&setup.map, &proof.compiled.model, &setup.device, &args.beyond)?;
        if args.json {
            let mut budget = proof.json();
            beyond.add_to(&setup.map, &mut budget);
            say!("{budget}");
        } else {
            beyond.warn(&setup.map);
            say::whole(&(proof.table() + &beyond.text(&setup.device)));
        }
        if let Some(path) = &args.path {
            let text = proof.path_as_assembly();
            write_whole(path, |w| w.write_all(text.as_bytes())).map_err(|error| Failure::Usage(error.to_string()))?;
        }
        if let Some(diagnostic) = proof.missed() {
            load::print(&setup.map, &[diagnostic], Severity::Error);
            fits = false;
        }
    }
    if fits { Ok(()) } else { Err(Failure::Program) }
}

/// Code is made for one kind of core so far.
fn possible(setup: &Setup) -> Result<&Setup, Failure> {
    let core = match setup.board.arch {
        Arch::V8M => return Ok(setup),
        Arch::V6M => "Cortex-M0+",
        Arch::V7EM => "Cortex-M4",
    };
    Err(Failure::Usage(format!(
        "`{}` has a {core}, and code is made for the Cortex-M33 only, so there is nothing to prove yet; boards with one: rp2350",
        setup.board.name
    )))
}

impl<'a> Proof<'a> {
    /// Bounds the image of so many keys while it plays one of its programs.
    fn find(setup: &'a Setup, modes: &[Modes], number: usize, keys: u32) -> Result<Self, Failure> {
        let (whole, keys) = setup.whole(modes, keys)?;
        let program = Program::of(&whole.image);
        let defect = |error: NotBounded| Failure::Defect(format!("no bound: {error}"));
        let cores = cores(&whole.image, &program, &setup.board.timing(), keys, number).map_err(defect)?;
        let compiled = &setup.programs[number];
        let budget = Budget::of(&cores, setup.board.clock_hz, compiled.model.rate_hz);
        let (name, modes) = (setup.names().swap_remove(number), mode_names(&compiled.model, &modes[number]));
        Ok(Self { setup, compiled, name, modes, whole, program, cores, budget })
    }

    /// The image of as many keys as fit; of the fewest where none fit.
    fn most(setup: &'a Setup, modes: &[Modes], number: usize) -> Result<Self, Failure> {
        let (mut fits, mut exceeds) = (Self::find(setup, modes, number, KEYS.0)?, KEYS.1 + 1);
        if !fits.budget.fits() {
            return Ok(fits);
        }
        while fits.keys() + 1 < exceeds {
            // What is left, in keys: right but for what grows around them.
            let more: u32 = fits.budget.cores.iter().map(|core| core.more_keys).sum();
            let next = fits.keys().saturating_add(more.max(1)).clamp(fits.keys() + 1, exceeds - 1);
            match Self::find(setup, modes, number, next) {
                Ok(tried) if tried.budget.fits() => fits = tried,
                Ok(_) => exceeds = next,
                Err(Failure::Usage(_) | Failure::Program) => exceeds = next,
                Err(other) => return Err(other),
            }
        }
        Ok(fits)
    }

    /// Keys of all cores.
    fn keys(&self) -> u32 {
        self.budget.cores.iter().map(|core| core.keys).sum()
    }

    /// The mode that costs most, its number in the modes, and its bound with nobody else at the bus.
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

    /// A deadline that is missed, with the lines that cost most and what would be enough.
    fn missed(&self) -> Option<Diagnostic> {
        let model = &self.compiled.model;
        missed(&self.setup.map, (&model.name, model.span), &self.budget, &self.program, self.dearest())
    }
}
