//! The analysis: pieces to systems, systems against the key by itself and against every hand.

use std::cell::RefCell;
use std::collections::HashSet;

use num_complex::Complex64;
use rustc_hash::{FxHashMap, FxHashSet};

use super::gradient::{decided, is_point};
use super::hands::hands;
use super::key::{Hand, Held, Key};
use super::linear::{Linear, System};
use super::margin::{Margin, angles, margin, on_circle};
use super::passive::{Hold, damping_for_changing};
use super::pieces::{Law, Piece};
use super::response::{Differentiator, forces, settles};
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_lang::model::{Interval, Model, Node, NodeId};

/// So many parameters are taken at all combinations of their ends; beyond, each at its ends by
/// itself.
const COMBINED_MAX: usize = 4;

/// What a hand makes of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerHand {
    /// The hand.
    pub hand: Hand,
    /// The forces may be so many times what they are before the loop rings; below 1 it does.
    pub factor: f64,
    /// What it rings with at that border (Hz); 0 where there is none.
    pub ring_hz: f64,
}

/// One linear system that occurs: some pieces of the law at some values of its parameters.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Machine states and live switches that it is found in first, with where `x` then lies.
    pub name: String,
    /// Stiffness, damping and mass felt directly (SI), summed over the senses.
    pub gains: [f64; 3],
    /// Cells that move along (coordinates, rates, memories).
    pub coupled: usize,
    /// Whether what moves along comes to rest while the key stands still.
    pub settles: bool,
    /// Damping the key needs to be passive here (N*s/m).
    pub damping_needed: f64,
    /// The hand that bears it least.
    pub worst: PerHand,
    pub(super) system: System,
}

/// The stability budget of one instrument on one device.
#[derive(Debug, Clone)]
pub struct Stability {
    /// The device's loop.
    pub key: Key,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Stiffness, damping and mass over everything that occurs, by interval differentiation.
    pub largest: [Interval; 3],
    /// What occurs, the worst first.
    pub modes: Vec<Mode>,
    /// Damping that suffices where gains change while playing; none where something moves along,
    /// which it does not cover.
    pub damping_for_changing: Option<f64>,
    /// The most by which one word of the sensor changes the force.
    pub force_per_word: f64,
    /// Some choices were left open: derivatives of both branches are taken together.
    pub coarse: bool,
    pub(super) loops: Loops,
}

impl Stability {
    /// Damping the key needs so that no hand can draw energy from any mode (N*s/m).
    pub fn damping_needed(&self) -> f64 {
        self.modes
            .iter()
            .map(|mode| mode.damping_needed)
            .fold(0.0, f64::max)
    }

    /// Whether the key's own friction makes every mode passive.
    pub fn is_passive(&self) -> bool {
        self.modes.iter().all(|mode| mode.settles) && self.key.damping >= self.damping_needed()
    }

    /// The factor by which forces may grow before the worst mode rings in the worst hand.
    pub fn factor(&self) -> f64 {
        self.modes
            .iter()
            .map(|mode| mode.worst.factor)
            .fold(f64::INFINITY, f64::min)
    }

    /// Whether no mode rings with any hand.
    pub fn is_stable(&self) -> bool {
        self.modes
            .iter()
            .all(|mode| mode.settles && mode.worst.factor > 1.0)
    }

    /// Whether one word more or less of the sensor moves nothing: dry friction holds it (Abbott and
    /// Okamura 2005: `K <= 2 f_c / LSB`).
    pub fn is_quiet(&self) -> bool {
        0.5 * self.force_per_word <= self.key.friction
    }
}

/// Everything about frequency that does not depend on the program's state: made once.
#[derive(Debug, Clone)]
pub(super) struct Loops {
    pub rate_hz: f64,
    pub angles: Vec<f64>,
    pub differentiators: Vec<Differentiator>,
    pub hands: Vec<(Hand, Held, Vec<Complex64>)>,
    /// `x`, `x'`, `x''` of every sense at the angles: on the circle, and on the unit circle.
    inputs: [Vec<Vec<Complex64>>; 2],
    holds: Vec<Hold>,
}

/// What was found between the angles, by the angle's bits: hands and systems halve the same steps.
#[derive(Debug, Default)]
pub(super) struct Between {
    /// Of the key in a hand, by its number too.
    gains: FxHashMap<(usize, u64), Complex64>,
    inputs: FxHashMap<u64, Vec<Complex64>>,
    /// Of all terms of one system.
    sums: FxHashMap<u64, Complex64>,
}

impl Loops {
    fn new(model: &Model, key: &Key) -> Loops {
        let rate_hz = f64::from(model.rate_hz);
        let angles = angles(rate_hz);
        let held = |hand: Hand| {
            let held = Held::new(key, &hand, rate_hz);
            let gains = angles
                .iter()
                .map(|theta| held.at(on_circle(*theta, rate_hz)))
                .collect();
            (hand, held, gains)
        };
        let differentiators: Vec<Differentiator> = model
            .senses
            .iter()
            .map(|s| Differentiator::new(s.window, rate_hz))
            .collect();
        let inputs = |z: &dyn Fn(f64) -> Complex64| {
            angles
                .iter()
                .map(|theta| inputs(&differentiators, z(*theta)))
                .collect::<Vec<_>>()
        };
        Loops {
            rate_hz,
            inputs: [inputs(&|theta| on_circle(theta, rate_hz)), inputs(&on_unit)],
            hands: hands(model.turns()).into_iter().map(held).collect(),
            holds: angles
                .iter()
                .map(|theta| Hold::new(key, rate_hz, *theta))
                .collect(),
            differentiators,
            angles,
        }
    }

    /// Forces of all terms for a unit of `x`, at an angle of the circle.
    pub fn forces(&self, system: &System, theta: f64) -> Vec<Complex64> {
        let z = on_circle(theta, self.rate_hz);
        forces(system, z, &inputs(&self.differentiators, z))
    }

    /// The sum of all terms at every angle.
    fn responses(
        &self,
        system: &System,
        inputs: &[Vec<Complex64>],
        z: impl Fn(f64) -> Complex64,
    ) -> Vec<Complex64> {
        let at = |(theta, inputs): (&f64, &Vec<Complex64>)| {
            forces(system, z(*theta), inputs).iter().sum()
        };
        self.angles.iter().zip(inputs).map(at).collect()
    }

    /// The margin in the hand that bears it least.
    pub fn worst(&self, system: &System, between: &mut Between) -> PerHand {
        let system = &system.summed();
        let responses = self.responses(system, &self.inputs[0], |theta| {
            on_circle(theta, self.rate_hz)
        });
        between.sums.clear();
        let between = RefCell::new(between);
        let per_hand = self
            .hands
            .iter()
            .enumerate()
            .map(|(number, (hand, held, gains))| {
                let at = |theta: f64| {
                    let z = on_circle(theta, self.rate_hz);
                    let Between {
                        gains,
                        inputs: known,
                        sums,
                    } = &mut **between.borrow_mut();
                    let gain = *gains
                        .entry((number, theta.to_bits()))
                        .or_insert_with(|| held.at(z));
                    let sum = sums.entry(theta.to_bits()).or_insert_with(|| {
                        let inputs = known
                            .entry(theta.to_bits())
                            .or_insert_with(|| inputs(&self.differentiators, z));
                        forces(system, z, inputs).iter().sum()
                    });
                    gain * *sum
                };
                let known: Vec<Complex64> =
                    gains.iter().zip(&responses).map(|(p, h)| p * h).collect();
                let Margin { factor, theta } = margin(&self.angles, &known, &at);
                PerHand {
                    hand: *hand,
                    factor,
                    ring_hz: theta * self.rate_hz / std::f64::consts::TAU,
                }
            });
        let least = |a: PerHand, b: PerHand| if b.factor < a.factor { b } else { a };
        per_hand.reduce(least).unwrap_or(PerHand {
            hand: Hand::FREE,
            factor: f64::INFINITY,
            ring_hz: 0.0,
        })
    }

    /// What holds for a system.
    fn mode(&self, name: String, system: System, between: &mut Between) -> Mode {
        let direct = |part: usize| {
            system
                .outputs
                .iter()
                .flat_map(move |o| o.direct.iter().skip(part).step_by(3))
                .sum()
        };
        Mode {
            name,
            gains: std::array::from_fn(direct),
            coupled: system.a.len(),
            settles: settles(&system.a, on_circle(0.0, self.rate_hz).re),
            damping_needed: self.damping_needed(&system),
            worst: self.worst(&system, between),
            system,
        }
    }

    /// Damping that the key needs to be passive.
    fn damping_needed(&self, system: &System) -> f64 {
        let responses = self.responses(&system.summed(), &self.inputs[1], on_unit);
        // Below 1 rad/s nothing is sampled: what is left there is the limit.
        let places = self.angles.iter().zip(self.holds.iter().zip(&responses));
        let places = places.filter(|(theta, _)| **theta * self.rate_hz >= 1.0);
        places
            .map(|(_, (hold, response))| hold.damping(*response))
            .fold(0.0, f64::max)
    }
}

fn on_unit(theta: f64) -> Complex64 {
    Complex64::from_polar(1.0, theta)
}

/// `x`, `x'`, `x''` of every sense for a unit of `x`.
fn inputs(differentiators: &[Differentiator], z: Complex64) -> Vec<Complex64> {
    differentiators.iter().flat_map(|d| d.at(z)).collect()
}

/// The stability budget of an instrument as checked; `None` where its values cannot be bounded.
pub fn analyze(model: &Model, key: &Key) -> Option<Stability> {
    analyze_law(&Law::of(model)?, key)
}

/// The same of its law.
pub fn analyze_law(law: &Law, key: &Key) -> Option<Stability> {
    let (model, loops) = (&law.model, Loops::new(&law.model, key));
    let mut found = Found {
        law,
        exactly: FxHashSet::default(),
        known: HashSet::new(),
        systems: Vec::new(),
    };
    let mut coarse = false;
    for (piece, rows) in law.pieces() {
        coarse |= piece.coarse;
        let linear = Linear::of(law, piece, rows);
        for corner in found.corners(piece, linear) {
            for system in corner.corners() {
                found.add(piece, system);
            }
        }
    }
    let mut modes = parallel::map_with(
        found.systems,
        Between::default,
        |between, (name, system)| loops.mode(name, system, between),
    );
    modes.sort_by(|a, b| a.worst.factor.total_cmp(&b.worst.factor));
    let whole = law.whole();
    let rows = law.rows(&whole).ok()?;
    let linear = Linear::of(law, &whole, &rows);
    let largest = std::array::from_fn(|part| {
        (0..model.senses.len())
            .map(|s| linear.total(3 * s + part))
            .fold(Interval::point(0.0), |sum, v| sum + v)
    });
    let sizes = largest.map(Interval::magnitude);
    let most = |of: &dyn Fn(&Differentiator) -> [f64; 2]| {
        loops
            .differentiators
            .iter()
            .map(of)
            .fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
    };
    let gains = most(&|d| d.gains(loops.rate_hz));
    let steps = most(&Differentiator::steps);
    let alone = modes.iter().all(|mode| mode.coupled == 0);
    Some(Stability {
        key: *key,
        rate_hz: loops.rate_hz,
        largest,
        modes,
        damping_for_changing: alone.then(|| damping_for_changing(key, loops.rate_hz, sizes, gains)),
        force_per_word: key.sensor_lsb * (sizes[0] + sizes[1] * steps[0] + sizes[2] * steps[1]),
        coarse,
        loops,
    })
}

struct Found<'a> {
    law: &'a Law,
    /// What systems are, in bits, and in words.
    exactly: FxHashSet<Vec<u64>>,
    known: HashSet<String>,
    /// Each with the name of the piece that it was found in.
    systems: Vec<(String, System)>,
}

impl Found<'_> {
    /// The systems of a piece at the ends of what parameters may be.
    fn corners(&self, piece: &Piece, linear: Linear<Interval>) -> Vec<Linear<Interval>> {
        let point = |row: &Vec<Interval>| row.iter().all(|v| is_point(*v));
        let fixed = linear.a.iter().chain(&linear.b).all(point)
            && linear
                .outputs
                .iter()
                .all(|o| point(&o.direct) && point(&o.cells));
        let parameters = self.law.parameters();
        if fixed || parameters.is_empty() {
            return vec![linear];
        }
        let mut found = Vec::new();
        for ends in ends(&parameters, &piece.at) {
            // A corner in which the piece does not occur is left out.
            let Some(given) = self.law.given(piece, &ends) else {
                continue;
            };
            if let Ok(rows) = self.law.rows(&given) {
                found.push(Linear::of(self.law, &given, &rows));
            }
        }
        found
    }

    fn add(&mut self, piece: &Piece, system: System) {
        let outputs = system
            .outputs
            .iter()
            .flat_map(|o| o.direct.iter().chain(&o.cells));
        let numbers = outputs
            .chain(system.a.iter().flatten())
            .chain(system.b.iter().flatten());
        // Most are known to the last bit, and need no words.
        let number = |v: &f64| format!("{v:.5e},");
        if self
            .exactly
            .insert(numbers.clone().map(|v| v.to_bits()).collect())
            && self.known.insert(numbers.map(number).collect())
        {
            self.systems.push((name(&self.law.model, piece), system));
        }
    }
}

/// All combinations of the ends of some parameters, or each by itself if there are many.
fn ends(parameters: &[NodeId], at: &IdMap<NodeId, Interval>) -> Vec<Vec<(NodeId, Interval)>> {
    let own = |p: &NodeId| at[p];
    let end = |p: &NodeId, high: bool| {
        (
            *p,
            Interval::point(if high { own(p).high } else { own(p).low }),
        )
    };
    if parameters.len() <= COMBINED_MAX {
        let corners = 0..1usize << parameters.len();
        return corners
            .map(|corner| {
                parameters
                    .iter()
                    .enumerate()
                    .map(|(bit, p)| end(p, corner >> bit & 1 == 1))
                    .collect()
            })
            .collect();
    }
    parameters
        .iter()
        .flat_map(|p| [vec![end(p, false)], vec![end(p, true)]])
        .collect()
}

/// `contact is touching, support is jack; x in 0 mm .. 6 mm`
fn name(model: &Model, piece: &Piece) -> String {
    let mut words = Vec::new();
    for (id, node) in model.dag.nodes() {
        let value = decided(&piece.at, id);
        match (node, value) {
            (Node::Is(machine, state), Some(true)) if model.machines[machine].states.len() > 1 => {
                let machine = &model.machines[machine];
                words.push(format!(
                    "{} is {}",
                    machine.name, machine.states[*state as usize]
                ));
            }
            (Node::LiveBool(live), Some(on)) => {
                words.push(format!(
                    "{} {}",
                    model.lives[*live as usize].name,
                    if on { "on" } else { "off" }
                ));
            }
            (Node::Sense(sense), _) => {
                let own = piece.at[id];
                let sense = &model.senses[*sense as usize];
                if own.width() < 0.999 * sense.range.width() {
                    words.push(format!(
                        "{} in {}",
                        sense.name,
                        whippen_lang::units::shown_range(own, sense.dim)
                    ));
                }
            }
            _ => {}
        }
    }
    if words.is_empty() {
        "everywhere".to_string()
    } else {
        words.join(", ")
    }
}
