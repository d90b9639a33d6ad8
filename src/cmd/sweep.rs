//! `whippen sweep`: measured numbers over a grid or over Sobol points of parameters.

pub mod grid;
mod quantity;
mod shown;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use clap::ValueHint;
use whippen_compiler::check::Options;
use whippen_compiler::diag::{Severity, nearest};
use whippen_compiler::model::Model;
use whippen_compiler::parallel;
use whippen_compiler::rate::Rate;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;

use super::budget::write_text;
use super::file_plan::FilePlan;
use super::opened::Opened;
use super::progress::Progress;
use super::settings::SettingArgs;
use super::{load, option, point};
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{self, say, tell};
use grid::Over;
use quantity::{Measured, SweptNumber};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen sweep instruments/hammond.whip --over k=60N/m..120N/m:7 --over B=0.1N*s/m..1N*s/m:4 --out table.csv --plot heat.svg\n\
                  Example: whippen sweep instruments/grand-piano.whip --over k=4kN/m..16kN/m --over B_k=20N*s/m..100N*s/m --sobol 64 --measure loudest_strike,strikes"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// A parameter and its values: from, to, and of a grid how many
    #[arg(
        long = "over",
        required = true,
        value_name = "NAME=LOW..HIGH:COUNT",
        allow_hyphen_values = true
    )]
    overs: Vec<Over>,
    /// So many points that fill the space evenly (Sobol's sequence), instead of a grid
    #[arg(long, value_name = "N", value_parser = option::points)]
    sobol: Option<u32>,
    /// Which Sobol points
    #[arg(long, value_name = "S", default_value_t = 0, requires = "sobol")]
    seed: u32,
    /// What is measured: numbers of `whippen measure` (down_weight, let_off_travel, ..), or of the
    /// bundled gesture (strikes, events, greatest_force, drive_clipped, slips_per_period,
    /// stick_share); pictures show the first
    #[arg(
        long = "measure",
        value_name = "NAME,..",
        value_delimiter = ',',
        default_value = "down_weight,up_weight,friction_weight,strikes,greatest_force"
    )]
    wanted: Vec<SweptNumber>,
    /// Values of the program that are drawn as lines over a heat map: each over the first
    /// parameter, in the unit of the second
    #[arg(long = "line", value_name = "NAME,..", value_delimiter = ',')]
    lines: Vec<String>,
    /// What runs it: jit (compiled, fixed point), interp (the reference) or ideal (f64)
    #[arg(long, default_value = "jit")]
    engine: EngineKind,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    tick_rate: Option<Rate>,
    /// Table: a row for each point
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    out: Option<PathBuf>,
    /// Picture: a curve over one parameter, a heat map over two
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    plot: Vec<PathBuf>,
}

/// A point and what was measured there.
struct Done {
    /// The values of the parameters (SI).
    point: Vec<f64>,
    /// What was measured; none where the program has no such number.
    values: Vec<Option<f64>>,
    /// Values of the program that are lines of the picture.
    lines: Vec<Option<f64>>,
    /// Why nothing was.
    trouble: Option<String>,
}

/// What does not change from point to point.
struct Swept<'a> {
    args: &'a Args,
    sources: &'a [(String, String)],
    name: Option<&'a str>,
    sets: Vec<(String, String)>,
    device: Device,
}

pub fn run(args: &Args) -> Outcome {
    let opened = Opened::words(&args.words)?;
    let read: Vec<PathBuf> = opened.paths().cloned().collect();
    FilePlan::default()
        .reads(&read)
        .writes("--out", &args.out, &["csv"])
        .writes("--plot", &args.plot, &["svg", "png"])
        .check()?;
    let points = points(args).map_err(Failure::Usage)?;
    let sets = args.settings.all(&opened)?;
    if let Some((name, _)) = sets
        .iter()
        .find(|set| args.overs.iter().any(|o| o.name == set.0))
    {
        let why = "is swept and set; take one away";
        return Err(Failure::Usage(format!("`{name}` {why}")));
    }
    let device = check_ends(args, &opened, &sets)?;
    let swept = Swept {
        args,
        sources: &opened.sources,
        name: opened.name,
        sets,
        device,
    };
    let all = points.len();
    let done = swept.all(points);
    say::whole(&shown::text(args, &done));
    if let Some(path) = &args.out {
        write_text(path, &shown::csv(args, &done))?;
        say!("table: {}", path.display());
    }
    for path in &args.plot {
        let drawn = shown::save_picture(args, &done, path);
        drawn.map_err(|e| Failure::Usage(e.to_string()))?;
        say!("plot: {}", path.display());
    }
    tell_outcome(&done, all)
}

fn points(args: &Args) -> Result<Vec<Vec<f64>>, String> {
    if args.engine.board().is_some() {
        return Err(
            "a board keeps no values from inside of ticks; use --engine jit, which is bit for bit the same".into(),
        );
    }
    if !args.plot.is_empty() && args.overs.len() > 2 {
        return Err("--plot: a picture is over one parameter or two".into());
    }
    if !args.lines.is_empty() && args.overs.len() != 2 {
        return Err("--line: a line is drawn over a heat map, which is over two parameters".into());
    }
    match args.sobol {
        Some(count) => grid::sobol(&args.overs, count, args.seed),
        None => grid::grid(&args.overs),
    }
}

/// Checks the program with each parameter at either end, so that what is wrong with a parameter is
/// told before anything is computed; gives the device.
fn check_ends(args: &Args, opened: &Opened, sets: &[(String, String)]) -> Result<Device, Failure> {
    let mut least = Severity::Warning;
    for over in &args.overs {
        for end in [over.ends.0, over.ends.1] {
            let own = [over.setting(end)];
            let options = options(args, &[sets, &own].concat());
            load::checked(&opened.sources, &options, least)?;
            least = Severity::Error;
        }
    }
    let (map, program) = load::checked(&opened.sources, &options(args, sets), least)?;
    let model = load::one_key(&program, opened.name, None)?;
    fits(args, &model).map_err(Failure::Usage)?;
    load::device(args.device.as_deref(), &map, &program, &model)
}

fn options(args: &Args, sets: &[(String, String)]) -> Options {
    Options {
        sets: sets.to_vec(),
        rate_hz: args.tick_rate,
        ..Options::default()
    }
}

/// That what is wanted can be measured on an instrument.
fn fits(args: &Args, model: &Model) -> Result<(), String> {
    if !model.is_of_key() {
        return Err(format!(
            "`{}` has several ports, and a sweep plays a key",
            model.name
        ));
    }
    for line in &args.lines {
        let named = model.named.iter().find(|named| named.name == *line);
        let upwards = args.overs.last().map(|over| over.dim);
        match named {
            None => return Err(no_value(line, model)),
            Some(named) if named.dim != upwards => {
                return Err(format!(
                    "--line: `{line}` is not of the kind of `{}`",
                    args.overs[1].name
                ));
            }
            Some(_) => {}
        }
    }
    match args.wanted.iter().find(|wanted| wanted.is_of_key()) {
        Some(wanted) if model.turns() => Err(format!(
            "`{}` turns, and {} is of a key that is pressed",
            model.name,
            wanted.name()
        )),
        _ => Ok(()),
    }
}

/// What is said of a line that is no value.
fn no_value(line: &str, model: &Model) -> String {
    let names = || model.named.iter().map(|named| named.name.as_str());
    let near = nearest(line, names());
    let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    format!("--line: `{}` has no value `{line}`{near}", model.name)
}

impl Swept<'_> {
    /// All points in their order, on all threads; of an interrupted sweep those that were done.
    fn all(&self, points: Vec<Vec<f64>>) -> Vec<Done> {
        let stopped = interrupt::stops();
        let progress = Mutex::new((Progress::of_things(points.len(), "points"), 0));
        let one = |point: Vec<f64>| {
            if stopped.load(Ordering::Relaxed) {
                return None;
            }
            let measured = self.measure(&point);
            if let Ok(mut progress) = progress.lock() {
                progress.1 += 1;
                progress.0.at(progress.1);
            }
            let ((values, lines), trouble) = match measured {
                Ok(values) => (values, None),
                Err(why) => (self.nothing(), Some(why)),
            };
            Some(Done {
                point,
                values,
                lines,
                trouble,
            })
        };
        let done = parallel::map(points, one);
        if let Ok(progress) = progress.lock() {
            progress.0.done();
        }
        done.into_iter().flatten().collect()
    }

    /// What is measured where nothing can be.
    fn nothing(&self) -> Measured {
        (
            vec![None; self.args.wanted.len()],
            vec![None; self.args.lines.len()],
        )
    }

    /// What is measured at a point; or why nothing is.
    fn measure(&self, point: &[f64]) -> Result<Measured, String> {
        let overs = self.args.overs.iter().zip(point);
        let own = overs.map(|(over, value)| over.setting(*value));
        let sets: Vec<_> = self.sets.iter().cloned().chain(own).collect();
        let options = options(self.args, &sets);
        let compiled = point::compiled(self.sources, self.name, &options, &self.device)?;
        let wanted = (&self.args.wanted[..], &self.args.lines[..]);
        quantity::measure(wanted, &compiled, &self.device, self.args.engine)
    }
}

/// Says what is missing.
fn tell_outcome(done: &[Done], all: usize) -> Outcome {
    let troubled = || done.iter().filter_map(|done| done.trouble.as_ref());
    if let Some(first) = troubled().next() {
        tell!(
            "error: {} of {} points could not be measured; the first: {first}",
            troubled().count(),
            done.len()
        );
    }
    if done.len() < all {
        tell!(
            "interrupted: {} of {all} points were done, and are kept",
            done.len()
        );
        return Err(Failure::Interrupted);
    }
    match troubled().next() {
        Some(_) => Err(Failure::Program),
        None => Ok(()),
    }
}
