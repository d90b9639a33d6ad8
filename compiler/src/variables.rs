//! What debuggers call the values of an instrument's keys: names of the program, places of its
//! code.
//!
//! ```text
//!   Model, Lowered (names, units, states) + Modes, StateLayout (places, what modes know) -> Variables
//! ```
//!
//! Names are spelled as in the header for C. Not here: how a debugger is told (`image`).

use whippen_arm::image::{Known, Meaning, Scale, Variable, Variables};
use whippen_arm::thumb::StateLayout;
use whippen_c99::spelled;
use whippen_kernel::Type;
use whippen_lang::units::Dim;
use whippen_lower::scales::Scales;
use whippen_modes::Modes;

use crate::pipeline::Compiled;

/// The variables of keys whose code was built under a name, with this layout.
pub fn variables(
    compiled: &Compiled,
    modes: &Modes,
    name: &str,
    layout: &StateLayout,
) -> Variables {
    let describe = Describe {
        compiled,
        modes,
        layout,
    };
    let (key, cells): (Vec<Variable>, Vec<Option<usize>>) = describe.key().into_iter().unzip();
    let known = modes.modes.iter().map(|mode| {
        let known = |(own, cell): (&Variable, &Option<usize>)| {
            let cell = (*cell).filter(|cell| mode.known.get(*cell) == Some(&true))?;
            let range = mode.cells.get(cell)?;
            Some(known(range.low, &own.meaning))
        };
        key.iter().zip(&cells).map(known).collect()
    });
    Variables {
        name: name.to_string(),
        state_bytes: layout.size(),
        shared: describe.shared(),
        records: (
            layout.keys(),
            layout.record(0),
            layout.record(1) - layout.record(0),
        ),
        words: describe.words(),
        known: known.collect(),
        nowhere: describe.nowhere(&key),
        key,
    }
}

struct Describe<'a> {
    compiled: &'a Compiled,
    modes: &'a Modes,
    layout: &'a StateLayout,
}

fn variable(name: impl Into<String>, at: u32, meaning: Meaning) -> Variable {
    let (name, array) = (name.into(), Vec::new());
    Variable {
        name,
        at,
        meaning,
        array,
    }
}

/// What all words of a row mean, if they mean the same; otherwise they are shown as they are.
fn in_common(meanings: &[Meaning], bytes: i8) -> Meaning {
    let first = meanings.first();
    let same = first.filter(|first| meanings.iter().all(|meaning| meaning == *first));
    same.cloned()
        .unwrap_or_else(|| real(bytes, 1.0, 0.0, String::new()))
}

fn real(bytes: i8, lsb: f64, zero: f64, unit: String) -> Meaning {
    let scale = match power_of_two(lsb) {
        Some(power) if zero == 0.0 => Scale::PowerOfTwo(power),
        _ => Scale::Linear {
            lsb: lsb.to_le_bytes(),
            zero: zero.to_le_bytes(),
            called: format!("{lsb:e} {unit} + {zero:e}"),
        },
    };
    Meaning::Real { bytes, scale, unit }
}

/// The power of two that a number is.
fn power_of_two(value: f64) -> Option<i32> {
    let (exponent, fraction) = (value.to_bits() >> 52, value.to_bits() << 12);
    (fraction == 0 && (1..2047).contains(&exponent)).then_some(exponent as i32 - 1023)
}

/// What an integer that is known means.
fn known(integer: i64, meaning: &Meaning) -> Known {
    let real = match meaning {
        Meaning::Real {
            scale: Scale::Linear { lsb, zero, .. },
            ..
        } => f64::from_le_bytes(*zero) + integer as f64 * f64::from_le_bytes(*lsb),
        _ => integer as f64,
    };
    Known {
        integer,
        real: real.to_le_bytes(),
    }
}

/// The unit as a program would write it, or that there is none.
fn unit(dim: Dim) -> String {
    if dim == Dim::NUMBER {
        "number".to_string()
    } else {
        dim.unit()
    }
}

impl Describe<'_> {
    /// Counters, live values, and where the state has them words and events.
    fn shared(&self) -> Vec<Variable> {
        let counters = ["event_head", "event_tail", "events_lost", "tick"];
        let counters = (0..).zip(counters);
        let mut all: Vec<Variable> = counters
            .map(|(nth, name)| variable(name, 4 * nth, Meaning::Unsigned))
            .collect();
        let lives = self
            .compiled
            .lowered
            .lives
            .iter()
            .zip(&self.compiled.model.lives);
        let kernels = (&self.compiled.lowered.kernel, &self.modes.kernel);
        for (index, (meaning, live)) in lives.enumerate() {
            // A part of an instrument has some of its live values.
            let name = kernels.0.lives.get(index).map(|live| &live.name);
            let mut own = kernels.1.lives.iter();
            let own = own.position(|own| Some(&own.name) == name);
            let Some(at) = own.and_then(|own| self.layout.live_param(own)) else {
                continue;
            };
            let meaning = match live.dim {
                Some(dim) => real(4, meaning.lsb, 0.0, unit(dim)),
                None => Meaning::Bool,
            };
            all.push(variable(
                format!("live_{}", spelled(&live.name)),
                at,
                meaning,
            ));
        }
        if self.layout.has_rows() {
            let kernel = &self.modes.kernel;
            let words = kernel.inputs.len().max(kernel.outputs.len()).max(1) as u32;
            let sensor = in_common(&self.sensor_meanings(), 2);
            let drive = in_common(&self.drive_meanings(), -2);
            let (inputs, outputs) = (self.layout.input(0, 0), self.layout.output(0, 0));
            for (name, at, meaning) in [("inputs", inputs, sensor), ("outputs", outputs, drive)] {
                all.push(Variable {
                    array: vec![self.layout.keys(), words],
                    ..variable(name, at, meaning)
                });
            }
            if let Some(ring) = self.layout.events() {
                all.push(Variable {
                    array: vec![ring.bytes / 4],
                    ..variable("events", ring.start, Meaning::Unsigned)
                });
            }
        }
        all
    }

    /// What a record has, and which cell of the kernel each is.
    fn key(&self) -> Vec<(Variable, Option<usize>)> {
        let (kernel, lowered, layout) = (&self.modes.kernel, &self.compiled.lowered, self.layout);
        let own = |at: Option<u32>| at.map(|at| at - layout.record(0));
        let mut all = vec![(variable("mode", 0, Meaning::Code), None)];
        if let Some(at) = own(layout.number(0)) {
            all.push((variable("key", at, Meaning::Unsigned), None));
        }
        if let Some(at) = own(layout.gain(0)) {
            all.push((
                variable("gain", at, real(4, 1.0 / 65_536.0, 0.0, unit(Dim::NUMBER))),
                None,
            ));
        }
        let meaning = |name: &str| {
            let meaning = lowered.memory.iter().find(|own| own.name == name)?;
            Some(real(4, meaning.lsb, meaning.zero, unit(meaning.dim)))
        };
        for (index, cell) in kernel.cells.iter().enumerate() {
            let Some(at) = own(layout.cell(0, index)) else {
                continue;
            };
            let of_model = (cell.ty == Type::I32)
                .then(|| meaning(&cell.name))
                .flatten();
            let Some(meaning) = of_model.or_else(|| self.discrete(&cell.name)) else {
                continue;
            };
            if cell.len == 1 {
                let name = cell.name.strip_suffix(".state").unwrap_or(&cell.name);
                all.push((variable(spelled(name), at, meaning), Some(index)));
            }
        }
        for (index, keyed) in kernel.keyed.iter().enumerate() {
            let place = own(layout.keyed(0, index)).zip(meaning(&keyed.name));
            all.extend(
                place.map(|(at, meaning)| (variable(spelled(&keyed.name), at, meaning), None)),
            );
        }
        all
    }

    /// The state of a machine, or whether an event's guard held in the tick before.
    fn discrete(&self, cell: &str) -> Option<Meaning> {
        let (name, kind) = cell.rsplit_once('.')?;
        match kind {
            "state" => {
                let machines = &self.compiled.model.machines;
                let machine = machines.iter().find(|machine| machine.name == name)?;
                Some(Meaning::States {
                    machine: spelled(name),
                    states: machine.states.iter().map(|state| spelled(state)).collect(),
                })
            }
            "event" => Some(Meaning::Bool),
            _ => None,
        }
    }

    /// What the sensor word of each port means.
    fn sensor_meanings(&self) -> Vec<Meaning> {
        let (model, scales) = (&self.compiled.model, &self.compiled.scales);
        let meaning = |(port, scales): (usize, &Scales)| {
            let unit = model.unit_of_sensed(port);
            real(2, scales.sensor_lsb, scales.sensor_zero, unit)
        };
        scales.iter().enumerate().map(meaning).collect()
    }

    /// What the drive word of each driven port means.
    fn drive_meanings(&self) -> Vec<Meaning> {
        let (model, scales) = (&self.compiled.model, &self.compiled.scales);
        let meaning = |port: usize| {
            let unit = model.dim_of_driven(port).unit();
            real(-2, scales[port].drive_lsb, 0.0, unit)
        };
        model.drives().into_iter().map(meaning).collect()
    }

    /// What comes in. What goes out is not this tick's until the tick ends.
    fn words(&self) -> Vec<Variable> {
        let inputs = self.modes.kernel.inputs.iter().zip(0..);
        inputs
            .zip(self.sensor_meanings())
            .map(|((port, nth), meaning)| variable(spelled(&port.name), 2 * nth, meaning))
            .collect()
    }

    /// Every `let` that no variable is named like.
    fn nowhere(&self, key: &[Variable]) -> Vec<(String, String)> {
        let named = self.compiled.model.named.iter();
        let named = named.map(|named| {
            (
                spelled(&named.name),
                named.dim.map_or_else(|| "bool".to_string(), unit),
            )
        });
        named
            .filter(|(name, _)| key.iter().all(|own| own.name != *name))
            .collect()
    }
}
