//! The budgets besides time: numbers, stability, motor. Each has a part of the text and a field of
//! the JSON.

use std::path::PathBuf;

use clap::ValueHint;
use serde_json::Value;
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::model::Model;
use whippen_compiler::parallel;
use whippen_compiler::source::SourceMap;
use whippen_compiler::stability::Law;
use whippen_runtime::device::Device;

use super::motor::MotorBudget;
use super::numbers::NumbersBudget;
use super::stability::StabilityBudget;
use crate::cmd::load;
use crate::exit::Failure;

/// What is played for the motor.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "The motor")]
pub struct BeyondArgs {
    /// The key moves as recorded here, a table with titles such as t_s,x_mm; without it the bundled
    /// gesture
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "midi")]
    pub motion: Option<PathBuf>,
    /// The busiest key of a performance, each note a synthetic stroke
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub midi: Option<PathBuf>,
}

impl BeyondArgs {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.motion.iter().chain(&self.midi)
    }
}

/// The budgets of one instrument on one device.
pub struct Beyond {
    numbers: NumbersBudget,
    stability: Option<StabilityBudget>,
    motor: Option<MotorBudget>,
    warnings: Vec<Diagnostic>,
}

impl Beyond {
    /// Finds them; `model` is as checked.
    ///
    /// # Errors
    /// A file to be played cannot be read.
    pub fn find(
        map: &SourceMap,
        model: &Model,
        device: &Device,
        args: &BeyondArgs,
    ) -> Result<Beyond, Failure> {
        let law = Law::of(model);
        let (found, stability) = parallel::both(
            || {
                let compiled = load::compiled_silently(map, model.clone(), device)?;
                Ok((
                    MotorBudget::find(&compiled, law.as_ref(), device, args)?,
                    NumbersBudget::find(&compiled),
                ))
            },
            || StabilityBudget::find(model, law.as_ref()?, device),
        );
        let (motor, numbers) = found?;
        let mut warnings = stability
            .as_ref()
            .map(|s| s.warnings().to_vec())
            .unwrap_or_default();
        warnings.extend(motor.as_ref().and_then(|m| m.warning(model)));
        warnings.sort_by_key(|d| (d.span, d.code));
        Ok(Beyond {
            numbers,
            stability,
            motor,
            warnings,
        })
    }

    /// Prints what is surely not meant.
    pub fn warn(&self, map: &SourceMap) {
        load::print(map, &self.warnings, Severity::Note);
    }

    /// For people.
    pub fn text(&self, device: &Device) -> String {
        let absent = |what: &str, table: &str| {
            format!(
                "{what}: not judged, as the device `{}` has no `[{table}]`\n",
                device.name
            )
        };
        let stability = self
            .stability
            .as_ref()
            .map_or_else(|| absent("stability", "mechanics"), StabilityBudget::text);
        let has_ports = !device.port().name.is_empty();
        let without = || {
            if has_ports {
                return "motor: not judged, which is of a key's only motor\n".to_string();
            }
            absent("motor", "motor")
                + "  an image with any motor takes the cycles above; `build` makes none without\n"
        };
        let motor = self.motor.as_ref().map_or_else(without, MotorBudget::text);
        self.numbers.text() + &stability + &motor
    }

    /// Adds the map of borders, which only a page shows, to the field `stability`.
    pub fn add_map_to(&self, model: &Model, budget: &mut Value) {
        if let Some(stability) = &self.stability {
            budget["stability"]["map"] = stability.map(model);
        }
    }

    /// Adds the fields `numbers`, `stability`, `motor` and `warnings` to an object.
    pub fn add_to(&self, map: &SourceMap, budget: &mut Value) {
        budget["numbers"] = self.numbers.json();
        budget["stability"] = self
            .stability
            .as_ref()
            .map_or(Value::Null, StabilityBudget::json);
        budget["motor"] = self.motor.as_ref().map_or(Value::Null, MotorBudget::json);
        budget["warnings"] = self
            .warnings
            .iter()
            .map(|d| crate::cmd::json::diagnostic(map, d))
            .collect();
    }
}
