//! Strings: in motion all along, held at both ends, computed at points.
//!
//! With rho the density, T the tension, S the stiffness and c0, c1 the losses, a string obeys
//!
//! ```text
//!   rho u'' = T d2(u) - S d4(u) - c0 u' + c1 d2(u') + forces
//! ```
//!
//! It is cut into N parts of h = length/N, and a tick k long changes the way v that each point
//! goes in a tick by
//!
//! ```text
//!   (P + 2 Q) w_l - Q (w_(l-1) + w_(l+1)) + V (v_(l-1) + v_(l+1)) - (2 V + R) v_l
//!   w_l = u_(l-1) - 2 u_l + u_(l+1)
//!   P = A T/rho (k/h)^2    Q = A S/rho (k/h^2)^2    V = A c1/rho k/h^2    R = A c0/rho k
//!   A = 1 - x (1 - x)      x = c0/rho k/2
//! ```
//!
//! **It is stable** where `2 (P + 4 Q) + 4 V + R <= 2` and all four are not negative. By
//! Gershgorin's circles no mode is then stiffer than a tick can follow, whatever holds the ends and
//! however the coefficients move; that K0 = P + 2 Q is at least 2 K1 = 2 Q, and K3 = 2 V + R at
//! least 2 K2 = 2 V, holds by the way they are made.

use super::{CellId, Dag, Interval, Node, NodeId};
use whippen_ids::impl_id;
use whippen_rate::Rate;
use whippen_source::Span;

/// Index of a [`Strand`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StrandId(pub u32);

impl_id!(StrandId);

/// How an end is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At rest, free to turn.
    Pinned,
    /// At rest, not free to turn.
    Clamped,
}

/// A number that follows from how many parts a string has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GridNumber {
    /// Parts a metre, 1/h.
    PerMetre,
    /// What a second difference is of the first mode, `4/h^2 sin^2(pi/2N)` (1/m^2).
    FirstMode,
}

/// What is read of a string at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reading {
    /// Where it is (m).
    Displacement,
    /// How fast it moves (m/s).
    Rate,
    /// How much it slopes.
    Slope,
}

/// `string`
#[derive(Debug, Clone)]
pub struct Strand {
    /// Name.
    pub name: String,
    /// Its displacement, as the program calls it.
    pub displacement: String,
    /// Its ends (m).
    pub along: Interval,
    /// Range of the displacement (m): what is read of it is clamped.
    pub range: Interval,
    /// Largest rate either way (m/s).
    pub rate: f64,
    /// How the ends are held.
    pub ends: [End; 2],
    /// How many points are asked for.
    pub points: Option<u32>,
    /// How many parts it has; 0 until that is known.
    pub parts: u32,
    /// Mass per length (kg/m).
    pub density: NodeId,
    /// What pulls it straight: coefficients of `d2(u)` (N), `-d4(u)` (N*m^2), `-u'` (N*s/m^2) and
    /// `d2(u')` (N*s), in this order.
    pub loads: [NodeId; 4],
    /// P, Q, V and R.
    pub coefficients: [NodeId; 4],
    /// Forces at places.
    pub pushes: Vec<Push>,
    /// What rubs it.
    pub friction: Option<Rub>,
    /// The frequency to which it is tuned (Hz).
    pub pitch: Option<NodeId>,
    /// While this holds it lies straight and still.
    pub hold: Option<NodeId>,
    /// Where it is declared.
    pub span: Span,
}

/// `force value at place`
#[derive(Debug, Clone, Copy)]
pub struct Push {
    /// What it changes the way of the string at its place by, over parts of a metre (m a tick).
    pub change: NodeId,
    /// The place (m from where the string begins).
    pub place: NodeId,
    /// Where it stands.
    pub span: Span,
}

/// `friction f(v) at place against w = law` of a string.
#[derive(Debug, Clone)]
pub struct Rub {
    /// Name.
    pub name: String,
    /// What it does to the string.
    pub push: Push,
    /// The slip of the tick before.
    pub last: CellId,
}

impl Strand {
    /// Fewest and most parts.
    pub const PARTS: [u32; 2] = [6, 1024];
    /// So far is the sum of the proof kept from 2, for what integers round.
    pub const MARGIN: f64 = 1.0 / 32_768.0;
    /// What a word of 32 bits may hold of the own losses of a point.
    const LOSSES: f64 = 0.5 - 1.0 / 65_536.0;
    /// A force changes the rate by no more than this part of its range in a tick.
    pub const PUSH: f64 = 0.25;
    /// Places are read and pushed no nearer to an end (parts).
    pub const NEAREST: u32 = 2;

    /// Length (m).
    pub fn length(&self) -> f64 {
        self.along.high - self.along.low
    }

    /// Length of a part (m).
    pub fn part(&self) -> f64 {
        self.length() / f64::from(self.parts.max(1))
    }

    /// Which end a place (m from where it begins) is, if it is one.
    pub fn is_end(&self, place: f64) -> Option<usize> {
        let slack = 1e-9 * self.length();
        [0.0, self.length()]
            .iter()
            .position(|end| (place - end).abs() <= slack)
    }

    /// The point before a place (m from where the string begins), and how much of a part is
    /// between; held to what has two points on either side.
    pub fn cell(&self, place: f64) -> (u32, f64) {
        let nearest = f64::from(Strand::NEAREST);
        let place = (place / self.part()).clamp(nearest, f64::from(self.parts) - nearest);
        let before = (place.floor() as u32).min(self.parts - Strand::NEAREST - 1);
        (before, place - f64::from(before))
    }

    /// What four points count at this part of the way from the second to the third: the cubic
    /// through them.
    pub fn weights(part: f64) -> [f64; 4] {
        let both = part * (1.0 - part);
        [
            -both * (2.0 - part) / 6.0,
            (1.0 - part) * (2.0 + both) / 2.0,
            part * (2.0 + both) / 2.0,
            -both * (1.0 + part) / 6.0,
        ]
    }

    /// The sum of the squares of the weights, from the middle of a part to a point.
    pub const SPREAD: Interval = Interval {
        low: 0.640625,
        high: 1.0,
    };

    /// The sum of the squares of the weights at this part of the way.
    pub fn spread(part: f64) -> f64 {
        let weights = Strand::weights(part);
        let sum: f64 = weights.iter().map(|weight| weight * weight).sum();
        sum.clamp(Strand::SPREAD.low, Strand::SPREAD.high)
    }

    /// What the three differences between them count in the slope, over a part: at a point it is
    /// the mean of both sides, and between it is that of the cubic which has these slopes there
    /// (Catmull-Rom). So it does not jump where a place moves from one part to the next.
    pub fn slopes(part: f64) -> [f64; 3] {
        let both = part * (1.0 - part);
        [
            0.5 - 0.5 * part - 1.5 * both,
            0.5 + 3.0 * both,
            0.5 * part - 1.5 * both,
        ]
    }

    /// A number that follows from the number of parts.
    pub fn number(&self, number: GridNumber) -> f64 {
        let parts = f64::from(self.parts.max(1));
        match number {
            GridNumber::PerMetre => parts / self.length(),
            GridNumber::FirstMode => {
                let s = libm::sin(std::f64::consts::PI / (2.0 * parts));
                4.0 * s * s / (self.part() * self.part())
            }
        }
    }

    /// The largest bend that a tick computes with (m, between neighbours), and what the difference
    /// of neighbours must be within.
    pub fn largest_bend(&self, rate_hz: Rate) -> f64 {
        self.rate / (2.0 * f64::from(rate_hz))
    }

    /// The sum that proves that it is stable, of the largest coefficients.
    pub fn sum([p, q, v, r]: [f64; 4]) -> f64 {
        2.0 * (p + 4.0 * q) + 4.0 * v + r
    }

    /// Whether these coefficients, the largest that they may be, are stable and fit their words.
    pub fn is_stable(largest: [f64; 4]) -> bool {
        let [_, _, v, r] = largest;
        Strand::sum(largest) <= 2.0 - Strand::MARGIN && 2.0 * v + r <= Strand::LOSSES
    }

    /// What is read of it lies here.
    pub fn reach(&self, reading: Reading, rate_hz: Rate) -> Interval {
        /// The weights of a cubic through four points add up to no more, signs aside.
        const WEIGHTS: f64 = 1.25;
        /// The same of a slope, over differences of neighbours.
        const SLOPES: f64 = 1.51;
        match reading {
            Reading::Displacement => self.range,
            Reading::Rate => Interval::around(WEIGHTS * self.rate),
            Reading::Slope => Interval::around(SLOPES * self.largest_bend(rate_hz) / self.part()),
        }
    }
}

/// Builds nodes that fold where they can.
struct Maker<'d>(&'d mut Dag);

impl Maker<'_> {
    fn constant(&mut self, value: f64) -> NodeId {
        self.0.constant(value)
    }

    fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.0.add_folded(Node::Mul(a, b))
    }

    fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.0.add_folded(Node::Sub(a, b))
    }

    fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.0.add_folded(Node::Div(a, b))
    }

    fn number(&mut self, id: StrandId, number: GridNumber) -> NodeId {
        self.0.add(Node::Grid(id, number))
    }
}

/// What losses leave of a change: `A = 1 - x (1 - x)`, which is `1 / (1 + x)` but for the third
/// power of what is small.
fn left(m: &mut Maker, damping: NodeId, density: NodeId, rate_hz: f64) -> NodeId {
    let (one, half) = (m.constant(1.0), m.constant(0.5 / rate_hz));
    let relative = m.div(damping, density);
    let x = m.mul(relative, half);
    let rest = m.sub(one, x);
    let lost = m.mul(x, rest);
    m.sub(one, lost)
}

/// P, Q, V and R of a string with such a density and such loads.
pub fn coefficients(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    density: NodeId,
    loads: [NodeId; 4],
) -> [NodeId; 4] {
    let m = &mut Maker(dag);
    let [tension, stiffness, damping, viscosity] = loads;
    let left = left(m, damping, density, rate_hz);
    let tick = m.constant(1.0 / rate_hz);
    let per_metre = m.number(id, GridNumber::PerMetre);
    let once = m.mul(tick, per_metre);
    let twice = m.mul(once, per_metre);
    let (once, both) = (m.mul(once, once), m.mul(twice, twice));
    let scales = [once, both, twice, tick];
    let loads = [tension, stiffness, viscosity, damping];
    std::array::from_fn(|at| {
        let own = m.div(loads[at], density);
        let scaled = m.mul(own, scales[at]);
        m.mul(left, scaled)
    })
}

/// What a force changes the way of a string by in a tick, over parts of a metre: `A k^2/(rho h) F`.
pub fn pushed(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    [force, density, damping]: [NodeId; 3],
) -> NodeId {
    let m = &mut Maker(dag);
    let left = left(m, damping, density, rate_hz);
    let square = m.constant(1.0 / (rate_hz * rate_hz));
    let per_metre = m.number(id, GridNumber::PerMetre);
    let scale = m.mul(square, per_metre);
    let scale = m.div(scale, density);
    let scale = m.mul(left, scale);
    m.mul(scale, force)
}

/// The tension at which the first mode of the string that is computed, without losses and with
/// pinned ends, has this frequency: `(rho (2/k)^2 sin^2(pi f k) - S e^2) / e`.
pub fn tension(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    [pitch, density, stiffness]: [NodeId; 3],
) -> NodeId {
    let m = &mut Maker(dag);
    let turn = m.constant(std::f64::consts::PI / rate_hz);
    let angle = m.mul(pitch, turn);
    let sine = m.0.add_folded(Node::Function(super::Function::Sin, angle));
    let twice = m.constant(2.0 * rate_hz);
    let sine = m.mul(sine, twice);
    let square = m.mul(sine, sine);
    let mode = m.number(id, GridNumber::FirstMode);
    let square = m.div(square, mode);
    let pulled = m.mul(density, square);
    let stiff = m.mul(stiffness, mode);
    m.sub(pulled, stiff)
}

/// What a force changes the slip at its place by, as the mean of before and after: `A k |I|^2/(2
/// rho h)` (m/s for each N).
pub fn slip_by_force(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    [density, damping, place]: [NodeId; 3],
) -> NodeId {
    let m = &mut Maker(dag);
    let spread = m.0.add(Node::Spread(id, place));
    let scale = slip_of_points(m, id, rate_hz, [density, damping]);
    m.mul(scale, spread)
}

/// The same but for how the weights at the place spread: `A k/(2 rho h)`.
fn slip_of_points(
    m: &mut Maker,
    id: StrandId,
    rate_hz: f64,
    [density, damping]: [NodeId; 2],
) -> NodeId {
    let left = left(m, damping, density, rate_hz);
    let half = m.constant(0.5 / rate_hz);
    let per_metre = m.number(id, GridNumber::PerMetre);
    let scale = m.mul(half, per_metre);
    let scale = m.div(scale, density);
    m.mul(left, scale)
}

/// The force that takes so much off that slip: `D/|I|^2` over the rest, which is all that moves it.
pub fn force_of_slip(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    [taken, density, damping, place]: [NodeId; 4],
) -> NodeId {
    let m = &mut Maker(dag);
    let spread = m.0.add(Node::Spread(id, place));
    let scale = slip_of_points(m, id, rate_hz, [density, damping]);
    let own = m.div(taken, spread);
    m.div(own, scale)
}

/// What takes so much off that slip, in the way of a string in a tick: `-2 k D/|I|^2`.
pub fn push_of_slip(
    dag: &mut Dag,
    id: StrandId,
    rate_hz: f64,
    [taken, place]: [NodeId; 2],
) -> NodeId {
    let m = &mut Maker(dag);
    let spread = m.0.add(Node::Spread(id, place));
    let twice = m.constant(-2.0 / rate_hz);
    let scaled = m.mul(twice, taken);
    m.div(scaled, spread)
}
