//! `run --midi`: a whole keyboard plays a performance.

mod told;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use whippen_compiler::check::{self, Program, midi_number, note_name};
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::{Follower, Move};
use whippen_runtime::keyboard::{self, KeyLog, Outcome as Played, PlayingKey};
use whippen_runtime::midi::{self, Note, Performance};
use whippen_runtime::report::{Made, Section, id};
use whippen_runtime::session::{self, Run};
use whippen_runtime::stroke::{Stroke, strokes};

use super::motion::Positions;
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
    pub seconds: Option<f64>,
    /// The instrument that was named after the files.
    pub name: Option<&'a str>,
    pub outputs: &'a Outputs,
}

/// The keys there are, and what is on them.
struct Board<'a> {
    name: Option<&'a str>,
    /// The program that plays.
    program: &'a str,
    /// By rising key.
    parts: Vec<keyboard::Part<'a>>,
    first: u8,
    last: u8,
}

impl<'a> Board<'a> {
    fn of(
        program: &'a Program,
        name: Option<&'a str>,
        args: &'a KeysArgs,
    ) -> Result<Board<'a>, Failure> {
        let name = args.program.as_deref().or(name);
        let Some(keyboard) = program.keyboards.first() else {
            let model = load::instrument(program, name)?;
            let parts = vec![keyboard::Part { model, keys: 0..88 }];
            return Ok(Board {
                name: None,
                program: &model.name,
                parts,
                first: 21,
                last: 108,
            });
        };
        let listed = || {
            keyboard
                .programs
                .iter()
                .map(|p| p.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        let playable = match name {
            Some(name) => keyboard.program(name),
            None => keyboard.programs.first(),
        };
        let Some(playable) = playable else {
            let (name, board) = (name.unwrap_or_default(), &keyboard.name);
            return Err(Failure::Usage(format!(
                "`{name}` is no program of the keyboard `{board}`; its programs are: {}",
                listed()
            )));
        };
        let index = |key: u8| usize::from(key - keyboard.first_key);
        let part = |part: &check::Part| keyboard::Part {
            model: &program.instruments[part.instrument],
            keys: index(part.first_key)..index(part.last_key) + 1,
        };
        let parts = playable.parts.iter().map(part).collect();
        let (first, last) = (keyboard.first_key, keyboard.last_key);
        Ok(Board {
            name: Some(&keyboard.name),
            program: &playable.name,
            parts,
            first,
            last,
        })
    }

    /// How many keys it has.
    fn keys(&self) -> usize {
        usize::from(self.last - self.first) + 1
    }

    /// Key index of a MIDI number.
    fn index(&self, key: u8) -> Option<usize> {
        (self.first..=self.last)
            .contains(&key)
            .then(|| usize::from(key - self.first))
    }

    /// What a key plays, by its index.
    fn model(&self, index: usize) -> &'a Model {
        self.parts
            .iter()
            .find(|part| part.keys.contains(&index))
            .map_or(self.parts[0].model, |part| part.model)
    }

    /// Ticks per second.
    fn rate_hz(&self) -> u32 {
        self.parts[0].model.rate_hz
    }

    /// The event of a key that is a strike.
    fn strike(&self, index: usize) -> Option<usize> {
        self.model(index)
            .emissions
            .iter()
            .position(|e| e.name == "note")
    }
}

/// What the keys play, or the lowest ones if they do not all play the same.
pub fn first_instrument<'a>(
    program: &'a Program,
    name: Option<&'a str>,
    args: &'a KeysArgs,
) -> Result<&'a Model, Failure> {
    Ok(Board::of(program, name, args)?.parts[0].model)
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

fn score(performance: &Performance, board: &Board, seconds: Option<f64>) -> Score {
    let until_s = seconds.unwrap_or(f64::INFINITY);
    let wanted: Vec<Note> = performance
        .notes
        .iter()
        .filter(|n| n.on_s + LATER_S < until_s)
        .copied()
        .collect();
    let (mut keys, mut all) = (Vec::new(), Vec::new());
    for key in board.first..=board.last {
        let own: Vec<(usize, Note)> = wanted
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, n)| n.key == key)
            .collect();
        if !own.is_empty() {
            let (moves, made) = strokes(&own, LATER_S);
            keys.push(PlayingKey {
                index: usize::from(key - board.first),
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
        .filter(|n| board.index(n.key).is_none())
        .count();
    let ticks = (end_s * f64::from(board.rate_hz())).ceil() as usize;
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
    let board = Board::of(setup.program, setup.name, args)?;
    let wanted = args.key.map(|key| traced_key(&board, key)).transpose()?;
    let outputs = setup.outputs;
    if wanted.is_none() && (outputs.out.is_some() || !outputs.plot.is_empty()) {
        return Err(Failure::Usage(
            "--out and --plot show one key of a performance; name it, such as `--key C4`".into(),
        ));
    }
    let performance = midi::load(path).map_err(|e| Failure::Usage(e.to_string()))?;
    let score = score(&performance, &board, setup.seconds);
    if score.keys.is_empty() {
        let (first, last) = (note_name(board.first), note_name(board.last));
        return Err(Failure::Usage(format!(
            "{}: no note is on the keys {first} .. {last}",
            path.display()
        )));
    }
    if score.ticks as f64 > LONGEST_S * f64::from(board.rate_hz()) {
        return Err(Failure::Usage(format!(
            "{}: lasts more than six hours; play a part with --seconds",
            path.display()
        )));
    }
    told::performance(path, &performance, &score, &board);
    // What is wrong with the instrument is told as for any run.
    for (at, part) in board.parts.iter().enumerate() {
        if board.parts[..at]
            .iter()
            .all(|before| before.model.name != part.model.name)
        {
            setup.device.fits(part.model).map_err(Failure::Usage)?;
            drop(load::compiled(
                setup.map,
                part.model.clone(),
                setup.device,
                false,
            )?);
        }
    }
    let logs = play(setup, args, &board, &score)?;
    let rate_hz = board.rate_hz();
    let played = Played::new(
        &score.notes,
        &logs,
        &score.strokes,
        |key| board.strike(key),
        rate_hz,
    );
    told::outcome(&board, &played, &logs);
    if let Some(path) = &outputs.events {
        let names = |key: u32| note_name(board.first.saturating_add(key as u8));
        let trace = told::events(&board, &logs);
        trace
            .save_named_events(path, &names)
            .map_err(|e| Failure::Usage(e.to_string()))?;
        say!("events: {}", path.display());
    }
    let traced = wanted
        .map(|index| trace_key(setup, &board, &score, index))
        .transpose()?;
    if let Some(to) = &outputs.report {
        let file = path
            .file_name()
            .map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let title = format!("{file} on {}", board.program.replace('_', " "));
        let mut sections = vec![told::section(
            setup,
            &board,
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

fn traced_key(board: &Board, key: u8) -> Result<usize, Failure> {
    let (first, last) = (note_name(board.first), note_name(board.last));
    let wrong = || {
        Failure::Usage(format!(
            "the keyboard has the keys {first} .. {last}, and not {}",
            note_name(key)
        ))
    };
    board.index(key).ok_or_else(wrong)
}

/// All keys, with a progress bar.
fn play(
    setup: &Setup,
    args: &KeysArgs,
    board: &Board,
    score: &Score,
) -> Result<Vec<KeyLog>, Failure> {
    let threads = args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    );
    let keys = score.keys.len();
    let progress = Mutex::new((Progress::new(score.ticks, board.rate_hz()), 0_usize));
    let start = Instant::now();
    let tell = |key_ticks: usize| {
        if let Ok(mut progress) = progress.lock() {
            progress.1 += key_ticks;
            progress.0.at(progress.1 / keys);
        }
    };
    let logs = if let Some(kind) = setup.engine.board() {
        on_board(setup, board, kind, score, |ticks| {
            tell(ticks * keys / board.keys())
        })
    } else {
        keyboard::play(
            &board.parts,
            setup.device,
            setup.engine,
            &score.keys,
            score.ticks,
            threads,
            tell,
        )
        .map_err(Failure::Defect)
    };
    if let Ok(progress) = progress.lock() {
        progress.0.done();
    }
    let played_s = score.ticks as f64 / f64::from(board.rate_hz());
    let of = board.name.map_or(String::new(), |name| format!("{name}, "));
    let (engine, factor) = (setup.engine, played_s / start.elapsed().as_secs_f64());
    let logs = logs?;
    say!(
        "{of}{}: {played_s:.2} s on engine {engine}, {threads} threads, {factor:.1}x real time",
        board.program
    );
    Ok(logs)
}

/// All keys of the keyboard on one board, those that rest too.
fn on_board(
    setup: &Setup,
    board: &Board,
    kind: BoardKind,
    score: &Score,
    tell: impl Fn(usize),
) -> Result<Vec<KeyLog>, Failure> {
    let playing = |index: usize| score.keys.iter().find(|key| key.index == index).cloned();
    let key = |index: usize| {
        playing(index).unwrap_or(PlayingKey {
            index,
            ..PlayingKey::default()
        })
    };
    let keys: Vec<PlayingKey> = (0..board.keys()).map(key).collect();
    let (mut logs, load) =
        keyboard::play_on_board(&board.parts, setup.device, kind, &keys, score.ticks, tell)
            .map_err(|why| run::stopped(setup.engine, why))?;
    run::tell_load(&load);
    logs.retain(|log| playing(log.index).is_some());
    Ok(logs)
}

/// One key again, with everything recorded and written.
fn trace_key(
    setup: &Setup,
    board: &Board,
    score: &Score,
    index: usize,
) -> Result<Section, Failure> {
    let name = note_name(board.first + index as u8);
    let model = keyboard::model_of_keys(board.model(index), &[index]);
    let compiled = load::compiled(setup.map, model, setup.device, true)?;
    let rate_hz = f64::from(board.rate_hz());
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
