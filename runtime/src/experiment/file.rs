//! Reading of an experiment's file.

use std::path::Path;

use toml::de::DeTable;
use whippen_compiler::units::Dim;

use super::claims::{self, Claim};
use super::columns::MEASURED;
use super::steps::{LONGEST_S, Moment, Way};
use crate::fields::{Fields, FileText, Written, quantity};
use crate::files::FileError;

/// An experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// What it is called: the name of its file.
    pub name: String,
    /// Heading.
    pub title: String,
    /// Where it comes from; may be empty.
    pub source: String,
    /// Sentences about it; may be empty.
    pub doc: String,
    /// What is played, all by the same player.
    pub instruments: Vec<Instrument>,
    /// The device, by name or file; the usual one otherwise.
    pub device: Option<String>,
    /// Who plays.
    pub mover: Mover,
    /// The recording whose motion is played, instead of steps.
    pub repeated: Option<Repeated>,
    pub(super) way: Way,
    pub(super) way_line: u64,
    pub(super) instants: Vec<NamedInstant>,
    pub(super) plotted: Plotted,
    pub(super) claims: Vec<Claim>,
    pub(super) path: std::path::PathBuf,
}

/// An instrument that is played.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// What its columns and events are preceded by; empty for the only one.
    pub name: String,
    /// A bundled program by name, or a file ending in `.whip`.
    pub program: String,
    /// The instrument of the program, where it has several.
    pub instrument: Option<String>,
    /// The key of a keyboard that is played.
    pub key: Option<String>,
    /// Parameters and their values.
    pub sets: Vec<(String, String)>,
    /// The earlier one, by its place, whose hand's force pushes the free key of this one.
    pub pushed_by: Option<usize>,
}

/// A stretch of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeated {
    /// The file that describes the recording.
    pub description: String,
    /// From when to when (s).
    pub between_s: (f64, f64),
}

/// Who plays.
#[derive(Debug, Clone, PartialEq)]
pub enum Mover {
    /// The key is where the motion says.
    Motion,
    /// A hand (mass, damping, stiffness) leads the key of the device along the motion.
    Hand(String),
    /// The way is a force on the free key.
    Force,
}

/// An instant with a name, and what it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NamedInstant {
    pub name: String,
    pub when: Written,
    /// It is looked for from there on: from the instant before it, if nothing else is said.
    pub after: Option<Moment>,
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Plotted {
    pub travel: Option<Written>,
    pub total: Option<Written>,
    pub forces: Vec<Written>,
    pub lines: Vec<Written>,
    pub states: Vec<Written>,
    /// Places on the way of the key with their names: `theta_1`.
    pub places: Vec<(String, Written)>,
}

const TOP: [&str; 14] = [
    "title",
    "source",
    "doc",
    "program",
    "instrument",
    "key",
    "set",
    "run",
    "device",
    "player",
    "when",
    "plot",
    "place",
    "assert",
];

impl Experiment {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// What is wrong with it, and in which line.
    pub fn read(path: &Path, text: &str) -> Result<Experiment, FileError> {
        let source = FileText { path, text };
        let table = DeTable::parse(text).map_err(|e| {
            let line = e.span().map_or(1, |span| source.line(span.start));
            source.error(line, e.message())
        })?;
        let top = Fields::new(source, table.get_ref(), 1, "an experiment", &TOP)?;
        let optional = |key| Ok::<_, FileError>(top.find(key)?.map_or(String::new(), |w| w.text));
        let instants = instants(&top)?;
        let names: Vec<String> = instants.iter().map(|i| i.name.clone()).collect();
        let played = player(&top)?;
        let known = claims::known();
        let asserts = top.tables("assert", "[[assert]]", &known)?;
        if asserts.is_empty() {
            let what = "an experiment asserts something: add [[assert]] tables, which can fail";
            return Err(source.error(1, what));
        }
        let claims = asserts.iter().map(|fields| Claim::read(fields, &names));
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        Ok(Experiment {
            name: stem.unwrap_or("experiment").to_string(),
            title: top.text("title", "A full key dip and release")?.text,
            source: optional("source")?,
            doc: optional("doc")?.trim().replace('\n', " "),
            instruments: instruments(&top, &played)?,
            device: top.find("device")?.map(|device| device.text),
            mover: played.mover,
            repeated: played.repeated,
            way: played.way,
            way_line: played.way_line,
            plotted: plotted(&top)?,
            claims: claims.collect::<Result<_, _>>()?,
            path: path.to_path_buf(),
            instants,
        })
    }

    pub(super) fn error(&self, line: u64, what: impl Into<String>) -> FileError {
        FileError::new(&self.path, what).at_line(line)
    }
}

/// Either one instrument at the top, or several `[[run]]`.
fn instruments(top: &Fields, played: &Playing) -> Result<Vec<Instrument>, FileError> {
    const KEYS: [&str; 5] = ["name", "program", "instrument", "key", "set"];
    const RUN: [&str; 6] = ["name", "program", "instrument", "key", "set", "pushed_by"];
    let runs = top.tables("run", "[[run]]", &RUN)?;
    if runs.is_empty() {
        if played.repeated.is_some() {
            let what = "what was recorded is called `measured.`, so each program stands in a [[run]] with a name";
            return Err(top.source.error(played.way_line, what));
        }
        return Ok(vec![instrument(top, String::new(), None)?]);
    }
    if let Some(key) = KEYS[1..].iter().find(|key| top.has(key)) {
        return Err(top.error(key, "stands in each [[run]] where there are some"));
    }
    let mut all: Vec<Instrument> = Vec::new();
    for fields in &runs {
        let name = fields.text("name", "grand")?;
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.text.is_empty() || !name.text.chars().all(is_word) {
            return Err(fields.error("name", "is made of letters, digits and `_`"));
        }
        if all.iter().any(|one| one.name == name.text) {
            return Err(fields.error("name", "is that of an earlier [[run]]"));
        }
        if played.repeated.is_some() && name.text == MEASURED {
            return Err(fields.error("name", "is what the recording is called"));
        }
        let pushed_by = pushed_by(fields, &all, &played.mover)?;
        all.push(instrument(fields, name.text, pushed_by)?);
    }
    Ok(all)
}

/// The place of the run whose hand pushes this one's key.
fn pushed_by(
    fields: &Fields,
    earlier: &[Instrument],
    mover: &Mover,
) -> Result<Option<usize>, FileError> {
    let Some(by) = fields.find("pushed_by")? else {
        return Ok(None);
    };
    if !matches!(mover, Mover::Hand(_)) {
        let what = "is a run that a hand leads: give the [player] a `hand`";
        return Err(fields.error("pushed_by", what));
    }
    let is_led = |one: &Instrument| one.name == by.text && one.pushed_by.is_none();
    let place = earlier.iter().position(is_led);
    let place = place.ok_or_else(|| {
        fields.error(
            "pushed_by",
            "is the name of an earlier [[run]] that the hand leads",
        )
    });
    place.map(Some)
}

fn instrument(
    fields: &Fields,
    name: String,
    pushed_by: Option<usize>,
) -> Result<Instrument, FileError> {
    let text = |written: Option<Written>| written.map(|w| w.text);
    let sets = fields.pairs("set", "[set]")?;
    Ok(Instrument {
        name,
        program: fields.text("program", "grand-piano")?.text,
        instrument: text(fields.find("instrument")?),
        key: text(fields.find("key")?),
        sets: sets
            .into_iter()
            .map(|(name, value)| (name, value.text))
            .collect(),
        pushed_by,
    })
}

/// What `[player]` says.
struct Playing {
    mover: Mover,
    repeated: Option<Repeated>,
    way: Way,
    way_line: u64,
}

fn player(top: &Fields) -> Result<Playing, FileError> {
    const KEYS: [&str; 6] = ["motion", "force", "recording", "from", "to", "hand"];
    let Some(player) = top.table("player", "[player]", &KEYS)? else {
        let what = "an experiment has a [player], such as motion = [\"wait 100 ms\", \"to 10 mm in 60 ms\"]";
        return Err(top.source.error(1, what));
    };
    let given = KEYS[..3].iter().filter(|key| player.has(key));
    let given: Vec<&str> = given.copied().collect();
    if let [first, second, ..] = given[..] {
        let what = format!("and `{first}` contradict each other: a player has one");
        return Err(player.error(second, &what));
    }
    let key = given.first().copied().unwrap_or("motion");
    let hand = player.find("hand")?;
    let mover = match (key, hand) {
        ("force", Some(_)) => {
            let what = "leads along a `motion`; a `force` acts on the free key";
            return Err(player.error("hand", what));
        }
        ("force", None) => Mover::Force,
        (_, Some(hand)) => Mover::Hand(hand.text.replace(", ", ",")),
        (_, None) => Mover::Motion,
    };
    if key == "recording" {
        return repeated(&player, mover);
    }
    if let Some(key) = KEYS[3..5].iter().find(|key| player.has(key)) {
        return Err(player.error(key, "is of a `recording`"));
    }
    let steps = player.list(key)?;
    if steps.is_empty() {
        let what = "[player] needs a `motion` or a `force`, a list of steps, or a `recording`";
        return Err(player.source.error(player.line, what));
    }
    let way = Way::read(steps.iter().map(|step| step.text.as_str()))
        .map_err(|(number, why)| player.source.error(steps[number].line, why))?;
    Ok(Playing {
        mover,
        repeated: None,
        way,
        way_line: steps[0].line,
    })
}

/// A player that repeats a stretch of a recording.
fn repeated(player: &Fields, mover: Mover) -> Result<Playing, FileError> {
    let description = player.text("recording", "kawai.toml")?;
    if !description.text.ends_with(".toml") {
        let what = "is a file that describes a recording, such as \"kawai.toml\"";
        return Err(player.error("recording", what));
    }
    let time = |key: &'static str| {
        let time = player.quantity(key, Dim::TIME, "24.6 s")?;
        time.ok_or_else(|| player.error(key, "of a recording is a time, such as \"24.6 s\""))
    };
    let between_s = (time("from")?, time("to")?);
    if between_s.1 - between_s.0 > LONGEST_S {
        return Err(player.error("to", &format!("is more than {LONGEST_S} s after `from`")));
    }
    let nothing = Way::read(std::iter::empty());
    Ok(Playing {
        mover,
        repeated: Some(Repeated {
            description: description.text,
            between_s,
        }),
        way: nothing.expect("no steps are fine"),
        way_line: description.line,
    })
}

/// Instants are named one after the other; each is looked for behind the one before.
fn instants(top: &Fields) -> Result<Vec<NamedInstant>, FileError> {
    let mut names: Vec<String> = Vec::new();
    let mut all: Vec<NamedInstant> = Vec::new();
    for fields in top.tables("when", "[[when]]", &["name", "is", "after"])? {
        let name = fields.text("name", "t1")?.text;
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(is_word) {
            return Err(fields.error(
                "name",
                "is a letter, with letters, digits and `_` behind it",
            ));
        }
        if names.contains(&name) {
            return Err(fields.error("name", "is that of an earlier instant"));
        }
        let after = match fields.find("after")? {
            Some(after) => Some(
                Moment::read(&after.text, &names)
                    .map_err(|why| fields.source.error(after.line, why))?,
            ),
            None => names.len().checked_sub(1).map(|before| Moment {
                named: Some(before),
                offset_s: 0.0,
                text: names[before].clone(),
            }),
        };
        let when = fields.text("is", "x above 1 mm")?;
        names.push(name.clone());
        all.push(NamedInstant { name, when, after });
    }
    Ok(all)
}

fn plotted(top: &Fields) -> Result<Plotted, FileError> {
    const KEYS: [&str; 5] = ["travel", "total", "forces", "lines", "states"];
    let places = top.pairs("place", "[place]")?;
    for (_, at) in &places {
        quantity(&at.text).map_err(|why| top.source.error(at.line, why))?;
    }
    let Some(plot) = top.table("plot", "[plot]", &KEYS)? else {
        let what = "an experiment has a [plot], such as travel = \"x\", total = \"force\"";
        return Err(top.source.error(1, what));
    };
    Ok(Plotted {
        travel: plot.find("travel")?,
        total: plot.find("total")?,
        forces: plot.list("forces")?,
        lines: plot.list("lines")?,
        states: plot.list("states")?,
        places,
    })
}
