//! The budget for programs.

use serde_json::{Map, Value, json};
use whippen_compiler::budget::{Bounded, CoreBudget, Zone};

use super::{Part, Played, Proof};
use crate::cmd::setup::name;

impl Proof<'_> {
    /// One object.
    pub fn json(&self, played: &Played) -> Value {
        let (dearest, _) = played.dearest_part();
        let bound = played.dearest().bound;
        let items = self.program.by_item(&bound.path).into_iter();
        let lines = self
            .program
            .by_place(&bound.path)
            .into_iter()
            .filter_map(|(place, _)| place);
        let lines: Vec<String> = lines
            .map(|place| format!("{}:{}", place.file, place.line))
            .collect();
        let cores = played.budget.cores.iter().zip(&played.cores).enumerate();
        let cores: Vec<Value> = cores
            .map(|(number, (core, of))| played.core_json(number, core, of))
            .collect();
        let image = &self.whole.image;
        json!({
            "kind": "budget",
            "instrument": played.name,
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
                "modes": played.modes_json(dearest),
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

impl Played<'_> {
    fn core_json(&self, number: usize, core: &CoreBudget, of: &Bounded) -> Value {
        let parts = |frame: &whippen_compiler::budget::Frame| {
            frame
                .parts
                .iter()
                .map(|(part, cycles)| (part.clone(), json!(cycles)))
                .collect::<Map<_, _>>()
        };
        let mut core = json!({
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
        });
        if self.parts.len() > 1 {
            let zone = |(zone, &part): (&Zone, &usize)| {
                let instrument = name(self.parts[part].compiled);
                json!({ "instrument": instrument, "keys": zone.keys, "key_cycles_max": zone.tick.key_cycles_max() })
            };
            core["zones"] = of
                .alone
                .zones
                .iter()
                .zip(&self.part_of[number])
                .map(zone)
                .collect();
        }
        core
    }

    /// Adds what each zone is, where there are several: a list of objects, to each of which
    /// `beyond` may add.
    pub fn add_zones(&self, budget: &mut Value, beyond: impl Fn(&mut Value, &Part)) {
        if self.parts.len() == 1 {
            return;
        }
        let zone = |(number, part): (usize, &Part)| {
            let alone = self
                .zones(number)
                .map(|(alone, _)| alone.tick.key_cycles_max())
                .max();
            let crowded = self
                .zones(number)
                .map(|(_, crowded)| crowded.tick.key_cycles_max())
                .max();
            let keys: u32 = self.zones(number).map(|(alone, _)| alone.keys).sum();
            let mut zone = json!({
                "instrument": name(part.compiled),
                "notes": part.keys,
                "keys": keys,
                "key": { "cycles_max": alone, "crowded_cycles_max": crowded, "modes": self.modes_json(number) },
            });
            beyond(&mut zone, part);
            zone
        };
        budget["zones"] = self.parts.iter().enumerate().map(zone).collect();
    }

    /// The modes of a part.
    fn modes_json(&self, part: usize) -> Vec<Value> {
        let mode = |(index, name): (usize, &String)| {
            let alone = self
                .mode(part, index)
                .map(|(alone, _)| alone.cycles_max)
                .max();
            let crowded = self
                .mode(part, index)
                .map(|(_, crowded)| crowded.cycles_max)
                .max();
            json!({ "name": name, "cycles_max": alone, "crowded_cycles_max": crowded })
        };
        self.parts[part]
            .modes
            .iter()
            .enumerate()
            .map(mode)
            .collect()
    }
}
