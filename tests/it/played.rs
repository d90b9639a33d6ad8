//! What the behaviour tests ask of a run: what was struck, when the hammer landed, what was felt.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::Gesture;
use whippen_runtime::session::{self, Run};

use crate::common::RATE_HZ;

/// A finished run on host code, and questions to it.
pub struct Played(pub Run);

/// Plays positions.
pub fn play(compiled: &Compiled, positions_m: &[f64]) -> Played {
    let run = session::run(
        compiled,
        &Device::of(&compiled.model),
        EngineKind::Jit,
        positions_m,
        |_| (),
    );
    Played(run.unwrap_or_else(|e| panic!("{}: {e}", compiled.model.name)))
}

/// Plays a gesture.
pub fn play_gesture(compiled: &Compiled, gesture: &Gesture) -> Played {
    play(compiled, &gesture.positions(RATE_HZ))
}

impl Played {
    /// When an event or a transition (`contact: flying -> touching`) happened (s).
    pub fn times(&self, event: &str) -> Vec<f64> {
        self.0
            .trace
            .events
            .iter()
            .filter(|e| e.event == event)
            .map(|e| e.t_s)
            .collect()
    }

    /// Speeds of the notes (m/s).
    pub fn speeds(&self) -> Vec<f64> {
        self.0
            .trace
            .events
            .iter()
            .filter(|e| e.event == "note")
            .map(|e| e.args[0].1)
            .collect()
    }

    /// When the hammer came back to the key (s).
    pub fn landings(&self) -> Vec<f64> {
        self.times("contact: flying -> touching")
    }

    /// All changes of contact after a time, both ways.
    pub fn contact_changes_after(&self, t_s: f64) -> usize {
        let of = |name: &str| self.times(name).iter().filter(|&&t| t > t_s).count();
        of("contact: flying -> touching") + of("contact: touching -> flying")
    }

    /// The values of a column, one per tick.
    pub fn column(&self, title: &str) -> &[f64] {
        self.0
            .trace
            .column(title)
            .unwrap_or_else(|| panic!("no column `{title}`"))
            .values()
    }

    /// Least and greatest value of a column from a time on.
    pub fn extremes(&self, title: &str, from_s: f64) -> (f64, f64) {
        let from = (from_s * f64::from(RATE_HZ)) as usize;
        let values = &self.column(title)[from..];
        assert!(!values.is_empty(), "nothing after {from_s} s");
        values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
                (low.min(v), high.max(v))
            })
    }
}
