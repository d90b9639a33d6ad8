//! The analysis: pieces to systems, systems against the key by itself and against every hand.

use std::collections::HashMap;

use rustc_hash::FxHashMap;

use super::gradient::{decided, is_point};
use super::key::Key;
use super::linear::{Linear, System};
use super::loops::{Between, Loops, PerHand};
use super::passive::damping_for_changing;
use super::pieces::{Law, Piece};
use super::place::{PLACES_MAX, Place};
use super::response::Differentiator;
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_lang::model::{Interval, Model, Node, NodeId};

/// So many parameters are taken at all combinations of their ends; beyond, each at its ends by
/// itself.
const COMBINED_MAX: usize = 6;

/// So often a piece is cut along something, and into so many parts.
const CUTS_MAX: u32 = 200;
const CUT_IN: u32 = 48;

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
    /// Its derivatives are ends of intervals: some may be larger than any that occurs.
    pub bounded: bool,
    /// Found only where choices were left open, with the derivatives of all branches.
    pub(super) coarse: bool,
    /// Where it occurs; the first few.
    pub places: Vec<Place>,
    pub(super) system: System,
}

impl Mode {
    fn is_stable(&self) -> bool {
        self.settles && self.worst.factor > 1.0
    }
}

/// The stability budget of one instrument on one device.
#[derive(Debug, Clone)]
pub struct Stability {
    /// The port whose loop it is, where an instrument has several.
    pub port: Option<String>,
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
    /// So many linear systems are of both branches of choices that were left open, and not all of
    /// them are stable: they say nothing, and are not among the modes.
    pub undecided: usize,
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

    /// Whether no mode rings with any hand, and nothing is left to be decided.
    pub fn is_stable(&self) -> bool {
        self.undecided == 0 && self.is_stable_where_decided()
    }

    /// Whether no mode rings with any hand.
    pub fn is_stable_where_decided(&self) -> bool {
        self.modes.iter().all(Mode::is_stable)
    }

    /// Whether one word more or less of the sensor moves nothing: dry friction holds it (Abbott and
    /// Okamura 2005: `K <= 2 f_c / LSB`).
    pub fn is_quiet(&self) -> bool {
        0.5 * self.force_per_word <= self.key.friction
    }
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
        cuts: CUTS_MAX,
        exactly: FxHashMap::default(),
        known: HashMap::new(),
        systems: Vec::new(),
    };
    for (piece, rows) in law.pieces() {
        let linear = Linear::of(law, piece, rows);
        for (given, corner) in found.corners(piece, linear) {
            let systems = corner.corners();
            let bounded = systems.len() > 1;
            for system in systems {
                found.add((piece, bounded), &given, system);
            }
        }
    }
    let mut modes = parallel::map_with(found.systems, Between::default, |between, found| {
        loops.mode(found, between)
    });
    let all = modes.len();
    // What is stable even with both branches of all choices needs no decision.
    if !modes.iter().all(|mode| !mode.coarse || mode.is_stable()) {
        modes.retain(|mode| !mode.coarse);
    }
    let undecided = all - modes.len();
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
        port: None,
        key: *key,
        rate_hz: loops.rate_hz,
        largest,
        modes,
        damping_for_changing: alone.then(|| damping_for_changing(key, loops.rate_hz, sizes, gains)),
        force_per_word: key.sensor_lsb * (sizes[0] + sizes[1] * steps[0] + sizes[2] * steps[1]),
        undecided,
        loops,
    })
}

struct Found<'a> {
    law: &'a Law,
    /// Pieces may still be cut so often to bound them better.
    cuts: u32,
    /// What systems are, in bits, and in words.
    exactly: FxHashMap<Vec<u64>, usize>,
    known: HashMap<String, usize>,
    systems: Vec<FoundSystem>,
}

/// A system that occurs.
pub(super) struct FoundSystem {
    /// Of the piece that it was found in.
    pub name: String,
    pub bounded: bool,
    pub coarse: bool,
    pub places: Vec<Place>,
    pub system: System,
}

impl Found<'_> {
    /// The systems of a piece at the ends of what parameters may be.
    fn corners(
        &mut self,
        piece: &Piece,
        linear: Linear<Interval>,
    ) -> Vec<(Piece, Linear<Interval>)> {
        let point = |row: &Vec<Interval>| row.iter().all(|v| is_point(*v));
        let fixed = linear.a.iter().chain(&linear.b).all(point)
            && linear
                .outputs
                .iter()
                .all(|o| point(&o.direct) && point(&o.cells));
        let parameters = self.law.parameters();
        if fixed {
            return vec![(piece.clone(), linear)];
        }
        if parameters.is_empty() {
            let tight = self.tightened(piece, linear);
            return vec![(piece.clone(), tight)];
        }
        let mut found = Vec::new();
        for ends in ends(&parameters, &piece.at) {
            // A corner in which the piece does not occur is left out.
            let Some(given) = self.law.given(piece, &ends) else {
                continue;
            };
            if let Ok(rows) = self.law.rows(&given) {
                let linear = self.tightened(&given, Linear::of(self.law, &given, &rows));
                found.push((given, linear));
            }
        }
        found
    }

    /// Bounded better by cutting the piece along each position and speed: what holds in every part
    /// holds in all. Only where nothing moves along, as then all parts have the same shape.
    fn tightened(&mut self, piece: &Piece, linear: Linear<Interval>) -> Linear<Interval> {
        let law = self.law;
        let open = |l: &Linear<Interval>| {
            l.outputs
                .iter()
                .any(|o| !o.direct.iter().all(|v| is_point(*v)))
        };
        let mut tight = linear;
        for &node in &law.nodes {
            let along = matches!(law.model.dag.get(node), Node::Sense(_) | Node::Slope(_));
            if !along || !tight.a.is_empty() || !open(&tight) || self.cuts == 0 {
                continue;
            }
            self.cuts -= 1;
            let own = piece.at[node];
            let end = |i: u32| own.low + own.width() * f64::from(i) / f64::from(CUT_IN);
            let part = |i: u32| {
                let (low, high) = (end(i), end(i + 1));
                let given = law.given(piece, &[(node, Interval { low, high })])?;
                Some(law.rows(&given).map(|rows| Linear::of(law, &given, &rows)))
            };
            let parts: Result<Vec<Linear<Interval>>, NodeId> =
                (0..CUT_IN).filter_map(part).collect();
            if let Ok(parts) = parts {
                tight = tight.within(&parts);
            }
        }
        tight
    }

    fn add(&mut self, (piece, bounded): (&Piece, bool), given: &Piece, system: System) {
        let outputs = system
            .outputs
            .iter()
            .flat_map(|o| o.direct.iter().chain(&o.cells));
        let numbers = outputs
            .chain(system.a.iter().flatten())
            .chain(system.b.iter().flatten());
        // Most are known to the last bit, and need no words.
        let number = |v: &f64| format!("{v:.5e},");
        let model = &self.law.model;
        let bits = numbers.clone().map(|v| v.to_bits()).collect();
        let (known, systems) = (&mut self.known, &mut self.systems);
        let at = *self.exactly.entry(bits).or_insert_with(|| {
            let new = || {
                systems.push(FoundSystem {
                    name: name(model, piece),
                    bounded,
                    coarse: true,
                    places: Vec::new(),
                    system: system.clone(),
                });
                systems.len() - 1
            };
            *known
                .entry(numbers.map(number).collect())
                .or_insert_with(new)
        });
        let system = &mut self.systems[at];
        system.coarse &= piece.coarse;
        let places = &mut system.places;
        if places.len() < PLACES_MAX {
            places.push(Place::of(model, given));
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
