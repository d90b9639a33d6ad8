//! Sensor noise at a key that rests: what the player feels of it.
//!
//! The key is left where it rests, its sensor adds normal noise, and the Kernel plays: no formula
//! is trusted, so friction, bodies and choices have their share. What is told is the force around
//! its mean over less than a second, at all frequencies up to half the rate; a drive with a
//! bandwidth lets less of it through.
//!
//! Not here: a key that is held down, which `run --noise` plays.

use whippen_compiler::lower::ExportKind;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::Dim;

use crate::device::Device;
use crate::engine::EngineKind;
use crate::session::{self, RunError};

/// What a sensor adds where its device does not say: the middle of what reflective sensors have
/// (m), and what a magnetic one of 16 bits has (rad).
const USUAL_M: f64 = 1e-6;
const USUAL_RAD: f64 = 1e-4;

/// What is waited for and what is measured (s).
const SETTLES_S: f64 = 0.5;
const MEASURED_S: f64 = 0.8;

/// What noise becomes.
#[derive(Debug, Clone, PartialEq)]
pub struct RestingNoise {
    /// What the sensor adds (m or rad, root of the mean square).
    pub sensor_rms: f64,
    /// Whether the device says so; it is what is usual otherwise.
    pub is_stated: bool,
    /// The force around its mean (N or N*m, root of the mean square).
    pub force_rms: f64,
    /// The same of each force term, the loudest first.
    pub terms: Vec<(String, f64)>,
}

/// What noise becomes at a key that rests; none for what is no key.
///
/// # Errors
/// No engine can be built on this machine.
pub fn noise(compiled: &Compiled, device: &Device) -> Result<Option<RestingNoise>, RunError> {
    let model = &compiled.model;
    let Some(sense) = model.senses.first().filter(|_| model.is_of_key()) else {
        return Ok(None);
    };
    let usual = match sense.dim == Dim::LENGTH {
        true => USUAL_M,
        false => USUAL_RAD,
    };
    let stated = device.sensor().noise_rms;
    let device = device.with_noise(stated.unwrap_or(usual));
    let rate_hz = f64::from(model.rate_hz);
    let (settles, measured) = (SETTLES_S * rate_hz, MEASURED_S * rate_hz);
    let rest = 0.0f64.clamp(sense.range.low, sense.range.high);
    let positions = vec![rest; (settles + measured) as usize];
    let play = |kind| session::run(compiled, &device, kind, &positions, |_| ());
    let run = play(EngineKind::Jit).or_else(|_| play(EngineKind::Interp))?;
    let rms = |kind: ExportKind| {
        let mut exports = compiled.lowered.exports.iter();
        let export = exports.find(|export| export.kind == kind)?;
        let column = run.trace.column(&session::title(model, export))?;
        let values = column.record.points().map(|(_, value)| value);
        Some((
            export.name.clone(),
            deviation(values.skip(settles as usize)),
        ))
    };
    let forces = (0..model.forces.len()).filter_map(|force| rms(ExportKind::Force(force as u32)));
    let mut terms: Vec<(String, f64)> = forces.filter(|(_, rms)| *rms > 0.0).collect();
    terms.sort_by(|a, b| b.1.total_cmp(&a.1));
    Ok(
        rms(ExportKind::Total(0)).map(|(_, force_rms)| RestingNoise {
            sensor_rms: stated.unwrap_or(usual),
            is_stated: stated.is_some(),
            force_rms,
            terms,
        }),
    )
}

/// The standard deviation.
fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    // Welford's recurrence.
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values {
        count += 1.0;
        let beside = value - mean;
        mean += beside / count;
        squares += beside * (value - mean);
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

impl RestingNoise {
    /// The same in words: `1 um rms of the sensor's noise moves the force by 16.6 mN rms`.
    pub fn told(&self, turns: bool) -> String {
        let (sensor, unit, force) = match turns {
            false => (self.sensor_rms * 1e6, "um", "mN"),
            true => (self.sensor_rms.to_degrees() * 1e3, "mdeg", "mN*m"),
        };
        let whose = match self.is_stated {
            true => "of the sensor's noise",
            false => "of noise (the device states none)",
        };
        let size = |newtons: f64| format!("{:.2}", newtons * 1e3);
        let terms = self.terms.iter().take(3);
        let terms: Vec<String> = terms
            .map(|(name, rms)| format!("{name} {}", size(*rms)))
            .collect();
        let shares = match terms.is_empty() {
            true => String::new(),
            false => format!(" ({})", terms.join(", ")),
        };
        format!(
            "{sensor:.3} {unit} rms {whose} moves the force at rest by {} {force} rms{shares}",
            size(self.force_rms)
        )
    }
}
