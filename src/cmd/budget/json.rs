//! The budget for programs.

use serde_json::{Map, Value, json};
use whippen_compiler::budget::{Bounded, CoreBudget};

use super::{Played, Proof};
use crate::cmd::setup::name;

impl Proof<'_> {
    /// One object.
    pub fn json(&self, played: &Played) -> Value {
        let bound = played.dearest().bound;
        let items = self.program.by_item(&bound.path).into_iter();
        let lines = self.program.by_place(&bound.path).into_iter().filter_map(|(place, _)| place);
        let lines: Vec<String> = lines.map(|place| format!("{}:{}", place.file, place.line)).collect();
        let cores: Vec<Value> =
            played.budget.cores.iter().zip(&played.cores).map(|(core, of)| core_json(core, of)).collect();
        let image = &self.whole.image;
        json!({
            "kind": "budget",
            "instrument": name(played.compiled),
            "board": self.setup.board.name,
            "keys": self.keys,
            "rate_hz": played.budget.rate_hz,
            "fits": played.budget.fits(),
            "period_cycles": played.budget.period_cycles,
            "key": {
                "cycles_max": played.budget.key_cycles_max,
                "contention_cycles_max": played.budget.crowded_key_cycles_max - played.budget.key_cycles_max,
                "by_item": items.map(|(item, cycles)| (item.to_string(), json!(cycles))).collect::<Map<_, _>>(),
                "worst_path": lines,
                "modes": (0..played.modes.len()).map(|index| played.mode_json(index)).collect::<Vec<_>>(),
                "class": played.budget.key_class.to_string(),
            },
            "cores": cores,
            "stack_bytes_max": played.budget.cores.iter().map(|core| core.stack_bytes_max).max(),
            "flash_bytes": image.stored_bytes(),
            "ram_bytes": image.run_bytes(),
            "class": played.budget.class.to_string(),
        })
    }
}

fn core_json(core: &CoreBudget, of: &Bounded) -> Value {
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

impl Played<'_> {
    fn mode_json(&self, index: usize) -> Value {
        let alone = self.mode(index).map(|(alone, _)| alone.cycles_max).max();
        let crowded = self.mode(index).map(|(_, crowded)| crowded.cycles_max).max();
        json!({ "name": self.modes[index], "cycles_max": alone, "crowded_cycles_max": crowded })
    }
}
