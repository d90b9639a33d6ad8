//! The interface of a compiled instrument: names, units and scales from its Model, offsets from its
//! code.

use std::collections::BTreeSet;

use super::{Argument, EventInterface, Interface, LiveInterface, PortInterface, Ring};
use crate::pipeline::Compiled;
use whippen_arm::thumb::{StateLayout, event_ring};
use whippen_c99::{component, spelled};
use whippen_isa::Arch;
use whippen_kernel::Verified;
use whippen_lang::model::EmissionId;
use whippen_lang::units::Dim;
use whippen_lower::LoweredEventKind;

impl Interface {
    /// What who calls the machine code of `compiled` must know: it was built under this name, for
    /// so many keys, with this layout.
    pub fn of(
        compiled: &Compiled,
        name: &str,
        keys: u32,
        layout: &StateLayout,
        arch: Arch,
    ) -> Interface {
        let most = event_ring(&compiled.lowered.kernel, keys).map_or(0, |(_, most)| most);
        let ring = layout.events().map(|ring| Ring {
            at: ring.start,
            bytes: ring.bytes,
            record_bytes: ring.event,
            tick_bytes_max: most,
        });
        let places = Places {
            rows: [layout.input(0, 0), layout.output(0, 0)],
            lives: (0..compiled.lowered.lives.len())
                .filter_map(|index| layout.live_param(index))
                .collect(),
            ring,
            state_bytes: layout.size(),
        };
        Interface {
            arch: Some(arch),
            ..Interface::at(compiled, name, keys, places)
        }
    }

    /// What who calls C text of `compiled` must know, and the kernel in it.
    pub fn of_c(compiled: &Compiled, kernel: Verified, name: &str, keys: u32) -> Interface {
        let ring = event_ring(kernel.kernel(), keys);
        let lives = compiled.lowered.lives.len() as u32;
        let words = row_words(compiled);
        let at = 16 + 4 * lives;
        let row = at + ring.map_or(0, |(ring, _)| ring.bytes);
        let places = Places {
            rows: [row, row + 2 * words * keys],
            lives: (0..lives).map(|index| 16 + 4 * index).collect(),
            ring: ring.map(|(ring, most)| Ring {
                at,
                bytes: ring.bytes,
                record_bytes: ring.event,
                tick_bytes_max: most,
            }),
            state_bytes: 0,
        };
        let prefix = format!("{name}_kernel");
        let text = component(kernel, &prefix, keys as usize, words as usize);
        Interface {
            component: Some(text),
            ..Interface::at(compiled, name, keys, places)
        }
    }

    fn at(compiled: &Compiled, name: &str, keys: u32, places: Places) -> Interface {
        let (model, kernel) = (&compiled.model, &compiled.lowered.kernel);
        let input = |(port, name): (usize, String)| PortInterface {
            name,
            lsb: compiled.scales[port].sensor_lsb,
            zero: compiled.scales[port].sensor_zero,
            unit: model.unit_of_sensed(port),
        };
        let output = |(port, name): (usize, String)| PortInterface {
            name,
            lsb: compiled.scales[port].drive_lsb,
            zero: 0.0,
            unit: model.dim_of_driven(port).unit(),
        };
        let names =
            |ports: &[whippen_kernel::Port]| unique(ports.iter().map(|port| port.name.as_str()));
        let sensed = (0..).zip(names(&kernel.inputs)).map(input).collect();
        let driven = model.drives().into_iter().zip(names(&kernel.outputs));
        let driven = driven.map(output).collect();
        let [inputs, outputs] = places.rows;
        let lives = lives(compiled, &places.lives);
        let mut events = events(compiled);
        tell_apart(&mut events, &lives);
        Interface {
            name: name.to_string(),
            keys,
            first_key: 0,
            rate_hz: kernel.rate_hz,
            state_bytes: places.state_bytes,
            inputs: (inputs, sensed),
            outputs: (outputs, driven),
            row_words: row_words(compiled),
            lives,
            events,
            ring: places.ring,
            arch: None,
            component: None,
            safety: None,
        }
    }
}

/// Where everything lies.
struct Places {
    /// Words in, words out.
    rows: [u32; 2],
    lives: Vec<u32>,
    ring: Option<Ring>,
    state_bytes: u32,
}

/// Words of a key in a row.
fn row_words(compiled: &Compiled) -> u32 {
    let kernel = &compiled.lowered.kernel;
    kernel.inputs.len().max(kernel.outputs.len()).max(1) as u32
}

fn lives(compiled: &Compiled, places: &[u32]) -> Vec<LiveInterface> {
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
            at: *places.get(index)?,
            range: (live.range.low as i32, live.range.high as i32),
            init: live.init,
            fraction_bits: fraction_bits(meaning.lsb),
            unit: model.dim.map(unit),
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

/// Gives arguments other names where a constant would have the name of another: that of argument
/// `min` of event `k` and that of the least value of `k`, of `a_b` in `c` and of `b` in `c_a`.
fn tell_apart(events: &mut [EventInterface], lives: &[LiveInterface]) {
    let of_live = |live: &LiveInterface| {
        ["min", "max", "init", "fraction_bits"]
            .map(|what| format!("{}_{what}", live.name.to_lowercase()))
    };
    let mut taken: BTreeSet<String> = lives.iter().flat_map(of_live).collect();
    taken.extend(
        events
            .iter()
            .map(|event| format!("event_{}", event.name.to_lowercase())),
    );
    for event in events {
        for index in 0..event.args.len() {
            let wanted = event.args[index].name.clone();
            let constants = |name: &str| {
                let constant = format!("{}_{name}", event.name).to_lowercase();
                [format!("{constant}_fraction_bits"), constant]
            };
            let is_free = |name: &String| {
                let own = |other: &Argument| other.name.eq_ignore_ascii_case(name);
                !constants(name).iter().any(|c| taken.contains(c))
                    && !event.args[..index].iter().any(own)
            };
            let numbered = (1..).map(|number| format!("{wanted}_{number}"));
            let free = std::iter::once(wanted.clone())
                .chain(numbered)
                .find(is_free);
            let name = free.unwrap_or(wanted);
            taken.extend(constants(&name));
            event.args[index].name = name;
        }
    }
}

/// The unit as a program would write it; `1` for a plain number.
fn unit(dim: Dim) -> String {
    if dim == Dim::NUMBER {
        "1".to_string()
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
    let all_wanted: Vec<String> = names.map(spelled).collect();
    let is_in = |all: &[String], name: &String| all.iter().any(|n| n.eq_ignore_ascii_case(name));
    let mut all: Vec<String> = Vec::new();
    for wanted in &all_wanted {
        let taken = |name: &String| is_in(&all, name);
        let numbered = (1..)
            .map(|number| format!("{wanted}_{number}"))
            .filter(|name| !is_in(&all_wanted, name));
        let free = std::iter::once(wanted.clone())
            .chain(numbered)
            .find(|name| !taken(name));
        all.extend(free);
    }
    all
}
