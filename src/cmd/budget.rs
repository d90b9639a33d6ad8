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
use std::path::{Path, PathBuf};

use clap::ValueHint;
use serde_json::Value;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::command;
use super::file_plan::FilePlan;
use super::progress;
use super::proof::{ImageProof, ProgramReport};
use super::setup::{ImageSetup, SetupArgs, symbol_prefix};
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
    /// Also say of which modes the bytes are shown to do what the modes say
    #[arg(long)]
    validate: bool,
    #[command(flatten)]
    beyond: BeyondArgs,
    /// Also write a page: cores and modes as bars, the map of stability, the current over time
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Print one JSON object a program instead
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Outcome {
    let opened = args.setup.open()?;
    FilePlan::default()
        .reads(opened.paths())
        .reads(&args.setup.files())
        .reads(args.beyond.files())
        .writes("--path", &args.path, &["s"])
        .writes("--report", &args.report, &["html"])
        .check()?;
    let setup = args.setup.all_programs(&opened)?;
    setup.check_supported()?;
    check_keys_can_change(&setup, args)?;
    let chips = setup.of_chips()?;
    let (all_beyond, proven) = progress::during("the budgets", || {
        parallel::both(|| find_beyond(&setup, args), || prove(&setup, &chips, args))
    });
    let (all_beyond, proven) = (all_beyond?, proven?);
    if let Some(path) = &args.path {
        write_text(path, &proven[0].0.path_as_assembly())?;
    }
    let mut budgets: Vec<Value> = Vec::new();
    for (proof, _) in &proven {
        let shown = ShownProof {
            proof,
            all_beyond: &all_beyond,
        };
        shown.print(args.json);
        if args.report.is_some() {
            let programs = proof.programs.iter();
            budgets.extend(programs.map(|played| shown.json_with_map(played)));
        }
    }
    if let Some(path) = &args.report {
        write_text(path, &budget_page(&budgets, &command::typed()))?;
    }
    let missed = proven
        .iter()
        .map(|(proof, most)| proof.report_missed(*most));
    // Each chip's is told before the first ends it.
    let missed: Vec<Outcome> = missed.collect();
    missed.into_iter().collect()
}

/// What is proven of each chip, and how many keys fit where that was found out.
fn prove<'a>(
    setup: &ImageSetup,
    chips: &'a [ImageSetup],
    args: &Args,
) -> Result<Vec<(ImageProof<'a>, Option<u32>)>, Failure> {
    let instruments = setup.image_instruments()?;
    let proofs = chips.iter().map(|chip| {
        let own = chip.with_own_keys(&instruments);
        let (mut proof, most) = ImageProof::wanted(chip, &own, args.most_keys)?;
        if args.validate {
            proof.validate(&own)?;
        }
        Ok((proof, most))
    });
    proofs.collect()
}

/// That the most keys are asked of one chip and of a keyboard without zones.
fn check_keys_can_change(setup: &ImageSetup, args: &Args) -> Outcome {
    let of_one = [
        ("--most-keys", args.most_keys),
        ("--path", args.path.is_some()),
    ];
    if let Some((option, _)) = of_one
        .into_iter()
        .find(|(_, asked)| *asked && setup.chips > 1)
    {
        let (board, chips) = (&setup.board.name, setup.chips);
        return Err(Failure::Usage(format!(
            "{option} is of one chip and not of {chips}: name one, `--board {board}`"
        )));
    }
    let Some(zones) = setup.layout.split_program().filter(|_| args.most_keys) else {
        return Ok(());
    };
    let why = "zones are for the keys of their keyboard: --most-keys counts keys that all play one instrument, so name one";
    Err(Failure::Usage(format!("`{}`: {why}", zones.name)))
}

/// What is known of each instrument besides its time.
fn find_beyond(setup: &ImageSetup, args: &Args) -> Result<Vec<Beyond>, Failure> {
    let beyond = |compiled: &Compiled| {
        Beyond::find(&setup.map, &compiled.model, &setup.device, &args.beyond)
    };
    setup.instruments.iter().map(beyond).collect()
}

pub fn write_text(path: &Path, text: &str) -> Outcome {
    write_whole(path, |w| w.write_all(text.as_bytes()))
        .map_err(|error| Failure::Usage(error.to_string()))
}

/// A proof with what is known besides time, by instrument.
struct ShownProof<'a> {
    proof: &'a ImageProof<'a>,
    all_beyond: &'a [Beyond],
}

impl ShownProof<'_> {
    fn print(&self, as_json: bool) {
        let setup = self.proof.setup;
        if let (Some(chip), false) = (&setup.chip, as_json) {
            say!("{}", chip.told());
        }
        for played in &self.proof.programs {
            match as_json {
                true => say!("{}", self.json(played)),
                false => say::whole(&self.text(played)),
            }
        }
    }

    /// The table of a program, then what is known of its instruments besides, which is the same on
    /// all chips; prints their warnings.
    fn text(&self, played: &ProgramReport) -> String {
        let setup = self.proof.setup;
        let mut text = self.proof.table(played);
        if setup.chip.is_some_and(|chip| !chip.is_last()) {
            return text + "\n";
        }
        for instrument in played.program.instruments() {
            let instrument = instrument.index();
            self.all_beyond[instrument].warn(&setup.map);
            if played.program.is_split() {
                let name = symbol_prefix(&setup.instruments[instrument]);
                let _ = writeln!(text, "\n{name}");
            }
            text += &self.all_beyond[instrument].text(&setup.device);
        }
        text
    }

    /// The field `key` is about the slowest zone, and so is what is said beyond time; zones have
    /// their own.
    fn json(&self, played: &ProgramReport) -> Value {
        let map = &self.proof.setup.map;
        let mut budget = self.proof.json(played);
        if let Some(chip) = &self.proof.setup.chip {
            budget["chip"] = chip.json();
        }
        self.beyond_slowest(played).add_to(map, &mut budget);
        played.add_zones(&mut budget, |json, zone| {
            self.all_beyond[zone.of.instrument.index()].add_to(map, json)
        });
        budget
    }

    fn json_with_map(&self, played: &ProgramReport) -> Value {
        let slowest = played.zone(played.slowest_zone());
        let mut budget = self.json(played);
        self.beyond_slowest(played)
            .add_map_to(&slowest.compiled.model, &mut budget);
        budget
    }

    fn beyond_slowest(&self, played: &ProgramReport) -> &Beyond {
        let slowest = played.zone(played.slowest_zone());
        &self.all_beyond[slowest.of.instrument.index()]
    }
}
