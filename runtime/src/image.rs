//! Parameters of an image: what it must know of instruments and their device, in the firmware's
//! words.
//!
//! ```text
//!   device (full scale, motor) ---.
//!   senses (range)             ---+--> firmware::Setup ------.
//!   events (note, release)     -------> ImageInstrument ------+--pipeline::build--> Image
//! ```
//!
//! Not here: the firmware itself (the compiler), files.

use whippen_compiler::firmware::{
    Coil, GuardedDrive, GuardedPort, InParts, Instrument, Midi, Motor, OwnTexts, Passivity, Setup,
    Velocities, divide_equally,
};
use whippen_compiler::image::{Place, places};
use whippen_compiler::model::Sense;
use whippen_compiler::modes::Modes;
use whippen_compiler::pipeline::{CompileError, Compiled, Observer, cut, specialize};
use whippen_compiler::source::SourceMap;

use crate::device::{Device, Port, Stands};

/// The part of the sensed range at either end where a constant word is no fault.
const END: f64 = 0.1;
/// The speed (m/s) that velocity 64 stands for: a hammer that is five times as fast as its key,
/// whose 64 is 0.25 m/s ([`crate::stroke::press_speed`]).
const MIDDLE_M_PER_S: f64 = 1.25;
/// Speeds above this (m/s) have the greatest velocity.
const FASTEST_M_PER_S: f64 = 8.0;

/// An instrument as an image needs it.
#[derive(Debug, Clone)]
pub struct ImageInstrument {
    /// The modes of its kernel, without probes.
    pub modes: Modes,
    /// Where its code was written; empty where nobody asks.
    pub places: Vec<Place>,
    /// Which events are notes.
    pub midi: Midi,
    /// The instrument in parts, if it is played once and has members that are worth it.
    pub parts: Option<InParts>,
}

impl ImageInstrument {
    /// Of a compiled instrument, with so many instructions for all modes of a key. With a map of
    /// its sources, its code knows its lines.
    ///
    /// # Errors
    /// A defect of the compiler.
    pub fn new(
        compiled: &Compiled,
        instructions: usize,
        map: Option<&SourceMap>,
        observer: Observer,
    ) -> Result<ImageInstrument, CompileError> {
        Ok(ImageInstrument {
            modes: specialize(compiled, instructions, observer)?,
            places: map.map_or_else(Vec::new, |map| places(&compiled.lowered.origins, map)),
            midi: midi(compiled),
            parts: match compiled.model.is_of_key() {
                true => None,
                false => cut(compiled, instructions)?,
            },
        })
    }

    /// The modes of what an image has as the keys of a zone: of the tail, if it is in parts.
    pub fn modes_of_zone(&self) -> &Modes {
        let tail = self.parts.as_ref().and_then(|parts| parts.modes.last());
        tail.unwrap_or(&self.modes)
    }

    /// As the builder of images takes them.
    pub fn borrow_all(all: &[ImageInstrument]) -> Vec<Instrument<'_>> {
        let all = all.iter().map(|own| Instrument {
            modes: &own.modes,
            places: &own.places,
            midi: &own.midi,
            parts: own.parts.as_ref(),
        });
        all.collect()
    }
}

/// The firmware's setup for so many keys on a board with so many cores; the first is this MIDI
/// note.
///
/// # Errors
/// The device says nothing of its motor, in words.
pub fn setup(
    compiled: &Compiled,
    device: &Device,
    keys: u32,
    cores: u32,
    first_note: u8,
) -> Result<Setup, String> {
    let ports = guarded_ports(compiled, device, None)?;
    setup_of_ports(compiled, device, (keys, cores), first_note, ports)
}

/// As [`setup`], for somebody who only bounds cycles: a motor's numbers are constants of code that
/// is otherwise the same, so one stands in where the device says nothing of its own.
///
/// # Errors
/// The device asks for more than the firmware's words can say, in words.
pub fn setup_to_bound(
    compiled: &Compiled,
    device: &Device,
    keys: u32,
    cores: u32,
    first_note: u8,
) -> Result<Setup, String> {
    let some = Motor {
        rated: 8192,
        peak_ms: 100,
        newton: 1024,
    };
    let ports = guarded_ports(compiled, device, Some(some))?;
    setup_of_ports(compiled, device, (keys, cores), first_note, ports)
}

/// The setup of so many keys on so many cores. What is no instrument of a key is played once, by
/// the first core.
fn setup_of_ports(
    compiled: &Compiled,
    device: &Device,
    (keys, cores): (u32, u32),
    first_note: u8,
    ports: Vec<GuardedPort>,
) -> Result<Setup, String> {
    let keys = match compiled.model.is_of_key() {
        true => divide_equally(keys, cores),
        false if keys == 1 => vec![1],
        false => {
            return Err(format!(
                "`{}` has ports that no key has and is played once, not on {keys} keys",
                compiled.model.name
            ));
        }
    };
    Ok(Setup {
        keys,
        rate_hz: compiled.model.rate_hz,
        ports,
        first_note: first_note.into(),
        coil: coil(device, f64::from(compiled.model.rate_hz)),
        passivity: passivity(device, f64::from(compiled.model.rate_hz))?,
        tuning: None,
        fine_velocity: false,
        passes_midi: false,
        monitor: None,
        own_texts: OwnTexts::default(),
    })
}

/// What a board that makes voltages must know of the motor, if the device says it.
fn coil(device: &Device, rate_hz: f64) -> Option<Coil> {
    let (motor, winding) = (device.motor?, device.drive().winding?);
    let part = |value: f64, of: f64| (value / of).round() as u32;
    Some(Coil {
        resistance_mohm: part(winding.resistance_ohm, 1e-3),
        kept: part(
            libm::exp(-winding.resistance_ohm / winding.inductance_h / rate_hz),
            libm::exp2(-32.0),
        ),
        peak_ma: part(motor.peak_a, 1e-3),
        torque_constant_un_m: part(motor.torque_constant, 1e-6),
    })
}

/// What the firmware must know to limit the energy of a key, where the device asks for it.
fn passivity(device: &Device, rate_hz: f64) -> Result<Option<Passivity>, String> {
    let Some(energy_j) = device.passivity_j else {
        return Ok(None);
    };
    let scales = device.port().scales();
    // A coil follows late by its time constant.
    let coil = device
        .drive()
        .bandwidth_hz
        .map_or(0.0, |hz| rate_hz / (std::f64::consts::TAU * hz));
    let late = device.sensor().delay_samples + device.drive().delay_samples + coil;
    let damping = device.port().mechanics.map_or(0.0, |m| m.damping) * scales.sensor_lsb * rate_hz
        / scales.drive_lsb;
    let words = Passivity {
        credit: (energy_j / (scales.drive_lsb * scales.sensor_lsb)).round() as u32,
        past: 1 + late.round() as u32,
        damping: (256.0 * damping).round() as u32,
    };
    let unit_j = scales.drive_lsb * scales.sensor_lsb;
    let [low_j, high_j] = [18, 30].map(|bits| f64::from(1_u32 << bits) * unit_j);
    match words {
        Passivity { credit, .. } if !(1 << 18..=1 << 30).contains(&credit) => Err(format!(
            "[passivity] of the device `{}`: value out of range (energy {energy_j:.3e} J, of \
             {low_j:.1e} J .. {high_j:.1e} J)",
            device.name
        )),
        Passivity { past: 17.., .. } => Err(format!(
            "[passivity] of the device `{}`: value out of range (delay of sensor and drive \
             {late:.1} ticks, at most 15)",
            device.name
        )),
        Passivity {
            damping: 8192.., ..
        } => Err(format!(
            "[passivity] of the device `{}`: value out of range (damping of the key {}/256 \
             drive words for a sensor word a tick, at most 8191/256)",
            device.name, words.damping
        )),
        words => Ok(Some(words)),
    }
}

/// What is guarded of a key, or of each port of an instrument that is played once; this motor
/// stands in where the device says nothing of its own.
fn guarded_ports(
    compiled: &Compiled,
    device: &Device,
    instead: Option<Motor>,
) -> Result<Vec<GuardedPort>, String> {
    let model = &compiled.model;
    if model.is_of_key() {
        let motor = match (motor(device), instead) {
            (Err(_), Some(some)) => some,
            (found, _) => found?,
        };
        return Ok(vec![GuardedPort {
            mid_travel: mid_travel(model.senses.first(), device.port()),
            rails: [true; 2],
            update_ticks: 1,
            drive: Some(GuardedDrive { word: 0, motor }),
        }]);
    }
    let drives = model.drives();
    let ports = device.ports_of(model);
    let guarded = (0..).zip(model.senses.iter().zip(ports));
    let guarded = guarded.map(|(number, (sense, port))| {
        let word = drives.iter().position(|drive| *drive == number);
        let drive = |word: usize| {
            let motor = match (motor_of_port(device, port), instead) {
                (Err(_), Some(some)) => some,
                (found, _) => found?,
            };
            let word = word as u32;
            Ok::<_, String>(GuardedDrive { word, motor })
        };
        let is_beyond = |end: f64, rail: u16| port.word(end).0 != rail;
        let rate_hz = f64::from(model.rate_hz);
        Ok(GuardedPort {
            mid_travel: mid_travel(Some(sense), port),
            rails: [
                is_beyond(sense.range.low, 0),
                is_beyond(sense.range.high, u16::MAX),
            ],
            update_ticks: (port.sensor.update_hz).map_or(1, |hz| (rate_hz / hz).ceil() as u32),
            drive: word.map(drive).transpose()?,
        })
    });
    guarded.collect()
}

/// What the drive of a port stands: word 32768 is the most that it gives.
fn motor_of_port(device: &Device, port: &Port) -> Result<Motor, String> {
    let Stands { rated, peak_s } = port.stands.ok_or_else(|| {
        format!(
            "the device `{}` does not say what the motor of its port `{name}` stands, and an image protects it: add \
             `[port.{name}.motor]` with `rated` and `peak_time` to its file",
            device.name,
            name = port.name
        )
    })?;
    let full_scale = port.drive().full_scale;
    Ok(Motor {
        rated: (32_768.0 * rated / full_scale).floor() as u32,
        peak_ms: (1000.0 * peak_s).floor() as u32,
        newton: newton(full_scale),
    })
}

/// The word of 1 N, or of 1 N*m, as far as there are words.
fn newton(full_scale: f64) -> u32 {
    (32_768.0 / full_scale).round().clamp(1.0, 32_767.0) as u32
}

/// Word 32768 is the peak current.
fn motor(device: &Device) -> Result<Motor, String> {
    let motor = device.motor.ok_or_else(|| {
        format!(
            "the device `{}` does not say what its motor stands, and an image protects it: add `[motor]` with \
             `torque_constant`, `rated`, `peak` and `peak_time` to its file",
            device.name
        )
    })?;
    Ok(Motor {
        rated: (32_768.0 * motor.rated_a / motor.peak_a).floor() as u32,
        peak_ms: (1000.0 * motor.peak_s).floor() as u32,
        newton: newton(device.drive().full_scale),
    })
}

fn mid_travel(sense: Option<&Sense>, port: &Port) -> [u16; 2] {
    let Some(range) = sense.map(|sense| sense.range) else {
        return [0, u16::MAX];
    };
    let at = |part: f64| port.word(range.low + part * (range.high - range.low)).0;
    [at(END), at(1.0 - END)]
}

/// Which events of a program are notes, and how fast a note's velocities are.
pub fn midi(compiled: &Compiled) -> Midi {
    let events = &compiled.lowered.kernel.events;
    let find = |name: &str| events.iter().position(|event| event.name == name);
    let speed_lsb = |at: usize| compiled.lowered.events[at].arg_lsbs.first().copied();
    // A velocity is made of an argument.
    let note = find("note").filter(|&at| events[at].args > 0);
    let release = find("release");
    let of_note = note.and_then(speed_lsb);
    let index = |at: usize| at as u32;
    Midi {
        note: note.map(index),
        release: release.map(index),
        velocities: velocities(of_note.unwrap_or(1.0)),
        release_velocities: release.and_then(speed_lsb).map(velocities),
    }
}

/// Velocities by a speed in this unit (m/s).
fn velocities(lsb: f64) -> Velocities {
    let step = |shift: u32| f64::from(1 << shift) * lsb;
    // The firmware shifts by one at least.
    let speed_shift = (1..24)
        .find(|&shift| 128.0 * step(shift) >= FASTEST_M_PER_S)
        .unwrap_or(24);
    let velocity = |index: usize| {
        let speed = index as f64 * step(speed_shift);
        let of_seven_bits = 64.0 + 30.0 * libm::log2(speed / MIDDLE_M_PER_S);
        // Less than 128 would be the end of a note.
        (128.0 * of_seven_bits).round().clamp(128.0, 16_383.0) as u16
    };
    Velocities {
        speed_shift,
        table: std::array::from_fn(velocity),
    }
}
