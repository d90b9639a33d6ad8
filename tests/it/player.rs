//! One key of an instrument on one engine, moved tick by tick and asked by name.

use whippen_compiler::lower::{ExportKind, LoweredEventKind};
use whippen_compiler::model::EmissionId;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{Engine, EngineKind};

/// A key being played.
pub struct Player<'c> {
    engine: Engine<'c>,
    device: Device,
    compiled: &'c Compiled,
    started: bool,
    /// The drive word of the last tick.
    pub drive: i16,
}

impl<'c> Player<'c> {
    /// A key at rest.
    pub fn new(compiled: &'c Compiled, kind: EngineKind) -> Player<'c> {
        let device = Device::of(&compiled.model);
        let engine = Engine::new(kind, compiled, &device, 1).unwrap_or_else(|e| panic!("{e}"));
        Player {
            engine,
            device,
            compiled,
            started: false,
            drive: 0,
        }
    }

    /// One tick with the key at the position.
    pub fn tick(&mut self, position_m: f64) {
        self.tick_word(self.device.word_of_position(position_m).0);
    }

    /// One tick with a sensor word.
    pub fn tick_word(&mut self, word: u16) {
        if !self.started {
            self.engine.start(&[word]);
            self.started = true;
        }
        let mut drive = [0];
        self.engine.tick(&[word], &mut drive);
        self.drive = drive[0];
    }

    /// Where in the list of exports a name stands.
    pub fn index(&self, name: &str) -> usize {
        let found = self
            .compiled
            .lowered
            .exports
            .iter()
            .position(|e| e.name == name);
        found.unwrap_or_else(|| panic!("`{}` exports no `{name}`", self.compiled.model.name))
    }

    /// An exported value of the last tick (SI); memory as it was at the tick's start.
    pub fn value_at(&self, index: usize) -> f64 {
        self.engine
            .value(0, index, &self.compiled.lowered.exports[index])
    }

    /// [`Player::value_at`] by name.
    pub fn value(&self, name: &str) -> f64 {
        self.value_at(self.index(name))
    }

    /// The proven bound on the error of one tick in a value.
    pub fn error(&self, name: &str) -> f64 {
        self.compiled.lowered.exports[self.index(name)].error
    }

    /// State of a machine at the last tick's start.
    pub fn state(&self, name: &str) -> &'c str {
        let export = &self.compiled.lowered.exports[self.index(name)];
        let ExportKind::Machine(id) = export.kind else {
            panic!("`{name}` is no machine")
        };
        &self.compiled.model.machines[id].states[self.value(name) as usize]
    }

    /// What happened since the last call: events and transitions by name, with arguments.
    pub fn events(&mut self) -> Vec<(String, Vec<f64>)> {
        let name = |kind: &LoweredEventKind| match kind {
            LoweredEventKind::Emission(e) => {
                self.compiled.model.emissions[EmissionId(*e)].name.clone()
            }
            LoweredEventKind::Rule(name) => name.clone(),
        };
        self.engine
            .drain()
            .into_iter()
            .map(|h| (name(&self.compiled.lowered.events[h.event].kind), h.args))
            .collect()
    }

    /// How often an event happened since the last call of this or [`Player::events`].
    pub fn count(&mut self, name: &str) -> usize {
        self.events()
            .iter()
            .filter(|(event, _)| event == name)
            .count()
    }
}
