//! Parts by the interpreter: each runs its tick, then its wires are copied.

use whippen_kernel::{EngineError, Happened, Interp};

use crate::{Of, Parts};

/// Parts of one key that run.
#[derive(Debug, Clone)]
pub struct Running {
    parts: Parts,
    engines: Vec<Interp>,
}

impl Running {
    /// Engines of all parts.
    ///
    /// # Errors
    /// A part does not verify, or has too much memory.
    pub fn new(parts: &Parts) -> Result<Running, EngineError> {
        let engines = parts
            .parts
            .iter()
            .map(|part| Interp::checked(&part.kernel, 1));
        Ok(Running {
            engines: engines.collect::<Result<_, _>>()?,
            parts: parts.clone(),
        })
    }

    /// As the whole does.
    pub fn init(&mut self, inputs: &[u16]) {
        for engine in &mut self.engines {
            engine.init(inputs);
        }
    }

    /// As the whole does.
    ///
    /// # Errors
    /// A wire's word is not in its range: a bug.
    pub fn tick(&mut self, inputs: &[u16], outputs: &mut [i16]) -> Result<(), EngineError> {
        let last = self.engines.len() - 1;
        for part in 0..=last {
            let outputs = if part == last { &mut *outputs } else { &mut [] };
            self.engines[part].tick(inputs, outputs);
            for wire in &self.parts.wires {
                if wire.from.part == part {
                    let number = wire.from.number as usize;
                    let word = self.engines[part].cell(0, number, wire.word as usize);
                    for to in &wire.to {
                        let live = to.number as usize;
                        self.engines[to.part].set_live(live, word.unwrap_or(0) as i32)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// As the whole's.
    ///
    /// # Errors
    /// There is none with this number; the value is outside its range.
    pub fn set_live(&mut self, live: usize, value: i32) -> Result<(), EngineError> {
        let Some(Of { part, number }) = self.parts.lives.get(live).copied() else {
            return self.engines[0].set_live(usize::MAX, value);
        };
        self.engines[part].set_live(number as usize, value)
    }

    /// A word of a cell of the whole.
    pub fn cell(&self, cell: usize, word: usize) -> Option<i64> {
        let Of { part, number } = *self.parts.cells.get(cell)?;
        self.engines[part].cell(0, number as usize, word)
    }

    /// The events since the last call.
    pub fn drain_events(&mut self) -> Vec<Happened> {
        let all = self
            .engines
            .iter_mut()
            .flat_map(|engine| engine.drain_events());
        all.collect()
    }

    /// The first value that has left its range, as text.
    pub fn violation(&self) -> Option<String> {
        let mut all = self.engines.iter().filter_map(|engine| engine.violation());
        all.next().map(ToString::to_string)
    }
}
