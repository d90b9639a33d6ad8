//! Touchweight metrology: what a technician measures on a key, measured on a program.
//!
//! ```text
//!   slow press and return --sweep--> force over travel, twice --read--.
//!                                                                     +--> Measured: a value or none for each Definition
//!   strokes, fast and soft, many keys at once --strokes--> strikes ---'
//! ```
//!
//! The key is led, and the force that it needs is read; a technician's weights would find the same
//! to the gram. What a number means is one line of [`DEFINITIONS`]; a number that an instrument has
//! not is absent, never 0.
//!
//! Not here: tables, pages, comparison with recordings (the command).

mod branch;
mod recorded;
mod strokes;
mod sweep;

use std::collections::BTreeMap;

use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::engine::EngineKind;
use crate::gesture;
use crate::session::RunError;
pub use branch::{Branch, Touch};
pub use recorded::{Compared, RecordedKeys};
pub use strokes::REPETITION_MAX_HZ;
pub use sweep::{Sweep, sweep, sweep_motion};

/// The speed of a slow press (m/s): a friction that is smoothed around standstill has its whole
/// size, and 1 N*s/m adds half a gram.
pub const SPEED_M_PER_S: f64 = 0.005;

/// One gram-force (N), by the standard acceleration of free fall.
pub const GRAM_FORCE_N: f64 = 9.806_65e-3;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Definition {
    /// Its name, without a unit.
    pub name: &'static str,
    /// Its unit as titles write it, SI.
    pub unit: &'static str,
    /// What technicians expect of a grand piano (SI), where there is such a range.
    pub expected: Option<(f64, f64)>,
}

impl Definition {
    /// The name with the unit last (`down_weight_n`).
    pub fn title(&self) -> String {
        format!("{}_{}", self.name, self.unit)
    }
}

const fn defined(
    name: &'static str,
    unit: &'static str,
    expected: Option<(f64, f64)>,
) -> Definition {
    Definition {
        name,
        unit,
        expected,
    }
}

/// All that is measured, in the order of reports. What each means and where its range is from:
/// `docs/measure.md`.
pub const DEFINITIONS: [Definition; 15] = [
    defined("down_weight", "n", Some((0.45, 0.55))),
    defined("up_weight", "n", Some((0.20, 0.25))),
    defined("balance_weight", "n", Some((0.325, 0.40))),
    defined("friction_weight", "n", Some((0.10, 0.175))),
    defined("rate_effect", "n", None),
    defined("let_off_travel", "m", Some((0.006, 0.009))),
    defined("let_off_force", "n", None),
    defined("let_off_bump", "n", Some((0.15, 0.25))),
    defined("after_travel", "m", None),
    defined("aftertouch", "m", Some((0.000_75, 0.0015))),
    defined("key_dip", "m", Some((0.0095, 0.011))),
    defined("repetition_limit", "hz", None),
    defined("softest_strike", "m_per_s", None),
    defined("loudest_strike", "m_per_s", None),
    defined("dynamic_range", "db", None),
];

/// What was measured on a key.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measured {
    values: BTreeMap<&'static str, f64>,
    /// How far the hammer, the first body that the program moves, falls back from its highest place
    /// in a slow press: unit and size. None where there is none, or it does not fall.
    pub drop: Option<(String, f64)>,
    /// Every stroke still struck at the fastest repetition that was tried.
    pub repeats_beyond: bool,
    /// The slow press and the return.
    pub touch: Touch,
}

impl Measured {
    /// A number by its name (SI).
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    fn set(&mut self, name: &'static str, value: Option<f64>) {
        if let Some(value) = value {
            self.values.insert(name, value);
        }
    }
}

/// How a key is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protocol {
    /// What runs the program.
    pub engine: EngineKind,
    /// How far the key goes (m).
    pub dip_m: f64,
    /// How fast a slow press is (m/s).
    pub speed_m_per_s: f64,
}

impl Protocol {
    /// How an instrument is measured where nobody says otherwise: as far as the bundled gesture
    /// goes.
    pub fn of(model: &Model, engine: EngineKind) -> Protocol {
        Protocol {
            engine,
            dip_m: gesture::dip_m(model),
            speed_m_per_s: SPEED_M_PER_S,
        }
    }
}

/// Measures a key.
///
/// # Errors
/// The engine cannot be built on this machine.
pub fn measure(
    compiled: &Compiled,
    device: &Device,
    protocol: &Protocol,
) -> Result<Measured, RunError> {
    let slow = sweep(compiled, device, protocol)?;
    let twice = Protocol {
        speed_m_per_s: 2.0 * protocol.speed_m_per_s,
        ..*protocol
    };
    let faster = sweep(compiled, device, &twice)?.touch;
    let strokes = strokes::play(compiled, device, protocol).map_err(RunError::Engine)?;
    let touch = &slow.touch;
    let let_off = touch.let_off();
    let down = touch.down_weight();
    let mut found = Measured {
        drop: slow.drop.clone(),
        repeats_beyond: strokes.repetition_hz == Some(REPETITION_MAX_HZ),
        ..Measured::default()
    };
    found.set("down_weight", Some(down));
    found.set("up_weight", Some(touch.up_weight()));
    found.set("balance_weight", Some(0.5 * (down + touch.up_weight())));
    found.set("friction_weight", Some(0.5 * (down - touch.up_weight())));
    found.set("rate_effect", Some(faster.down_weight_like(touch) - down));
    found.set("let_off_travel", let_off.map(|l| l.travel_m));
    found.set("let_off_force", let_off.map(|l| l.force_n));
    found.set("let_off_bump", let_off.map(|l| l.force_n - down));
    found.set("after_travel", let_off.map(|l| protocol.dip_m - l.travel_m));
    found.set("aftertouch", let_off.map(|l| protocol.dip_m - l.end_m));
    found.set("key_dip", Some(protocol.dip_m));
    found.set("repetition_limit", strokes.repetition_hz);
    let (softest, loudest) = strokes.speeds.unzip();
    found.set("softest_strike", softest);
    found.set("loudest_strike", loudest);
    found.set(
        "dynamic_range",
        strokes
            .speeds
            .map(|(softest, loudest)| 20.0 * libm::log10(loudest / softest)),
    );
    found.touch = slow.touch;
    Ok(found)
}
