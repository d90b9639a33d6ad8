//! The device of an instrument: the one that `--device` names, or its keyboard's, or the usual one.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use whippen_compiler::check::{DeviceName, Keyboard, Program};
use whippen_compiler::diag::{Code, Diagnostic};
use whippen_compiler::model::{Model, Sense};
use whippen_compiler::source::SourceMap;
use whippen_compiler::units::shown;
use whippen_runtime::device::{Device, Port};

use crate::hardware::DEVICE;

/// What `--device` is for.
pub const HELP: &str = "The device, by name (mikey, chain, knob, touch, pad, mouse) or as a TOML file: the scales of sensors \
     and drives; the keyboard's otherwise, or mikey, or knob for what turns, or the one that has the ports";

/// How `--device` is written.
pub const VALUE: &str = "NAME|FILE.toml";

/// The file that `--device` names, unless it names a bundled device.
pub fn file(named: Option<&OsStr>) -> Option<PathBuf> {
    DEVICE.file(named?)
}

/// The device that `--device` names.
///
/// # Errors
/// In words: there is no such device, or what is wrong with its file.
pub fn named(name: &OsStr) -> Result<Device, String> {
    match DEVICE.file(name) {
        Some(path) if path.exists() => Device::load(&path).map_err(|error| error.to_string()),
        Some(_) => Err(DEVICE.absent(name)),
        None => (name.to_str().and_then(Device::bundled)).ok_or_else(|| DEVICE.absent(name)),
    }
}

/// The device of a keyboard; `folder` says where a file of the program lies.
///
/// # Errors
/// What is wrong with its file.
pub fn of_keyboard(
    keyboard: &Keyboard,
    map: &SourceMap,
    folder: impl Fn(&str) -> Option<PathBuf>,
) -> Result<Option<Device>, Box<Diagnostic>> {
    let (file, span) = match &keyboard.device {
        DeviceName::Usual => return Ok(None),
        DeviceName::Bundled(name) => return Ok(Device::bundled(name)),
        DeviceName::File(file, span) => (file, *span),
    };
    let program = map.files().get(span.file as usize);
    let folder = program.and_then(|program| folder(&program.name));
    let path = folder.unwrap_or_default().join(file);
    Device::load(&path).map(Some).map_err(|error| {
        let message = format!("the device of `{}` cannot be used: {error}", keyboard.name);
        let wrong = Diagnostic::new(Code::UnknownHardware, span, message, "this file");
        Box::new(wrong.hint(
            "the file's place is told from the folder of the program; \
             docs/how-to/device.md says how it is written",
        ))
    })
}

/// So much of what a device measures may be missing at an end without a word.
const UNMEASURED: f64 = 0.05;

/// What an instrument senses beyond what its device measures, in words, if it is much: a note for
/// each port.
pub fn unmeasured(device: &Device, model: &Model) -> Vec<String> {
    let ports = model.senses.iter().zip(device.ports_of(model));
    let note = |(sense, port): (&Sense, &Port)| {
        let sensor = &port.sensor;
        let much = UNMEASURED * (sensor.high - sensor.low);
        let is_beyond =
            sense.range.low < sensor.low - much || sense.range.high > sensor.high + much;
        let words = |low: f64, high: f64| {
            format!("{} .. {}", shown(low, sense.dim), shown(high, sense.dim))
        };
        let (of_instrument, of_device) = if model.senses.len() > 1 {
            (
                format!("`{}` of ", sense.name),
                format!("`{}` of ", port.name),
            )
        } else {
            (String::new(), String::new())
        };
        is_beyond.then(|| {
            format!(
                "{of_instrument}`{}` senses {}, and {of_device}the device `{}` measures {}: the rest is never reached; \
                 give a device of your own with --device FILE.toml",
                model.name,
                words(sense.range.low, sense.range.high),
                device.name,
                words(sensor.low, sensor.high),
            )
        })
    };
    ports
        .filter_map(note)
        .chain(device.assumption(model))
        .collect()
}

/// The folder of a file of the command line.
pub fn folder_of(file: &str) -> Option<PathBuf> {
    Path::new(file).parent().map(Path::to_path_buf)
}

/// Whether an instrument can be played on a device.
///
/// # Errors
/// In words: it cannot, and which device to give.
pub fn fits(device: &Device, model: &Model) -> Result<(), String> {
    let usual = Device::of(model).name;
    let other = |why| format!("{why}; give another device, such as --device {usual}");
    device.fits(model).map_err(other)
}

/// Why no device of the command line or of the keyboard can be used.
pub enum NoDevice {
    /// The command line is wrong.
    Usage(String),
    /// The program is wrong.
    Program(Box<Diagnostic>),
}

/// The device that was named, or of the program's keyboard, or the bundled one that moves as the
/// instrument does; on which the instrument can be played.
///
/// # Errors
/// There is none, or it moves in another way.
pub fn find(
    wanted: Option<&OsStr>,
    map: &SourceMap,
    program: &Program,
    model: &Model,
) -> Result<Device, NoDevice> {
    let of_program = || match program.keyboards.first() {
        Some(keyboard) => of_keyboard(keyboard, map, folder_of).map_err(NoDevice::Program),
        None => Ok(None),
    };
    let found = match wanted {
        Some(name) => Some(named(name).map_err(NoDevice::Usage)?),
        None => of_program()?,
    };
    let device = found.unwrap_or_else(|| Device::of(model));
    fits(&device, model).map_err(NoDevice::Usage)?;
    Ok(device)
}
