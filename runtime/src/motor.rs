//! The motor over a run: current, heat, and what would be held back.
//!
//! ```text
//!   word --32768 is the peak current--> current --^2, time constant--> rise of the winding
//!                                          `--above the rated current, as the firmware adds it up--> time held back
//! ```
//!
//! Word 32768 is the peak current, as in the firmware (`docs/firmware.md`): there the heat above
//! the rated one is added up; what `peak` for `peak_time` makes of it is the limit, and the key
//! then gets no more than the rated current until half of it is gone.

use whippen_compiler::lower::ExportKind;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;

use crate::device::{Device, Motor};
use crate::engine::{Engine, EngineKind};

/// What a run asks of a motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// How long it was (s).
    pub seconds: f64,
    /// Largest current (A).
    pub peak_a: f64,
    /// Root of the mean square (A).
    pub rms_a: f64,
    /// Above the rated current, all together (s).
    pub above_rated_s: f64,
    /// The longest time above it without a pause (s).
    pub longest_s: f64,
    /// The program asked for more than the drive gives (s).
    pub clipped_s: f64,
    /// The most it asked for (N or N*m), whatever the drive gives.
    pub asked: f64,
    /// The firmware would have held the current back to the rated one (s).
    pub held_back_s: f64,
    /// The warmest the winding got above its surroundings (K), if the device says how it gets warm;
    /// from cold.
    pub rise_k: Option<f64>,
    /// The same if it were played again and again.
    pub endless_rise_k: Option<f64>,
}

/// Adds up a run.
#[derive(Debug, Clone)]
pub struct Meter {
    motor: Motor,
    full_scale: f64,
    tick_s: f64,
    ticks: usize,
    squares: f64,
    spell_s: f64,
    /// Heat above the rated (A^2 s), and whether the firmware holds back.
    heat: f64,
    holds: bool,
    rise_k: f64,
    demand: Demand,
}

impl Meter {
    /// Nothing played yet; `None` if the device says nothing of its motor.
    pub fn new(device: &Device, rate_hz: Rate) -> Option<Meter> {
        let motor = device.motor?;
        let warm = motor.heat.map(|_| 0.0);
        Some(Meter {
            motor,
            full_scale: device.drive().full_scale,
            tick_s: 1.0 / f64::from(rate_hz),
            ticks: 0,
            squares: 0.0,
            spell_s: 0.0,
            heat: 0.0,
            holds: false,
            rise_k: 0.0,
            demand: Demand {
                seconds: 0.0,
                peak_a: 0.0,
                rms_a: 0.0,
                above_rated_s: 0.0,
                longest_s: 0.0,
                clipped_s: 0.0,
                asked: 0.0,
                held_back_s: 0.0,
                rise_k: warm,
                endless_rise_k: warm,
            },
        })
    }

    /// One tick: what the program asks for (N or N*m).
    pub fn tick(&mut self, force: f64) {
        let Motor {
            rated_a,
            peak_a,
            peak_s,
            heat,
            ..
        } = self.motor;
        let d = &mut self.demand;
        let wanted_a = force.abs() / self.full_scale * peak_a;
        let amperes = wanted_a.min(peak_a);
        d.asked = d.asked.max(force.abs());
        d.clipped_s += if wanted_a > peak_a { self.tick_s } else { 0.0 };
        d.peak_a = d.peak_a.max(amperes);
        self.squares += amperes * amperes;
        self.spell_s = if amperes > rated_a {
            self.spell_s + self.tick_s
        } else {
            0.0
        };
        d.above_rated_s += if amperes > rated_a { self.tick_s } else { 0.0 };
        d.longest_s = d.longest_s.max(self.spell_s);
        let limit = (peak_a * peak_a - rated_a * rated_a) * peak_s;
        // While it is held back the winding gets the rated current at the most.
        let flows = if self.holds {
            amperes.min(rated_a)
        } else {
            amperes
        };
        d.held_back_s += if self.holds && amperes > rated_a {
            self.tick_s
        } else {
            0.0
        };
        self.heat =
            (self.heat + (flows * flows - rated_a * rated_a) * self.tick_s).clamp(0.0, limit);
        self.holds = self.heat >= limit || self.holds && self.heat >= 0.5 * limit;
        if let Some(heat) = heat {
            let goal = heat.rise_k * (amperes / rated_a).powi(2);
            self.rise_k += (goal - self.rise_k) * self.tick_s / heat.time_s;
            d.rise_k = d.rise_k.map(|most| most.max(self.rise_k));
        }
        self.ticks += 1;
    }

    /// The rise of the winding as it stands (K).
    pub fn rise_k(&self) -> f64 {
        self.rise_k
    }

    /// What it was.
    pub fn finish(mut self) -> Demand {
        let d = &mut self.demand;
        d.seconds = self.ticks as f64 * self.tick_s;
        d.rms_a = (self.squares / self.ticks.max(1) as f64).sqrt();
        let mean = (d.rms_a / self.motor.rated_a).powi(2);
        d.endless_rise_k = self.motor.heat.map(|heat| heat.rise_k * mean);
        self.demand
    }
}

/// A slice of a run, for a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slice {
    /// When it begins (s).
    pub t_s: f64,
    /// Largest current in it (A).
    pub peak_a: f64,
    /// The winding's rise at its end (K); 0 where the device does not say.
    pub rise_k: f64,
}

/// A played motion, and what it asked of the motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// All of it.
    pub demand: Demand,
    /// In slices of equal length.
    pub slices: Vec<Slice>,
}

/// So many slices a motion is shown in.
const SLICES: usize = 600;

/// Plays a motion (m at each tick) and adds up what the program asks for; none if the device says
/// nothing of its motor. `compiled` observes.
///
/// # Errors
/// The engine cannot be built on this machine, or `compiled` does not observe its force.
pub fn play(
    compiled: &Compiled,
    device: &Device,
    positions: &[f64],
) -> Result<Option<Played>, String> {
    let Some(mut meter) = Meter::new(device, compiled.model.rate_hz) else {
        return Ok(None);
    };
    let exports = &compiled.lowered.exports;
    let total = exports
        .iter()
        .position(|e| e.kind == ExportKind::Total(0))
        .ok_or("the force is not observed")?;
    let mut engine = Engine::new(EngineKind::Jit, compiled, device, 1)?;
    let (motor, rate_hz) = (meter.motor, f64::from(compiled.model.rate_hz));
    let mut words = vec![0; compiled.model.senses.len()];
    let (mut drive, mut slices) = ([0], Vec::with_capacity(SLICES));
    let length = positions.len().div_ceil(SLICES).max(1);
    for (tick, x) in positions.iter().enumerate() {
        words.fill(device.word_of_position(device.port().read(0, tick, *x)).0);
        if tick == 0 {
            engine.start(&words);
        }
        engine.tick(&words, &mut drive);
        if tick % 4096 == 0 {
            drop(engine.drain());
        }
        let force = engine.value(0, total, &exports[total]);
        meter.tick(force);
        if tick % length == 0 {
            slices.push(Slice {
                t_s: tick as f64 / rate_hz,
                peak_a: 0.0,
                rise_k: 0.0,
            });
        }
        if let Some(slice) = slices.last_mut() {
            let amperes = (force.abs() / meter.full_scale * motor.peak_a).min(motor.peak_a);
            (slice.peak_a, slice.rise_k) = (slice.peak_a.max(amperes), meter.rise_k());
        }
    }
    Ok(Some(Played {
        demand: meter.finish(),
        slices,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: u32 = 44_100;

    fn demand(seconds: f64, force: impl Fn(f64) -> f64) -> Demand {
        let mut meter = Meter::new(&Device::mikey(), RATE_HZ.into()).expect("mikey has a motor");
        let ticks = (seconds * f64::from(RATE_HZ)) as usize;
        (0..ticks).for_each(|i| meter.tick(force(i as f64 / f64::from(RATE_HZ))));
        meter.finish()
    }

    #[test]
    fn the_rated_current_for_ever_makes_the_stated_rise() {
        // 8 N are 0.5 A.
        let d = demand(90.0, |_| -8.0);
        assert!(
            (d.rms_a - 0.5).abs() < 1e-9 && d.above_rated_s == 0.0 && d.held_back_s == 0.0,
            "{d:?}"
        );
        let rise = d.rise_k.expect("mikey says how it gets warm");
        assert!(
            (rise - 60.0 * (1.0 - (-3.0_f64).exp())).abs() < 0.01,
            "{rise}"
        );
        assert!((d.endless_rise_k.unwrap_or(0.0) - 60.0).abs() < 1e-6);
    }

    #[test]
    fn the_peak_is_allowed_for_its_time_and_then_held_back() {
        let d = demand(0.5, |t| if t < 0.099 { 32.0 } else { 0.0 });
        assert!(
            d.held_back_s == 0.0 && (d.longest_s - 0.099).abs() < 1e-3 && d.peak_a == 2.0,
            "{d:?}"
        );
        let d = demand(0.5, |_| 40.0);
        assert!((d.held_back_s - 0.4).abs() < 1e-3, "{d:?}");
        assert!(
            (d.clipped_s - 0.5).abs() < 1e-6 && d.asked == 40.0 && d.peak_a == 2.0,
            "{d:?}"
        );
    }
}
