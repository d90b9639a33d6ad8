//! Writes of a tick in f64, and how they are committed (steps 3 and 5).

use super::KeyState;
use whippen_ids::IdMap;
use whippen_lang::model::{CellId, CellKind, MachineId, Model, NodeId, PulseId};

/// The memory of a key as it will stand, before clamps.
pub(super) struct RealWrites {
    pub cells: IdMap<CellId, f64>,
    pub machines: IdMap<MachineId, u32>,
    pulse_left: IdMap<PulseId, u32>,
}

impl RealWrites {
    /// Bodies moved one tick on, pulses counted down, `next` values taken.
    pub fn integrated(
        model: &Model,
        state: &KeyState,
        value: impl Fn(NodeId) -> f64,
    ) -> RealWrites {
        let mut writes = RealWrites {
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
            let c = body.coordinate;
            let r = body.rate;
            if body.hold.is_some_and(|h| value(h) != 0.0) {
                writes.cells[r] = 0.0;
            } else {
                writes.cells[r] += period_s * value(body.acceleration);
                let friction = body.friction.as_ref();
                writes.cells[r] -= friction.map_or(0.0, |friction| value(friction.taken));
                writes.cells[c] += period_s * writes.cells[r];
            }
        }
        for (pulse, left) in model.pulses.iter().zip(&writes.pulse_left) {
            if *left == 0 {
                writes.cells[pulse.level] = 0.0;
            }
        }
        for (cell, node) in &model.nexts {
            writes.cells[cell] = value(*node);
        }
        writes
    }

    /// Starts a pulse; one that runs restarts with the larger value.
    pub fn fire(&mut self, model: &Model, state: &KeyState, pulse: PulseId, level: f64) {
        let p = &model.pulses[pulse];
        let cell = p.level;
        let range = model.cells[cell].range;
        let level = level.clamp(range.low, range.high);
        let runs = state.pulse_left[pulse] > 0;
        self.cells[cell] = if runs {
            level.max(state.cells[cell])
        } else {
            level
        };
        self.pulse_left[pulse] = p.ticks;
    }

    /// Clamps everything to its range; a coordinate stopped at an end loses a rate that points
    /// outwards.
    pub fn commit(mut self, model: &Model, state: &mut KeyState) {
        for body in &model.bodies {
            let c = body.coordinate;
            let r = body.rate;
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
