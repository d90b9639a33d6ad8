//! Bare `whippen`: every bundled instrument, checked, compiled, played and drawn, on one page.
//!
//! Everything is written below one folder. Files of other names there are left alone, and so is a
//! profile that is already there: it may have been changed.

use std::path::{Path, PathBuf};

use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::lower::ExportKind;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::compare::compare;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::{Cell, Made, Page, Row, Section, Table};
use whippen_runtime::session::{self, Run};

use super::motion::{MotionArgs, Positions};
use super::run::{self, Outputs};
use super::{command, load};
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// Where it writes.
const FOLDER: &str = "whippen-tour";

/// One instrument after the tour has been there.
struct Stop {
    name: String,
    strikes: usize,
    /// Unit of what it drives: `N`, or `N*m` if it turns.
    unit: &'static str,
    /// The greatest force.
    peak: f64,
    /// Largest difference of the force to `ideal`; none behind a friction, where the least change
    /// decides when something slips.
    error: Option<f64>,
    /// Seconds played per second of computing.
    real_time: f64,
    section: Section,
}

impl Stop {
    fn told_error(&self) -> String {
        let told = |error| format!("{error:.1e} {}", self.unit);
        self.error.map_or("friction".to_string(), told)
    }
}

pub fn run() -> Outcome {
    std::fs::create_dir_all(FOLDER)
        .map_err(|e| Failure::Usage(format!("cannot make the folder `{FOLDER}`: {e}")))?;
    say!(
        "the bundled instruments, each on the bundled gesture; the whole story is in {FOLDER}/report.html\n"
    );
    say!(
        "{:<18} {:>6} {:>8} {:>11} {:>14} {:>10}",
        "instrument",
        "check",
        "strikes",
        "peak force",
        "force error",
        "real time"
    );
    let mut stops = Vec::new();
    for (file, text) in INSTRUMENTS {
        for stop in visit(file, text)? {
            let (peak, error) = (format!("{:.2} {}", stop.peak, stop.unit), stop.told_error());
            say!(
                "{:<18} {:>6} {:>8} {peak:>11} {error:>14} {:>9.0}x",
                stop.name,
                "ok",
                stop.strikes,
                stop.real_time
            );
            stops.push(stop);
        }
    }
    say!(
        "\nforce error: largest difference between fixed point (jit) and f64 (ideal), both running free; behind a friction \
         the least change decides when something slips, so none is told"
    );
    page(stops)?;
    next();
    Ok(())
}

/// Checks, compiles, plays and draws the instruments of one file.
fn visit(file: &str, text: &str) -> Result<Vec<Stop>, Failure> {
    let sources = [(format!("instruments/{file}"), text.to_string())];
    let (map, program) = load::checked(&sources, &Options::default(), Severity::Warning)?;
    keep(&at(file), text)?;
    let mut stops = Vec::new();
    for model in program.instruments {
        let (device, positions) = (Device::of(&model), MotionArgs::bundled(&model, None));
        let compiled = load::compiled(&map, model, &device, true)?;
        let (kind, outputs) = (EngineKind::Jit, outputs(&compiled));
        let columns = session::recorded(&compiled, &device, kind, &[]);
        let recording = outputs.recording(columns, &compiled, kind)?;
        let played = run::play(&compiled, &device, kind, &positions, recording)?;
        let (peak, error) = felt(&compiled, &device, &positions, &played)?;
        outputs.draw(&compiled, &played)?;
        let counts = &played.counts;
        stops.push(Stop {
            name: compiled.model.name.replace('_', " "),
            strikes: played.happenings.strikes,
            unit: if compiled.model.turns() { "N*m" } else { "N" },
            peak,
            error,
            real_time: counts.ticks as f64
                / f64::from(compiled.model.rate_hz)
                / counts.engine_time.as_secs_f64(),
            section: section(&compiled, &played, &device, &positions, &sources),
        });
    }
    Ok(stops)
}

/// The greatest force on the first port, and by how much it differs from `ideal`.
fn felt(
    compiled: &Compiled,
    device: &Device,
    positions: &Positions,
    played: &Run,
) -> Result<(f64, Option<f64>), Failure> {
    let mut exports = compiled.lowered.exports.iter();
    let Some(total) = exports.position(|export| export.kind == ExportKind::Total(0)) else {
        return Ok((0.0, Some(0.0)));
    };
    let export = &compiled.lowered.exports[total];
    if !export.error.is_finite() {
        let mut columns = played.trace.columns.iter();
        let column = columns.find(|column| column.heading.name == export.name);
        let values = column.map_or_else(Default::default, |column| column.values());
        let peak = values
            .iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        return Ok((peak, None));
    }
    let comparison = compare(compiled, device, EngineKind::Jit, &positions.places, |_| ());
    let deviations = comparison.map_err(Failure::Defect)?.deviations;
    let found = deviations
        .iter()
        .find(|deviation| deviation.export == total);
    Ok(found.map_or((0.0, Some(0.0)), |deviation| {
        let (low, high) = deviation.seen;
        (low.abs().max(high.abs()), Some(deviation.max))
    }))
}

fn section(
    compiled: &Compiled,
    played: &Run,
    device: &Device,
    positions: &Positions,
    sources: &[(String, String)],
) -> Section {
    let made = Made {
        engine: EngineKind::Jit,
        motion: &positions.notes,
        device,
        settings: &[],
        sources,
    };
    Section::of_run(compiled, played, &made)
}

/// Trace, events and picture of one run.
fn outputs(compiled: &Compiled) -> Outputs {
    let name = compiled.model.name.replace('_', "-");
    Outputs {
        out: vec![at(&format!("{name}.csv"))],
        every: 44,
        events: Some(at(&format!("{name}-events.csv"))),
        plot: vec![at(&format!("{name}.svg"))],
        ..Outputs::default()
    }
}

fn page(stops: Vec<Stop>) -> Outcome {
    let row = |stop: &Stop| {
        let (peak, error) = (format!("{:.3} {}", stop.peak, stop.unit), stop.told_error());
        let cells = vec![
            Cell::text(&stop.name),
            Cell::text(
                stop.section
                    .doc
                    .split(['.', ':', '('])
                    .next()
                    .unwrap_or_default()
                    .trim(),
            ),
            Cell::text("ok"),
            Cell::number(stop.strikes as f64, stop.strikes.to_string()),
            Cell::number(stop.peak, peak),
            match stop.error {
                Some(number) => Cell::number(number, error),
                None => Cell::text(&error),
            },
        ];
        Row {
            cells,
            section: Some(stop.section.id.clone()),
            ..Row::default()
        }
    };
    let heads = [
        "instrument",
        "what it is",
        "check",
        "strikes",
        "peak force",
        "force error",
    ];
    let overview = Table {
        title: "Bundled instruments".into(),
        note: "Each on the bundled gesture. Force error: the largest difference between fixed point and f64; none is told behind a friction.".into(),
        heads: heads.map(String::from).to_vec(),
        rows: stops.iter().map(row).collect(),
    };
    let sections = stops.into_iter().map(|stop| stop.section).collect();
    let page = Page {
        title: "Whippen: the tour".into(),
        command: command::typed(),
        overview: Some(overview),
        sections,
    };
    page.save(&at("report.html"))
        .map_err(|e| Failure::Usage(e.to_string()))
}

fn next() {
    say!("\nnext:");
    say!("  open {FOLDER}/report.html                        in any browser, no network needed");
    say!("  whippen run {FOLDER}/grand-piano.whip --set weight=0.2N --report heavier.html");
    say!("  whippen check {FOLDER}/grand-piano.whip --numbers");
}

fn at(name: &str) -> PathBuf {
    Path::new(FOLDER).join(name)
}

/// Writes a profile to play with, unless there is one already.
fn keep(profile: &Path, text: &str) -> Outcome {
    if profile.exists() {
        return Ok(());
    }
    write_whole(profile, |file| file.write_all(text.as_bytes()))
        .map_err(|e| Failure::Usage(e.to_string()))
}
