//! What a sweep measures at each point.

use std::str::FromStr;

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture;
use whippen_runtime::measure::{DEFINITIONS, Definition, Protocol, measure as measure_key};
use whippen_runtime::session::{self, Keep, Recorded, Recording, Run};

/// A number of a run of the bundled gesture: its name, its unit as titles write it, and how it is
/// read.
type OfRun = (&'static str, &'static str, fn(&Run) -> Option<f64>);

const OF_RUN: [OfRun; 6] = [
    ("strikes", "", |run| Some(run.happenings.strikes as f64)),
    ("events", "", |run| Some(run.happenings.events as f64)),
    ("greatest_force", "n", greatest_force),
    ("drive_clipped", "ticks", |run| {
        Some(run.counts.drive_clipped as f64)
    }),
    ("slips_per_period", "", |run| {
        run.frictions.first()?.second_half.slips_per_period()
    }),
    ("stick_share", "", |run| {
        run.frictions.first()?.second_half.stick_share()
    }),
];

/// Numbers that were measured, and values of the program; none where there is none.
pub type Measured = (Vec<Option<f64>>, Vec<Option<f64>>);

/// A number that is wanted.
#[derive(Debug, Clone, Copy)]
pub enum SweptNumber {
    /// As `whippen measure` finds it.
    Measured(Definition),
    /// Of a run.
    Run(&'static OfRun),
}

impl FromStr for SweptNumber {
    type Err = String;

    fn from_str(text: &str) -> Result<SweptNumber, String> {
        let measured = DEFINITIONS.iter().find(|d| d.name == text);
        let run = OF_RUN.iter().find(|r| r.0 == text);
        let found = measured.map(|d| SweptNumber::Measured(*d));
        found.or(run.map(SweptNumber::Run)).ok_or_else(|| {
            let names = DEFINITIONS.iter().map(|d| d.name);
            let names = names.chain(OF_RUN.iter().map(|r| r.0));
            let names: Vec<&str> = names.collect();
            format!("measured are {}", names.join(", "))
        })
    }
}

impl SweptNumber {
    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            SweptNumber::Measured(definition) => definition.name,
            SweptNumber::Run(run) => run.0,
        }
    }

    /// Its name with the unit last.
    pub fn title(&self) -> String {
        match self {
            SweptNumber::Measured(definition) => definition.title(),
            SweptNumber::Run((name, "", _)) => (*name).to_string(),
            SweptNumber::Run((name, unit, _)) => format!("{name}_{unit}"),
        }
    }

    /// Whether it is of a key that is pressed.
    pub fn is_of_key(&self) -> bool {
        matches!(self, SweptNumber::Measured(_))
    }
}

/// Measures what is wanted, and what values of the program are at the end of a run.
///
/// # Errors
/// The engine cannot be built on this machine, or there is no such value, in words.
pub fn measure(
    (wanted, lines): (&[SweptNumber], &[String]),
    compiled: &Compiled,
    device: &Device,
    engine: EngineKind,
) -> Result<Measured, String> {
    let key = wanted.iter().any(SweptNumber::is_of_key).then(|| {
        let protocol = Protocol::of(&compiled.model, engine);
        measure_key(compiled, device, &protocol)
    });
    let key = key.transpose().map_err(|why| why.to_string())?;
    let plays = !lines.is_empty() || wanted.iter().any(|wanted| !wanted.is_of_key());
    let run = plays.then(|| play(compiled, device, engine, lines));
    let run = run.transpose()?;
    let value = |wanted: &SweptNumber| match wanted {
        SweptNumber::Measured(definition) => key.as_ref()?.value(definition.name),
        SweptNumber::Run((_, _, of)) => of(run.as_ref()?),
    };
    let last = |line: &String| {
        let columns = &run.as_ref()?.trace.columns;
        let column = columns.iter().find(|column| column.heading.name == *line)?;
        column.values().last().copied()
    };
    Ok((
        wanted.iter().map(value).collect(),
        lines.iter().map(last).collect(),
    ))
}

/// The bundled gesture, with its forces and some values of the program kept.
fn play(
    compiled: &Compiled,
    device: &Device,
    engine: EngineKind,
    lines: &[String],
) -> Result<Run, String> {
    let gesture = gesture::bundled(&compiled.model);
    let rate_hz = compiled.model.rate_hz;
    let positions = gesture.positions(rate_hz);
    let move_to = |tick: usize, places: &mut [f64]| places.fill(positions[tick]);
    let force = session::roles(compiled).total;
    let all = session::recorded(compiled, device, engine, &[]);
    // The force is the first, where there is one.
    let is_force = |column: &&Recorded| column.heading.title() == force;
    let mut columns: Vec<Recorded> = all.iter().filter(is_force).cloned().collect();
    if !lines.is_empty() {
        let chosen = session::choose(&all, lines)?;
        columns.extend(
            chosen
                .into_iter()
                .filter(|column| !columns.contains(column))
                .collect::<Vec<_>>(),
        );
    }
    let recording = Recording::new(columns, Keep::Everything);
    let motion = (positions.len(), move_to);
    let run = session::record(compiled, device, engine, motion, recording, |_| {});
    run.map_err(|why| why.to_string())
}

fn greatest_force(run: &Run) -> Option<f64> {
    let (low, high) = run.trace.columns.first()?.record.extent()?;
    Some(high.abs().max(low.abs()))
}
