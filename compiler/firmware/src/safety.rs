//! Safety as code to be linked: what guards keys in an image guards them in a relocatable file, by
//! the same texts, and in C text by the same numbers.
//!
//! ```text
//!   safe.s, service.s, passivity.s, guard.s  +  numbers of a device  +  where the keys' state has what  -->  an object
//! ```
//!
//! Not here: a converter, a watchdog, outputs: those are of the program that has the file.

use std::collections::BTreeMap;

use whippen_arm::asm::{Source, assemble};
use whippen_arm::image::Object;
use whippen_arm::thumb::StateLayout;
use whippen_isa::Arch;

use super::boards::safety_texts;
use super::constants::{GAIN, RECORD_MAX, guard_constants};
use super::offsets::{Fault, assembly_constants, core_block};
use super::ports::Guards;
use super::{FAULTS, FirmwareError, Setup};

/// The frame of a tick that somebody else calls.
const SAFE: Source<'static> = Source {
    name: "firmware/safe.s",
    text: include_str!("safe.s"),
};

/// The faults that it finds, by their bits.
pub fn safety_faults() -> impl Iterator<Item = &'static Fault> {
    const FOUND: u32 = 1 | 2 | 4 | 8;
    FAULTS.iter().filter(|fault| fault.bit & FOUND != 0)
}

/// Where its block has what the outside may read (bytes): the number of the last tick, ticks
/// missed, faults, the key of the last one.
pub const SAFETY_WORDS: [u32; 4] = [
    core_block::TICK,
    core_block::MISSED,
    core_block::FAULTS,
    core_block::FAULTY,
];

/// Bytes of the block.
pub const SAFETY_BYTES: u32 = core_block::RAMP + 4;

/// The name of a tick with its safety, of keys with that prefix.
pub fn safe_tick_name(name: &str) -> String {
    format!("{name}_safe_tick")
}

/// The numbers with which keys are guarded, by their names in the texts; for C text, which any core
/// runs.
///
/// # Errors
/// Motor, passivity or keys are out of range, or what is played has ports that no key has.
pub fn safety_numbers(setup: &Setup) -> Result<BTreeMap<String, i64>, FirmwareError> {
    numbers(setup, Arch::V8M)
}

fn numbers(setup: &Setup, arch: Arch) -> Result<BTreeMap<String, i64>, FirmwareError> {
    if setup.guards() == Guards::Ports {
        return Err(FirmwareError::SafetyPorts);
    }
    let mut all = guard_constants(setup, arch)?;
    match setup.keys[..] {
        [keys @ 1..=255] => all.insert("KEYS".into(), keys.into()),
        [keys] => return Err(FirmwareError::Keys(keys)),
        _ => return Err(FirmwareError::Cores(setup.keys.len(), 1)),
    };
    Ok(all)
}

/// The safety of keys whose code has that prefix, and a gain, and whose state lies so: to be linked
/// with it.
///
/// # Errors
/// As [`safety_numbers`]; there is no passivity on a Cortex-M0+; a record or a row is too large.
pub fn safety_object(
    name: &str,
    layout: &StateLayout,
    setup: &Setup,
    arch: Arch,
) -> Result<Object, FirmwareError> {
    let mut all = numbers(setup, arch)?;
    let record = layout.record(1) - layout.record(0);
    if record > RECORD_MAX {
        return Err(FirmwareError::Record(record));
    }
    let (keys, past) = (all["KEYS"], all["PAST"]);
    let own: [(&str, i64); 8] = [
        ("SMALL", (arch == Arch::V6M).into()),
        ("ZONES", 0),
        ("RECORD", record.into()),
        ("GAIN", GAIN.into()),
        (
            "DISTANCE",
            (layout.output(0, 0) - layout.input(0, 0)).into(),
        ),
        ("INPUTS", layout.input(0, 0).into()),
        (
            "GAINS",
            layout.gain(0).unwrap_or(layout.record(0) + GAIN).into(),
        ),
        ("LEDGER_WORDS", (4 + 8 * keys + 2 * keys * past + 3) / 4),
    ];
    all.extend(own.map(|(name, value)| (name.to_string(), value)));
    all.extend(assembly_constants());
    let texts: Vec<Source> = [SAFE].into_iter().chain(safety_texts(arch)).collect();
    let object = assemble(&texts, &all, arch).map_err(FirmwareError::Assembly)?;
    Ok(named(object, name))
}

/// Under the names of its keys; nobody else sees what is in it but the functions and the block.
fn named(mut object: Object, name: &str) -> Object {
    for section in &mut object.sections {
        section.name = section
            .name
            .replacen(".frame", &format!(".{name}.safety"), 1);
        for fixup in &mut section.fixups {
            fixup.symbol = symbol_of(&fixup.symbol, name);
        }
    }
    for symbol in &mut object.symbols {
        symbol.name = symbol_of(&symbol.name, name);
    }
    object
}

fn symbol_of(symbol: &str, name: &str) -> String {
    match symbol {
        "safe_tick" => safe_tick_name(name),
        "safe_init" => format!("{name}_safe_init"),
        "block" => format!("{name}_safety"),
        "state" => format!("{name}_state"),
        "keys_tick" => format!("{name}_tick"),
        "keys_init" => format!("{name}_init"),
        label => format!("{name}.safety.{label}"),
    }
}
