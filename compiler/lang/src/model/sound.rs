//! Noise, delay lines and sound.

use super::{Interval, NodeId};
use crate::units::Dim;
use whippen_ids::impl_id;
use whippen_source::Span;

/// Index of a [`Noise`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NoiseId(pub u32);
/// Index of a [`Delay`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DelayId(pub u32);
/// Index of a use of `tuned`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TunedId(pub u32);

impl_id!(NoiseId, DelayId, TunedId);

/// `noise`: a number between -1 and 1, another one in every tick.
#[derive(Debug, Clone)]
pub struct Noise {
    /// Name.
    pub name: String,
    /// The first word of each key, in the order of the keys; the last one for all that follow.
    pub seeds: Vec<u32>,
    /// Where it is declared.
    pub span: Span,
}

impl Noise {
    /// The word of the next tick (Numerical Recipes' multiplier, modulo 2^32).
    pub fn stir(word: u32) -> u32 {
        word.wrapping_mul(Noise::FACTOR).wrapping_add(Noise::STEP)
    }

    /// The factor of [`Noise::stir`].
    pub const FACTOR: u32 = 1_664_525;
    /// What [`Noise::stir`] adds.
    pub const STEP: u32 = 1_013_904_223;

    /// The number that a word stands for: its upper 31 bits, -1 .. 1.
    pub fn value(word: u32) -> f64 {
        f64::from(word as i32 >> 1) / f64::from(1_u32 << 30)
    }

    /// The first word of a key (MIDI number): from the noise's full name and the key, stirred until
    /// keys that lie side by side are far apart.
    pub fn seed(name: &str, key: u8) -> u32 {
        let bytes = name.bytes().chain([key]);
        // FNV-1a.
        let mixed = bytes.fold(0x811c_9dc5, |hash: u32, byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        });
        (0..4).fold(mixed, |word, _| Noise::stir(word))
    }

    /// The first word of a key, by its place among the keys.
    pub fn first(&self, key: usize) -> u32 {
        let seed = self.seeds.get(key).or(self.seeds.last());
        seed.copied().unwrap_or_default()
    }
}

/// `delay`: what was fed, for a while.
#[derive(Debug, Clone)]
pub struct Delay {
    /// Name.
    pub name: String,
    /// Dimension of what is fed.
    pub dim: Dim,
    /// Range of what is fed (SI): it is clamped to it.
    pub range: Interval,
    /// How many ticks back it reaches, at least 1.
    pub ticks: u32,
    /// What is fed in every tick.
    pub feed: NodeId,
    /// Where it is declared.
    pub span: Span,
}

impl Delay {
    /// So many bits of the range are kept of what is fed: the rest is cut off towards zero, so that
    /// loops with a gain below 1 end in silence.
    pub const BITS: i32 = 24;
    /// Least ticks of `tuned`: the fraction is 0.3 .. 1.3 ticks, and the rest is whole.
    pub const TUNED_TICKS_MIN: f64 = 1.3;
    /// Least fraction of a tick that `tuned` leaves to its allpass.
    pub const FRACTION_MIN: f64 = 0.3;

    /// How far from zero what is read by `tuned` may be: an allpass with coefficient `eta` gives at
    /// most `(1 + eta) / (1 - eta)` times what goes in, which is `1 / fraction`, and what a table
    /// of `eta` may be off.
    pub fn tuned_reach(&self) -> f64 {
        self.range.magnitude() * 1.0001 / Delay::FRACTION_MIN
    }

    /// Coefficient of the allpass that delays by a fraction of a tick (Jaffe and Smith 1983), for
    /// low frequencies.
    pub fn allpass(fraction: f64) -> f64 {
        (1.0 - fraction) / (1.0 + fraction)
    }

    /// By how much the coefficient changes at most with the fraction (per tick).
    pub fn allpass_slope() -> f64 {
        2.0 / (1.0 + Delay::FRACTION_MIN).powi(2)
    }
}

/// A side from which sound comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Channel 0.
    Left,
    /// Channel 1.
    Right,
}

/// `sound`: a term of what is heard.
#[derive(Debug, Clone)]
pub struct Sound {
    /// Its label.
    pub name: String,
    /// Its value: -1 .. 1 is full scale.
    pub value: NodeId,
    /// From which side; `None` from everywhere.
    pub side: Option<Side>,
    /// Where it is declared.
    pub span: Span,
}
