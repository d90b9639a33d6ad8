//! `whippen fit`: values of parameters that fit recordings, and how well they are known.

mod free;
mod outcome;
mod overlay;
mod shown;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueHint;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::model::Model;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::fit::data::{FitData, Fittable, share_spreads};
use whippen_runtime::fit::description;
use whippen_runtime::fit::residuals::{self, ResidualPart};
use whippen_runtime::fit::solve::{self, Local, Loss, NoStart, Search};
use whippen_runtime::fit::strokes::{self, StrokePair};
use whippen_runtime::session;

use super::budget::write_text;
use super::file_plan::FilePlan;
use super::opened::Opened;
use super::progress::during;
use super::settings::SettingArgs;
use super::{load, option, point};
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{self, say, tell};
use free::{Free, FreeName};
use outcome::Fitted;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen fit spring.whip --free k,B --data press.csv --out fitted.whip\n\
                  Example: whippen fit piano.whip --free k=4kN/m..16kN/m --data soft.csv --data loud.csv --held-out other.csv --global 30 --plot fit.svg"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// Parameters to be found, within their ranges or the ones given here
    #[arg(
        long,
        required = true,
        value_name = "NAME[=LOW..HIGH],..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    free: Vec<FreeName>,
    /// A recording: a table of a motion and of what was measured with it, with the titles of a run;
    /// or a description of one of bare columns
    #[arg(long, required = true, value_name = "FILE.csv|FILE.toml", value_hint = ValueHint::FilePath)]
    data: Vec<PathBuf>,
    /// What happened in each recording, in their order: tables such as `run --events` writes
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    events: Vec<PathBuf>,
    /// How much each recording counts, in their order
    #[arg(long, value_name = "N,..", value_delimiter = ',', value_parser = weight)]
    weights: Vec<f64>,
    /// A recording that is not fitted, only judged
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    held_out: Vec<PathBuf>,
    /// A title of the recordings, and the title of a run that it stands for, such as f_n=force_n
    #[arg(long = "as", value_name = "TITLE=TITLE", value_parser = renamed)]
    renamed: Vec<(String, String)>,
    /// Fit to these columns of a run alone, such as force_n
    #[arg(long, value_name = "TITLE,..", value_delimiter = ',')]
    columns: Vec<String>,
    /// Low-pass filter without delay for the motions, against their noise
    #[arg(long, value_name = "FREQUENCY", value_parser = option::frequency)]
    lowpass: Option<f64>,
    /// What a residual costs: squares, or with less weight on what lies far out soft-l1, huber,
    /// cauchy; beyond a part of a column's spread, such as huber:0.1
    #[arg(long, value_name = "LOSS[:PART]", default_value = "squares", value_parser = loss)]
    loss: (Loss, f64),
    /// Look everywhere first: so many generations of CMA-ES; otherwise downhill from the present
    /// values alone
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = generations)]
    global: u64,
    /// Which random numbers the generations use
    #[arg(long, value_name = "S", default_value_t = 0, requires = "global")]
    seed: u64,
    /// How it goes downhill, within the bounds
    #[arg(long, value_name = "METHOD", default_value = "trust-region",
          value_parser = PossibleValuesParser::new(Local::ALL.map(|(name, _)| name)).map(local))]
    method: Local,
    /// What runs it: ideal (f64), jit (compiled, fixed point) or interp (the reference)
    #[arg(long, default_value = "ideal")]
    engine: EngineKind,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    tick_rate: Option<Rate>,
    /// The program with the values that were found
    #[arg(long, value_name = "FILE.whip", value_hint = ValueHint::FilePath)]
    out: Option<PathBuf>,
    /// Picture: measured, before and after, over time; the first column of the first recording
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    plot: Vec<PathBuf>,
    /// Print one line of JSON instead
    #[arg(long)]
    json: bool,
}

fn weight(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok();
    let value = value.filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "wanted is a number above 0".to_string())
}

fn generations(text: &str) -> Result<u64, String> {
    let value = text.parse::<u64>().ok().filter(|n| *n <= 100_000);
    value.ok_or_else(|| "wanted is a number of generations from 0 to 100000".to_string())
}

fn renamed(text: &str) -> Result<(String, String), String> {
    let (from, to) = text
        .split_once('=')
        .ok_or("wanted is TITLE=TITLE, such as f_n=force_n")?;
    Ok((from.trim().to_string(), to.trim().to_string()))
}

fn local(name: String) -> Local {
    let found = Local::ALL.into_iter().find(|(known, _)| *known == name);
    found.map_or(Local::default(), |(_, local)| local)
}

/// A loss and where it begins to be one.
fn loss(text: &str) -> Result<(Loss, f64), String> {
    let (name, part) = match text.split_once(':') {
        Some((name, part)) => (name, Some(weight(part)?)),
        None => (text, None),
    };
    let found = Loss::ALL.iter().find(|loss| loss.0 == name);
    let names: Vec<&str> = Loss::ALL.iter().map(|loss| loss.0).collect();
    let found = found.ok_or_else(|| format!("there are {}", names.join(", ")))?;
    match (found.1, part) {
        (Loss::Squares, Some(_)) => Err("squares have no such part".into()),
        (loss, part) => Ok((loss, part.unwrap_or(0.1))),
    }
}

/// What does not change while parameters do.
struct Fit<'a> {
    args: &'a Args,
    sources: &'a [(String, String)],
    name: Option<&'a str>,
    sets: Vec<(String, String)>,
    free: Vec<Free>,
    device: Device,
    data: Vec<FitData>,
    held_out: Vec<FitData>,
    parts: Vec<ResidualPart>,
}

pub fn run(args: &Args) -> Outcome {
    if args.json {
        say::hush();
    }
    let opened = Opened::words(&args.words)?;
    plan(args, &opened).check()?;
    counts_fit(args).map_err(Failure::Usage)?;
    let sets = args.settings.all(&opened)?;
    let options = options(args, &sets);
    let (map, program) = load::checked(&opened.sources, &options, Severity::Warning)?;
    let model = load::one_key(&program, opened.name, None)?;
    let free = Free::find(&args.free, &model)?;
    if let Some((name, _)) = sets.iter().find(|set| free.iter().any(|f| f.name == set.0)) {
        return Err(Failure::Usage(format!(
            "`{name}` is free and set; take one away"
        )));
    }
    check_ends(args, &opened, &sets, &free)?;
    let device = load::device(args.device.as_deref(), &map, &program, &model)?;
    let compiled = load::compiled(&map, model.clone(), &device, true)?;
    let (data, held_out) = read(args, &compiled, &device)?;
    let fit = Fit {
        args,
        sources: &opened.sources,
        name: opened.name,
        sets,
        free,
        device,
        parts: residuals::parts(&data),
        data,
        held_out,
    };
    let fitted = fit.solve()?;
    fit.write(&fitted, &map, &model)
}

/// The files of the command line.
fn plan(args: &Args, opened: &Opened) -> FilePlan {
    let recordings = args.data.iter().chain(&args.events).chain(&args.held_out);
    let read: Vec<PathBuf> = opened.paths().chain(recordings).cloned().collect();
    FilePlan::default()
        .reads(&read)
        .writes("--out", &args.out, &["whip"])
        .writes("--plot", &args.plot, &["svg", "png"])
}

/// That there is one of each for each.
fn counts_fit(args: &Args) -> Result<(), String> {
    let data = args.data.len();
    for (option, count) in [
        ("--events", args.events.len()),
        ("--weights", args.weights.len()),
    ] {
        if count > 0 && count != data {
            return Err(format!(
                "{option}: there are {data} recordings and {count} of these; give one for each"
            ));
        }
    }
    match args.engine.board() {
        Some(_) => Err(
            "a board keeps no values from inside of ticks; use --engine jit, which is bit for bit the same".into(),
        ),
        None => Ok(()),
    }
}

fn options(args: &Args, sets: &[(String, String)]) -> Options {
    Options {
        sets: sets.to_vec(),
        rate_hz: args.tick_rate,
        ..Options::default()
    }
}

/// Checks the program with each parameter at either bound, so that what is wrong with one is told
/// before anything is computed.
fn check_ends(
    args: &Args,
    opened: &Opened,
    sets: &[(String, String)],
    free: &[Free],
) -> Result<(), Failure> {
    for one in free {
        for bound in [one.bounds.0, one.bounds.1] {
            let own = [one.setting(bound)];
            let options = options(args, &[sets, &own].concat());
            load::checked(&opened.sources, &options, Severity::Error)?;
        }
    }
    Ok(())
}

/// Whether a file describes a recording instead of being one.
fn is_description(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "toml")
}

/// Reads what is fitted, and what is held out.
fn read(
    args: &Args,
    compiled: &Compiled,
    device: &Device,
) -> Result<(Vec<FitData>, Vec<FitData>), Failure> {
    let fittable = Fittable {
        model: &compiled.model,
        columns: &session::recorded(compiled, device, args.engine, &[]),
        renamed: &args.renamed,
        wanted: &args.columns,
        lowpass_hz: args.lowpass,
    };
    fittable.check().map_err(Failure::Usage)?;
    let one = |path: &Path, events: Option<&Path>| {
        let data = fittable.read(path, events);
        data.map_err(|error| Failure::Usage(error.to_string()))
    };
    let (mut data, mut held_out) = (Vec::new(), Vec::new());
    for (number, path) in args.data.iter().enumerate() {
        let events = args.events.get(number).map(PathBuf::as_path);
        let weight = args.weights.get(number).copied().unwrap_or(1.0);
        if is_description(path) {
            let read = description::read(path, &fittable);
            let read = read.map_err(|error| Failure::Usage(error.to_string()))?;
            let weighed = |data| FitData { weight, ..data };
            data.extend(read.fitted.into_iter().map(weighed));
            held_out.extend(read.held_out);
            continue;
        }
        data.push(FitData {
            weight,
            ..one(path, events)?
        });
    }
    if data.is_empty() {
        return Err(Failure::Usage("all stretches are held out".into()));
    }
    for path in &args.held_out {
        held_out.push(one(path, None)?);
    }
    // What is held out is judged by what was fitted, if it has that.
    let is_fitted = |title: &String| {
        data.iter()
            .any(|d| d.columns.iter().any(|c| c.title == *title))
    };
    for out in &mut held_out {
        if out.columns.iter().any(|column| is_fitted(&column.title)) {
            out.columns.retain(|column| is_fitted(&column.title));
        }
    }
    share_spreads(&mut data, &mut held_out);
    for data in data.iter().chain(&held_out) {
        if !data.unused.is_empty() {
            let unused = data.unused.join("`, `");
            tell!("note: {}: `{unused}` are no columns of a run", data.name);
        }
    }
    Ok((data, held_out))
}

impl Fit<'_> {
    /// Looks for the values.
    fn solve(&self) -> Result<Fitted, Failure> {
        static STOPPED: AtomicBool = AtomicBool::new(false);
        interrupt::take_first(|| STOPPED.store(true, Ordering::Relaxed));
        let search = Search {
            local: self.args.method,
            loss: self.args.loss.0,
            loss_scale: self.args.loss.1,
            generations: self.args.global,
            seed: self.args.seed,
        };
        let start: Vec<f64> = self.free.iter().map(Free::start).collect();
        let at = |point: &[f64]| self.residuals(point);
        let found = during("fitting", || {
            solve::solve(&start, &at, &search, &STOPPED, &|_, _| {})
        });
        let found = found.map_err(|NoStart| {
            let why = self.compiled(&start).err().unwrap_or_else(|| {
                "a value is no number; look at the run with --engine ideal".to_string()
            });
            Failure::Usage(format!(
                "the program cannot be run with its own values: {why}"
            ))
        })?;
        Ok(Fitted::new(self, &start, found))
    }

    /// The values of the parameters at a point, as settings.
    fn settings(&self, point: &[f64]) -> Vec<(String, String)> {
        let pairs = self.free.iter().zip(point);
        pairs
            .map(|(free, part)| free.setting(free.at(*part)))
            .collect()
    }

    /// The instrument at a point; or why there is none.
    fn compiled(&self, point: &[f64]) -> Result<Compiled, String> {
        let sets: Vec<_> = [self.sets.clone(), self.settings(point)].concat();
        let options = options(self.args, &sets);
        point::compiled(self.sources, self.name, &options, &self.device)
    }

    /// All residuals at a point; none where there are none.
    fn residuals(&self, point: &[f64]) -> Option<Vec<f64>> {
        let compiled = self.compiled(point).ok()?;
        let all = self.of(&compiled, self.args.engine, &self.data, &self.parts)?;
        Some(all.concat())
    }

    /// The residuals of each of some recordings.
    fn of(
        &self,
        compiled: &Compiled,
        engine: EngineKind,
        data: &[FitData],
        parts: &[ResidualPart],
    ) -> Option<Vec<Vec<f64>>> {
        let one = |(number, data): (usize, &FitData)| {
            let own: Vec<&ResidualPart> = parts.iter().filter(|p| p.recording == number).collect();
            let trace = residuals::play(compiled, &self.device, engine, data).ok()?;
            residuals::of_recording(&trace, data, &own)
        };
        let all: Vec<(usize, &FitData)> = data.iter().enumerate().collect();
        parallel::map(all, one).into_iter().collect()
    }

    /// The strokes of recordings, like for like, with the arithmetic of the chip.
    fn strokes(&self, compiled: &Compiled, data: &[FitData]) -> Vec<(String, StrokePair)> {
        let one = |data: &FitData| {
            let found = strokes::compare(compiled, &self.device, EngineKind::Jit, data)?;
            Some((data.name.clone(), found))
        };
        let found = parallel::map(data.iter().collect(), one);
        found.into_iter().flatten().collect()
    }

    /// Prints and writes what was found.
    fn write(&self, fitted: &Fitted, map: &SourceMap, model: &Model) -> Outcome {
        if self.args.json {
            say::whole(&format!("{}\n", shown::json(self, fitted)));
        } else {
            say::whole(&shown::text(self, fitted));
        }
        if let Some(path) = &self.args.out {
            let values = [self.sets.clone(), shown::rounded(self, fitted)].concat();
            let text = overlay::text(map, self.sources.len(), model, &values);
            let text = text.map_err(|why| Failure::Usage(format!("--out: {why}")))?;
            write_text(path, &text)?;
            say!("program: {}", path.display());
        }
        for path in &self.args.plot {
            let drawn = shown::save_picture(self, fitted, path);
            drawn.map_err(|e| Failure::Usage(e.to_string()))?;
            say!("plot: {}", path.display());
        }
        match fitted.end {
            solve::End::Interrupted => {
                tell!("interrupted: these are the best values so far");
                Err(Failure::Interrupted)
            }
            _ => Ok(()),
        }
    }
}
