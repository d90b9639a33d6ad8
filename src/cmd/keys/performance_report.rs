//! The report of a performance: on the terminal, in the table of events, on the report page.

use std::path::Path;

use serde_json::{Value, json};
use whippen_compiler::check::note_name;
use whippen_compiler::keyboard::Zone;
use whippen_compiler::model::EmissionId;
use whippen_runtime::files::{FileError, write_whole};
use whippen_runtime::gesture::dip_m;
use whippen_runtime::keyboard::{KeyLog, Outcome, PlayedNote};
use whippen_runtime::midi::Performance;
use whippen_runtime::report::{Cell, Row, Section, Table, id};
use whippen_runtime::session::{argument_title, argument_titles};
use whippen_runtime::stroke::press_speed;
use whippen_runtime::struck::StruckNotes;
use whippen_runtime::trace::{Argument, EventRow, EventTable, Form};

use super::{LATER_S, PlayedKeyboard, Score, Setup};
use crate::say::say;

/// So many notes that did not strike are listed on the terminal.
const LISTED_MAX: usize = 10;

/// So many notes are listed in a table of the report.
const ROWS_MAX: usize = 200;

/// What the file holds.
pub fn report_file(
    path: &Path,
    performance: &Performance,
    score: &Score,
    keyboard: &PlayedKeyboard,
) {
    let keys = keyboard.keys();
    let (notes, playing) = (score.notes.len(), score.keys.len());
    say!(
        "midi: {}: {notes} notes on {playing} of {keys} keys, {:.1} s",
        path.display(),
        performance.end_s
    );
    performance
        .told
        .iter()
        .for_each(|told| say!("midi: {told}"));
    if let Some(outside) = score.outside(keyboard) {
        say!("midi: {outside}");
    }
}

/// Notes against strikes.
pub fn report_outcome(keyboard: &PlayedKeyboard, played: &Outcome, logs: &[KeyLog]) {
    let zones = &keyboard.program().zones;
    let silent: Vec<&Zone> = zones
        .iter()
        .filter(|zone| is_silent(keyboard, zone))
        .collect();
    for zone in &silent {
        say!(
            "  {} emits no `note`: strikes are not compared with notes",
            keyboard.played().model_of(zone).name
        );
    }
    if silent.len() == zones.len() {
        return;
    }
    say!("  {}", counted(played));
    if let Some(times) = latencies(played) {
        say!("  {times}");
    }
    let missed: Vec<&PlayedNote> = played.missed().collect();
    for note in missed.iter().take(LISTED_MAX) {
        let (name, velocity) = (note_name(note.note.key), note.note.velocity);
        say!(
            "    {:>10.4} s  {name:<4} velocity {velocity:>3}  {}",
            note.note.on_s + LATER_S,
            note.reason()
        );
    }
    if missed.len() > LISTED_MAX {
        say!("    and {} more", missed.len() - LISTED_MAX);
    }
    if !missed.is_empty() {
        say!(
            "  a key that goes down slowly does not throw its hammer: that is the instrument, not an error"
        );
    }
    let told = cut_off(keyboard.driven(), logs);
    told.iter().for_each(|told| say!("  {told}"));
}

/// Whether the keys of a zone never strike.
fn is_silent(keyboard: &PlayedKeyboard, zone: &Zone) -> bool {
    keyboard.strike(zone.keys.first as usize).is_none()
}

fn counted(played: &Outcome) -> String {
    let waited = played.notes.iter().filter(|n| n.waited()).count();
    let mut out = format!(
        "{} notes: {} struck, {} did not",
        played.notes.len(),
        played.matched(),
        played.missed().count()
    );
    let doubled = played.doubled().count();
    if played.usual > 1 {
        out += &format!("; {} strikes a note are usual here", played.usual);
    }
    if doubled > 0 {
        out += &format!("; {doubled} struck more often");
    }
    if waited > 0 {
        out += &format!("; {waited} went down late, as the key was not free before");
    }
    if played.stray > 0 {
        out += &format!("; {} strikes without a note", played.stray);
    }
    out
}

/// From note-on to strike: the middle, and where nine of ten are.
fn latencies(played: &Outcome) -> Option<String> {
    let mut all: Vec<f64> = played
        .notes
        .iter()
        .filter_map(|n| n.latency_s(LATER_S))
        .map(|s| s * 1e3)
        .collect();
    all.sort_by(f64::total_cmp);
    let part = |p: f64| {
        all.get(((all.len() - 1) as f64 * p).round() as usize)
            .copied()
    };
    let (low, middle, high) = if all.is_empty() {
        return None;
    } else {
        (part(0.05)?, part(0.5)?, part(0.95)?)
    };
    Some(format!(
        "note-on to strike: median {middle:.1} ms, nine of ten within {low:.1} .. {high:.1} ms"
    ))
}

/// What was cut off; `drives` is what the keys' drives give.
fn cut_off(drives: &str, logs: &[KeyLog]) -> Vec<String> {
    let sum = |of: fn(&KeyLog) -> usize| logs.iter().map(of).sum::<usize>();
    let all = [
        (
            sum(|l| l.events_lost),
            "events beyond those that are kept of a key, not written".to_string(),
        ),
        (
            sum(|l| l.drive_clipped),
            format!("key-ticks with more {drives} than the drive gives, clipped"),
        ),
        (
            sum(|l| l.sense_clamped),
            "key-ticks beyond the range the instrument senses".to_string(),
        ),
    ];
    all.into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect()
}

/// Writes the table of the events of all keys, with the keys' names.
pub fn write_events(
    path: &Path,
    keyboard: &PlayedKeyboard,
    logs: &[KeyLog],
    form: Form,
) -> Result<(), FileError> {
    write_whole(path, |file| {
        let mut table = EventTable::new(file, &arguments(keyboard, logs), true, form)?;
        for (tick, log, event) in by_time(logs) {
            let (model, key) = (keyboard.model(log.index), log.index as u32);
            let (_, emission, args) = &log.events[event];
            let emission = &model.emissions[EmissionId(*emission as u32)];
            let titles = emission.args.iter().map(argument_title);
            let row = EventRow {
                t_s: tick as f64 / f64::from(keyboard.rate_hz()),
                key,
                event: emission.name.clone(),
                args: titles.zip(args.iter().copied()).collect(),
            };
            table.row(&row, Some(&keyboard.key_name(key)))?;
        }
        table.into_inner().map(drop)
    })
}

/// Writes what was struck, as a MIDI file.
pub fn write_notes(
    path: &Path,
    keyboard: &PlayedKeyboard,
    logs: &[KeyLog],
    ticks: usize,
) -> Result<(), FileError> {
    let time_s = |tick: usize| tick as f64 / f64::from(keyboard.rate_hz());
    let mut struck = StruckNotes::default();
    for (tick, log, event) in by_time(logs) {
        let model = keyboard.model(log.index);
        let (_, emission, args) = &log.events[event];
        let name = &model.emissions[EmissionId(*emission as u32)].name;
        let note = keyboard.layout.note_of(log.index as u32);
        struck.event(time_s(tick), note, name, args);
    }
    struck.write(path, time_s(ticks))
}

/// The columns of the table: the arguments of all emissions of all keys.
fn arguments(keyboard: &PlayedKeyboard, logs: &[KeyLog]) -> Vec<Argument> {
    let of_key = |log: &KeyLog| {
        let titles = argument_titles(keyboard.model(log.index));
        let argument = |(title, step)| Argument { title, step };
        let all = titles.into_iter().zip(log.steps.clone());
        all.flat_map(|(titles, steps)| titles.into_iter().zip(steps))
            .map(argument)
            .collect::<Vec<_>>()
    };
    Argument::merged(logs.iter().flat_map(of_key))
}

/// All events by time, then key: tick, whose it is, and its number there. What one key did in one
/// tick stays in its order.
fn by_time(logs: &[KeyLog]) -> Vec<(usize, &KeyLog, usize)> {
    let of_key = |log| std::iter::repeat(log).zip(0..);
    let mut all: Vec<(usize, &KeyLog, usize)> = Vec::new();
    for log in logs {
        let events = log.events.iter().zip(of_key(log));
        all.extend(events.map(|((tick, ..), (log, number))| (*tick, log, number)));
    }
    all.sort_by_key(|(tick, log, _)| (*tick, log.index));
    all
}

/// A performance that was played, with what is told of it.
pub struct Performed<'a> {
    pub setup: &'a Setup<'a>,
    pub keyboard: &'a PlayedKeyboard<'a>,
    pub score: &'a Score,
    pub played: &'a Outcome,
    pub logs: &'a [KeyLog],
    pub performance: &'a Performance,
}

impl Performed<'_> {
    /// The section of a performance.
    pub fn section(&self) -> Section {
        let (keyboard, played) = (self.keyboard, self.played);
        let mut warnings = cut_off(keyboard.driven(), self.logs);
        warnings.extend(self.score.outside(keyboard));
        let name = keyboard.name.unwrap_or("keyboard");
        Section {
            id: id(name),
            title: name.replace('_', " "),
            doc: "Every note as a synthetic stroke of its key, and what the keys struck. A key that goes down slowly does not throw its \
                  hammer: such a note is missed by the instrument, not by the program."
                .into(),
            facts: self.facts(),
            warnings,
            data: vec![("keys", roll(keyboard, self.score, played))],
            tables: vec![worst(played), keys(keyboard, played, self.logs)],
            sources: self.setup.sources.to_vec(),
        }
    }

    /// What there is to know at a glance.
    fn facts(&self) -> Vec<(String, String)> {
        let (keyboard, score) = (self.keyboard, self.score);
        let rate_hz = f64::from(keyboard.rate_hz());
        let (played_s, keys) = (score.ticks as f64 / rate_hz, score.keys.len());
        let fact = |name: &str, value: String| (name.to_string(), value);
        let mut facts = vec![
            fact("notes", counted(self.played)),
            fact(
                "played",
                format!("{played_s:.2} s on {keys} keys at {rate_hz} Hz"),
            ),
            fact("program", keyboard.program().name.replace('_', " ")),
            fact("engine", self.setup.engine.to_string()),
            fact("strokes", strokes(keyboard)),
        ];
        if keyboard.program().is_split() {
            facts.push(fact("zones", zones(keyboard)));
        }
        facts.extend(latencies(self.played).map(|times| fact("timing", times)));
        let told = self.performance.told.iter();
        facts.extend(told.map(|told| fact("file", told.clone())));
        let settings = self.setup.settings.iter();
        facts.extend(settings.map(|(name, value)| fact("set", format!("{name} = {value}"))));
        facts
    }
}

/// How notes become strokes.
fn strokes(keyboard: &PlayedKeyboard) -> String {
    format!(
        "synthetic, dip {} mm; velocity 64 is {} m/s, 30 more are twice as fast",
        (dip_m(keyboard.model(0)) * 1e6).round() / 1e3,
        press_speed(64)
    )
}

/// What which keys play.
fn zones(keyboard: &PlayedKeyboard) -> String {
    let note = |key: u32| note_name(keyboard.layout.note_of(key));
    let zone = |zone: &Zone| {
        format!(
            "{} .. {}: {}",
            note(zone.keys.first),
            note(zone.keys.end - 1),
            keyboard.played().model_of(zone).name.replace('_', " ")
        )
    };
    let zones: Vec<String> = keyboard.program().zones.iter().map(zone).collect();
    zones.join(", ")
}

/// What the piano roll draws: per note key, on, off, velocity, strike, speed, strikes.
fn roll(keyboard: &PlayedKeyboard, score: &Score, played: &Outcome) -> Value {
    let short = |v: f64| (v * 1e5).round() / 1e5;
    let note = |n: &PlayedNote| {
        let (on, off) = (short(n.note.on_s + LATER_S), short(n.note.off_s + LATER_S));
        let first = n.strikes.first();
        let (at, speed) = (first.map(|s| short(s.t_s)), first.map(|s| short(s.speed)));
        json!([
            n.note.key,
            on,
            off,
            n.note.velocity,
            at,
            speed,
            n.strikes.len()
        ])
    };
    let end_s = score.ticks as f64 / f64::from(keyboard.rate_hz());
    json!({
        "first": keyboard.layout.first_note, "last": keyboard.layout.last_note(), "end": end_s, "usual": played.usual,
        "notes": played.notes.iter().map(note).collect::<Vec<_>>(),
    })
}

/// Notes that did not strike, then those that struck too often, then the latest and earliest.
fn worst(played: &Outcome) -> Table {
    let mut rows: Vec<(String, &PlayedNote)> = played.missed().map(|n| (n.reason(), n)).collect();
    let (missed, doubled) = (rows.len(), played.doubled().count());
    rows.extend(
        played
            .doubled()
            .map(|n| (format!("struck {} times", n.strikes.len()), n)),
    );
    let mut timed: Vec<&PlayedNote> = played
        .notes
        .iter()
        .filter(|n| !n.strikes.is_empty())
        .collect();
    let late = |n: &PlayedNote| n.latency_s(LATER_S).unwrap_or_default();
    timed.sort_by(|a, b| late(b).total_cmp(&late(a)));
    let why = |n: &PlayedNote| {
        if n.waited() {
            "late: the key was still down for the note before"
        } else {
            "among the latest"
        }
    };
    rows.extend(timed.iter().take(20).map(|n| (why(n).to_string(), *n)));
    let heads = [
        "time (s)",
        "key",
        "velocity",
        "note-on to strike (ms)",
        "speed (m/s)",
        "what",
    ];
    let note = format!(
        "{missed} did not strike, {doubled} struck more often than usual; then the latest of the others."
    );
    let note = if rows.len() > ROWS_MAX {
        format!("{note} The first {ROWS_MAX} of {} rows.", rows.len())
    } else {
        note
    };
    Table {
        title: "Worst notes".into(),
        note,
        heads: heads.map(String::from).to_vec(),
        rows: rows
            .into_iter()
            .take(ROWS_MAX)
            .map(|(what, n)| note_row(&what, n))
            .collect(),
    }
}

fn note_row(what: &str, n: &PlayedNote) -> Row {
    let on_s = n.note.on_s + LATER_S;
    let number = |value: Option<f64>, digits: usize| {
        value.map_or(Cell::text(""), |v| {
            Cell::number(v, format!("{v:.digits$}").replace('-', "−"))
        })
    };
    let cells = vec![
        Cell::number(on_s, format!("{on_s:.4}")),
        Cell::number(f64::from(n.note.key), note_name(n.note.key)),
        number(Some(f64::from(n.note.velocity)), 0),
        number(n.latency_s(LATER_S).map(|s| s * 1e3), 2),
        number(n.strikes.first().map(|s| s.speed), 3),
        Cell::text(what),
    ];
    Row {
        cells,
        at_s: Some(on_s),
        ..Row::default()
    }
}

/// One row per key that played.
fn keys(keyboard: &PlayedKeyboard, played: &Outcome, logs: &[KeyLog]) -> Table {
    let greatest = match keyboard.driven() {
        "torque" => "greatest torque (N*m)",
        _ => "greatest force (N)",
    };
    let heads = [
        "key",
        "notes",
        "struck",
        "did not",
        "fastest strike (m/s)",
        greatest,
        "at (s)",
        "drive clipped (ticks)",
    ];
    let rate_hz = f64::from(keyboard.rate_hz());
    let row = |log: &KeyLog| {
        let key = keyboard.layout.note_of(log.index as u32);
        let own = || played.notes.iter().filter(move |n| n.note.key == key);
        let struck = own().filter(|n| !n.strikes.is_empty()).count();
        let fastest = own()
            .flat_map(|n| &n.strikes)
            .map(|s| s.speed)
            .fold(0.0, f64::max);
        let count = |n: usize| Cell::number(n as f64, n.to_string());
        let (peak_n, at_s) = (log.peak.0, log.peak.1 as f64 / rate_hz);
        let cells = vec![
            Cell::number(f64::from(key), note_name(key)),
            count(own().count()),
            count(struck),
            count(own().count() - struck),
            Cell::number(fastest, format!("{fastest:.3}")),
            Cell::number(peak_n, format!("{peak_n:.3}").replace('-', "−")),
            Cell::number(at_s, format!("{at_s:.4}")),
            count(log.drive_clipped),
        ];
        Row {
            cells,
            at_s: Some(at_s),
            ..Row::default()
        }
    };
    Table {
        title: "Keys".into(),
        note: "Keys that have no note are at rest and are not run.".into(),
        heads: heads.map(String::from).to_vec(),
        rows: logs.iter().map(row).collect(),
    }
}
