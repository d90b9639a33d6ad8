//! `run --steps`: what a board does instruction by instruction, beside the listing and what is
//! proven, as one JSON object.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::ValueHint;
use serde_json::{Map, Value, json};
use whippen_compiler::image::{CodeRow, code_rows};
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::Register;
use whippen_runtime::emulated::{BoardStep, BoardSteps, EmulatedBoard, REGISTERS};
use whippen_runtime::engine::EngineKind;
use whippen_runtime::files::write_whole;
use whippen_runtime::session::{Recording, Run};

use super::super::file_plan::FilePlan;
use super::super::on_board::ProvenImage;
use crate::exit::{Failure, Outcome};
use crate::say::say;

/// The most ticks whose instructions are written: more is no reading.
const TICKS_MAX: u64 = 1000;

/// What to tell of instructions.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "The emulated board")]
pub struct StepsArgs {
    /// The cycles of every tick beside what is proven, and of some ticks each instruction with its
    /// cycles, the registers that it changes and its line of source (docs/emulator.md)
    #[arg(long, value_name = "FILE.json", value_hint = ValueHint::FilePath, conflicts_with_all = ["midi", "watch"])]
    steps: Option<PathBuf>,
    /// The first tick whose instructions are written, counted from 0
    #[arg(long, value_name = "TICK", requires = "steps", default_value_t = 0)]
    steps_from: u64,
    /// How many ticks' instructions are written, at most 1000
    #[arg(long, value_name = "N", requires = "steps", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=TICKS_MAX))]
    steps_ticks: u64,
}

impl StepsArgs {
    /// Whether it is to be written.
    pub fn is_wanted(&self) -> bool {
        self.steps.is_some()
    }

    /// Adds it to the files of a command.
    pub fn plan(&self, plan: FilePlan) -> FilePlan {
        plan.writes("--steps", &self.steps, &["json"])
    }

    /// A recording with what is wanted.
    pub fn wanted(&self, recording: Recording) -> Recording {
        let end = self.steps_from.saturating_add(self.steps_ticks);
        match self.steps {
            Some(_) => recording.with_steps(self.steps_from..end),
            None => recording,
        }
    }

    /// Writes what was kept.
    ///
    /// # Errors
    /// The file cannot be written; the image that ran is not the one whose lines are known.
    pub fn write(
        &self,
        compiled: &Compiled,
        engine: EngineKind,
        proven: Option<&ProvenImage>,
        run: &Run,
    ) -> Outcome {
        let (Some(path), Some(steps)) = (&self.steps, &run.steps) else {
            return Ok(());
        };
        let (Some(proven), Some(board)) = (proven, engine.board()) else {
            return Err(Failure::Defect("steps without a board".to_string()));
        };
        if proven.image.image.segments != steps.segments {
            let why = "the image that ran is not the one that was proven";
            return Err(Failure::Defect(why.to_string()));
        }
        let object = object(compiled, board, proven, (run, steps));
        write_whole(path, |w| writeln!(w, "{object}"))
            .map_err(|error| Failure::Usage(error.to_string()))?;
        say!(
            "steps: {}: {} instructions",
            path.display(),
            steps.all.len()
        );
        Ok(())
    }
}

fn object(
    compiled: &Compiled,
    board: EmulatedBoard,
    proven: &ProvenImage,
    (run, steps): (&Run, &BoardSteps),
) -> Value {
    let load = run.load.as_ref();
    let period_cycles = load.map_or(0, |load| load.period_cycles);
    let bounds = proven.budget.as_ref().map(|budget| {
        let cores = budget.cores.iter().map(|core| core.cycles_max);
        cores.collect::<Vec<_>>()
    });
    let rate_hz = compiled.model.rate_hz.fraction();
    let names = Register::all().take(REGISTERS);
    json!({
        "kind": "steps",
        "instrument": compiled.model.name,
        "board": board.kind.name(),
        "core": board.kind.board().core.name(),
        "clock_hz": board.kind.board().clock_hz,
        "rate_hz": rate_hz,
        "period_cycles": period_cycles,
        "keys": proven.image.keys_of_cores,
        "bound_cycles": bounds,
        "ticks": steps.ticks,
        "first": steps.of.start,
        "registers": names.map(Register::name).collect::<Vec<_>>(),
        "listing": listing(&code_rows(&proven.image.image), steps),
        "steps": steps.all.iter().map(step).collect::<Vec<_>>(),
    })
}

/// The functions that ran, whole. What has no size of its own, as in the firmware, reaches to the
/// next name.
fn listing(rows: &[CodeRow], steps: &BoardSteps) -> Vec<Value> {
    let ran: BTreeSet<u32> = steps.all.iter().map(|step| step.address).collect();
    let functions = rows.chunk_by(|_, next| next.function.is_none());
    let functions = functions.flat_map(|piece| {
        let name = piece.first().and_then(|row| row.function.as_deref());
        piece.iter().map(move |row| (name, row))
    });
    let functions: Vec<(Option<&str>, &CodeRow)> = functions.collect();
    let pieces = functions.chunk_by(|(one, _), (other, _)| one == other);
    let shown = pieces.filter(|piece| piece.iter().any(|(_, row)| ran.contains(&row.address)));
    let shown = shown.flatten().map(|(name, of)| row(*name, of));
    shown.collect()
}

fn row(function: Option<&str>, row: &CodeRow) -> Value {
    let mut object = json!({ "address": row.address, "text": row.text });
    if let Some(function) = function {
        object["function"] = json!(function);
    }
    if let Some(place) = &row.place {
        object["file"] = json!(place.file);
        object["line"] = json!(place.line);
        object["item"] = json!(place.item);
    }
    object
}

fn step(step: &BoardStep) -> Value {
    let changes = step.changes.iter().map(|(number, value)| {
        let name = Register::all().nth(usize::from(*number));
        let name = name.map_or("", Register::name);
        (name.to_string(), json!(value))
    });
    let cost = step.cost.to_string();
    let why = cost.split_once(": ").map_or("", |(_, why)| why);
    json!({
        "tick": step.tick,
        "core": step.core,
        "cycle": step.cycle,
        "address": step.address,
        "cycles": step.cost.cycles(),
        "why": why,
        "changes": changes.collect::<Map<_, _>>(),
    })
}
