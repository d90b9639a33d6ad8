//! `whippen run`

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::firmware::FAULTS;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::compare::compare;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::Load;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::files::FileError;
use whippen_runtime::plot;
use whippen_runtime::report::{Made, Page, Section};
use whippen_runtime::session::{self, Counts, Run};

use super::file_plan::FilePlan;
use super::hand::HandArgs;
use super::keys::{self, KeysArgs, Setup};
use super::motion::{self, MotionArgs, Positions};
use super::on_board::BoardArgs;
use super::{command, errors, load, progress::Progress, watch};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen run instruments/grand-piano.whip --motion key.csv --out trace.csv --plot touch.png\n\
                  Example: whippen run instruments/grand-piano.whip --report touch.html\n\
                  Example: whippen run instruments/grand-piano.whip --hand 0.2kg,3N*s/m,500N/m --plot touch.png\n\
                  Example: whippen run instruments/grand-piano.whip --midi song.mid --key C4 --report song.html"
)]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    #[command(flatten)]
    motion: MotionArgs,
    #[command(flatten)]
    hand: HandArgs,
    #[command(flatten)]
    keys: KeysArgs,
    /// What runs it: jit (compiled, fixed point), interp (the reference), ideal (f64) or emulated
    /// (the image of `build` on its board)
    #[arg(long, default_value = "jit")]
    engine: EngineKind,
    #[command(flatten)]
    on_board: BoardArgs,
    /// Give a parameter another value, such as weight=0.4N
    #[arg(
        long = "set",
        value_name = "NAME=VALUE",
        help_heading = "The instrument"
    )]
    sets: Vec<String>,
    /// Device file with the scales of sensor and drive; the keyboard's device or mikey otherwise
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, help_heading = "The instrument")]
    device: Option<PathBuf>,
    /// Stop after so long
    #[arg(long, value_name = "TIME", value_parser = motion::seconds)]
    seconds: Option<f64>,
    /// Run the f64 engine too, and print how far fixed point is from it
    #[arg(long)]
    errors: bool,
    /// Run again whenever one of the files is saved, until Ctrl-C
    #[arg(long)]
    watch: bool,
    #[command(flatten)]
    outputs: Outputs,
}

/// What to write.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What to write")]
pub struct Outputs {
    /// Trace: a row per tick with ports, force terms, coordinates and states
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Only every N-th row of the trace
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub every: u32,
    /// Events: emitted ones, named ones and transitions
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub events: Option<PathBuf>,
    /// Picture: forces against time and travel, hammer and states against time
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    pub plot: Vec<PathBuf>,
    /// Page to explore: plots to zoom, force loop, strikes, numbers, the program; one file that
    /// needs no network
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    pub report: Option<PathBuf>,
}

impl Outputs {
    /// Adds them to the files of a command.
    fn plan(&self, plan: FilePlan) -> FilePlan {
        plan.writes("--out", &self.out, &["csv"])
            .writes("--events", &self.events, &["csv"])
            .writes("--plot", &self.plot, &["svg", "png"])
            .writes("--report", &self.report, &["html"])
    }
}

impl Args {
    /// All files that are read.
    fn files(&self) -> Result<Vec<PathBuf>, Failure> {
        let (mut files, _) = load::split(&self.words)?;
        let others = self.motion.files().chain(self.hand.files());
        files.extend(others.chain(&self.device).chain(&self.keys.midi).cloned());
        Ok(files)
    }

    /// A board keeps no values from inside of ticks: no figure can be drawn of it, and nothing but
    /// the drive be compared.
    fn fits_engine(&self) -> Result<(), String> {
        let outputs = &self.outputs;
        let wanted = [
            ("--plot", !outputs.plot.is_empty()),
            ("--report", outputs.report.is_some()),
            ("--errors", self.errors),
        ];
        match wanted
            .iter()
            .find(|(_, wanted)| *wanted && self.engine.board().is_some())
        {
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
    watch::watch(&args.files()?, || run_once(args))
}

fn run_once(args: &Args) -> Outcome {
    let (files, name) = load::split(&args.words)?;
    let plan = FilePlan::default().reads(&args.files()?);
    args.outputs.plan(plan).check()?;
    args.fits_engine().map_err(Failure::Usage)?;
    let options = Options {
        sets: load::sets(&args.sets)?,
        ..Options::default()
    };
    let sources = load::read(&files)?;
    let (map, program) = load::checked(&sources, &options, Severity::Warning)?;
    let engine = args.on_board.engine(args.engine, &program);
    let engine = engine.map_err(Failure::Usage)?;
    if let Some(path) = &args.keys.midi {
        let device = load::device(
            args.device.as_deref(),
            &program,
            keys::first_instrument(&program, name, &args.keys)?,
        )?;
        let setup = Setup {
            map: &map,
            program: &program,
            sources: &sources,
            settings: &options.sets,
            device: &device,
            engine,
            on_board: &args.on_board,
            seconds: args.seconds,
            name,
            outputs: &args.outputs,
        };
        return keys::run(&setup, &args.keys, path);
    }
    let model = load::one_key(&program, name, args.keys.key)?;
    let device = load::device(args.device.as_deref(), &program, &model)?;
    let mut positions = args.motion.load(&model)?;
    if let Some(on) = engine.board() {
        let on_board = &args.on_board;
        on_board.prove_instrument(&map, &model, &device, on)?;
    }
    // A board gets the image that `build` makes, in which nothing is observed.
    let compiled = load::compiled(&map, model, &device, engine.board().is_none())?;
    if let Some(seconds) = args.seconds {
        let ticks = (seconds * f64::from(compiled.model.rate_hz)).ceil() as usize;
        positions.position_m.truncate(ticks.max(1));
    }
    let run = if args.hand.closes() {
        let (run, moved) = args.hand.play(&compiled, &device, engine, &positions)?;
        positions = moved;
        run
    } else {
        play(&compiled, &device, engine, &positions)?
    };
    summary(&compiled, &run, engine, &positions);
    write(&args.outputs, &compiled, &run)?;
    if let Some(path) = &args.outputs.report {
        let made = Made {
            engine,
            motion: &positions.notes,
            device: &device,
            settings: &options.sets,
            sources: &sources,
        };
        report(
            path,
            &compiled.model.name.replace('_', " "),
            vec![Section::of_run(&compiled, &run, &made)],
        )?;
    }
    if args.errors {
        print_errors(&compiled, &device, engine, &positions)
    } else {
        Ok(())
    }
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
    let progress = Progress::new(positions.position_m.len(), compiled.model.rate_hz);
    let comparison = compare(compiled, device, kind, &positions.position_m, |ticks| {
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
) -> Result<Run, Failure> {
    let progress = Progress::new(positions.position_m.len(), compiled.model.rate_hz);
    let run = session::run(compiled, device, kind, &positions.position_m, |ticks| {
        progress.at(ticks)
    });
    progress.done();
    run.map_err(|why| stopped(kind, why))
}

/// What an engine could not go on with: on a board that is the program, or its device.
pub fn stopped(kind: EngineKind, why: String) -> Failure {
    if kind.board().is_none() {
        return Failure::Defect(why);
    }
    eprintln!("error: on the emulated board: {why}");
    Failure::Program
}

/// What a run took on the board, and what went wrong there.
pub fn report_load(load: &Load) {
    for (number, core) in load.cores.iter().enumerate() {
        say!(
            "  core {number}: {} keys, longest tick {} of {} cycles, {:.1} % busy, {} missed, faults {}",
            core.keys,
            core.frame_cycles_max,
            load.period_cycles,
            100.0 * core.utilisation(load),
            core.missed,
            core.faults
        );
        for fault in FAULTS.iter().filter(|fault| core.faults & fault.bit != 0) {
            say!("    fault {}: {}", fault.bit, fault.what);
        }
    }
}

/// What happened, in a few lines.
fn summary(compiled: &Compiled, run: &Run, kind: EngineKind, positions: &Positions) {
    positions
        .notes
        .iter()
        .for_each(|note| say!("motion: {note}"));
    let Counts {
        ticks, engine_time, ..
    } = run.counts;
    let played_s = ticks as f64 / f64::from(compiled.model.rate_hz);
    say!(
        "{}: {played_s:.2} s on engine {kind}, {:.0}x real time",
        compiled.model.name,
        played_s / engine_time.as_secs_f64()
    );
    let marked = session::marked(&compiled.model);
    for event in run.trace.events.iter().filter(|e| e.event == marked) {
        let args: Vec<String> = event
            .args
            .iter()
            .map(|(title, value)| format!("{title} {value:.3}"))
            .collect();
        say!("  {:>9.4} s  {marked}  {}", event.t_s, args.join("  "));
    }
    for (count, what) in run.counts.told() {
        say!("  {count} of {ticks} ticks {what}");
    }
    if let Some(load) = &run.load {
        report_load(load);
        say!(
            "  traced are the drive and what is emitted: a board keeps no values and transitions of a tick"
        );
    }
}

/// Writes what was asked for and says where it is.
fn write(outputs: &Outputs, compiled: &Compiled, run: &Run) -> Outcome {
    for (what, path) in write_files(outputs, compiled, run)? {
        say!("{what}: {}", path.display());
    }
    Ok(())
}

/// Writes trace, events and plots; every file appears whole or not at all. Gives what each is.
pub fn write_files<'o>(
    outputs: &'o Outputs,
    compiled: &Compiled,
    run: &Run,
) -> Result<Vec<(&'static str, &'o Path)>, Failure> {
    let failed = |e: FileError| Failure::Usage(e.to_string());
    let mut written: Vec<(&'static str, &Path)> = Vec::new();
    if let Some(path) = &outputs.out {
        run.trace
            .save_ticks(path, outputs.every as usize)
            .map_err(failed)?;
        written.push(("trace", path));
    }
    if let Some(path) = &outputs.events {
        run.trace.save_events(path).map_err(failed)?;
        written.push(("events", path));
    }
    for path in &outputs.plot {
        plot::save(&session::figure(compiled, run), path).map_err(failed)?;
        written.push(("plot", path));
    }
    Ok(written)
}
