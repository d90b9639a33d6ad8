//! The numbers budget in a few lines; all of it is `whippen check --numbers`.

use serde_json::{Value, json};
use whippen_compiler::lower::ExportKind;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::session;

/// What the proofs of lowering say.
pub struct NumbersBudget {
    values: usize,
    clamps: Vec<String>,
    force: Option<Named>,
    /// The value whose error of one tick is largest for its range.
    coarsest: Option<Named>,
}

struct Named {
    name: String,
    unit: String,
    error: f64,
}

impl NumbersBudget {
    pub fn find(compiled: &Compiled) -> NumbersBudget {
        let exports = compiled.lowered.exports.iter().filter(|e| e.dim.is_some());
        let named = |e: &whippen_compiler::lower::Export| Named {
            name: e.name.clone(),
            unit: session::unit(&compiled.model, e),
            error: e.error,
        };
        let share = |e: &&whippen_compiler::lower::Export| {
            e.error / (e.range.high - e.range.low).max(f64::MIN_POSITIVE)
        };
        let others = exports.clone().filter(|e| {
            !matches!(e.kind, ExportKind::Total(_)) && e.error > 0.0 && e.error.is_finite()
        });
        NumbersBudget {
            values: exports.clone().count(),
            clamps: compiled.lowered.clamps.clone(),
            force: exports
                .clone()
                .find(|e| e.kind == ExportKind::Total(0))
                .map(named),
            coarsest: others
                .max_by(|a, b| share(a).total_cmp(&share(b)))
                .map(named),
        }
    }

    pub fn text(&self) -> String {
        let mut out = format!(
            "numbers: no overflow, proven for all {} values that are observed\n",
            self.values
        );
        let error = |n: &Named| {
            let line = match n.error.is_finite() {
                true => format!(
                    "  error of one tick: {} at most {:.1e} {}",
                    n.name, n.error, n.unit
                ),
                false => format!(
                    "  error of one tick: {} has no bound behind a friction",
                    n.name
                ),
            };
            line.trim_end().to_string() + "\n"
        };
        out.extend(self.force.iter().chain(&self.coarsest).map(error));
        if !self.clamps.is_empty() {
            out += &format!("  clamps that act: {}\n", self.clamps.join(", "));
        }
        out
    }

    pub fn json(&self) -> Value {
        let error =
            |n: &Named| json!({ "name": n.name, "unit": n.unit, "error_of_one_tick": n.error });
        json!({
            "overflow_free": true,
            "values": self.values,
            "clamps": self.clamps,
            "force": self.force.as_ref().map(error),
            "coarsest": self.coarsest.as_ref().map(error),
        })
    }
}
