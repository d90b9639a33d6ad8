//! `whippen run`

mod beside;
mod outputs;
mod steps;
mod summary;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use whippen_compiler::rate::Rate;

use clap::ValueHint;
use whippen_compiler::check::{Options, Program};
use whippen_compiler::diag::Severity;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_runtime::compare::compare;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::report::{Made, Page, Section};
use whippen_runtime::session::{self, Recorded, Recording, Run, RunError};

use super::file_plan::FilePlan;
use super::hand::HandArgs;
use super::keys::{self, KeysArgs, Setup};
use super::live::LiveArgs;
use super::motion::{MotionArgs, Positions};
use super::on_board::BoardArgs;
use super::opened::Opened;
use super::settings::SettingArgs;
use super::{command, errors, load, option, progress::Progress, watch};
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{self, say, tell};
pub use outputs::Outputs;
use steps::StepsArgs;
pub use summary::report_load;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen run instruments/grand-piano.whip --motion key.csv --out trace.csv --plot touch.png\n\
                  Example: whippen run instruments/grand-piano.whip --seconds 3600 --out hour.csv --every 441 --columns x,force,support\n\
                  Example: whippen run instruments/grand-piano.whip --report touch.html\n\
                  Example: whippen run instruments/grand-piano.whip --hand 0.2kg,3N*s/m,500N/m --plot touch.png\n\
                  Example: whippen run instruments/grand-piano.whip --midi song.mid --key C4 --report song.html"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    #[command(flatten)]
    motion: MotionArgs,
    #[command(flatten)]
    hand: HandArgs,
    #[command(flatten)]
    live: LiveArgs,
    #[command(flatten)]
    keys: KeysArgs,
    /// What runs it: jit (compiled, fixed point), interp (the reference), ideal (f64) or emulated
    /// (the image of `build` on its board)
    #[arg(long, default_value = "jit")]
    engine: EngineKind,
    #[command(flatten)]
    on_board: BoardArgs,
    #[command(flatten)]
    settings: SettingArgs,
    /// The same for several, as a JSON object, such as '{"k": 9e3, "weight": "0.4N"}'; plain
    /// numbers are in SI
    #[arg(
        long = "set-json",
        value_name = "OBJECT",
        help_heading = "The instrument"
    )]
    set_json: Vec<String>,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP, help_heading = "The instrument")]
    device: Option<OsString>,
    /// What the sensor adds to each reading, normal and white, as root of the mean square: 1um, or
    /// 0.005deg of what turns; what the device states otherwise
    #[arg(long, value_name = "LENGTH|ANGLE", value_parser = option::noise, help_heading = "The instrument")]
    noise: Option<option::Noise>,
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE, help_heading = "The instrument")]
    tick_rate: Option<Rate>,
    /// Stop after so long
    #[arg(long, value_name = "TIME", allow_negative_numbers = true, value_parser = option::seconds)]
    seconds: Option<f64>,
    /// Run the f64 engine too, and print how far fixed point is from it
    #[arg(long)]
    errors: bool,
    /// Print one line of JSON instead: what happened, what was counted, the files
    #[arg(long, conflicts_with_all = ["midi", "errors", "watch"])]
    json: bool,
    /// Run again whenever one of the files is saved, until Ctrl-C
    #[arg(long)]
    watch: bool,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    steps: StepsArgs,
}

impl Args {
    /// All files that are read.
    fn files(&self, opened: &Opened) -> Vec<PathBuf> {
        let others = self.motion.files().chain(self.hand.files());
        let others = others.chain(self.live.files());
        let named = opened.paths().chain(others).chain(&self.keys.midi);
        named
            .cloned()
            .chain(device::file(self.device.as_deref()))
            .chain(self.settings.files())
            .chain(self.outputs.compare.clone())
            .collect()
    }

    /// The device with the noise that is asked for.
    fn with_noise(&self, device: Device) -> Result<Device, Failure> {
        let noisy = self.noise.map(|noise| noise.of(&device));
        let noisy = noisy.transpose().map_err(Failure::Usage)?;
        Ok(noisy.unwrap_or(device))
    }

    /// A board keeps no values from inside of ticks: no figure can be drawn of it, and nothing but
    /// the drive be compared.
    fn fits_engine(&self) -> Result<(), String> {
        let outputs = &self.outputs;
        let wanted = [
            ("--plot", !outputs.plot.is_empty()),
            ("--report", outputs.report.is_some()),
            ("--compare", outputs.compare.is_some()),
            ("--errors", self.errors),
        ];
        match wanted
            .iter()
            .find(|(_, wanted)| *wanted && self.engine.board().is_some())
        {
            None if self.steps.is_wanted() && self.engine.board().is_none() => {
                Err("--steps is of a board: give --engine emulated".to_string())
            }
            Some((option, _)) => Err(format!(
                "{option} shows values from inside of ticks, which a board does not keep; use --engine jit, which is bit for bit the same"
            )),
            None => Ok(()),
        }
    }
}

pub fn run(args: &Args) -> Outcome {
    if !args.watch {
        return run_once(args);
    }
    let files = args.files(&Opened::words(&args.words)?);
    watch::watch(&files, || run_once(args))
}

fn run_once(args: &Args) -> Outcome {
    if args.json {
        say::hush();
    }
    let opened = Opened::words(&args.words)?;
    let (sources, name) = (&opened.sources, opened.name);
    let plan = FilePlan::default().reads(&args.files(&opened));
    args.steps.plan(args.outputs.plan(plan)).check()?;
    args.fits_engine().map_err(Failure::Usage)?;
    let (of_json, in_si) = load::json_sets(&args.set_json)?;
    let options = Options {
        sets: [args.settings.all(&opened)?, of_json].concat(),
        in_si,
        rate_hz: args.tick_rate,
        ..Options::default()
    };
    let (map, program) = load::checked(sources, &options, Severity::Warning)?;
    let engine = args.on_board.engine(args.engine, &program);
    let engine = engine.map_err(Failure::Usage)?;
    let Some(path) = &args.keys.midi else {
        let checked = Checked {
            map: &map,
            program: &program,
            sources,
            settings: &options.sets,
            engine,
        };
        return run_key(args, &checked, name);
    };
    let first = keys::first_instrument(&program, name, &args.keys)?;
    let device = load::device(args.device.as_deref(), &map, &program, first)?;
    let device = args.with_noise(device)?;
    let setup = Setup {
        map: &map,
        program: &program,
        sources,
        settings: &options.sets,
        device: &device,
        engine,
        on_board: &args.on_board,
        seconds: args.seconds,
        name,
        outputs: &args.outputs,
        stop: (!args.watch).then(interrupt::stops),
    };
    keys::run(&setup, &args.keys, path)
}

/// A program that was read and checked, and what is to run it.
struct Checked<'a> {
    map: &'a SourceMap,
    program: &'a Program,
    sources: &'a [(String, String)],
    settings: &'a [(String, String)],
    engine: EngineKind,
}

impl<'a> Checked<'a> {
    /// What a page says of where a run is from.
    fn made(&self, motion: &'a [String], device: &'a Device) -> Made<'a> {
        Made {
            engine: self.engine,
            motion,
            device,
            settings: self.settings,
            sources: self.sources,
        }
    }
}

/// Runs one key.
fn run_key(args: &Args, checked: &Checked, name: Option<&str>) -> Outcome {
    let (program, engine) = (checked.program, checked.engine);
    let model = moved_once(args, load::one_key(program, name, args.keys.key)?)?;
    let device = args.device.as_deref();
    let device = args.with_noise(load::device(device, checked.map, program, &model)?)?;
    for note in device::unmeasured(&device, &model) {
        tell!("note: {note}");
    }
    let outputs = &args.outputs;
    let (mut positions, measured) = beside::positions(outputs, &args.motion, &model)?;
    let prove = |on| {
        let on_board = &args.on_board;
        on_board.prove_instrument(checked.map, &model, &device, on)
    };
    let proven = engine.board().map(prove).transpose()?;
    // A board gets the image that `build` makes, in which nothing is observed.
    let compiled = load::compiled(checked.map, model, &device, engine.board().is_none())?;
    if let Some(seconds) = args.seconds {
        let ticks = (seconds * f64::from(compiled.model.rate_hz)).ceil() as usize;
        positions = positions.lasting(ticks.max(1));
    }
    let (automation, told) = args.live.load(&compiled.model)?;
    // A watch has its own way to end.
    let stop = (!args.watch).then(interrupt::stops);
    let recording = |columns: Vec<Recorded>| {
        let recording = outputs.recording(columns, &compiled, engine)?;
        let recording = recording.changing(automation.clone());
        let recording = args.steps.wanted(recording);
        Ok(recording.starting(positions.start_s).until(stop))
    };
    let (mut run, mut notes) = if args.hand.closes() {
        args.hand
            .play(&compiled, &device, engine, &positions, recording)?
    } else {
        let recording = recording(session::recorded_of_motion(&compiled, &device, engine))?;
        let run = play(&compiled, &device, engine, &positions, recording)?;
        (run, positions.notes.clone())
    };
    notes.extend(told);
    summary::report_run(&compiled, &run, engine, &notes);
    run.beside = measured.map(|measured| measured.beside(&compiled, &run));
    beside::report(&run);
    outputs.finish(&compiled, &run)?;
    args.steps.write(&compiled, engine, proven.as_ref(), &run)?;
    if let Some(path) = &outputs.report {
        let made = checked.made(&notes, &device);
        let section = Section::of_run(&compiled, &run, &made);
        report(path, &compiled.model.name.replace('_', " "), vec![section])?;
    }
    if args.json {
        let object = summary::json(&compiled, &run, engine, checked.settings, outputs);
        say::whole(&format!("{object}\n"));
    }
    ended([run.counts.ticks, run.ticks_wanted], compiled.model.rate_hz)?;
    if args.errors {
        print_errors(&compiled, &device, engine, &positions)
    } else {
        Ok(())
    }
}

/// A key that a force moves follows no recording.
fn moved_once(args: &Args, model: Model) -> Result<Model, Failure> {
    if model.is_of_key() && args.hand.files().next().is_some() && args.motion.is_recorded() {
        let why = "--force alone moves the key; leave --motion away";
        return Err(Failure::Usage(why.to_string()));
    }
    Ok(model)
}

/// Whether a run came to its end: ticks that were played, and that were wanted.
pub fn ended([played, wanted]: [usize; 2], rate_hz: Rate) -> Outcome {
    let seconds = |ticks: usize| ticks as f64 / f64::from(rate_hz);
    if played < wanted {
        tell!(
            "interrupted: {:.2} of {:.2} s were played, and are kept",
            seconds(played),
            seconds(wanted)
        );
        return Err(Failure::Interrupted);
    }
    Ok(())
}

/// Writes a page and says where it is.
pub fn report(path: &Path, title: &str, sections: Vec<Section>) -> Outcome {
    let page = Page {
        title: title.to_string(),
        command: command::typed(),
        overview: None,
        sections,
    };
    page.save(path).map_err(|e| Failure::Usage(e.to_string()))?;
    say!("report: {}", path.display());
    Ok(())
}

fn print_errors(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    positions: &Positions,
) -> Outcome {
    let progress = Progress::new(positions.ticks(), compiled.model.rate_hz);
    let comparison = compare(compiled, device, kind, &positions.places, |ticks| {
        progress.at(ticks)
    });
    progress.done();
    say::whole(&errors::report(
        compiled,
        &comparison.map_err(Failure::Defect)?,
    ));
    Ok(())
}

/// Runs with a progress bar.
pub fn play(
    compiled: &Compiled,
    device: &Device,
    kind: EngineKind,
    positions: &Positions,
    recording: Recording,
) -> Result<Run, Failure> {
    let progress = Progress::new(positions.ticks(), compiled.model.rate_hz);
    let move_to = |tick: usize, places: &mut [f64]| {
        for (place, trajectory) in places.iter_mut().zip(&positions.places) {
            *place = trajectory.at(tick);
        }
    };
    let motion = (positions.ticks(), move_to);
    let at = |ticks| progress.at(ticks);
    let run = session::record(compiled, device, kind, motion, recording, at);
    progress.done();
    run.map_err(|why| stopped(kind, why))
}

/// What a run could not go on with: on a board that is the program, or its device.
pub fn stopped(kind: EngineKind, why: RunError) -> Failure {
    match why {
        RunError::Output(error) => Failure::Usage(error.to_string()),
        RunError::Engine(why) => stopped_engine(kind, why),
    }
}

/// What an engine could not go on with.
pub fn stopped_engine(kind: EngineKind, why: String) -> Failure {
    if kind.board().is_none() {
        return Failure::Defect(why);
    }
    tell!("error: on the emulated board: {why}");
    Failure::Program
}
