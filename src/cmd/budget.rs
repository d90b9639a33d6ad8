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
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::command;
use super::file_plan::FilePlan;
use super::proof::ImageProof;
use super::setup::{SetupArgs, symbol_prefix};
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
    proof.report_missed(keys_fitting)
}
