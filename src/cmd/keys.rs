//! `run --midi`: a whole keyboard plays a performance.

mod performance_report;
mod played_keyboard;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use whippen_compiler::check::{Program, midi_number, note_name};
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::EmulatedBoard;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::{Follower, Move};
use whippen_runtime::keyboard::{
    KeyLog, Outcome as Played, PlayingKey, model_of_keys, play as play_keys, play_on_board,
};
use whippen_runtime::midi::{self, Note, Performance};
use whippen_runtime::report::{Made, Section, id};
use whippen_runtime::session::{self, Run};
use whippen_runtime::stroke::{Stroke, strokes};

use self::played_keyboard::PlayedKeyboard;
use super::motion::Positions;
use super::on_board::BoardArgs;
use super::progress::Progress;
use super::run::Outputs;
use super::{load, run};
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// The performance begins after this much rest (s): softest strokes begin before their notes.
const LATER_S: f64 = 0.5;

/// After the last note it goes on for this long (s).
const AFTER_S: f64 = 1.0;

/// The longest that is played (s): the clock of a run has 30 bits of ticks.
const LONGEST_S: f64 = 6.0 * 3600.0;

/// A trace of one key is at most so long (s).
const TRACED_S: f64 = 60.0;

/// Which keys play what.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "A whole keyboard")]
pub struct KeysArgs {
    /// A performance: every note is a synthetic stroke of its key, all keys run
    #[arg(long, value_name = "FILE.mid", conflicts_with_all = ["motion", "errors"])]
    pub midi: Option<PathBuf>,
    /// The program of the keyboard that plays, an instrument or zones; otherwise its first
    #[arg(long, value_name = "PROGRAM", requires = "midi")]
    program: Option<String>,
    /// Record everything about this key, such as C4: for --out, --plot and --report; without --midi
    /// the key that is played
    #[arg(long, value_name = "NOTE", value_parser = note)]
    pub key: Option<u8>,
    /// So many threads compute; the outcome is the same with any number. Without it, one per
    /// processor
    #[arg(long, value_name = "N", requires = "midi", value_parser = clap::value_parser!(u32).range(1..=256))]
    threads: Option<u32>,
}

/// A note name, as programs write it.
fn note(text: &str) -> Result<u8, String> {
    midi_number(text)
        .ok_or_else(|| "a note is a letter and an octave, such as C4, F#3 or Bb5".to_string())
}

/// What is common to all ways of running.
pub struct Setup<'a> {
    pub map: &'a SourceMap,
    pub program: &'a Program,
    pub sources: &'a [(String, String)],
    pub settings: &'a [(String, String)],
    pub device: &'a Device,
    pub engine: EngineKind,
    pub on_board: &'a BoardArgs,
    pub seconds: Option<f64>,
    /// The instrument that was named after the files.
    pub name: Option<&'a str>,
    pub outputs: &'a Outputs,
}

/// What the keys play, or the lowest ones if they do not all play the same.
pub fn first_instrument<'a>(
    program: &'a Program,
    name: Option<&'a str>,
    args: &'a KeysArgs,
) -> Result<&'a Model, Failure> {
    Ok(PlayedKeyboard::find(program, name, args)?.model(0))
}

/// A performance laid out on a keyboard.
struct Score {
    notes: Vec<Note>,
    keys: Vec<PlayingKey>,
    strokes: Vec<Vec<Stroke>>,
    /// Notes for which the keyboard has no key.
    outside: usize,
    ticks: usize,
}

fn score(performance: &Performance, keyboard: &PlayedKeyboard, seconds: Option<f64>) -> Score {
    let until_s = seconds.unwrap_or(f64::INFINITY);
    let wanted: Vec<Note> = performance
        .notes
        .iter()
        .filter(|n| n.on_s + LATER_S < until_s)
        .copied()
        .collect();
    let (mut keys, mut all) = (Vec::new(), Vec::new());
    for key in keyboard.layout.first_note..=keyboard.layout.last_note() {
        let own: Vec<(usize, Note)> = wanted
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, n)| n.key == key)
            .collect();
        if !own.is_empty() {
            let (moves, made) = strokes(&own, LATER_S);
            keys.push(PlayingKey {
                index: usize::from(key - keyboard.layout.first_note),
                moves,
            });
            all.push(made);
        }
    }
    let end = |m: &Move| m.start_s + m.duration_s + AFTER_S;
    let end_s = keys
        .iter()
        .flat_map(|k| &k.moves)
        .map(end)
        .fold(0.0, f64::max)
        .min(until_s);
    let outside = wanted
        .iter()
        .filter(|n| keyboard.layout.key_of_note(n.key).is_none())
        .count();
    let ticks = (end_s * f64::from(keyboard.rate_hz())).ceil() as usize;
    Score {
        notes: wanted,
        keys,
        strokes: all,
        outside,
        ticks,
    }
}

/// Plays, tells, writes.
pub fn run(setup: &Setup, args: &KeysArgs, path: &Path) -> Outcome {
    let keyboard = PlayedKeyboard::find(setup.program, setup.name, args)?;
    let keyboard = match setup.on_board.keys {
        Some(keys) => keyboard.with_keys(keys)?,
        None => keyboard,
    };
    let wanted = args.key.map(|key| traced_key(&keyboard, key)).transpose()?;
    let outputs = setup.outputs;
    if wanted.is_none() && (outputs.out.is_some() || !outputs.plot.is_empty()) {
        return Err(Failure::Usage(
            "--out and --plot show one key of a performance; name it, such as `--key C4`".into(),
        ));
    }
    let performance = midi::load(path).map_err(|e| Failure::Usage(e.to_string()))?;
    let score = score(&performance, &keyboard, setup.seconds);
    if score.keys.is_empty() {
        let (first, last) = (
            note_name(keyboard.layout.first_note),
            note_name(keyboard.layout.last_note()),
        );
        return Err(Failure::Usage(format!(
            "{}: no note is on the keys {first} .. {last}",
            path.display()
        )));
    }
    if score.ticks as f64 > LONGEST_S * f64::from(keyboard.rate_hz()) {
        return Err(Failure::Usage(format!(
            "{}: lasts more than six hours; play a part with --seconds",
            path.display()
        )));
    }
    performance_report::report_file(path, &performance, &score, &keyboard);
    // What is wrong with an instrument is reported as for any run.
    for model in keyboard.models() {
        setup.device.fits(model).map_err(Failure::Usage)?;
        drop(load::compiled(
            setup.map,
            model.clone(),
            setup.device,
            false,
        )?);
    }
    if let Some(on) = setup.engine.board() {
        keyboard.prove(setup, on)?;
    }
    let logs = play(setup, args, &keyboard, &score)?;
    let rate_hz = keyboard.rate_hz();
    let played = Played::new(
        &score.notes,
        &logs,
        &score.strokes,
        |key| keyboard.strike(key),
        rate_hz,
    );
    performance_report::report_outcome(&keyboard, &played, &logs);
    if let Some(path) = &outputs.events {
        let names = |key: u32| note_name(keyboard.layout.note_of(key));
        let trace = performance_report::events(&keyboard, &logs);
        trace
            .save_named_events(path, &names)
            .map_err(|e| Failure::Usage(e.to_string()))?;
        say!("events: {}", path.display());
    }
    let traced = wanted
        .map(|index| trace_key(setup, &keyboard, &score, index))
        .transpose()?;
    if let Some(to) = &outputs.report {
        let file = path
            .file_name()
            .map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let title = format!("{file} on {}", keyboard.program().name.replace('_', " "));
        let mut sections = vec![performance_report::section(
            setup,
            &keyboard,
            &score,
            &played,
            &logs,
            &performance,
        )];
        sections.extend(traced);
        run::report(to, &title, sections)?;
    }
    Ok(())
}

fn traced_key(keyboard: &PlayedKeyboard, key: u8) -> Result<usize, Failure> {
    let (first, last) = (
        note_name(keyboard.layout.first_note),
        note_name(keyboard.layout.last_note()),
    );
    let wrong = || {
        Failure::Usage(format!(
            "the keyboard has the keys {first} .. {last}, and not {}",
            note_name(key)
        ))
    };
    let key = keyboard.layout.key_of_note(key).ok_or_else(wrong)?;
    Ok(key as usize)
}

/// All keys, with a progress bar.
fn play(
    setup: &Setup,
    args: &KeysArgs,
    keyboard: &PlayedKeyboard,
    score: &Score,
) -> Result<Vec<KeyLog>, Failure> {
    let threads = args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let keys = score.keys.len();
    let progress = Mutex::new((Progress::new(score.ticks, keyboard.rate_hz()), 0_usize));
    let start = Instant::now();
    let report = |key_ticks: usize| {
        if let Ok(mut progress) = progress.lock() {
            progress.1 += key_ticks;
            progress.0.at(progress.1 / keys);
        }
    };
    let logs = if let Some(on) = setup.engine.board() {
        on_board(setup, keyboard, on, score, |ticks| {
            report(ticks * keys / keyboard.keys())
        })
    } else {
        play_keys(
            &keyboard.played(),
            setup.device,
            setup.engine,
            &score.keys,
            score.ticks,
            threads,
            report,
        )
        .map_err(Failure::Defect)
    };
    if let Ok(progress) = progress.lock() {
        progress.0.done();
    }
    let played_s = score.ticks as f64 / f64::from(keyboard.rate_hz());
    let of = keyboard
        .name
        .map_or(String::new(), |name| format!("{name}, "));
    let (engine, factor) = (setup.engine, played_s / start.elapsed().as_secs_f64());
    let logs = logs?;
    say!(
        "{of}{}: {played_s:.2} s on engine {engine}, {threads} threads, {factor:.1}x real time",
        keyboard.program().name
    );
    Ok(logs)
}

/// All keys of the keyboard on one keyboard, those that rest too.
fn on_board(
    setup: &Setup,
    keyboard: &PlayedKeyboard,
    on: EmulatedBoard,
    score: &Score,
    progress: impl Fn(usize),
) -> Result<Vec<KeyLog>, Failure> {
    let playing = |index: usize| score.keys.iter().find(|key| key.index == index).cloned();
    let key = |index: usize| {
        playing(index).unwrap_or(PlayingKey {
            index,
            ..PlayingKey::default()
        })
    };
    let keys: Vec<PlayingKey> = (0..keyboard.keys()).map(key).collect();
    let (mut logs, load) = play_on_board(
        &keyboard.played(),
        setup.device,
        on,
        &keys,
        score.ticks,
        progress,
    )
    .map_err(|why| run::stopped(setup.engine, why))?;
    run::report_load(&load);
    logs.retain(|log| playing(log.index).is_some());
    Ok(logs)
}

/// One key again, with everything recorded and written.
fn trace_key(
    setup: &Setup,
    keyboard: &PlayedKeyboard,
    score: &Score,
    index: usize,
) -> Result<Section, Failure> {
    let name = note_name(keyboard.layout.note_of(index as u32));
    let model = model_of_keys(keyboard.model(index), &[index]);
    let compiled = load::compiled(setup.map, model, setup.device, true)?;
    let rate_hz = f64::from(keyboard.rate_hz());
    let moves = score
        .keys
        .iter()
        .find(|key| key.index == index)
        .map_or(&[][..], |key| &key.moves);
    let mut follower = Follower::new(moves);
    let ticks = score.ticks.min((TRACED_S * rate_hz) as usize);
    let position_m = (0..ticks)
        .map(|tick| follower.at(tick as f64 / rate_hz))
        .collect();
    let mut notes = vec![format!("the strokes of {name} (synthetic)")];
    if ticks < score.ticks {
        notes.push(format!(
            "the first {TRACED_S} s of {:.1} s",
            score.ticks as f64 / rate_hz
        ));
    }
    let positions = Positions { position_m, notes };
    let played = traced(setup, &compiled, &positions)?;
    let made = Made {
        engine: setup.engine,
        motion: &positions.notes,
        device: setup.device,
        settings: setup.settings,
        sources: &[],
    };
    let section = Section::of_run(&compiled, &played, &made);
    Ok(Section {
        id: format!("key-{}", id(&name)),
        title: format!("key {name}"),
        ..section
    })
}

fn traced(setup: &Setup, compiled: &Compiled, positions: &Positions) -> Result<Run, Failure> {
    let progress = Progress::new(positions.position_m.len(), compiled.model.rate_hz);
    let at = |ticks| progress.at(ticks);
    let played = session::run(
        compiled,
        setup.device,
        setup.engine,
        &positions.position_m,
        at,
    )
    .map_err(|why| run::stopped(setup.engine, why))?;
    progress.done();
    let outputs = setup.outputs;
    // The events are those of all keys, and the report has all sections.
    let own = Outputs {
        events: None,
        report: None,
        plot: outputs.plot.clone(),
        out: outputs.out.clone(),
        ..*outputs
    };
    for (what, path) in run::write_files(&own, compiled, &played)? {
        say!("{what}: {}", path.display());
    }
    Ok(played)
}
