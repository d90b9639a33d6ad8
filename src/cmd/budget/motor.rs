//! The motor budget: the worst static force, and what a played motion asks of current and heat.

use std::fmt::Write;

use serde_json::{Value, json};
use whippen_compiler::check::note_name;
use whippen_compiler::diag::Diagnostic;
use whippen_compiler::model::{Interval, Model};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::stability::{Law, Static, static_force_of, too_strong};
use whippen_runtime::device::{Device, Motor};
use whippen_runtime::gesture::{Follower, dip_m};
use whippen_runtime::midi::{self, Note};
use whippen_runtime::motion::{self, MotionOptions};
use whippen_runtime::motor::{self, Demand, Played, Slice};
use whippen_runtime::stroke::{press_speed, strokes};

use super::beyond::BeyondArgs;
use crate::cmd::motion::MotionArgs;
use crate::exit::Failure;

/// What is played before the first note (s).
const LATER_S: f64 = 0.5;

/// What is known of the motor of one instrument.
pub struct MotorBudget {
    statics: Option<Static>,
    played: Played,
    motion: String,
    motor: Motor,
    full_scale: f64,
    rated_force: f64,
    unit: &'static str,
}

impl MotorBudget {
    /// `None` if the device says nothing of its motor. `compiled` observes; `law` is its force law,
    /// if that can be bounded.
    pub fn find(
        compiled: &Compiled,
        law: Option<&Law>,
        device: &Device,
        args: &BeyondArgs,
    ) -> Result<Option<MotorBudget>, Failure> {
        let (positions, motion) = positions(&compiled.model, args)?;
        let played = motor::play(compiled, device, &positions).map_err(Failure::Defect)?;
        let (Some(played), Some(motor), Some(rated_force)) =
            (played, device.motor, device.rated_force())
        else {
            return Ok(None);
        };
        Ok(Some(MotorBudget {
            statics: law.and_then(static_force_of),
            played,
            motion,
            motor,
            full_scale: device.drive().full_scale,
            rated_force,
            unit: if device.turns() { "N*m" } else { "N" },
        }))
    }

    pub fn warning(&self, model: &Model) -> Option<Diagnostic> {
        too_strong(model, self.statics.as_ref()?, self.rated_force)
    }

    pub fn text(&self) -> String {
        let verdict = match self.exceeds() {
            false => "within its rating",
            true => "MORE THAN RATED",
        };
        let mut out = format!("motor: {verdict}\n");
        self.add_rating(&mut out);
        self.add_statics(&mut out);
        self.add_motion(&mut out);
        out
    }

    /// What the motor gives.
    fn add_rating(&self, out: &mut String) {
        let unit = self.unit;
        let _ = writeln!(
            out,
            "  it gives {:.3} {unit} at {} A for {:.0} ms and {:.3} {unit} at {} A for ever; {:.4} {unit}/A is {:.1} mN*m/A at an arm of {:.2} mm",
            self.full_scale,
            self.motor.peak_a,
            1e3 * self.motor.peak_s,
            self.rated_force,
            self.motor.rated_a,
            self.full_scale / self.motor.peak_a,
            1e3 * self.motor.torque_constant,
            1e3 * self.motor.torque_constant * self.motor.peak_a / self.full_scale
        );
    }

    /// Forces on a key that is held still.
    fn add_statics(&self, out: &mut String) {
        let Some(Static { balanced, held, .. }) = &self.statics else {
            return;
        };
        let range = |i: &Interval| format!("{:.3} .. {:.3} {}", i.low, i.high, self.unit);
        let _ = writeln!(out, "  held still: {} at the most", range(balanced));
        if let Some(held) = held.filter(|held| !balanced.contains(*held)) {
            let _ = writeln!(
                out,
                "  held still while a body is held: within {}, a bound that need not occur",
                range(&held)
            );
        }
    }

    /// Current and heat of the motion that is played.
    fn add_motion(&self, out: &mut String) {
        let (d, unit) = (&self.played.demand, self.unit);
        let _ = writeln!(
            out,
            "  {}: peak {:.3} A, rms {:.3} A, {} above the rated current ({} at a time)",
            self.motion,
            d.peak_a,
            d.rms_a,
            seconds(d.above_rated_s),
            seconds(d.longest_s)
        );
        if d.clipped_s > 0.0 {
            let _ = writeln!(
                out,
                "  clipped for {}: up to {:.3} {unit} asked for, {:.3} given",
                seconds(d.clipped_s),
                d.asked,
                self.full_scale
            );
        }
        if d.held_back_s > 0.0 {
            let _ = writeln!(
                out,
                "  held back to the rated current by the firmware for {}",
                seconds(d.held_back_s)
            );
        }
        if let (Some(once), Some(endless)) = (d.rise_k, d.endless_rise_k) {
            let _ = writeln!(
                out,
                "  winding: {once:.1} K warmer at the most, {endless:.1} K if it is played for ever"
            );
        }
    }

    /// Whether the rated current is too little for it: for a key that is held, or for this motion
    /// again and again.
    fn exceeds(&self) -> bool {
        let d: &Demand = &self.played.demand;
        let held = self
            .statics
            .as_ref()
            .is_some_and(|s| s.balanced.magnitude() > self.rated_force);
        held || d.rms_a > self.motor.rated_a || d.held_back_s > 0.0
    }

    pub fn json(&self) -> Value {
        let d = &self.played.demand;
        let range = |i: &Interval| json!([i.low, i.high]);
        let slice = |s: &Slice| json!([s.t_s, s.peak_a, s.rise_k]);
        json!({
            "within_rating": !self.exceeds(),
            "force_per_ampere": self.full_scale / self.motor.peak_a,
            "full_scale": self.full_scale,
            "rated_force": self.rated_force,
            "rated_a": self.motor.rated_a,
            "static": self.statics.as_ref().map(|s| range(&s.balanced)),
            "static_held": self.statics.as_ref().and_then(|s| s.held.as_ref().map(range)),
            "motion": self.motion,
            "seconds": d.seconds, "peak_a": d.peak_a, "rms_a": d.rms_a, "above_rated_s": d.above_rated_s,
            "longest_above_rated_s": d.longest_s, "clipped_s": d.clipped_s, "asked": d.asked,
            "held_back_s": d.held_back_s, "rise_k": d.rise_k, "endless_rise_k": d.endless_rise_k,
            "slices": self.played.slices.iter().map(slice).collect::<Vec<_>>(),
        })
    }
}

/// What the key does, and how that is called.
fn positions(model: &Model, args: &BeyondArgs) -> Result<(Vec<f64>, String), Failure> {
    let usage = |e: whippen_runtime::files::FileError| Failure::Usage(e.to_string());
    if let Some(path) = &args.midi {
        if model.turns() {
            return Err(Failure::Usage(
                "--midi plays keys, and this instrument turns".to_string(),
            ));
        }
        let performance = midi::load(path).map_err(usage)?;
        let (key, notes) = busiest(&performance.notes);
        let (moves, _) = strokes(&notes, LATER_S, dip_m(model));
        let end_s = moves
            .iter()
            .map(|m| m.start_s + m.duration_s)
            .fold(0.0, f64::max)
            + LATER_S;
        let rate_hz = f64::from(model.rate_hz);
        let mut follower = Follower::new(&moves);
        let positions = (0..(end_s * rate_hz) as usize)
            .map(|i| follower.at(i as f64 / rate_hz))
            .collect();
        return Ok((
            positions,
            format!(
                "{}, the busiest key {} with {} notes",
                path.display(),
                note_name(key),
                notes.len()
            ),
        ));
    }
    let Some(path) = &args.motion else {
        return Ok((
            MotionArgs::bundled(model, None).first().to_vec(),
            "the bundled gesture".to_string(),
        ));
    };
    let options = MotionOptions {
        turns: model.turns(),
        ..MotionOptions::default()
    };
    let motion = motion::load(path, &options, model.rate_hz).map_err(usage)?;
    Ok((motion.positions.to_vec(), path.display().to_string()))
}

/// The key whose strokes ask most of a motor: by the sum of the squares of their speeds.
fn busiest(notes: &[Note]) -> (u8, Vec<(usize, Note)>) {
    let of = |key: u8| -> Vec<(usize, Note)> {
        notes
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, n)| n.key == key)
            .collect()
    };
    let work = |key: &u8| {
        of(*key)
            .iter()
            .map(|(_, n)| press_speed(n.velocity).powi(2))
            .sum::<f64>()
    };
    let key = (0..=127)
        .max_by(|a, b| work(a).total_cmp(&work(b)))
        .unwrap_or(60);
    (key, of(key))
}

fn seconds(time_s: f64) -> String {
    if time_s > 0.0 && time_s < 1.0 {
        format!("{:.1} ms", 1e3 * time_s)
    } else {
        format!("{time_s:.2} s")
    }
}
