//! `run --midi`: a whole keyboard plays a performance.

mod performance_report;
mod played_keyboard;
mod score;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use whippen_compiler::check::{Program, midi_number, note_name};
use whippen_compiler::model::Model;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::emulated::EmulatedBoard;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::Follower;
use whippen_runtime::keyboard::{
    Outcome as Notes, PlayedKeys, PlayingKey, Playtime, model_of_keys, play as play_keys,
    play_on_board,
};
use whippen_runtime::midi;
use whippen_runtime::report::{Made, Section, id};
use whippen_runtime::session;

use super::on_board::BoardArgs;
use super::progress::Progress;
use super::run::Outputs;
use super::{load, option, run};
use crate::exit::{Failure, Outcome};
use crate::say::say;
use performance_report::Performed;
use played_keyboard::PlayedKeyboard;
use score::{LATER_S, Score};

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
    #[arg(long, value_name = "N", requires = "midi", allow_negative_numbers = true, value_parser = option::threads)]
    threads: Option<u32>,
}

/// A note name, as programs write it.
pub fn note(text: &str) -> Result<u8, String> {
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
    /// What ends a performance with what was played.
    pub stop: Option<&'static AtomicBool>,
}

/// What the keys play, or the lowest ones if they do not all play the same.
pub fn first_instrument<'a>(
    program: &'a Program,
    name: Option<&'a str>,
    args: &'a KeysArgs,
) -> Result<&'a Model, Failure> {
    Ok(PlayedKeyboard::find(program, name, args)?.model(0))
}

/// Plays, tells, writes.
pub fn run(setup: &Setup, args: &KeysArgs, path: &Path) -> Outcome {
    let keyboard = PlayedKeyboard::find(setup.program, setup.name, args)?;
    only_keys(&keyboard)?;
    let keyboard = match setup.on_board.keys {
        Some(keys) => keyboard.with_keys(keys)?,
        None => keyboard,
    };
    let wanted = args.key.map(|key| traced_key(&keyboard, key)).transpose()?;
    let outputs = setup.outputs;
    if wanted.is_none() && (!outputs.out.is_empty() || !outputs.plot.is_empty()) {
        return Err(Failure::Usage(
            "--out and --plot show one key of a performance; name it, such as `--key C4`".into(),
        ));
    }
    let performance = midi::load(path).map_err(|e| Failure::Usage(e.to_string()))?;
    let mut score = Score::new(&performance, &keyboard, setup.seconds);
    score.check(path, &keyboard)?;
    performance_report::report_file(path, &performance, &score, &keyboard);
    check_instruments(setup, &keyboard)?;
    if let Some(on) = setup.engine.board() {
        keyboard.prove(setup, on)?;
    }
    let wanted_ticks = score.ticks;
    let PlayedKeys { logs, ticks } = play(setup, args, &keyboard, &score)?;
    score.end_at(ticks, keyboard.rate_hz());
    let strike = |key| keyboard.strike(key);
    let (notes, strokes) = (&score.notes, &score.strokes);
    let played = Notes::new(notes, &logs, strokes, strike, keyboard.rate_hz());
    performance_report::report_outcome(&keyboard, &played, &logs);
    if let Some(path) = &outputs.events {
        let written = performance_report::write_events(path, &keyboard, &logs, outputs.form());
        written.map_err(|e| Failure::Usage(e.to_string()))?;
        say!("events: {}", path.display());
    }
    if let Some(path) = &outputs.midi_out {
        let written = performance_report::write_notes(path, &keyboard, &logs, ticks);
        written.map_err(|e| Failure::Usage(e.to_string()))?;
        say!("notes: {}", path.display());
    }
    let traced = wanted
        .map(|index| trace_key(setup, &keyboard, &score, index))
        .transpose()?;
    let ended = || run::ended([ticks, wanted_ticks], keyboard.rate_hz());
    let Some(to) = &outputs.report else {
        return ended();
    };
    let performed = Performed {
        setup,
        keyboard: &keyboard,
        score: &score,
        played: &played,
        logs: &logs,
        performance: &performance,
    };
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let title = format!("{file} on {}", keyboard.program().name.replace('_', " "));
    let sections = std::iter::once(performed.section()).chain(traced);
    run::report(to, &title, sections.collect())?;
    ended()
}

/// What is wrong with an instrument is reported as for any run.
fn check_instruments(setup: &Setup, keyboard: &PlayedKeyboard) -> Outcome {
    for model in keyboard.models() {
        setup.device.fits(model).map_err(Failure::Usage)?;
        let compiled = load::compiled(setup.map, model.clone(), setup.device, false);
        drop(compiled?);
    }
    Ok(())
}

fn traced_key(keyboard: &PlayedKeyboard, key: u8) -> Result<usize, Failure> {
    let (first, last) = keyboard.ends();
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
) -> Result<PlayedKeys, Failure> {
    let duration = Playtime {
        ticks: score.ticks,
        stop: setup.stop,
    };
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
    let played = if let Some(on) = setup.engine.board() {
        on_board(setup, keyboard, on, score, duration, |ticks| {
            report(ticks * keys / keyboard.keys())
        })
    } else {
        play_keys(
            &keyboard.played(),
            setup.device,
            setup.engine,
            &score.keys,
            duration,
            threads,
            report,
        )
        .map_err(Failure::Defect)
    };
    if let Ok(progress) = progress.lock() {
        progress.0.done();
    }
    let played = played?;
    let played_s = played.ticks as f64 / f64::from(keyboard.rate_hz());
    let of = keyboard
        .name
        .map_or(String::new(), |name| format!("{name}, "));
    let (engine, factor) = (setup.engine, played_s / start.elapsed().as_secs_f64());
    say!(
        "{of}{}: {played_s:.2} s on engine {engine}, {threads} threads, {factor:.1}x real time",
        keyboard.program().name
    );
    Ok(played)
}

/// All keys of the keyboard on one keyboard, those that rest too.
fn on_board(
    setup: &Setup,
    keyboard: &PlayedKeyboard,
    on: EmulatedBoard,
    score: &Score,
    duration: Playtime,
    progress: impl Fn(usize),
) -> Result<PlayedKeys, Failure> {
    let playing = |index: usize| score.keys.iter().find(|key| key.index == index).cloned();
    let key = |index: usize| {
        playing(index).unwrap_or(PlayingKey {
            index,
            ..PlayingKey::default()
        })
    };
    let keys: Vec<PlayingKey> = (0..keyboard.keys()).map(key).collect();
    let (mut played, load) = play_on_board(
        &keyboard.played(),
        setup.device,
        on,
        &keys,
        duration,
        progress,
    )
    .map_err(|why| run::stopped_engine(setup.engine, why))?;
    run::report_load(&load, false);
    (played.logs).retain(|log| playing(log.index).is_some());
    Ok(played)
}

/// That every instrument of a performance is one of keys.
fn only_keys(keyboard: &PlayedKeyboard) -> Outcome {
    match keyboard.models().find(|model| !model.is_of_key()) {
        None => Ok(()),
        Some(model) => Err(Failure::Usage(format!(
            "a performance is played on keys, with a port each, and `{}` has other ones: play it with --motion",
            model.name
        ))),
    }
}

/// One key again, with everything recorded and written.
fn trace_key(
    setup: &Setup,
    keyboard: &PlayedKeyboard,
    score: &Score,
    index: usize,
) -> Result<Section, Failure> {
    let name = keyboard.key_name(index as u32);
    let model = model_of_keys(keyboard.model(index), &[index]);
    let (device, engine) = (setup.device, setup.engine);
    let compiled = load::compiled(setup.map, model, device, engine.board().is_none())?;
    // Events and notes are those of all keys, and the report has all sections.
    let outputs = Outputs {
        events: None,
        midi_out: None,
        ..setup.outputs.clone()
    };
    let columns = session::recorded(&compiled, device, engine, &[]);
    let recording = outputs.recording(columns, &compiled, engine)?;
    let playing = score.keys.iter().find(|key| key.index == index);
    let mut follower = Follower::new(playing.map_or(&[][..], |key| &key.moves));
    let rate_hz = f64::from(keyboard.rate_hz());
    let move_to = |tick: usize, places: &mut [f64]| places.fill(follower.at(tick as f64 / rate_hz));
    let motion = (score.ticks, move_to);
    let progress = Progress::new(score.ticks, keyboard.rate_hz());
    let at = |ticks| progress.at(ticks);
    let played = session::record(&compiled, device, engine, motion, recording, at)
        .map_err(|why| run::stopped(engine, why))?;
    progress.done();
    outputs.finish(&compiled, &played)?;
    let made = Made {
        engine,
        motion: &[format!("the strokes of {name} (synthetic)")],
        device,
        settings: setup.settings,
        sources: &[],
    };
    Ok(Section {
        id: format!("key-{}", id(&name)),
        title: format!("key {name}"),
        ..Section::of_run(&compiled, &played, &made)
    })
}
