//! The budget for programs.

use serde_json::{Map, Value, json};
use whippen_compiler::budget::{Bounded, CoreBudget, CutBound, Waited, ZoneBound};
use whippen_compiler::image::Place;
use whippen_compiler::keyboard::ZoneId;
use whippen_runtime::rate;

use crate::cmd::proof::{ImageProof, ProgramReport, ZoneReport};
use crate::cmd::setup::symbol_prefix;

impl ImageProof<'_> {
    /// One object.
    pub fn json(&self, played: &ProgramReport) -> Value {
        let slowest = played.slowest_zone();
        let bound = played.worst_case().bound;
        let items = self.bytes.by_item(&bound.path).into_iter();
        let places = self.bytes.by_place(&bound.path).into_iter();
        let of_lines = places.filter_map(|(place, cycles)| Some((place?, cycles)));
        let lines: Vec<Value> = of_lines
            .map(|(place, cycles)| {
                let Place {
                    file, line, item, ..
                } = place;
                json!({ "file": file, "line": line, "item": item, "cycles": cycles })
            })
            .collect();
        let cores = played.budget.cores.iter().zip(&played.cores);
        let cores: Vec<Value> = cores.map(|(core, of)| played.core_json(core, of)).collect();
        let image = &self.image.image;
        json!({
            "kind": "budget",
            "instrument": played.program.name,
            "board": self.setup.board.name,
            "keys": self.keys,
            "rate_hz": rate::number(played.budget.rate_hz),
            "fits": played.budget.fits(),
            "period_cycles": played.budget.period_cycles,
            "key": {
                "cycles_max": played.budget.key_cycles_max,
                "contention_cycles_max": played.budget.contended_key_cycles_max - played.budget.key_cycles_max,
                "by_item": items.map(|(item, cycles)| (item.to_string(), json!(cycles))).collect::<Map<_, _>>(),
                "worst_path": lines,
                "modes": played.modes_json(slowest),
                "class": played.budget.key_class.to_string(),
            },
            "cores": cores,
            "stack_bytes_max": played.budget.cores.iter().map(|core| core.stack_bytes_max).max(),
            "flash_bytes": image.stored_bytes(),
            "ram_bytes": image.run_bytes(),
            "class": played.budget.class.to_string(),
            "validation": self.validated.as_ref().map(|own| own.of_program(played.id).json()),
        })
    }
}

impl ProgramReport<'_> {
    fn core_json(&self, core: &CoreBudget, of: &Bounded) -> Value {
        let parts = |frame: &whippen_compiler::budget::TickHandlerBound| {
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
            "waiting": of.waiting().iter().map(waited_json).collect::<Vec<_>>(),
            "around_keys": parts(&of.alone),
            "more_keys": core.more_keys,
            "stack_bytes_max": core.stack_bytes_max,
        });
        if self.program.is_split() {
            let zone = |zone: &ZoneBound| {
                json!({
                    "instrument": symbol_prefix(self.zone(zone.of.zone).compiled),
                    "keys": zone.keys(),
                    "key_cycles_max": zone.tick.key_cycles_max(),
                })
            };
            core["zones"] = of.alone.zones.iter().map(zone).collect();
        }
        if let Some(sending) = of.contended.sending {
            core["sending"] = json!({
                "cycles_max": sending.cycles_max,
                "until_cycles": sending.until_cycles,
            });
        }
        if let Some(cut) = &of.alone.cut {
            core["parts"] = parts_json(cut, &of.alone.zones);
        }
        core
    }

    /// Adds what each zone is, where there are several: a list of objects, to each of which
    /// `beyond` may add.
    pub fn add_zones(&self, budget: &mut Value, beyond: impl Fn(&mut Value, &ZoneReport)) {
        if !self.program.is_split() {
            return;
        }
        let zone = |(number, report): (ZoneId, &ZoneReport)| {
            let alone = self
                .bounds(number)
                .map(|(alone, _)| alone.tick.key_cycles_max())
                .max();
            let contended = self
                .bounds(number)
                .map(|(_, contended)| contended.tick.key_cycles_max())
                .max();
            let keys: u32 = self.bounds(number).map(|(alone, _)| alone.keys()).sum();
            let mut zone = json!({
                "instrument": symbol_prefix(report.compiled),
                "notes": report.notes,
                "keys": keys,
                "key": { "cycles_max": alone, "contended_cycles_max": contended, "modes": self.modes_json(number) },
            });
            beyond(&mut zone, report);
            zone
        };
        budget["zones"] = self.numbered_zones().map(zone).collect();
    }

    /// The modes of a zone.
    fn modes_json(&self, zone: ZoneId) -> Vec<Value> {
        let mode = |(index, name): (usize, &String)| {
            let alone = self
                .mode(zone, index)
                .map(|(alone, _)| alone.cycles_max)
                .max();
            let contended = self
                .mode(zone, index)
                .map(|(_, contended)| contended.cycles_max)
                .max();
            json!({ "name": name, "cycles_max": alone, "contended_cycles_max": contended })
        };
        self.zone(zone).modes.iter().enumerate().map(mode).collect()
    }
}

/// The parts of an instrument, the tail last.
fn parts_json(cut: &CutBound, tail: &[ZoneBound]) -> Value {
    let part = |role: String, core: usize, code: &ZoneBound| json!({ "part": role, "core": core, "cycles_max": code.tick.cycles_max(1) });
    let parts = cut.parts.iter();
    let parts = parts.map(|own| part(own.role.to_string(), own.core, &own.code));
    let tail = tail.iter().map(|own| part("tail".to_string(), 0, own));
    let helped = cut.helped.as_ref().map(|helped| {
        let [own, of_core1] = helped.members_cycles_max();
        json!({
            "own_cycles_max": own,
            "helped_cycles_max": of_core1,
            "sound_cycles_max": helped.sound_cycles_max(),
        })
    });
    json!({ "all": parts.chain(tail).collect::<Vec<_>>(), "members": helped })
}

fn waited_json(waited: &Waited) -> Value {
    json!({ "for": waited.cause.to_string(), "data": waited.data, "cycles": waited.cycles })
}
