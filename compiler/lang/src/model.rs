//! The Model: one instrument as equations over the reals, in SI units, with everything resolved.
//!
//! Terms are inlined, primes are expanded, names are gone (kept for messages and traces only).
//! Values are nodes of a hash-consed graph ([`Dag`]); memory is a list of [`Cell`]s; what happens
//! at an instant is a list of [`Rule`]s in the order of the text, because the later of two writes
//! wins.
//!
//! ```text
//!   check -> Model -> simplify -> range -> fix::lower -> Kernel
//!                       `-> ideal (the same meaning in f64)
//! ```
//!
//! Not here: formats, integers, code.

pub mod curve;
pub mod dag;
pub mod fold;
mod function;
mod parameter;
pub mod prime;
pub mod print;
mod sound;
pub mod strand;
pub mod sweep;
pub mod table;

pub use dag::{Balance, Cmp, Dag, Node, NodeId};
pub use function::Function;
pub use parameter::{Keyed, Live, Parameter};
pub use sound::{Delay, DelayId, Noise, NoiseId, Side, Sound, TunedId};
pub use strand::{End, GridNumber, Push, Reading, Rub, Strand, StrandId};

use crate::units::Dim;
use whippen_ids::{IdMap, impl_id};
use whippen_rate::Rate;
use whippen_source::Span;

/// Index of a [`Cell`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CellId(pub u32);
/// Index of a [`Machine`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MachineId(pub u32);
/// Index of a [`Pulse`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PulseId(pub u32);
/// Index of an [`Emission`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EmissionId(pub u32);

impl_id!(CellId, MachineId, PulseId, EmissionId);

/// A closed interval of reals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// One instrument, ready for analysis.
#[derive(Debug, Clone)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Where its name stands.
    pub span: Span,
    /// Its documentation.
    pub doc: String,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// All values.
    pub dag: Dag,
    /// Where each value was first written, by node number; may be shorter than the graph.
    pub spans: IdMap<NodeId, Option<Span>>,
    /// Inside which call of a term each value was first written (an index into `calls`), by node
    /// number; may be shorter than the graph.
    pub within: IdMap<NodeId, Option<u32>>,
    /// The calls of terms that have been inlined.
    pub calls: Vec<Call>,
    /// What the text declares, with the declarations of inlined terms: what values and code are
    /// made for.
    pub items: Vec<Item>,
    /// What is measured, in the order of the text.
    pub senses: Vec<Sense>,
    /// Every parameter that is a number, with the value it has here, in the order of first use.
    pub parameters: Vec<Parameter>,
    /// What the player may turn, in the order of the text.
    pub lives: Vec<Live>,
    /// Parameters with a value per key.
    pub keyed: Vec<Keyed>,
    /// The memory of one key, as reals.
    pub cells: IdMap<CellId, Cell>,
    /// The state machines of one key.
    pub machines: IdMap<MachineId, Machine>,
    /// Bodies, which move the cells of their coordinates.
    pub bodies: Vec<Body>,
    /// Strings.
    pub strands: IdMap<StrandId, Strand>,
    /// Pulses.
    pub pulses: IdMap<PulseId, Pulse>,
    /// Noises.
    pub noises: IdMap<NoiseId, Noise>,
    /// Delay lines.
    pub delays: IdMap<DelayId, Delay>,
    /// Uses of `tuned`, each with memory of its own: the delay line.
    pub tuned: IdMap<TunedId, DelayId>,
    /// `next` values: cell and its value in the next tick.
    pub nexts: Vec<(CellId, NodeId)>,
    /// Transitions and events, in the order of the text.
    pub rules: Vec<Rule>,
    /// Kinds of emitted events: names and argument names.
    pub emissions: IdMap<EmissionId, Emission>,
    /// Force terms, in the order of the text.
    pub forces: Vec<Force>,
    /// Terms of the sound, in the order of the text.
    pub sounds: Vec<Sound>,
    /// What is heard, -1 .. 1: nothing, one channel, or left and right.
    pub channels: Vec<NodeId>,
    /// Every `let` and every result of a term (`jack.resistance`), in the order of the text:
    /// exported to traces.
    pub named: Vec<Named>,
}

/// A call of a term, which has been inlined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// Where it stands.
    pub span: Span,
    /// The call inside which it stands.
    pub outer: Option<u32>,
}

/// A declaration or a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Its kind and full name: `force contact`, `state jack.held`; a transition as in
    /// [`Model::rule_name`].
    pub name: String,
    /// All of it.
    pub span: Span,
    /// Inside which call of a term (an index into the Model's).
    pub call: Option<u32>,
}

/// How that moves which is sensed, and so what may push it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moves {
    /// It slides (m), and forces push it.
    Slides,
    /// It turns (rad), and torques push it.
    Turns,
    /// It is no position, such as a pressure: nothing pushes it.
    Not,
}

/// `sense`: a port of the instrument.
#[derive(Debug, Clone)]
pub struct Sense {
    /// Name.
    pub name: String,
    /// Its dimension.
    pub dim: Dim,
    /// The unit of its values in SI, by the name of its type: `Hz` for a `frequency`, `rad/s` for
    /// an `angular_rate`. Empty for plain numbers.
    pub unit: &'static str,
    /// The range the program accepts (SI).
    pub range: Interval,
    /// Window of the differentiators in ticks: odd, at least 3.
    pub window: u32,
    /// What may push it.
    pub moves: Moves,
    /// Largest speed let through, SI units per second.
    pub slew_per_s: Option<f64>,
    /// Where it is declared.
    pub span: Span,
}

/// What a cell is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// Coordinate of a body.
    Coordinate,
    /// Rate of a body.
    Rate,
    /// `state`
    State,
    /// The slip of a friction in the tick before, 0 where it gave no force.
    Slip,
    /// Present level of a pulse; 0 while it does not run.
    Pulse,
    /// Where a live parameter that glides has come to.
    Glide,
}

/// One remembered real.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Name; a rate is named after its coordinate with a prime (`phi'`), a cell of a term with the
    /// place of the call (`jack.held`).
    pub name: String,
    /// What it is for.
    pub kind: CellKind,
    /// Its dimension.
    pub dim: Dim,
    /// Its range (SI): written values are clamped to it.
    pub range: Interval,
    /// First value (SI).
    pub init: f64,
    /// Where it is declared.
    pub span: Span,
}

/// `states`
#[derive(Debug, Clone)]
pub struct Machine {
    /// Name (`jack.jack` for the machine `jack` of the term called as `jack`).
    pub name: String,
    /// Its states; it starts in the first.
    pub states: Vec<String>,
    /// Where it is declared.
    pub span: Span,
}

/// `body`
#[derive(Debug, Clone)]
pub struct Body {
    /// Name.
    pub name: String,
    /// The coordinate.
    pub coordinate: CellId,
    /// Its rate.
    pub rate: CellId,
    /// Sum of torques divided by inertia (rad/s^2 or m/s^2).
    pub acceleration: NodeId,
    /// What rubs it.
    pub friction: Option<Friction>,
    /// While this holds the body is not integrated (all `hold`s of the body, joined by `or`).
    pub hold: Option<NodeId>,
    /// Where it is declared.
    pub span: Span,
}

/// `friction`
#[derive(Debug, Clone)]
pub struct Friction {
    /// Name.
    pub name: String,
    /// What it takes off the rate in this tick (rad/s or m/s).
    pub taken: NodeId,
    /// The slip of the tick before.
    pub last: CellId,
    /// Where it stands.
    pub span: Span,
}

/// `pulse`
#[derive(Debug, Clone)]
pub struct Pulse {
    /// Name.
    pub name: String,
    /// Its level.
    pub level: CellId,
    /// How long it runs, in ticks (at least 1).
    pub ticks: u32,
    /// Where it is declared.
    pub span: Span,
}

/// What makes a rule act.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RuleKind {
    /// A step of a machine: it acts if the machine is in `from`, the guard holds, and no earlier
    /// transition of the same machine from the same state acts in this tick.
    Transition {
        /// The machine.
        machine: MachineId,
        /// State left (index into its states).
        from: u32,
        /// State entered.
        to: u32,
    },
    /// An event: it acts when the guard is true now and was not true in the tick before (in the
    /// first tick it counts as having been true).
    Event {
        /// Its name.
        name: String,
    },
}

/// A transition or an event.
#[derive(Debug, Clone)]
pub struct Rule {
    /// What makes it act.
    pub kind: RuleKind,
    /// Its guard (a bool).
    pub guard: NodeId,
    /// What it does.
    pub actions: Vec<Action>,
    /// Where it stands.
    pub span: Span,
    /// Inside which call of a term (an index into the Model's).
    pub call: Option<u32>,
}

/// What a rule does.
#[derive(Debug, Clone)]
pub enum Action {
    /// Replaces the value of a cell.
    Write {
        /// The cell.
        cell: CellId,
        /// Its value.
        value: NodeId,
        /// Where it stands.
        span: Span,
    },
    /// Starts a pulse.
    Fire {
        /// The pulse.
        pulse: PulseId,
        /// Its level, clamped to the pulse's range.
        value: NodeId,
        /// Where it stands.
        span: Span,
    },
    /// Emits an event to the outside.
    Emit {
        /// Which kind.
        emission: EmissionId,
        /// One value per argument name of the kind.
        args: Vec<NodeId>,
        /// Where it stands.
        span: Span,
    },
}

impl Action {
    /// Where it stands.
    pub fn span(&self) -> Span {
        match self {
            Action::Write { span, .. } | Action::Fire { span, .. } | Action::Emit { span, .. } => {
                *span
            }
        }
    }
}

/// A kind of emitted event. Two `emit`s with the same name and the same argument names share one.
#[derive(Debug, Clone, PartialEq)]
pub struct Emission {
    /// Name (`note`).
    pub name: String,
    /// Arguments: name and dimension (`speed`, m/s).
    pub args: Vec<(String, Dim)>,
}

/// A force term.
#[derive(Debug, Clone)]
pub struct Force {
    /// Name: its label, with the sense where several are driven (`walls.z`).
    pub name: String,
    /// A force, or a torque for what turns.
    pub dim: Dim,
    /// What it acts on (index into the senses); 0 in an instrument that senses nothing.
    pub port: usize,
    /// Its value.
    pub value: NodeId,
    /// Where it is declared.
    pub span: Span,
}

/// A value with a name.
#[derive(Debug, Clone)]
pub struct Named {
    /// Name.
    pub name: String,
    /// Its dimension; `None` for a bool.
    pub dim: Option<Dim>,
    /// Its value.
    pub value: NodeId,
    /// Where it is declared.
    pub span: Span,
}

impl Model {
    /// The places of a call and of those around it, innermost first.
    pub fn calls_from(&self, call: Option<u32>) -> impl Iterator<Item = Span> {
        let at = |call: Option<u32>| call.and_then(|c| self.calls.get(c as usize));
        std::iter::successors(at(call), move |c| at(c.outer)).map(|c| c.span)
    }

    /// The places of the calls inside which a value was first written, innermost first.
    pub fn calls_around(&self, node: NodeId) -> impl Iterator<Item = Span> {
        self.calls_from(self.within.get(node).copied().flatten())
    }

    /// Whether it turns: its first sense is an angle, and its forces are torques. Otherwise it
    /// slides.
    pub fn turns(&self) -> bool {
        self.port_turns(0)
    }

    /// Whether a port is an angle.
    pub fn port_turns(&self, port: usize) -> bool {
        let sense = self.senses.get(port);
        sense.is_some_and(|sense| sense.moves == Moves::Turns)
    }

    /// Whether a key has its ports: one at most, which slides or turns.
    pub fn is_of_key(&self) -> bool {
        match &self.senses[..] {
            [] => true,
            [only] => only.moves != Moves::Not,
            _ => false,
        }
    }

    /// The ports that are driven (indices of the senses), by rising number: those on which a force
    /// acts. A key without any force has a drive, too, which gives 0.
    pub fn drives(&self) -> Vec<usize> {
        let is_driven = |port: &usize| self.forces.iter().any(|force| force.port == *port);
        if self.forces.is_empty() {
            return if self.is_of_key() {
                vec![0]
            } else {
                Vec::new()
            };
        }
        (0..self.senses.len().max(1)).filter(is_driven).collect()
    }

    /// The unit of what a port senses, as a program writes it.
    pub fn unit_of_sensed(&self, port: usize) -> String {
        match self.senses.get(port) {
            Some(sense) if sense.moves == Moves::Turns => "rad".to_string(),
            Some(sense) => sense.dim.unit_without_angle(),
            None => Dim::LENGTH.unit(),
        }
    }

    /// The dimension of what drives a port.
    pub fn dim_of_driven(&self, port: usize) -> Dim {
        if self.port_turns(port) {
            Dim::TORQUE
        } else {
            Dim::FORCE
        }
    }

    /// A name of something that each driven port has, such as its drive: with the name of the sense
    /// where several are driven.
    pub fn name_of_driven(&self, what: &str, port: usize) -> String {
        match self.senses.get(port) {
            Some(sense) if self.drives().len() > 1 => format!("{what}.{}", sense.name),
            _ => what.to_string(),
        }
    }

    /// How a rule is called in messages and event lists: the event's name, or `contact: touching ->
    /// flying`.
    pub fn rule_name(&self, rule: &Rule) -> String {
        match &rule.kind {
            RuleKind::Event { name } => name.clone(),
            RuleKind::Transition { machine, from, to } => {
                let machine = &self.machines[machine];
                format!(
                    "{}: {} -> {}",
                    machine.name, machine.states[*from as usize], machine.states[*to as usize]
                )
            }
        }
    }
}
