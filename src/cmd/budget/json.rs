//! The budget for programs.

use serde_json::{Map, Value, json};
use whippen_compiler::budget::{Bounded, CoreBudget};

use super::Proof;

impl Proof<'_> {
    /// One object.
    pub fn json(&self) -> Value {
        let bound = self.dearest().bound;
        let items = self.program.by_item(&bound.path).into_iter();
        let lines = self.program.by_place(&bound.path).into_iter().filter_map(|(place, _)| place);
        let lines: Vec<String> = lines.map(|place| format!("{}:{}", place.file, place.line)).collect();
        let cores: Vec<Value> =
            self.budget.cores.iter().zip(&self.cores).map(|(core, of)| self.core(core, of)).collect();
        let image = &self.whole.image;
        json!({
            "kind": "budget",
            "instrument": self.name,
            "board": self.setup.board.name,
            "keys": self.keys(),
            "rate_hz": self.budget.rate_hz,
            "fits": self.budget.fits(),
            "period_cycles": self.budget.period_cycles,
            "key": {
                "cycles_max": self.budget.key_cycles_max,
                "contention_cycles_max": self.budget.crowded_key_cycles_max - self.budget.key_cycles_max,
                "by_item": items.map(|(item, cycles)| (item.to_string(), json!(cycles))).collect::<Map<_, _>>(),
                "worst_path": lines,
                "modes": (0..self.modes.len()).map(|index| self.mode_json(index)).collect::<Vec<_>>(),
                "class": self.budget.key_class.to_string(),
            },
            "cores": cores,
            "stack_bytes_max": self.budget.cores.iter().map(|core| core.stack_bytes_max).max(),
            "flash_bytes": image.stored_bytes(),
            "ram_bytes": image.run_bytes(),
            "class": self.budget.class.to_string(),
        })
    }

    fn core(&self, core: &CoreBudget, of: &Bounded) -> Value {
        let parts = |frame: &whippen_compiler::budget::Frame| {
            frame.parts.iter().map(|(part, cycles)| (part.clone(), json!(cycles))).collect::<Map<_, _>>()
        };
        json!({
            "keys": core.keys,
            "cycles_max": core.cycles_max,
            "utilization": core.utilization(),
            "slack_cycles": core.slack_cycles,
            "slack": core.slack(),
            "alone_cycles_max": of.alone.cycles_max,
            "contention_cycles_max": core.contention_cycles_max,
            "around_keys": parts(&of.alone),
            "more_keys": core.more_keys,
            "stack_bytes_max": core.stack_bytes_max,
        })
    }

    fn mode_json(&self, index: usize) -> Value {
        let alone = self.mode(index).map(|(alone, _)| alone.cycles_max).max();
        let crowded = self.mode(index).map(|(_, crowded)| crowded.cycles_max).max();
        json!({ "name": self.modes[index], "cycles_max": alone, "crowded_cycles_max": crowded })
    }
}
