//! The bound of a relocatable file's tick: what its keys take, if the project that has it places
//! code and data as is said.

use whippen_compiler::budget::{
    Bound, Budget, CoreBudget, NotBounded, Program as Bytes, Tick, calling_tick_without_waiting,
    tick_without_waiting,
};
use whippen_compiler::deadline_diagnostic::{WorstMode, deadline_diagnostic};
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::firmware::safe_tick_name;
use whippen_compiler::image::{Board, Input, Start, link};
use whippen_compiler::mode_names::mode_names;
use whippen_runtime::image::ImageInstrument;

use super::project::Part;
use crate::cmd::load;
use crate::cmd::proof::ANYWAY;
use crate::cmd::setup::{ImageSetup, link_failure};
use crate::exit::Failure;
use crate::say::tell;

/// A tick of all keys of a file, on one core.
pub struct TickBound {
    bytes: Bytes,
    tick: Tick,
    /// With what guards the keys, where it is part of the file.
    safe: Option<Bound>,
    /// The modes of a key, in words.
    modes: Vec<String>,
    budget: Budget,
}

/// What is to be said of a file's time; of one that is not in time only where it is written all the
/// same.
///
/// # Errors
/// It is not in time, which is reported as a budget does, or it has no bound.
pub fn check(
    (setup, part): (&ImageSetup, &Part),
    bound: Result<TickBound, Failure>,
    unproven: bool,
) -> Result<String, Failure> {
    let bound = match bound {
        Err(Failure::Usage(why)) if unproven => return Ok(format!("No bound of its time: {why}")),
        other => other?,
    };
    match bound.missed(setup, part) {
        Some(late) if !unproven => {
            load::print(&setup.map, &[late], Severity::Error);
            tell!("{ANYWAY}");
            Err(Failure::Program)
        }
        Some(late) => Ok(format!("Not proven to be in time: {}.", late.message)),
        None => Ok(bound.text(setup, part)),
    }
}

/// The board with nobody who starts on it, so that nothing is needed to start.
pub fn board_to_link_for(setup: &ImageSetup) -> Board {
    Board {
        start: Start::Vectors,
        ..setup.board.clone()
    }
}

impl TickBound {
    /// Of objects with the code of an instrument's keys, and of what guards them, if that is wanted.
    ///
    /// # Errors
    /// It has no bound, or no place on the board.
    pub fn of(
        (setup, part): (&ImageSetup, &Part),
        instrument: &ImageInstrument,
        inputs: &[Input],
    ) -> Result<Self, Failure> {
        let name = &part.name;
        let board = board_to_link_for(setup);
        let linked = link(&board, inputs, &format!("{name}_tick")).map_err(link_failure)?;
        let bytes = Bytes::of(&linked);
        let timing = board.timing().at_worst();
        let tick = tick_without_waiting(&bytes, name, &timing)
            .map_err(|error: NotBounded| Failure::Usage(error.to_string()))?;
        let safe_tick = safe_tick_name(name);
        let is_guarded = bytes.symbols.contains_key(&safe_tick);
        let safe = is_guarded.then(|| {
            let called = (name.as_str(), &tick, part.keys);
            calling_tick_without_waiting(&bytes, &safe_tick, called, &timing)
                .map_err(|error| Failure::Usage(error.to_string()))
        });
        let safe = safe.transpose()?;
        Ok(Self {
            budget: budget(setup, part, &tick, safe.as_ref()),
            safe,
            modes: mode_names(&part.compiled.model, &instrument.modes),
            bytes,
            tick,
        })
    }

    /// Cycles that a tick takes at most, and those between two ticks.
    pub fn cycles(&self) -> (u64, u64) {
        (self.budget.cores[0].cycles_max, self.budget.period_cycles)
    }

    /// The deadline, where a tick takes longer.
    fn missed(&self, setup: &ImageSetup, part: &Part) -> Option<Diagnostic> {
        let modes = self.modes.iter().zip(&self.tick.modes);
        let (mode, (_, bound)) = modes.max_by_key(|(_, (_, bound))| bound.cycles_max)?;
        let model = &part.compiled.model;
        deadline_diagnostic(
            &setup.map,
            (&model.name, model.span, !model.is_of_key()),
            &self.budget,
            &self.bytes,
            WorstMode { mode, bound },
            None,
        )
    }

    /// What is proven, and under which conditions.
    fn text(&self, setup: &ImageSetup, part: &Part) -> String {
        let (name, core) = (&part.name, setup.board.timing().name);
        let (most, period) = self.cycles();
        let (key, class) = (self.tick.key_cycles_max(), self.budget.class);
        let (frame, function) = (
            most - u64::from(part.keys) * key,
            if self.safe.is_some() {
                "safe_tick"
            } else {
                "tick"
            },
        );
        format!(
            "{name}_{function} takes at most {most} cycles of a {core}, {key} for each key and {frame} around them;\n\
             a tick at {:#} Hz and {} MHz has {period}. That is proven ({}) where each fetch and each access\n\
             takes one cycle, all data lie in one memory, from which nothing is fetched and which nobody else uses,\n\
             and nothing interrupts it. What calls it is not counted.",
            self.budget.rate_hz,
            f64::from(self.budget.clock_hz) / 1e6,
            class,
        )
    }
}

/// A tick as the budget of one core, around whose keys nothing is but the function, and what guards
/// them.
fn budget(setup: &ImageSetup, part: &Part, tick: &Tick, safe: Option<&Bound>) -> Budget {
    let (rate_hz, clock_hz) = (part.compiled.model.rate_hz, setup.board.clock_hz);
    let (period_cycles, key) = (rate_hz.cycles_min(clock_hz), tick.key_cycles_max());
    let alone = tick.cycles_max(part.keys);
    let cycles_max = safe.map_or(alone, |safe| safe.cycles_max);
    let around_cycles_max = tick.frame_cycles_max() + cycles_max.saturating_sub(alone);
    let class = safe.map_or(tick.class(), |safe| safe.class.max(tick.class()));
    let stack_bytes_max = safe.map_or(tick.stack_bytes_max(), |safe| safe.stack_bytes_max);
    let slack_cycles = period_cycles as i64 - cycles_max as i64;
    Budget {
        period_cycles,
        clock_hz,
        rate_hz,
        key_cycles_max: key,
        contended_key_cycles_max: key,
        cores: vec![CoreBudget {
            keys: part.keys,
            cycles_max,
            keys_cycles_max: cycles_max - around_cycles_max,
            around_cycles_max,
            contention_cycles_max: 0,
            slack_cycles,
            more_keys: (slack_cycles.max(0) as u64 / key.max(1)) as u32,
            stack_bytes_max,
        }],
        class,
        key_class: tick.class(),
    }
}
