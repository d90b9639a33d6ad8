//! How strings vibrate: their shapes in slow motion, in short windows spread evenly over a run.
//!
//! ```text
//!   run      |----[==]--------[==]--------[==]--------[==]----|
//!   window   4 periods of the string, at most 96 shapes of at most 65 places
//! ```
//!
//! Memory is bounded however long a run lasts: all strings together have at most 64 windows, and a
//! string no more than 16. A window is long enough to show what a string does and short enough to
//! see each of its shapes.

use std::f64::consts::{PI, TAU};

use whippen_compiler::ideal::{Ideal, RealStrand};
use whippen_compiler::model::Strand;
use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::sticking::Sticking;

/// Periods of a window.
const PERIODS: f64 = 4.0;
/// Most shapes of a window.
const SHAPES_MAX: usize = 96;
/// Most windows of a string.
const WINDOWS_MAX: usize = 16;
/// Most windows of all strings together.
const ALL_WINDOWS_MAX: usize = 64;
/// Most places of a shape, ends included.
const PLACES_MAX: usize = 65;
/// What moves by less than this part of its range stands still, but for rounding.
const STILL: f64 = 1e-6;
/// The frequency of a string whose own is not known (Hz).
const USUAL_HZ: f64 = 200.0;

/// How a string vibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct Vibration {
    /// Its name.
    pub name: String,
    /// Its ends, as the program says them (m).
    pub along_m: [f64; 2],
    /// The name of what rubs it.
    pub friction: Option<String>,
    /// Places of a shape, evenly from end to end.
    pub places: usize,
    /// Ticks from a shape to the next.
    pub every: usize,
    /// Its windows, in the order of time.
    pub windows: Vec<Shapes>,
    /// What moves less stands still (m).
    least_m: f64,
    /// When each window begins, and how many shapes each has at most.
    begins: Vec<usize>,
    shapes_max: usize,
}

/// A window: shapes, one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shapes {
    /// The tick of the first.
    pub first: usize,
    /// Displacements (m) of each shape.
    pub shapes: Vec<Vec<f32>>,
    /// What rubs the string at each: what it does, and where (a part of the string).
    pub rubbed: Vec<Option<(Sticking, f32)>>,
}

impl Shapes {
    /// The greatest displacement either way (m).
    pub fn greatest(&self) -> f32 {
        let all = self.shapes.iter().flatten();
        all.fold(0.0, |most, u| most.max(u.abs()))
    }
}

impl Vibration {
    /// Of a string (its number among the lowered) in a run of so many ticks.
    pub fn new(compiled: &Compiled, device: &Device, number: usize, ticks: usize) -> Vibration {
        let lowered = compiled.lowered.strands[number];
        let strand = &compiled.model.strands[lowered.strand];
        let strings = compiled.lowered.strands.len().max(1);
        let period = f64::from(compiled.model.rate_hz) / first_mode_hz(compiled, device, strand);
        let wanted = (PERIODS * period).ceil() as usize;
        let every = wanted.div_ceil(SHAPES_MAX).max(1);
        let shapes_max = wanted.div_ceil(every).clamp(1, SHAPES_MAX);
        let long = shapes_max * every;
        let most = (ALL_WINDOWS_MAX / strings).clamp(1, WINDOWS_MAX);
        let count = (ticks / long).clamp(1, most);
        let middle = |window: usize| (2 * window + 1) * ticks / (2 * count);
        Vibration {
            name: strand.name.clone(),
            along_m: [strand.along.low, strand.along.high],
            friction: strand.friction.as_ref().map(|rub| rub.name.clone()),
            places: (strand.parts as usize + 1).min(PLACES_MAX),
            every,
            windows: Vec::new(),
            least_m: STILL * strand.range.magnitude(),
            begins: (0..count)
                .map(|window| middle(window).saturating_sub(long / 2))
                .collect(),
            shapes_max,
        }
    }

    /// Whether the shape of a tick is kept.
    pub fn wants(&self, tick: usize) -> bool {
        let Some(begin) = self.begins.iter().rev().find(|begin| **begin <= tick) else {
            return false;
        };
        let since = tick - begin;
        since.is_multiple_of(self.every) && since / self.every < self.shapes_max
    }

    /// Keeps the shape of a tick that is wanted, and what rubs it: what that does, and where (m
    /// from where the string begins).
    pub fn push(&mut self, tick: usize, state: &RealStrand, rubbed: Option<(Sticking, f64)>) {
        let is_first = self.begins.contains(&tick);
        if is_first || self.windows.is_empty() {
            self.windows.push(Shapes {
                first: tick,
                ..Shapes::default()
            });
        }
        let length_m = self.along_m[1] - self.along_m[0];
        let last = (state.u.len() - 1) as f64;
        let places = self.places.max(2);
        let place = |at: usize| {
            let place = at as f64 / (places - 1) as f64 * last;
            let before = (place.floor() as usize).min(state.u.len() - 2);
            let part = place - before as f64;
            (state.u[before] * (1.0 - part) + state.u[before + 1] * part) as f32
        };
        if let Some(window) = self.windows.last_mut() {
            window.shapes.push((0..places).map(place).collect());
            let part = |(does, place_m): (Sticking, f64)| (does, (place_m / length_m) as f32);
            window.rubbed.push(rubbed.map(part));
        }
    }

    /// The window in which it moved most, if it moved.
    pub fn loudest(&self) -> Option<&Shapes> {
        let louder = |a: &&Shapes, b: &&Shapes| a.greatest().total_cmp(&b.greatest());
        let found = self.windows.iter().max_by(louder);
        found.filter(|window| f64::from(window.greatest()) > self.least_m)
    }
}

/// The frequency of the first mode of a string (Hz), with what is live as it begins.
pub fn first_mode_hz(compiled: &Compiled, device: &Device, strand: &Strand) -> f64 {
    let model = &compiled.model;
    let mut ideal = Ideal::new(model, &device.scales(), 1);
    ideal.tick(&vec![0; model.senses.len()]);
    let coefficients = strand.coefficients.map(|node| ideal.value(0, node));
    let hz = first_mode(strand, coefficients) * f64::from(model.rate_hz);
    if hz > 0.0 { hz } else { USUAL_HZ }
}

/// Frequency of the first mode as it fades (turns a tick), with pinned ends, by P, Q, V and R.
fn first_mode(strand: &Strand, [p, q, v, r]: [f64; 4]) -> f64 {
    let half = (PI / (2.0 * f64::from(strand.parts))).sin();
    let s = 4.0 * half * half;
    let (pull, loss) = (p * s + q * s * s, v * s + r);
    let cosine = (2.0 - loss - pull) / (2.0 * (1.0 - loss).sqrt());
    cosine.clamp(-1.0, 1.0).acos() / TAU
}
