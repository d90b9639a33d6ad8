//! What would make a mode stable: less of a term, some damping, a shorter window. Each is searched
//! with the criterion itself, so that what is told passes it.

use std::cell::{Cell, OnceCell, RefCell};

use super::linear::System;
use super::loops::{Between, Loops};
use super::modes::{Mode, Stability};

/// So often an interval is halved: three digits also of a small part.
const HALVINGS: u32 = 14;

/// So many modes are judged in all, 49 hands each; what is not settled then is not advised.
const JUDGED_MAX: u32 = 2000;

/// A value that suits one mode is tried on all; so often one that it does not suit joins the
/// search.
const JOINS_MAX: usize = 4;

/// Added damping is looked for up to this share of what turns mass against frequency, in doublings.
const DAMPING_MOST: f64 = 16.0;
const DOUBLINGS: i32 = 14;

/// A value that was looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Looked {
    /// This passes.
    Found(f64),
    /// This passes where this term is to blame, and elsewhere others ring without it, too.
    Partly(f64),
    /// None passes.
    Never,
    /// It was not looked for to the end.
    Unknown,
}

/// Finds a value that passes.
type Find<'f> = dyn Fn(&dyn Fn(f64) -> bool) -> Option<f64> + 'f;

/// A search through values.
pub(super) struct Search<'a> {
    stability: &'a Stability,
    left: Cell<u32>,
    between: RefCell<Between>,
    shorter: OnceCell<Loops>,
}

impl<'a> Search<'a> {
    pub fn new(stability: &'a Stability) -> Search<'a> {
        Search {
            stability,
            left: Cell::new(JUDGED_MAX),
            between: RefCell::default(),
            shorter: OnceCell::new(),
        }
    }

    /// The largest part of a force term's stiffness, damping or mass (0, 1, 2) with which its modes
    /// ring in no hand; what is felt of cells is taken with it.
    pub fn part(&self, force: usize, kind: usize, own: &[&'a Mode]) -> Looked {
        let scale = |system: &mut System, part: f64| {
            let output = &mut system.outputs[force];
            let direct = output.direct.iter_mut().skip(kind).step_by(3);
            direct
                .chain(&mut output.cells)
                .for_each(|gain| *gain *= part);
        };
        let find = |passes: &dyn Fn(f64) -> bool| passes(0.0).then(|| halved(0.0, 1.0, passes));
        // Where others ring without it, too, it is theirs to be less.
        let alone = |mode: &&&Mode| self.ringing(&[**mode], 0.0, &scale).is_none();
        let able: Vec<&Mode> = own.iter().filter(alone).copied().collect();
        if able.is_empty() {
            Looked::Never
        } else {
            match self.guided(&able, &able, &scale, &find) {
                Looked::Found(part) if able.len() < own.len() => Looked::Partly(part),
                found => found,
            }
        }
    }

    /// The least damping that, added to the program as `b * x'`, makes these modes stable and
    /// leaves the others so.
    pub fn damping(&self, own: &[&'a Mode]) -> Looked {
        let Some(worst) = own.first().map(|mode| mode.worst) else {
            return Looked::Never;
        };
        let mass = self.stability.key.mass + worst.hand.mass;
        let most = DAMPING_MOST * mass * std::f64::consts::TAU * worst.ring_hz.max(1.0);
        let add = |system: &mut System, damping: f64| {
            if let Some(speed) = system.outputs.first_mut().and_then(|o| o.direct.get_mut(1)) {
                *speed += damping;
            }
        };
        let find = |passes: &dyn Fn(f64) -> bool| {
            let tried = (0..DOUBLINGS).map(|i| most / 2.0_f64.powi(DOUBLINGS - 1 - i));
            let enough = tried.into_iter().find(|b| passes(*b))?;
            let least = halved(enough, 0.5 * enough, passes);
            let told = rounded_up(least);
            passes(told).then_some(told)
        };
        let others = self.stability.modes.iter().filter(|m| m.worst.factor > 1.0);
        let all: Vec<&Mode> = own.iter().copied().chain(others).collect();
        self.guided(own, &all, &add, &find)
    }

    /// The window of half the length (ticks) if with such ones these modes are stable as they are;
    /// none where nothing in them depends on a speed or an acceleration.
    pub fn shorter_window(&self, own: &[&'a Mode]) -> Option<u32> {
        let primed = |mode: &&Mode| {
            let rows = mode.system.outputs.iter().map(|o| &o.direct);
            let mut rows = rows.chain(&mode.system.b);
            rows.any(|row| row.iter().enumerate().any(|(i, v)| i % 3 > 0 && *v != 0.0))
        };
        if !own.iter().any(primed) {
            return None;
        }
        let loops = &self.stability.loops;
        let shorter = (self.shorter).get_or_init(|| loops.with_half_windows());
        let stable = |mode: &&Mode| {
            let factor = |loops: &Loops| loops.worst(&mode.system, &mut Between::default()).factor;
            self.spend() && factor(shorter) > 1.0
        };
        let first = shorter.differentiators.first()?;
        own.iter().all(stable).then(|| first.window())
    }

    /// Searches for a value that suits all modes, by those that it is found not to suit.
    fn guided(
        &self,
        own: &[&'a Mode],
        all: &[&'a Mode],
        change: &dyn Fn(&mut System, f64),
        find: &Find,
    ) -> Looked {
        let mut held: Vec<&Mode> = own.iter().take(1).copied().collect();
        for _ in 0..JOINS_MAX {
            let found = find(&|value| self.ringing(&held, value, change).is_none());
            let Some(value) = found.filter(|_| self.left.get() > 0) else {
                return if self.left.get() > 0 {
                    Looked::Never
                } else {
                    Looked::Unknown
                };
            };
            match self.ringing(all, value, change) {
                None => return Looked::Found(value),
                Some(mode) => held.push(mode),
            }
        }
        Looked::Unknown
    }

    /// The first mode that is not stable in every hand with a value.
    fn ringing<'m>(
        &self,
        modes: &[&'m Mode],
        value: f64,
        change: &dyn Fn(&mut System, f64),
    ) -> Option<&'m Mode> {
        let rings = |mode: &&&Mode| {
            let mut system = mode.system.clone();
            change(&mut system, value);
            let loops = &self.stability.loops;
            !self.spend() || loops.worst(&system, &mut self.between.borrow_mut()).factor <= 1.0
        };
        modes.iter().find(rings).copied()
    }

    /// Takes one judgement; false where none is left.
    fn spend(&self) -> bool {
        let left = self.left.get();
        self.left.set(left.saturating_sub(1));
        left > 0
    }
}

/// The last value on the way from one that passes to one that does not.
fn halved(passing: f64, failing: f64, passes: &dyn Fn(f64) -> bool) -> f64 {
    let (mut good, mut bad) = (passing, failing);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if passes(middle) {
            good = middle
        } else {
            bad = middle
        }
    }
    good
}

/// Three digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Three digits, towards zero.
pub(super) fn rounded_down(value: f64) -> f64 {
    let close = rounded(value);
    if close.abs() > value.abs() {
        rounded(value * 0.995)
    } else {
        close
    }
}

/// Three digits, away from zero.
fn rounded_up(value: f64) -> f64 {
    let close = rounded(value);
    if close.abs() < value.abs() {
        rounded(value * 1.005)
    } else {
        close
    }
}
