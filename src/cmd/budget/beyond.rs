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
use whippen_runtime::judged::{JudgedPort, judge};

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
    /// Of each port that is driven; nothing where the device does not say how it moves, and so on.
    stability: Vec<(JudgedPort, Option<StabilityBudget>)>,
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
        // That of a key tells of its motor, too.
        let law = model.is_of_key().then(|| Law::of(model)).flatten();
        let (found, stability) = parallel::both(
            || {
                let compiled = load::compiled_silently(map, model.clone(), device)?;
                Ok((
                    MotorBudget::find(&compiled, law.as_ref(), device, args)?,
                    NumbersBudget::find(&compiled),
                ))
            },
            || {
                let judged = judge(model, device, law.as_ref()).into_iter();
                let budget = |port: JudgedPort| {
                    let budget = StabilityBudget::of(&port);
                    (port, budget)
                };
                judged.map(budget).collect::<Vec<_>>()
            },
        );
        let (motor, numbers) = found?;
        let budgets = stability.iter().filter_map(|(_, budget)| budget.as_ref());
        let mut warnings: Vec<Diagnostic> = budgets
            .flat_map(|budget| budget.warnings().to_vec())
            .collect();
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
        let of_port = |(port, budget): &(JudgedPort, Option<StabilityBudget>)| {
            let at = match &*port.port {
                "" => String::new(),
                name => format!(" of `{name}`"),
            };
            let why = port.found.as_ref().err().map_or("", String::as_str);
            let not = || format!("stability{at}: not judged, as {why}\n");
            budget.as_ref().map_or_else(not, StabilityBudget::text)
        };
        let stability: String = self.stability.iter().map(of_port).collect();
        let has_ports = !device.port().name.is_empty();
        let without = || {
            if has_ports {
                return "motor: not judged, which is of a key's only motor\n".to_string();
            }
            format!(
                "motor: not judged, as the device `{}` has no `[motor]`\n",
                device.name
            ) + "  an image with any motor takes the cycles above; `build` makes none without\n"
        };
        let motor = self.motor.as_ref().map_or_else(without, MotorBudget::text);
        self.numbers.text() + &stability + &motor
    }

    /// Adds the map of borders, which only a page shows, to the field `stability`.
    pub fn add_map_to(&self, model: &Model, budget: &mut Value) {
        if let [(_, Some(stability))] = &self.stability[..]
            && model.is_of_key()
        {
            budget["stability"]["map"] = stability.map(model);
        }
    }

    /// Adds the fields `numbers`, `stability`, `motor` and `warnings` to an object.
    pub fn add_to(&self, map: &SourceMap, budget: &mut Value) {
        budget["numbers"] = self.numbers.json();
        let of_port = |budget: &Option<StabilityBudget>| {
            let budget = budget.as_ref();
            budget.map_or(Value::Null, StabilityBudget::json)
        };
        budget["stability"] = match &self.stability[..] {
            [(port, only)] if port.port.is_empty() => of_port(only),
            ports => {
                let named = ports
                    .iter()
                    .map(|(port, own)| (port.port.clone(), of_port(own)));
                Value::Object(named.collect())
            }
        };
        budget["motor"] = self.motor.as_ref().map_or(Value::Null, MotorBudget::json);
        budget["warnings"] = self
            .warnings
            .iter()
            .map(|d| crate::cmd::json::diagnostic(map, d))
            .collect();
    }
}
