//! Stick and slip: what each friction does over a run, told from its slip and its speed.
//!
//! A friction **sticks** while its slip is less than a fifth of the speed that it rubs with, and
//! **slips** once it is more than half of that; between the two it does what it did. It slips,
//! too, where it gives no force, and is **free** once that has lasted for a period. In Helmholtz's
//! motion a bowed string slips once a period.
//!
//! ```text
//!   memory: the slip of the tick before, the rate of what is rubbed --> speed = rate - slip
//! ```
//!
//! Both are read of what the engine remembers, so all is told one tick late.

use whippen_compiler::ideal::Ideal;
use whippen_compiler::lower::ExportKind;
use whippen_compiler::model::{CellId, Model, Node, NodeId};
use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::engine::{Engine, EngineKind};
use crate::trace::Heading;

/// A slip that is a smaller part of the speed sticks.
const STICKS: f64 = 0.2;
/// A slip that is a greater part slips.
const SLIPS: f64 = 0.5;
/// Speeds count as no less (m/s, rad/s): what hardly moves is not told apart from what stands.
const SPEED_LEAST: f64 = 1e-3;
/// The columns tell what the last so many periods were like.
const PERIODS: f64 = 20.0;
/// A period where none is known (s).
const PERIOD_S: f64 = 0.02;

/// What a friction does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sticking {
    /// It gives no force.
    #[default]
    Free,
    /// It holds what it rubs.
    Sticks,
    /// It has let go.
    Slips,
}

/// The names of [`Sticking`], in its order.
pub const STATES: [&str; 3] = ["free", "sticks", "slips"];

/// What a column tells of a friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrictionSignal {
    /// [`Sticking`], as its index.
    State,
    /// How often it let go in a period of its string, over the last periods.
    SlipsPerPeriod,
    /// The part of that time in which it stuck.
    StickShare,
}

/// A value that is known while a run goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Known {
    /// It stays.
    Fixed(f64),
    /// It is exported (index).
    Export(usize),
}

impl Known {
    /// How a value of the program is known, if it is: where it is made of constants and parameters
    /// alone, or has a name.
    pub fn of(compiled: &Compiled, device: &Device, node: NodeId) -> Option<Known> {
        let model = &compiled.model;
        let stays = |id: NodeId| {
            let node = model.dag.get(id);
            !node.is_leaf()
                || matches!(
                    node,
                    Node::Const(_)
                        | Node::Bool(_)
                        | Node::Live(_)
                        | Node::LiveBool(_)
                        | Node::Keyed(_)
                        | Node::Grid(..)
                )
        };
        if model.dag.below(node).into_iter().all(stays) && stays(node) {
            let mut ideal = Ideal::new(model, &device.scales(), 1);
            ideal.tick(&vec![0; model.senses.len()]);
            return Some(Known::Fixed(ideal.value(0, node)));
        }
        let is_it = |kind: ExportKind| match kind {
            ExportKind::Named(index) => model.named[index as usize].value == node,
            ExportKind::Cell(id) => *model.dag.get(node) == Node::Cell(id),
            ExportKind::Sense(sense) => *model.dag.get(node) == Node::Sense(sense),
            _ => false,
        };
        let mut exports = compiled.lowered.exports.iter();
        exports
            .position(|export| is_it(export.kind))
            .map(Known::Export)
    }

    /// Its value in the last tick.
    pub fn value(self, engine: &Engine, compiled: &Compiled) -> f64 {
        match self {
            Known::Fixed(value) => value,
            Known::Export(index) => engine.value(0, index, &compiled.lowered.exports[index]),
        }
    }
}

/// What is rubbed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rubbed {
    /// A body: the export of its rate.
    Body(usize),
    /// A string (its number among the lowered) at a place.
    String { number: usize, place: Known },
}

/// A friction and what it did so far.
#[derive(Debug, Clone)]
pub struct WatchedFriction {
    /// Its name.
    pub name: String,
    /// The exports of the slip that it remembers, and of its force.
    last: usize,
    force: usize,
    /// Its force in the tick before.
    gave: f64,
    on: Rubbed,
    pitch: Option<Known>,
    rate_hz: f64,
    /// Rates of a string at the place, as this tick and the one before it began.
    rates: [f64; 2],
    state: Sticking,
    /// Ticks since it gave force, and how many make it free.
    idle: usize,
    idle_max: usize,
    window: LastTicks,
    whole: Tally,
    second_half: Tally,
}

/// What is counted of a friction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Ticks in which it rubbed.
    pub rubbed: u64,
    /// Those in which it stuck.
    pub stuck: u64,
    /// How often it let go.
    pub slips: u64,
    /// How many periods of its string passed while it rubbed, where they are known.
    pub periods: f64,
}

impl Tally {
    /// The part of the time in which it stuck, while it rubbed.
    pub fn stick_share(&self) -> Option<f64> {
        (self.rubbed > 0).then(|| self.stuck as f64 / self.rubbed as f64)
    }

    /// How often it let go in a period.
    pub fn slips_per_period(&self) -> Option<f64> {
        (self.periods > 0.0).then(|| self.slips as f64 / self.periods)
    }

    fn add(&mut self, state: Sticking, lets_go: bool, periods: f64) {
        if state == Sticking::Free {
            return;
        }
        self.rubbed += 1;
        self.stuck += u64::from(state == Sticking::Sticks);
        self.slips += u64::from(lets_go);
        self.periods += periods;
    }
}

/// What a friction did in a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrictionTally {
    /// Its name.
    pub name: String,
    /// Over the whole run.
    pub whole: Tally,
    /// Over its second half, in which what begins has settled.
    pub second_half: Tally,
}

/// The last ticks of a friction, as a ring.
#[derive(Debug, Clone, Default)]
struct LastTicks {
    ticks: Vec<(Sticking, bool)>,
    at: usize,
    rubbed: usize,
    stuck: usize,
    slips: usize,
}

impl LastTicks {
    fn new(ticks: usize) -> LastTicks {
        LastTicks {
            ticks: vec![(Sticking::Free, false); ticks.max(1)],
            ..LastTicks::default()
        }
    }

    fn push(&mut self, state: Sticking, lets_go: bool) {
        let (old, let_go) = std::mem::replace(&mut self.ticks[self.at], (state, lets_go));
        self.at = (self.at + 1) % self.ticks.len();
        let count = |of: bool| usize::from(of);
        self.rubbed = self.rubbed + count(state != Sticking::Free) - count(old != Sticking::Free);
        self.stuck = self.stuck + count(state == Sticking::Sticks) - count(old == Sticking::Sticks);
        self.slips = self.slips + count(lets_go) - count(let_go);
    }
}

/// The columns of the frictions of a program that are told of, in their order; none on a board,
/// which keeps no values.
pub fn headings(compiled: &Compiled, kind: EngineKind) -> Vec<(Heading, usize, FrictionSignal)> {
    if kind.board().is_some() {
        return Vec::new();
    }
    let names = frictions(&compiled.model);
    let of_one = |(number, friction): (usize, &Declared)| {
        let heading = |name: &str, labels: &[&str]| Heading {
            name: format!("{}.{name}", friction.name),
            labels: labels.iter().map(|label| label.to_string()).collect(),
            ..Heading::default()
        };
        let mut all = vec![
            (heading("sticking", &STATES), number, FrictionSignal::State),
            (
                heading("stick_share", &[]),
                number,
                FrictionSignal::StickShare,
            ),
        ];
        if friction.pitch.is_some() {
            let heading = heading("slips_per_period", &[]);
            all.push((heading, number, FrictionSignal::SlipsPerPeriod));
        }
        all
    };
    names.iter().enumerate().flat_map(of_one).collect()
}

/// A friction of the Model.
struct Declared {
    name: String,
    last: CellId,
    /// The rate of a body, or the place on a string (its number among the Model's).
    on: Result<CellId, (usize, NodeId)>,
    pitch: Option<NodeId>,
}

fn frictions(model: &Model) -> Vec<Declared> {
    let bodies = model.bodies.iter().filter_map(|body| {
        let friction = body.friction.as_ref()?;
        Some(Declared {
            name: friction.name.clone(),
            last: friction.last,
            on: Ok(body.rate),
            pitch: None,
        })
    });
    let strings = model
        .strands
        .iter()
        .enumerate()
        .filter_map(|(number, strand)| {
            let rub = strand.friction.as_ref()?;
            Some(Declared {
                name: rub.name.clone(),
                last: rub.last,
                on: Err((number, rub.push.place)),
                pitch: strand.pitch,
            })
        });
    bodies.chain(strings).collect()
}

impl WatchedFriction {
    /// All of a program, in the order of [`headings`]; none on an engine that keeps no values.
    pub fn all(compiled: &Compiled, device: &Device) -> Vec<Option<WatchedFriction>> {
        let all = frictions(&compiled.model);
        all.into_iter()
            .map(|declared| WatchedFriction::new(compiled, device, declared))
            .collect()
    }

    fn new(compiled: &Compiled, device: &Device, of: Declared) -> Option<WatchedFriction> {
        let export = |id: CellId| {
            let mut exports = compiled.lowered.exports.iter();
            exports.position(|export| export.kind == ExportKind::Cell(id))
        };
        let on = match of.on {
            Ok(rate) => Rubbed::Body(export(rate)?),
            Err((strand, place)) => Rubbed::String {
                number: (compiled.lowered.strands.iter())
                    .position(|one| one.strand.0 as usize == strand)?,
                place: Known::of(compiled, device, place)?,
            },
        };
        let is_force = |kind: ExportKind| match kind {
            ExportKind::Named(index) => compiled.model.named[index as usize].name == of.name,
            _ => false,
        };
        let force = (compiled.lowered.exports.iter()).position(|export| is_force(export.kind))?;
        let pitch = of.pitch.and_then(|node| Known::of(compiled, device, node));
        let rate_hz = f64::from(compiled.model.rate_hz);
        let period_s = match pitch {
            Some(Known::Fixed(hz)) if hz > 0.0 => 1.0 / hz,
            _ => PERIOD_S,
        };
        let ticks = |periods: f64| (periods * period_s * rate_hz).round() as usize;
        Some(WatchedFriction {
            name: of.name,
            last: export(of.last)?,
            force,
            gave: 0.0,
            on,
            pitch,
            rate_hz,
            rates: [0.0; 2],
            state: Sticking::Free,
            idle: 0,
            idle_max: ticks(1.0),
            window: LastTicks::new(ticks(PERIODS)),
            whole: Tally::default(),
            second_half: Tally::default(),
        })
    }

    /// Looks at what a tick will find.
    pub fn before(&mut self, engine: &Engine, compiled: &Compiled) {
        if let Rubbed::String { number, place } = self.on {
            let rate = engine.strand_rate(number, place.value(engine, compiled));
            self.rates = [rate, self.rates[0]];
        }
    }

    /// Counts what the tick before did, of which this one has told.
    pub fn after(&mut self, engine: &Engine, compiled: &Compiled, is_second_half: bool) {
        let value = |index: usize| engine.value(0, index, &compiled.lowered.exports[index]);
        let slip = value(self.last);
        let rate = match self.on {
            Rubbed::Body(rate) => value(rate),
            // A string slips by the mean of before and after.
            Rubbed::String { .. } => 0.5 * (self.rates[0] + self.rates[1]),
        };
        let part = slip.abs() / (rate - slip).abs().max(SPEED_LEAST);
        let before = self.state;
        let gave = std::mem::replace(&mut self.gave, value(self.force));
        self.idle = if gave == 0.0 { self.idle + 1 } else { 0 };
        self.state = match before {
            Sticking::Free if gave == 0.0 => Sticking::Free,
            _ if self.idle > self.idle_max => Sticking::Free,
            // Its slip is forgotten, too.
            _ if gave == 0.0 => Sticking::Slips,
            _ if part < STICKS => Sticking::Sticks,
            Sticking::Sticks if part <= SLIPS => Sticking::Sticks,
            _ => Sticking::Slips,
        };
        let lets_go = before == Sticking::Sticks && self.state == Sticking::Slips;
        let hz = self
            .pitch
            .map_or(0.0, |pitch| pitch.value(engine, compiled));
        let periods = hz / self.rate_hz;
        self.window.push(self.state, lets_go);
        self.whole.add(self.state, lets_go, periods);
        if is_second_half {
            self.second_half.add(self.state, lets_go, periods);
        }
    }

    /// What a column tells.
    pub fn value(&self, signal: FrictionSignal) -> f64 {
        let window = &self.window;
        match signal {
            FrictionSignal::State => f64::from(self.state as u8),
            FrictionSignal::StickShare => window.stuck as f64 / window.rubbed.max(1) as f64,
            FrictionSignal::SlipsPerPeriod => {
                let hz = match self.pitch {
                    Some(Known::Fixed(hz)) => hz,
                    _ => return f64::NAN,
                };
                // Of less than a period nothing can be said.
                let periods = (window.rubbed as f64 * hz / self.rate_hz).max(1.0);
                window.slips as f64 / periods
            }
        }
    }

    /// What it does.
    pub fn state(&self) -> Sticking {
        self.state
    }

    /// The string that it rubs (its number among the lowered), and where (m from where it begins).
    pub fn place(&self, engine: &Engine, compiled: &Compiled) -> Option<(usize, f64)> {
        match self.on {
            Rubbed::Body(_) => None,
            Rubbed::String { number, place } => Some((number, place.value(engine, compiled))),
        }
    }

    /// What it did.
    pub fn tally(&self) -> FrictionTally {
        FrictionTally {
            name: self.name.clone(),
            whole: self.whole,
            second_half: self.second_half,
        }
    }
}
