//! `check --numbers`: ranges, formats, errors, and what the differentiators cost.

use std::fmt::Write;

use whippen_compiler::lower::OverTime;
use whippen_compiler::model::Sense;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::{resting, session};

use super::strings;

/// The report of one instrument.
pub fn report(compiled: &Compiled, device: &Device) -> String {
    let mut out = format!("{}\n", compiled.model.name);
    table(&mut out, compiled);
    updates(&mut out, compiled);
    clamps(&mut out, compiled);
    for line in strings::report(compiled, device) {
        let _ = writeln!(out, "{line}");
    }
    for sense in &compiled.model.senses {
        differentiators(&mut out, compiled, sense, device);
    }
    for line in device.told_converters() {
        let _ = writeln!(out, "  {line}");
    }
    if let Ok(Some(noise)) = resting::noise(compiled, device) {
        let _ = writeln!(out, "  {}", noise.told(compiled.model.turns()));
    }
    out
}

fn table(out: &mut String, compiled: &Compiled) {
    let _ = writeln!(
        out,
        "  {:<24} {:>12} .. {:<12} {:<11} {:<9} error of one tick",
        "value", "low", "high", "unit", "format"
    );
    for export in compiled.lowered.exports.iter().filter(|e| e.dim.is_some()) {
        let unit = session::unit(&compiled.model, export);
        let (low, high) = (
            format!("{:.6}", sig(export.range.low)),
            format!("{:.6}", sig(export.range.high)),
        );
        let error = bound(export.error);
        let _ = writeln!(
            out,
            "  {:<24} {low:>12} .. {high:<12} {unit:<11} {:<9} {error}",
            export.name,
            export.format()
        );
    }
}

/// A bound of an error, or that there is none.
fn bound(error: f64) -> String {
    match error.is_finite() {
        true => format!("{error:.1e}"),
        false => "none: it depends on a friction".to_string(),
    }
}

/// What is kept, one row for all writes of one kind to one cell.
fn updates(out: &mut String, compiled: &Compiled) {
    let rows = kept(compiled);
    if rows.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "  {:<24} {:<11} {:<9} what that comes to",
        "rounding of what is kept", "unit", "at a time"
    );
    for Kept {
        name,
        unit,
        error,
        over_time,
    } in rows
    {
        let error = match error.is_finite() {
            true => bound(error),
            false => "none".to_string(),
        };
        let comes_to = match over_time {
            OverTime::Exact => "exact".to_string(),
            OverTime::Bounded(most) => format!("at most {most:.1e}, however long it runs"),
            OverTime::Grows(per_second) => {
                format!("grows with every tick, by at most {per_second:.1e} a second")
            }
            OverTime::BehindFriction => bound(f64::INFINITY),
            OverTime::FedBack(per_second) => {
                format!(
                    "adds at most {per_second:.1e} a second; it is fed back, and no bound is proven"
                )
            }
        };
        let _ = writeln!(out, "  {name:<24} {unit:<11} {error:<9} {comes_to}");
    }
}

/// What the writes of one kind to one cell round.
pub struct Kept {
    pub name: String,
    pub unit: String,
    /// At a time (SI).
    pub error: f64,
    pub over_time: OverTime,
}

/// The rows of all writes to memory, in the order of lowering; then what is fed to delay lines.
pub fn kept(compiled: &Compiled) -> Vec<Kept> {
    let mut rows: Vec<Kept> = Vec::new();
    for update in &compiled.lowered.updates {
        let name = update.name(&compiled.model);
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.error = row.error.max(update.error),
            None => rows.push(Kept {
                name,
                unit: session::unit_of_cell(&compiled.model, update.cell),
                error: update.error,
                over_time: update.over_time,
            }),
        }
    }
    let model = &compiled.model;
    let fed = compiled.lowered.fed.iter().map(|fed| Kept {
        name: format!("feed {}", model.delays[fed.delay].name),
        unit: model.delays[fed.delay].dim.unit(),
        error: fed.error,
        over_time: fed.over_time,
    });
    rows.extend(fed);
    rows
}

/// Six significant digits at the most.
fn sig(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn clamps(out: &mut String, compiled: &Compiled) {
    if compiled.lowered.clamps.is_empty() {
        let _ = writeln!(out, "  every clamp was proved away");
    } else {
        let _ = writeln!(
            out,
            "  clamps that could not be proved away: {}",
            compiled.lowered.clamps.join(", ")
        );
    }
}

/// Delay and noise gain of x' and x'' (rule 6 of the manual).
fn differentiators(out: &mut String, compiled: &Compiled, sense: &Sense, device: &Device) {
    let n = f64::from(sense.window);
    let rate = f64::from(compiled.model.rate_hz);
    let delay = (n - 1.0) / 2.0;
    let port = device.port_of(&sense.name).unwrap_or(device.port());
    let lsb = port.scales().sensor_lsb;
    // Variances of the slope of a line and of the second derivative of a parabola fitted to N
    // samples of unit variance.
    let slope = rate * (12.0 / (n * (n * n - 1.0))).sqrt();
    let curvature = 2.0 * rate * rate * (180.0 / (n * (n * n - 1.0) * (n * n - 4.0))).sqrt();
    let name = &sense.name;
    let _ = writeln!(
        out,
        "  {name}: window {n} ticks ({:.3} ms); {name}' and {name}'' lag {delay} ticks ({:.3} ms)",
        n / rate * 1e3,
        delay / rate * 1e3
    );
    // Who turns a knob thinks in degrees.
    let (unit, small, large) = if sense.dim.is_number() {
        ("deg", 1e3, 1.0)
    } else {
        ("m", 1e6, 1e3)
    };
    let lsb = if sense.dim.is_number() {
        lsb.to_degrees()
    } else {
        lsb
    };
    let (tiny, fine) = if unit == "m" {
        ("um", "mm")
    } else {
        ("mdeg", "deg")
    };
    let _ = writeln!(
        out,
        "  {name}: noise of 1 LSB rms ({:.3} {tiny}) gives {:.3} {fine}/s rms in {name}' and {:.3} {unit}/s^2 rms in {name}''",
        lsb * small,
        lsb * slope * large,
        lsb * curvature
    );
}
