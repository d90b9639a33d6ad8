//! An instrument as a WebAssembly module: its Kernel, and what the words mean to whoever loads it.
//!
//! ```text
//!   sensor word = round((value - low) / (high - low) * 65535)      force = drive word / 32768 * full_scale
//!   live word   = round(value / lsb)                               probe = lsb * word + offset
//! ```
//!
//! Not here: the module's code and its memory (`whippen_wasm`).

use serde_json::{Value, json};
use whippen_compiler::kernel::FULL_SCALE;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::wasm::{self, Module, WasmError};

use crate::device::Device;
use crate::session::{event_headings, suffix, title};

/// The module of so many keys.
///
/// # Errors
/// There is no memory for so many, or a tick is too large for browsers.
pub fn module(compiled: &Compiled, device: &Device, keys: usize) -> Result<Module, WasmError> {
    let kernel = &compiled.lowered.kernel;
    wasm::module(kernel, keys, meaning(compiled, device))
}

/// What the integers of a module mean, in SI.
fn meaning(compiled: &Compiled, device: &Device) -> Value {
    let (model, lowered) = (&compiled.model, &compiled.lowered);
    let ports = device.ports_of(model);
    let senses = model.senses.iter().zip(&ports).map(|(sense, port)| {
        json!({
            "name": sense.name, "unit": sense.unit,
            "low": port.sensor.low, "high": port.sensor.high,
        })
    });
    let drives = model.drives().into_iter().map(|at| {
        let name = model.senses.get(at).map_or("", |sense| &sense.name);
        let full_scale = ports.get(at).map_or(0.0, |port| port.drive().full_scale);
        let unit = if model.port_turns(at) { "N*m" } else { "N" };
        json!({ "name": name, "unit": unit, "full_scale": full_scale })
    });
    let lives = model.lives.iter().zip(&lowered.lives).map(|(live, of)| {
        json!({
            "name": live.name, "unit": live.dim.map(|_| &live.unit), "lsb": of.lsb,
            "low": live.range.low, "high": live.range.high, "value": live.value,
        })
    });
    let events = event_headings(compiled).into_iter().zip(&lowered.events);
    let events = events
        .map(|((name, args), event)| json!({ "name": name, "args": args, "lsbs": event.arg_lsbs }));
    let probes = lowered.exports.iter().map(|export| {
        json!({
            "title": title(model, export), "unit": suffix(model, export),
            "lsb": export.lsb, "offset": export.offset,
        })
    });
    json!({
        "instrument": model.name,
        "is_of_key": model.is_of_key(),
        "senses": senses.collect::<Vec<_>>(),
        "drives": drives.collect::<Vec<_>>(),
        "lives": lives.collect::<Vec<_>>(),
        "events": events.collect::<Vec<_>>(),
        "probes": probes.collect::<Vec<_>>(),
        "channels": lowered.kernel.channels(),
        "full_scale": FULL_SCALE,
    })
}
