//! The loop of each port of an instrument, judged by itself.
//!
//! What is driven is judged where the device says how it moves; the other ports stand still
//! somewhere (`stability::of_port`). Not here: the analysis (`stability`), trials of what is not
//! proven stable (`ringing`).

use whippen_compiler::model::Model;
use whippen_compiler::stability::{self, Law, Stability};

use crate::device::{Device, Port};

/// The loop of a port.
pub struct JudgedPort {
    /// The name of the port; empty for the only one.
    pub port: String,
    /// The instrument with this port alone.
    pub model: Model,
    /// The device with this port alone.
    pub device: Device,
    /// What is known of the loop; or why nothing is, in words.
    pub found: Result<Stability, String>,
}

/// The loops of an instrument on a device, one for each port that is driven. `law` is that of the
/// whole instrument, for one with a single port, if it is known.
pub fn judge(model: &Model, device: &Device, law: Option<&Law>) -> Vec<JudgedPort> {
    let ports = device.ports_of(model);
    let is_only = model.senses.len() < 2;
    let judged = |number: usize| {
        let port = ports.get(number).copied().unwrap_or(device.port());
        let name = if is_only {
            ""
        } else {
            &model.senses[number].name
        };
        let own = stability::of_port(model, number);
        let found = of_port(&own, (port, device), law.filter(|_| is_only)).map(|mut found| {
            found.port = (!is_only).then(|| name.to_string());
            found
        });
        JudgedPort {
            port: name.to_string(),
            model: own,
            device: device.with_port(port),
            found,
        }
    };
    model.drives().into_iter().map(judged).collect()
}

fn of_port(
    model: &Model,
    (port, device): (&Port, &Device),
    law: Option<&Law>,
) -> Result<Stability, String> {
    let Some(key) = port.key(model.rate_hz) else {
        let table = match &*port.name {
            "" => "mechanics".to_string(),
            name => format!("port.{name}.mechanics"),
        };
        return Err(format!("the device `{}` has no `[{table}]`", device.name));
    };
    let found = match law {
        Some(law) => stability::analyze_law(law, &key),
        None => stability::analyze(model, &key),
    };
    found.ok_or_else(|| "a force there depends on a friction or a string".to_string())
}
