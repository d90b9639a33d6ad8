//! What a tick writes, and how it is committed (steps 3 and 5).

use super::KeyState;
use whippen_lang::model::{CellKind, Model, NodeId, PulseId};

/// The memory of a key as it will stand, before clamps.
pub(super) struct Writes {
    pub cells: Vec<f64>,
    pub machines: Vec<u32>,
    pulse_left: Vec<u32>,
}

impl Writes {
    /// Bodies moved one tick on, pulses counted down, `next` values taken.
    pub fn integrated(model: &Model, state: &KeyState, value: impl Fn(NodeId) -> f64) -> Writes {
        let mut writes = Writes {
            cells: state.cells.clone(),
            machines: state.machines.clone(),
            pulse_left: state
                .pulse_left
                .iter()
                .map(|left| left.saturating_sub(1))
                .collect(),
        };
        let period_s = 1.0 / f64::from(model.rate_hz);
        for body in &model.bodies {
            let (c, r) = (body.coordinate.0 as usize, body.rate.0 as usize);
            if body.hold.is_some_and(|h| value(h) != 0.0) {
                writes.cells[r] = 0.0;
            } else {
                writes.cells[r] += period_s * value(body.acceleration);
                writes.cells[c] += period_s * writes.cells[r];
            }
        }
        for (pulse, left) in model.pulses.iter().zip(&writes.pulse_left) {
            if *left == 0 {
                writes.cells[pulse.level.0 as usize] = 0.0;
            }
        }
        for (cell, node) in &model.nexts {
            writes.cells[cell.0 as usize] = value(*node);
        }
        writes
    }

    /// Starts a pulse; one that runs restarts with the larger value.
    pub fn fire(&mut self, model: &Model, state: &KeyState, pulse: PulseId, level: f64) {
        let p = &model.pulses[pulse.0 as usize];
        let (cell, range) = (p.level.0 as usize, model.cells[p.level.0 as usize].range);
        let level = level.clamp(range.low, range.high);
        let runs = state.pulse_left[pulse.0 as usize] > 0;
        self.cells[cell] = if runs {
            level.max(state.cells[cell])
        } else {
            level
        };
        self.pulse_left[pulse.0 as usize] = p.ticks;
    }

    /// Clamps everything to its range; a coordinate stopped at an end loses a rate that points
    /// outwards.
    pub fn commit(mut self, model: &Model, state: &mut KeyState) {
        for body in &model.bodies {
            let (c, r) = (body.coordinate.0 as usize, body.rate.0 as usize);
            let range = model.cells[c].range;
            let outward = (self.cells[c] > range.high && self.cells[r] > 0.0)
                || (self.cells[c] < range.low && self.cells[r] < 0.0);
            if outward {
                self.cells[r] = 0.0;
            }
        }
        for (value, cell) in self.cells.iter_mut().zip(&model.cells) {
            debug_assert!(
                cell.kind != CellKind::Pulse
                    || cell.range.low <= *value && *value <= cell.range.high
            );
            *value = value.clamp(cell.range.low, cell.range.high);
        }
        state.cells = self.cells;
        state.machines = self.machines;
        state.pulse_left = self.pulse_left;
    }
}
