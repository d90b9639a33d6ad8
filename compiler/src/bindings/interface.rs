//! The interface of a compiled instrument: names, units and scales from its Model, offsets from its
//! code.

use super::{Argument, EventInterface, Interface, LiveInterface, PortInterface, Ring};
use crate::pipeline::Compiled;
use whippen_arm::thumb::StateLayout;
use whippen_c99::spelled;
use whippen_lang::model::EmissionId;
use whippen_lang::units::Dim;
use whippen_lower::LoweredEventKind;
use whippen_lower::scales::Scales;

impl Interface {
    /// What who calls the code of `compiled` must know: it was lowered with these scales and built
    /// under this name, for so many keys, with this layout.
    pub fn of(
        compiled: &Compiled,
        scales: Scales,
        name: &str,
        keys: u32,
        layout: &StateLayout,
    ) -> Interface {
        let (model, kernel) = (&compiled.model, &compiled.lowered.kernel);
        let (position, force) = if model.turns() {
            ("rad", "N*m")
        } else {
            ("m", "N")
        };
        let input = |name| PortInterface {
            name,
            lsb: scales.sensor_lsb,
            zero: scales.sensor_zero,
            unit: position.into(),
        };
        let output = |name| PortInterface {
            name,
            lsb: scales.drive_lsb,
            zero: 0.0,
            unit: force.into(),
        };
        let names =
            |ports: &[whippen_kernel::Port]| unique(ports.iter().map(|port| port.name.as_str()));
        let ring = layout.events();
        let ring = ring.map(|ring| Ring {
            at: ring.start,
            bytes: ring.bytes,
            record_bytes: ring.event,
        });
        Interface {
            name: name.to_string(),
            keys,
            rate_hz: kernel.rate_hz,
            state_bytes: layout.size(),
            inputs: (
                layout.input(0, 0),
                names(&kernel.inputs).into_iter().map(input).collect(),
            ),
            outputs: (
                layout.output(0, 0),
                names(&kernel.outputs).into_iter().map(output).collect(),
            ),
            row_words: kernel.inputs.len().max(kernel.outputs.len()).max(1) as u32,
            lives: lives(compiled, layout),
            events: events(compiled),
            ring,
        }
    }
}

fn lives(compiled: &Compiled, layout: &StateLayout) -> Vec<LiveInterface> {
    let kernel = &compiled.lowered.kernel;
    let names = unique(kernel.lives.iter().map(|live| live.name.as_str()));
    let parts = kernel
        .lives
        .iter()
        .zip(&compiled.lowered.lives)
        .zip(&compiled.model.lives)
        .zip(names)
        .enumerate();
    let live = |(index, (((live, meaning), model), name)): (
        usize,
        (((&whippen_kernel::Live, _), &whippen_lang::model::Live), _),
    )| {
        let meaning: &whippen_lower::LoweredLive = meaning;
        Some(LiveInterface {
            name,
            at: layout.live_param(index)?,
            range: (live.range.low as i32, live.range.high as i32),
            init: live.init,
            fraction_bits: fraction_bits(meaning.lsb),
            unit: model.dim.map_or_else(String::new, unit),
        })
    };
    parts.filter_map(live).collect()
}

fn events(compiled: &Compiled) -> Vec<EventInterface> {
    let kernel = &compiled.lowered.kernel;
    let names = unique(kernel.events.iter().map(|event| event.name.as_str()));
    let event = |(name, meaning): (String, &whippen_lower::LoweredEvent)| {
        let args = match meaning.kind {
            LoweredEventKind::Emission(index) => {
                &compiled.model.emissions[EmissionId(index)].args[..]
            }
            LoweredEventKind::Rule(_) => &[],
        };
        let spelled = unique(args.iter().map(|(name, _)| name.as_str()));
        let arg = |((name, (_, dim)), lsb): ((String, &(String, Dim)), &f64)| Argument {
            name,
            fraction_bits: fraction_bits(*lsb),
            unit: unit(*dim),
        };
        EventInterface {
            name,
            args: spelled
                .into_iter()
                .zip(args)
                .zip(&meaning.arg_lsbs)
                .map(arg)
                .collect(),
        }
    };
    names
        .into_iter()
        .zip(&compiled.lowered.events)
        .map(event)
        .collect()
}

/// The unit as a program would write it; nothing for a plain number.
fn unit(dim: Dim) -> String {
    if dim == Dim::NUMBER {
        String::new()
    } else {
        dim.unit()
    }
}

/// `n` where one unit is `2^-n`.
fn fraction_bits(lsb: f64) -> i32 {
    // The exponent's field: a power of two has no other.
    1023 - (lsb.to_bits() >> 52 & 0x7ff) as i32
}

/// Names that C and Rust can spell, each once also in capitals.
fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for (index, name) in names.enumerate() {
        let wanted = spelled(name);
        let taken = all.iter().any(|other| other.eq_ignore_ascii_case(&wanted));
        all.push(if taken {
            format!("{wanted}_{index}")
        } else {
            wanted
        });
    }
    all
}
