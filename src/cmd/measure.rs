//! `whippen measure`: the technician's report.

mod compare;
mod json;
mod picture;
mod table;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Mutex;

use clap::ValueHint;
use whippen_compiler::check::{Options, Program, note_name};
use whippen_compiler::diag::Severity;
use whippen_compiler::model::Model;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::measure::{Measured, Protocol, RecordedKeys, SPEED_M_PER_S, measure};

use super::budget::write_text;
use super::file_plan::FilePlan;
use super::keys;
use super::opened::Opened;
use super::progress::Progress;
use super::run::stopped;
use super::settings::SettingArgs;
use super::{load, option};
use crate::device;
use crate::exit::{Failure, Outcome};
use crate::say::{self, say, tell};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen measure instruments/grand-piano.whip\n\
                  Example: whippen measure instruments/mikey.whip grand_piano --keys --compare touchweight.csv --plot keys.svg\n\
                  Example: whippen measure instruments/hammond.whip --json -")]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// Measure every key of the keyboard, each with its own values
    #[arg(long, conflicts_with = "key")]
    keys: bool,
    /// Measure this key of the keyboard, such as C4
    #[arg(long, value_name = "NOTE", value_parser = keys::note)]
    key: Option<u8>,
    /// How far the key goes; otherwise 10 mm, or nine tenths of what is sensed where that is less
    #[arg(long, value_name = "LENGTH", value_parser = option::length)]
    dip: Option<f64>,
    /// How fast the slow press is; 5 mm/s otherwise
    #[arg(long, value_name = "SPEED", value_parser = option::speed)]
    speed: Option<f64>,
    /// What runs it: jit (compiled, fixed point), interp (the reference) or ideal (f64)
    #[arg(long, default_value = "jit")]
    engine: EngineKind,
    #[command(flatten)]
    settings: SettingArgs,
    #[arg(long, value_name = device::VALUE, value_hint = ValueHint::FilePath, help = device::HELP)]
    device: Option<OsString>,
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = option::rate, help = option::TICK_RATE)]
    tick_rate: Option<Rate>,
    /// Set beside what was measured on a real keyboard: a table with the columns key (1 is A0) and
    /// such as down_weight_g, up_weight_g
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    compare: Option<PathBuf>,
    /// The numbers as JSON, in a file or on stdout (-) instead of the text
    #[arg(long, value_name = "FILE|-", value_hint = ValueHint::FilePath)]
    json: Option<PathBuf>,
    /// Page: the numbers, and the slow press to explore
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Picture: force over travel of one key, or weights along the keys
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    plot: Vec<PathBuf>,
}

/// A key, and what was measured on it.
struct Key {
    /// Its MIDI number, if it is one of a keyboard.
    note: Option<u8>,
    compiled: Compiled,
    measured: Measured,
}

impl Key {
    /// Its name, if it has one.
    fn name(&self) -> Option<String> {
        self.note.map(note_name)
    }
}

/// All that was measured, and how.
struct Measurement<'a> {
    keys: Vec<Key>,
    protocol: Protocol,
    recorded: Option<&'a RecordedKeys>,
}

pub fn run(args: &Args) -> Outcome {
    let opened = Opened::words(&args.words)?;
    let read: Vec<PathBuf> = opened.paths().chain(&args.compare).cloned().collect();
    let json = args.json.iter().filter(|path| path.as_os_str() != "-");
    FilePlan::default()
        .reads(&read)
        .writes("--json", json, &["json"])
        .writes("--report", &args.report, &["html"])
        .writes("--plot", &args.plot, &["svg", "png"])
        .check()?;
    if args.engine.board().is_some() {
        return Err(Failure::Usage(
            "a board keeps no values from inside of ticks; use --engine jit, which is bit for bit the same".into(),
        ));
    }
    let recorded = args.compare.as_deref().map(RecordedKeys::load).transpose();
    let recorded = recorded.map_err(|e| Failure::Usage(e.to_string()))?;
    let options = Options {
        sets: args.settings.all(&opened)?,
        rate_hz: args.tick_rate,
        ..Options::default()
    };
    let (map, program) = load::checked(&opened.sources, &options, Severity::Warning)?;
    let models = models(args, &program, opened.name)?;
    let first = &models[0].1;
    let device = load::device(args.device.as_deref(), &map, &program, first)?;
    for note in device::unmeasured(&device, first) {
        tell!("note: {note}");
    }
    let protocol = protocol(args, first)?;
    let mut compiled = Vec::new();
    for (note, model) in models {
        // What is to be warned of is the same for all keys.
        let one = if compiled.is_empty() {
            load::compiled(&map, model, &device, true)
        } else {
            load::compiled_silently(&map, model, &device)
        };
        compiled.push((note, one?));
    }
    let all = Measurement {
        keys: measured(compiled, &device, &protocol)?,
        protocol,
        recorded: recorded.as_ref(),
    };
    write(args, &all, &device, &opened.sources, &options.sets)
}

/// The instruments of the keys that are measured, with their notes.
fn models(
    args: &Args,
    program: &Program,
    name: Option<&str>,
) -> Result<Vec<(Option<u8>, Model)>, Failure> {
    let notes = match (args.keys, program.keyboards.first()) {
        (false, _) => vec![args.key],
        (true, Some(keyboard)) => {
            let layout = &keyboard.layout;
            (layout.first_note..=layout.last_note()).map(Some).collect()
        }
        (true, None) => {
            let why = "--keys measures every key of a keyboard, and the program has none: all keys would be the same";
            return Err(Failure::Usage(why.into()));
        }
    };
    let one = |note: Option<u8>| {
        let model = load::one_key(program, name, note)?;
        if !model.is_of_key() || model.turns() {
            let why = "what is measured is a key that is pressed, with one port that slides";
            return Err(Failure::Usage(format!("`{}`: {why}", model.name)));
        }
        Ok((note, model))
    };
    notes.into_iter().map(one).collect()
}

fn protocol(args: &Args, model: &Model) -> Result<Protocol, Failure> {
    let usual = Protocol::of(model, args.engine);
    let dip_m = args.dip.unwrap_or(usual.dip_m);
    let sensed = model.senses.first().map_or(usual.dip_m, |s| s.range.high);
    if !(dip_m > 0.0 && dip_m <= sensed) {
        return Err(Failure::Usage(format!(
            "--dip: `{}` senses up to {:.3} mm, and a key goes down",
            model.name,
            1e3 * sensed
        )));
    }
    Ok(Protocol {
        dip_m,
        speed_m_per_s: args.speed.unwrap_or(SPEED_M_PER_S),
        ..usual
    })
}

/// Measures all keys, on all threads.
fn measured(
    compiled: Vec<(Option<u8>, Compiled)>,
    device: &Device,
    protocol: &Protocol,
) -> Result<Vec<Key>, Failure> {
    let progress = Mutex::new((Progress::of_things(compiled.len(), "keys"), 0));
    let one = |(note, compiled): (Option<u8>, Compiled)| {
        let measured = measure(&compiled, device, protocol);
        if let Ok(mut progress) = progress.lock() {
            progress.1 += 1;
            progress.0.at(progress.1);
        }
        Ok(Key {
            note,
            measured: measured.map_err(|why| stopped(protocol.engine, why))?,
            compiled,
        })
    };
    let keys = parallel::map(compiled, one);
    if let Ok(progress) = progress.lock() {
        progress.0.done();
    }
    keys.into_iter().collect()
}

fn write(
    args: &Args,
    all: &Measurement,
    device: &Device,
    sources: &[(String, String)],
    sets: &[(String, String)],
) -> Outcome {
    let on_stdout = args
        .json
        .as_ref()
        .is_some_and(|path| path.as_os_str() == "-");
    if !on_stdout {
        say::whole(&table::text(all));
    }
    let mut written = Vec::new();
    if let Some(path) = &args.json {
        let text = format!("{}\n", json::of(all));
        if on_stdout {
            say::whole(&text);
        } else {
            write_text(path, &text)?;
            written.push(("json", path));
        }
    }
    for path in &args.plot {
        let drawn = picture::map(all).save(path);
        drawn.map_err(|e| Failure::Usage(e.to_string()))?;
        written.push(("plot", path));
    }
    if let Some(path) = &args.report {
        let page = picture::page(all, device, sources, sets)?;
        page.save(path).map_err(|e| Failure::Usage(e.to_string()))?;
        written.push(("report", path));
    }
    if !on_stdout {
        written
            .iter()
            .for_each(|(what, path)| say!("{what}: {}", path.display()));
    }
    Ok(())
}
