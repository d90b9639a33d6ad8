//! The engine `ideal`: a Model in f64, the yardstick for fixed point.
//!
//! It follows the rules of a tick as the manual words them, on the Model as checked (before
//! algebra), so it shares nothing with lowering but the meaning of the language. It reads the same
//! raw words as the other engines, and its differentiators sum the same integers, here straight
//! over the window.
//!
//! ```text
//!   words -> sense -> values of the graph -> bodies -> rules -> commit
//! ```

mod commit;
mod friction;
mod line;
mod sense;
mod strand;
mod value;

use crate::scales::{PortScales, Scales};
use commit::RealWrites;
use line::RealLine;
use sense::SenseState;
pub use strand::RealStrand;
use whippen_ids::IdMap;
use whippen_lang::model::{
    Action, CellId, DelayId, MachineId, Model, Node, NodeId, Noise, NoiseId, PulseId, RuleKind,
    StrandId, TunedId,
};

/// What happened at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Occurrence {
    /// The key.
    pub key: u32,
    /// What.
    pub what: What,
    /// Arguments of an emission (SI).
    pub args: Vec<f64>,
}

/// The kind of an [`Occurrence`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// An emission (index into `Model::emissions`).
    Emission(u32),
    /// A rule acted (index into `Model::rules`).
    Rule(u32),
}

/// Memory of one key.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyState {
    /// Value of every cell (SI).
    pub cells: IdMap<CellId, f64>,
    /// State of every machine.
    pub machines: IdMap<MachineId, u32>,
    /// Per rule: whether its guard held in the tick before.
    pub held: Vec<bool>,
    /// Per pulse: ticks it still runs, this one included.
    pub pulse_left: IdMap<PulseId, u32>,
    /// Word of every noise.
    pub noises: IdMap<NoiseId, u32>,
    /// Last value of every `tuned`.
    pub tuned: IdMap<TunedId, f64>,
    /// Every string.
    pub strands: IdMap<StrandId, RealStrand>,
}

/// A Model running on some keys.
#[derive(Debug, Clone)]
pub struct Ideal<'m> {
    model: &'m Model,
    lives: Vec<f64>,
    keys: Vec<KeyState>,
    /// Memory as it stood at the start of the last tick.
    before: Vec<KeyState>,
    senses: Vec<Vec<SenseState>>,
    /// What was fed to the delay lines of each key.
    lines: Vec<IdMap<DelayId, RealLine>>,
    values: Vec<IdMap<NodeId, f64>>,
    occurrences: Vec<Occurrence>,
    started: bool,
    /// By sense.
    scales: Vec<Scales>,
}

impl<'m> Ideal<'m> {
    /// `keys` keys at rest in their initial states.
    pub fn new(model: &'m Model, scales: &PortScales, keys: usize) -> Ideal<'m> {
        let state = KeyState {
            cells: model.cells.iter().map(|c| c.init).collect(),
            machines: IdMap::filled(0, model.machines.len()),
            held: vec![true; model.rules.len()],
            pulse_left: IdMap::filled(0, model.pulses.len()),
            noises: model.noises.iter().map(|noise| noise.first(0)).collect(),
            tuned: IdMap::filled(0.0, model.tuned.len()),
            strands: model.strands.iter().map(RealStrand::new).collect(),
        };
        let of_key = |key: usize| KeyState {
            noises: model.noises.iter().map(|noise| noise.first(key)).collect(),
            ..state.clone()
        };
        let states: Vec<KeyState> = (0..keys).map(of_key).collect();
        let lines = model.delays.iter().map(RealLine::new).collect();
        Ideal {
            model,
            lives: model.lives.iter().map(|l| l.value).collect(),
            keys: states.clone(),
            before: states,
            lines: vec![lines; keys],
            senses: Vec::new(),
            values: vec![IdMap::filled(0.0, model.dag.len()); keys],
            occurrences: Vec::new(),
            started: false,
            scales: scales.of(model),
        }
    }

    /// One tick of all keys. `words` holds one word per sense and key, key after key. The values it
    /// computes stay readable until the next tick.
    pub fn tick(&mut self, words: &[u16]) {
        self.occurrences.clear();
        let senses = self.model.senses.len();
        for key in 0..self.keys.len() {
            self.sense(key, &words[key * senses..(key + 1) * senses]);
            self.before[key].clone_from(&self.keys[key]);
            let tick = value::Tick {
                model: self.model,
                lives: &self.lives,
                key,
                state: &self.keys[key],
                senses: &self.senses[key],
                lines: &self.lines[key],
            };
            tick.evaluate(&mut self.values[key]);
            self.act(key);
        }
        self.started = true;
    }

    fn sense(&mut self, key: usize, words: &[u16]) {
        if !self.started {
            let rate_hz = self.model.rate_hz;
            let start = |((s, &scales), &w)| SenseState::new(s, scales, rate_hz, w);
            let senses = self.model.senses.iter().zip(&self.scales);
            self.senses.push(senses.zip(words).map(start).collect());
        } else {
            self.senses[key]
                .iter_mut()
                .zip(words)
                .for_each(|(s, &w)| s.push(w));
        }
    }

    /// Steps 3 to 5 of a tick.
    fn act(&mut self, key: usize) {
        let (model, values, state) = (self.model, &self.values[key], &mut self.keys[key]);
        let value = |n: NodeId| values[n];
        let mut writes = RealWrites::integrated(model, state, value);
        let mut moved: IdMap<MachineId, bool> = IdMap::filled(false, model.machines.len());
        for (index, rule) in model.rules.iter().enumerate() {
            let guard = value(rule.guard) != 0.0;
            let acts = match rule.kind {
                RuleKind::Transition { machine, from, .. } => {
                    guard && state.machines[machine] == from && !moved[machine]
                }
                RuleKind::Event { .. } => guard && !state.held[index],
            };
            state.held[index] = guard;
            if !acts {
                continue;
            }
            self.occurrences.push(Occurrence {
                key: key as u32,
                what: What::Rule(index as u32),
                args: vec![],
            });
            if let RuleKind::Transition { machine, to, .. } = rule.kind {
                moved[machine] = true;
                writes.machines[machine] = to;
            }
            for action in &rule.actions {
                match action {
                    Action::Write { cell, value: v, .. } => writes.cells[cell] = value(*v),
                    Action::Fire {
                        pulse, value: v, ..
                    } => writes.fire(model, state, *pulse, value(*v)),
                    Action::Emit { emission, args, .. } => self.occurrences.push(Occurrence {
                        key: key as u32,
                        what: What::Emission(emission.0),
                        args: args.iter().map(|&a| value(a)).collect(),
                    }),
                }
            }
        }
        writes.commit(model, state);
        tick_strings(model, state, value);
        let lines = &mut self.lines[key];
        for (id, node) in model.dag.nodes() {
            if let Node::Tuned(_, _, own) = *node {
                state.tuned[own] = values[id];
            }
        }
        for (id, delay) in model.delays.enumerated() {
            lines[id].feed(values[delay.feed].clamp(delay.range.low, delay.range.high));
        }
        state
            .noises
            .iter_mut()
            .for_each(|word| *word = Noise::stir(*word));
    }

    /// A value of the last tick (SI; a bool is 0 or 1).
    pub fn value(&self, key: usize, node: NodeId) -> f64 {
        self.values[key][node]
    }

    /// A sensed value in the last tick (SI).
    pub fn sensed(&self, key: usize, sense: usize) -> f64 {
        self.senses[key][sense].value()
    }

    /// The first derivative of a sensed value in the last tick (SI).
    pub fn slope(&self, key: usize, sense: usize) -> f64 {
        self.senses[key][sense].slope()
    }

    /// The second derivative of a sensed value in the last tick (SI).
    pub fn curvature(&self, key: usize, sense: usize) -> f64 {
        self.senses[key][sense].curvature()
    }

    /// Sum of the force terms on the first port in the last tick (N or N*m).
    pub fn force_n(&self, key: usize) -> f64 {
        self.force_on(key, 0)
    }

    /// Sum of the force terms on a port (index of the sense) in the last tick (N or N*m).
    pub fn force_on(&self, key: usize, port: usize) -> f64 {
        self.model
            .forces
            .iter()
            .filter(|f| f.port == port)
            .map(|f| self.value(key, f.value))
            .sum()
    }

    /// The drive words of the last tick, one for each driven port, clipped as a drive clips them.
    pub fn drive_words(&self, key: usize, words: &mut [i16]) {
        for (word, port) in words.iter_mut().zip(self.model.drives()) {
            let force = self.force_on(key, port) / self.scales[port].drive_lsb;
            *word = force.round().clamp(-32_768.0, 32_767.0) as i16;
        }
    }

    /// Memory of a key at the start of the last tick, on which its values were computed.
    pub fn before(&self, key: usize) -> &KeyState {
        &self.before[key]
    }

    /// Memory of a key as it stands.
    pub fn state(&self, key: usize) -> &KeyState {
        &self.keys[key]
    }

    /// Replaces the memory of a key (not its sensor histories).
    pub fn adopt(&mut self, key: usize, state: KeyState) {
        self.keys[key] = state;
    }

    /// Replaces what a key's delay line holds, the last that was fed first.
    pub fn adopt_line(&mut self, key: usize, delay: DelayId, values: Vec<f64>) {
        self.lines[key][delay].adopt(values);
    }

    /// Sets a live parameter (SI; a bool is 0 or 1), clamped to its range.
    pub fn set_live(&mut self, live: usize, value: f64) {
        let range = self.model.lives[live].range;
        self.lives[live] = value.clamp(range.low, range.high);
    }

    /// What happened in the last tick, key after key, in the order of the text.
    pub fn occurrences(&self) -> &[Occurrence] {
        &self.occurrences
    }
}

/// Moves the strings one tick on.
fn tick_strings(model: &Model, state: &mut KeyState, value: impl Fn(NodeId) -> f64) {
    for (id, strand) in model.strands.enumerated() {
        let rub = strand.friction.as_ref().map(|rub| &rub.push);
        let pushes = strand.pushes.iter().chain(rub);
        let pushes: Vec<(f64, f64)> = pushes
            .map(|push| (value(push.change), value(push.place)))
            .collect();
        let is_held = strand.hold.is_some_and(|held| value(held) != 0.0);
        let coefficients = strand.coefficients.map(&value);
        state.strands[id].tick(strand, model.rate_hz, coefficients, &pushes, is_held);
    }
}
