//! The numbers as one JSON object: SI values with their units in the names, weights in gram-force
//! too; what an instrument has not is null.

use serde_json::{Map, Value, json};
use whippen_runtime::measure::{DEFINITIONS, GRAM_FORCE_N};

use super::compare::compared;
use super::{Key, Measurement};

pub fn of(all: &Measurement) -> Value {
    let recorded = compared(all).into_iter().map(|c| {
        let kind = c.what.unit;
        json!({
            "column": c.title, "keys": c.pairs.len(), format!("recorded_{kind}"): c.recorded(),
            format!("difference_{kind}"): c.difference(), format!("rms_{kind}"): c.rms(),
        })
    });
    json!({
        "kind": "measure",
        "instrument": all.keys[0].compiled.model.name,
        "engine": all.protocol.engine.to_string(),
        "dip_m": all.protocol.dip_m,
        "speed_m_per_s": all.protocol.speed_m_per_s,
        "keys": all.keys.iter().map(key).collect::<Vec<_>>(),
        "compared": recorded.collect::<Vec<_>>(),
    })
}

fn key(key: &Key) -> Value {
    let measured = &key.measured;
    let mut object = Map::new();
    object.insert("key".into(), json!(key.name()));
    for definition in &DEFINITIONS {
        let value = measured.value(definition.name);
        object.insert(definition.title(), json!(value));
        if definition.unit == "n" {
            let grams = value.map(|n| n / GRAM_FORCE_N);
            object.insert(format!("{}_gf", definition.name), json!(grams));
        }
    }
    let drop = |wanted: &str| {
        let found = measured.drop.as_ref().filter(|(unit, _)| unit == wanted);
        json!(found.map(|drop| drop.1))
    };
    object.insert("drop_rad".into(), drop("rad"));
    object.insert("drop_m".into(), drop("m"));
    object.insert("repeats_beyond".into(), json!(measured.repeats_beyond));
    Value::Object(object)
}
