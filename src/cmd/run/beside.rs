//! `run --compare`: a measured loop of force over travel beside the computed one.

use std::path::Path;

use serde_json::{Value, json};
use whippen_compiler::model::{Model, Moves};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;
use whippen_runtime::measure::sweep_motion;
use whippen_runtime::measured_loop::{LoopDistance, MeasuredLoop};
use whippen_runtime::session::{self, Beside, Recorded, Run};
use whippen_runtime::trajectory::Trajectory;

use super::super::import::curve::cleaned;
use super::super::import::recording::{self, GRAM_N, rounded};
use super::super::motion::{MotionArgs, Positions};
use super::Outputs;
use crate::exit::Failure;
use crate::say::say;
use crate::table_text;

/// A slow press takes so long one way (s).
const WAY_S: f64 = 2.0;

/// Ends of a range may be rounded by so much (m).
const ROUNDED_M: f64 = 1e-9;

/// A loop that was read, and what was left out of it.
pub struct Measured {
    pub file: String,
    pub of: MeasuredLoop,
    pub glitches: usize,
    /// Points where the instrument senses nothing.
    pub beyond: usize,
}

impl Measured {
    /// Reads what is to be compared with an instrument.
    ///
    /// # Errors
    /// It is no recording of force over travel, or the instrument has no such loop.
    pub fn load(path: &Path, model: &Model) -> Result<Measured, Failure> {
        let wrong = |why: String| {
            let path = path.display();
            Failure::Usage(format!("--compare: `{path}` cannot be compared: {why}"))
        };
        has_loop(model).map_err(Failure::Usage)?;
        let text = table_text::text(path).map_err(wrong)?;
        let recording = recording::read(&text).map_err(wrong)?;
        let (recording, glitches) = cleaned(&recording);
        let is_glitch = |pressed: bool, x_m: f64| {
            let mut all = glitches.iter();
            all.any(|glitch| glitch.pressed == pressed && glitch.x_m == x_m)
        };
        let kept = |branch: &[recording::Point], pressed: bool| {
            let points = branch.iter();
            let points = points.filter(|point| !is_glitch(pressed, point.0));
            points.copied().collect()
        };
        let all = MeasuredLoop {
            press: kept(&recording.press, true),
            back: kept(&recording.back, false),
        };
        let all = all.between(recording.travel_m());
        let before = all.points().count();
        let sensed = model.senses[0].range;
        let of = all.between([sensed.low - ROUNDED_M, sensed.high + ROUNDED_M]);
        let beyond = before - of.points().count();
        if of.press.len() < 2 || of.back.len() < 2 {
            let name = &model.name;
            return Err(wrong(format!("its travel is not one that `{name}` senses")));
        }
        Ok(Measured {
            file: path.display().to_string(),
            of,
            glitches: glitches.len(),
            beyond,
        })
    }

    /// A slow press over its travel.
    pub fn sweep(&self, rate_hz: Rate) -> Positions {
        let places = self.of.points().map(|point| point.0);
        let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |ends, x| {
            [ends[0].min(x), ends[1].max(x)]
        });
        let (dip_m, rate) = (high - low, f64::from(rate_hz));
        let (gone, seconds) = sweep_motion(dip_m, dip_m / WAY_S);
        let ticks = (seconds * rate).ceil() as usize;
        let place = |tick: usize| low + gone(tick as f64 / rate);
        Positions {
            places: vec![Trajectory::from((0..ticks).map(place).collect::<Vec<_>>())],
            start_s: 0.0,
            notes: vec![format!(
                "a slow press over the travel of {}, {WAY_S} s down and as long up",
                self.file
            )],
        }
    }

    /// Compares a run with it, which has the columns that [`check_columns`] asks for.
    pub fn beside(self, compiled: &Compiled, run: &Run) -> Beside {
        let roles = session::roles(compiled);
        let travel = run.trace.column(&roles.travel);
        let distance = travel.zip(run.trace.column(&roles.total));
        let distance = distance.map(|(travel, force)| {
            let step = travel.heading.step.unwrap_or(0.0);
            self.of.distance(&travel.record, &force.record, step)
        });
        let distance = distance.unwrap_or_default();
        Beside {
            told: self.told(&distance),
            measured: self.of,
            distance,
        }
    }

    /// How far a run is from it, in words.
    fn told(&self, distance: &LoopDistance) -> String {
        let LoopDistance { rms_n, points, .. } = *distance;
        let mut out = match points {
            0 => format!("{}: the key passed none of its points", self.file),
            _ => format!("{}: {} rms at {points} points", self.file, both(rms_n)),
        };
        if let Some((place, off)) = distance.worst {
            out += &format!(", at most {} at {} mm", both(off), rounded(1e3 * place));
        }
        let left = [
            (distance.missed, "that the key did not pass"),
            (self.beyond, "beyond what the instrument senses"),
            (self.glitches, "that are glitches"),
        ];
        for (count, what) in left.into_iter().filter(|(count, _)| *count > 0) {
            out += &format!("; left out are {count} {what}");
        }
        out
    }
}

/// Travel and force must be among the columns that are asked for.
///
/// # Errors
/// One of them is not.
pub fn check_columns(
    compiled: &Compiled,
    columns: &[Recorded],
    names: &[String],
) -> Result<(), Failure> {
    let chosen = session::choose(columns, names).unwrap_or_default();
    let is_chosen = |title: &String| chosen.iter().any(|column| column.heading.title() == *title);
    let roles = session::roles(compiled);
    match [&roles.travel, &roles.total]
        .into_iter()
        .find(|title| !is_chosen(title))
    {
        Some(title) if !chosen.is_empty() => Err(Failure::Usage(format!(
            "--compare needs the travel and the force of the key; add `{title}` to --columns"
        ))),
        _ => Ok(()),
    }
}

/// A force in both units that recordings have.
fn both(force_n: f64) -> String {
    format!("{:.4} N ({:.2} gf)", force_n, force_n / GRAM_N)
}

/// Only what slides and pushes has a loop of force over travel.
fn has_loop(model: &Model) -> Result<(), String> {
    let slides = model.senses.len() == 1 && model.senses[0].moves == Moves::Slides;
    if slides && !model.forces.is_empty() {
        return Ok(());
    }
    Err(format!(
        "--compare is for what senses a travel and answers with a force; `{}` does not",
        model.name
    ))
}

/// What the key does, and what its loop is compared with: without a motion a slow press over that.
pub fn positions(
    outputs: &Outputs,
    motion: &MotionArgs,
    model: &Model,
) -> Result<(Positions, Option<Measured>), Failure> {
    let Some(path) = &outputs.compare else {
        return Ok((motion.load(model)?, None));
    };
    let measured = Measured::load(path, model)?;
    let positions = match motion.is_given() {
        true => motion.load(model)?,
        false => measured.sweep(model.rate_hz),
    };
    Ok((positions, Some(measured)))
}

/// Says on the terminal how far a run is from what was measured.
pub fn report(run: &Run) {
    if let Some(beside) = &run.beside {
        say!("measured: {}", beside.told);
    }
}

/// The same for `--json`.
pub fn json(beside: &Beside) -> Value {
    let LoopDistance {
        rms_n,
        points,
        missed,
        ..
    } = beside.distance;
    json!({ "rms_n": rms_n, "rms_gf": rms_n / GRAM_N, "points": points, "missed": missed })
}
