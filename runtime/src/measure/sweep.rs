//! The slow press: down at one speed, a while at the bottom, up at the same speed.

use whippen_compiler::lower::ExportKind;
use whippen_compiler::model::CellKind;
use whippen_compiler::pipeline::Compiled;

use super::{Branch, Protocol, Touch};
use crate::device::Device;
use crate::session::{self, Recorded, Recording, RunError, Signal};
use crate::trace::Column;

/// The key gets its speed and loses it in this time (s): no jolt, however heavy the key.
const START_S: f64 = 0.1;
/// It stays up before, and down between, for so long (s).
const HOLD_S: f64 = 0.5;
/// A body that falls back by less than this part of all it moved did not drop.
const LEAST_DROP: f64 = 0.002;

/// What a slow press gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Force over travel.
    pub touch: Touch,
    /// How far the first body falls back from its highest place: unit, size.
    pub drop: Option<(String, f64)>,
}

/// Where a key is that goes down and up at one speed; how long that takes (s).
pub fn sweep_motion(dip_m: f64, speed: f64) -> (impl Fn(f64) -> f64, f64) {
    // A short way is gone at less than the speed.
    let start_s = START_S.min(dip_m / speed);
    let way_s = dip_m / speed + start_s;
    let gone = move |t: f64| {
        let t = t.clamp(0.0, way_s);
        let ramp = |t: f64| 0.5 * speed * t * t / start_s;
        match t {
            t if t < start_s => ramp(t),
            t if t > way_s - start_s => dip_m - ramp(way_s - t),
            t => speed * (t - 0.5 * start_s),
        }
    };
    let at = move |t: f64| gone(t - HOLD_S) - gone(t - 2.0 * HOLD_S - way_s);
    (at, 3.0 * HOLD_S + 2.0 * way_s)
}

/// Presses a key slowly and lets it up.
///
/// # Errors
/// The engine cannot be built on this machine.
pub fn sweep(compiled: &Compiled, device: &Device, protocol: &Protocol) -> Result<Sweep, RunError> {
    let (place, seconds) = sweep_motion(protocol.dip_m, protocol.speed_m_per_s);
    let rate_hz = f64::from(compiled.model.rate_hz);
    let ticks = (seconds * rate_hz).ceil() as usize;
    let move_to = |tick: usize, places: &mut [f64]| places.fill(place(tick as f64 / rate_hz));
    let recording = Recording::everything(columns(compiled, device, protocol));
    let motion = (ticks, move_to);
    let run = session::record(compiled, device, protocol.engine, motion, recording, |_| {})?;
    let column = |name: &str| run.trace.column(name).map_or(&[][..], Column::values);
    let roles = session::roles(compiled);
    let force = column(&roles.total);
    // The place that was asked for: what is sensed is as good, but for its steps.
    let middle = ticks / 2;
    let samples = |from: usize, to: usize| {
        let part = force.iter().enumerate().take(to).skip(from);
        part.map(|(tick, force)| (place(tick as f64 / rate_hz), *force))
    };
    let touch = Touch {
        dip_m: protocol.dip_m,
        press: Branch::of(samples(0, middle), protocol.dip_m),
        back: Branch::of(samples(middle, ticks), protocol.dip_m),
    };
    let body = run.trace.columns.iter().find(|c| {
        let title = c.title();
        title != roles.total && title != roles.travel
    });
    Ok(Sweep {
        touch,
        drop: body.and_then(|body| dropped(body, middle)),
    })
}

/// The sum of forces and the first body's place.
fn columns(compiled: &Compiled, device: &Device, protocol: &Protocol) -> Vec<Recorded> {
    let kind = |recorded: &Recorded| match recorded.source {
        Signal::Export(index) => Some(compiled.lowered.exports[index].kind),
        _ => None,
    };
    let is_place = |kind| match kind {
        ExportKind::Cell(id) => compiled.model.cells[id].kind == CellKind::Coordinate,
        _ => false,
    };
    let all = session::recorded(compiled, device, protocol.engine, &[]);
    let force = all.iter().find(|r| kind(r) == Some(ExportKind::Total(0)));
    let body = all.iter().find(|r| kind(r).is_some_and(is_place));
    force.into_iter().chain(body).cloned().collect()
}

/// How far a body fell back from its highest place until the middle of the hold.
fn dropped(body: &Column, middle: usize) -> Option<(String, f64)> {
    let (first, values) = (*body.values().first()?, body.values().get(..middle)?);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let drop = highest - values.last()?;
    (drop > LEAST_DROP * (highest - first)).then(|| (body.heading.unit.clone(), drop))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineKind;

    #[test]
    fn a_slow_press_has_one_speed_and_ends_where_it_began() {
        let protocol = Protocol {
            engine: EngineKind::Jit,
            dip_m: 0.010,
            speed_m_per_s: 0.005,
        };
        let (place, seconds) = sweep_motion(protocol.dip_m, protocol.speed_m_per_s);
        assert_eq!((place(0.0), place(seconds)), (0.0, 0.0));
        assert!((place(0.5 * seconds) - 0.010).abs() < 1e-12);
        let speed = |t: f64| (place(t + 1e-4) - place(t - 1e-4)) / 2e-4;
        assert!((speed(1.5) - 0.005).abs() < 1e-9 && (speed(4.0) + 0.005).abs() < 1e-9);
        let fastest = (0..seconds as usize * 1000).map(|i| speed(i as f64 * 1e-3).abs());
        assert!(fastest.fold(0.0, f64::max) < 0.005 + 1e-9);
    }
}
