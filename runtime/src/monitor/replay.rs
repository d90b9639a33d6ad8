//! What was measured beside what the program says to it: the engine `jit` on the sensor words of
//! the board.
//!
//! Where a program began during the capture, the engine begins with it. Elsewhere the engine begins
//! with the first word, held for a while, as a key at rest does; then a difference may also come of
//! what the key did before.

use whippen_compiler::pipeline::Compiled;

use super::capture::CapturedRow;
use crate::device::Device;
use crate::engine::{Engine, EngineKind};
use crate::session::{self, Body, Recorded, Recording, Run, RunError};
use crate::trace::Heading;

/// For how long a first word is held (s).
const SETTLE_S: f64 = 0.1;
/// For how long no drive word is compared after a program began (s): force comes up.
const RAMP_S: f64 = 0.022;

/// What is replayed: the rows of one key.
#[derive(Debug, Clone, Copy)]
pub struct Replay<'a> {
    /// The instrument.
    pub compiled: &'a Compiled,
    /// Its device.
    pub device: &'a Device,
    /// What was captured, by rising tick, without gaps.
    pub rows: &'a [CapturedRow],
    /// Which of its keys.
    pub key: usize,
    /// Whether the key began with the first row.
    pub begins: bool,
    /// Live values that play (integers), in the order of the program.
    pub lives: &'a [i32],
    /// Names of the captured words of memory.
    pub cells: &'a [String],
}

/// How far a board is from the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Difference {
    /// Drive words that were compared.
    pub compared: usize,
    /// Those that differ.
    pub differ: usize,
    /// By how much at most.
    pub most: u16,
    /// The row of the first that does.
    pub first: Option<usize>,
}

impl Replay<'_> {
    /// Ticks before the first row.
    fn settling(&self) -> usize {
        let ticks = SETTLE_S * f64::from(self.compiled.model.rate_hz);
        if self.begins {
            0
        } else {
            ticks.ceil() as usize
        }
    }

    /// Rows whose drive words are not compared.
    fn ramp(&self) -> usize {
        let ticks = RAMP_S * f64::from(self.compiled.model.rate_hz);
        // The row of its beginning has no tick of the key.
        if self.begins {
            ticks.ceil() as usize + 1
        } else {
            0
        }
    }

    /// The word of a tick, counted with those before the first row.
    fn word(&self, tick: usize) -> u16 {
        let row = tick.saturating_sub(self.settling());
        self.rows[row.min(self.rows.len() - 1)].keys[self.key].0
    }

    /// Compares drive words.
    ///
    /// # Errors
    /// The engine cannot be built on this machine.
    pub fn difference(&self) -> Result<Difference, String> {
        let mut found = Difference::default();
        if self.rows.is_empty() {
            return Ok(found);
        }
        let mut engine = Engine::new(EngineKind::Jit, self.compiled, self.device, 1)?;
        engine.start(&[self.word(0)]);
        self.set_lives(&mut engine)?;
        let first = usize::from(self.begins);
        let mut drive = [0];
        for tick in first..self.settling() + self.rows.len() {
            engine.tick(&[self.word(tick)], &mut drive);
            let Some(row) = tick
                .checked_sub(self.settling())
                .filter(|at| *at >= self.ramp())
            else {
                continue;
            };
            let off = self.rows[row].keys[self.key].1.abs_diff(drive[0]);
            found.compared += 1;
            found.differ += usize::from(off > 0);
            found.most = found.most.max(off);
            if off > 0 {
                found.first.get_or_insert(row);
            }
        }
        Ok(found)
    }

    fn set_lives(&self, engine: &mut Engine) -> Result<(), String> {
        let lives = self.compiled.lowered.lives.iter().zip(self.lives);
        for (number, (live, word)) in lives.enumerate() {
            engine.set_live(number, f64::from(*word) * live.lsb)?;
        }
        Ok(())
    }

    /// The columns of the trace: those of a run, what was measured, cells.
    pub fn columns(&self) -> Vec<Recorded> {
        let unit = if self.device.turns() { "n_m" } else { "n" };
        let mut body = vec![Heading {
            name: "measured_drive".to_string(),
            unit: unit.to_string(),
            step: Some(self.device.force_of_word(1).abs()),
            ..Heading::default()
        }];
        body.extend(self.cells.iter().map(|name| Heading {
            name: format!("measured_{name}"),
            step: Some(1.0),
            ..Heading::default()
        }));
        session::recorded(self.compiled, self.device, EngineKind::Jit, &body)
    }

    /// A run over the measured words, with what was measured beside; `first_s` is the time of the
    /// first row.
    ///
    /// # Errors
    /// The engine cannot be built on this machine, or a table cannot be written.
    pub fn run(
        &self,
        recording: impl FnOnce(Vec<Recorded>) -> Result<Recording, RunError>,
        first_s: f64,
    ) -> Result<Run, RunError> {
        let rate_hz = f64::from(self.compiled.model.rate_hz);
        let settling = self.settling();
        let start_s = first_s - settling as f64 / rate_hz;
        let mut body = MeasuredBody {
            replay: self,
            observed: vec![0.0; 1 + self.cells.len()],
        };
        let recording = recording(self.columns())?.starting(start_s);
        let ticks = settling + self.rows.len();
        session::record_body(
            self.compiled,
            self.device,
            EngineKind::Jit,
            (ticks, &mut body),
            recording,
            |_| {},
        )
    }
}

/// A key that is where it was measured.
struct MeasuredBody<'a, 'b> {
    replay: &'a Replay<'b>,
    observed: Vec<f64>,
}

impl Body for MeasuredBody<'_, '_> {
    fn move_to(&mut self, tick: usize, _: Option<&[i16]>, places: &mut [f64]) {
        let replay = self.replay;
        places.fill(replay.device.position_of_word(replay.word(tick)));
        let row = tick.saturating_sub(replay.settling());
        let Some(row) = replay.rows.get(row) else {
            return;
        };
        self.observed[0] = replay.device.force_of_word(row.keys[replay.key].1);
        for (value, cell) in self.observed[1..].iter_mut().zip(&row.cells) {
            *value = f64::from(*cell);
        }
    }

    fn observe(&self) -> &[f64] {
        &self.observed
    }
}
