//! From texts and settings to a compiled instrument and its device; what is wrong raises.

use std::ffi::OsString;

use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use whippen_command::device::{self, NoDevice};
use whippen_command::table_text::BESIDE_FILES;
use whippen_compiler::check::{self, Options};
use whippen_compiler::diag::{Diagnostic, Severity, render, summary};
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::{self, CompileError, Compiled};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

use crate::ProgramError;

/// What is compiled, beside its texts.
#[derive(Debug, Clone, Default)]
pub struct Wanted {
    /// The name of the instrument, where there are several.
    pub instrument: Option<String>,
    /// A bundled device or the file of one.
    pub device: Option<String>,
    pub rate_hz: Option<Rate>,
    /// Parameters and their values as text.
    pub sets: Vec<(String, String)>,
    /// Those of them that are plain numbers, in SI.
    pub in_si: Vec<String>,
}

/// Errors of a program as `whippen check` prints them, without colour.
fn wrong(map: &SourceMap, diagnostics: &[Diagnostic]) -> PyErr {
    let errors = diagnostics
        .iter()
        .filter(|d| d.severity() == Severity::Error);
    let shown: Vec<String> = errors.map(|d| render(map, d, false)).collect();
    ProgramError::new_err(format!("{}\n{}", shown.join("\n"), summary(diagnostics)))
}

/// Reads and checks files (names and texts).
pub fn checked(
    sources: &[(String, String)],
    wanted: &Wanted,
) -> Result<(SourceMap, check::Program), PyErr> {
    let mut map = SourceMap::default();
    for (name, text) in sources {
        map.add(name, text);
    }
    let options = Options {
        rate_hz: wanted.rate_hz,
        sets: wanted.sets.clone(),
        in_si: wanted.in_si.clone(),
        read: BESIDE_FILES,
    };
    let (program, diagnostics) = pipeline::front(&mut map, &options);
    let program = program.ok_or_else(|| wrong(&map, &diagnostics))?;
    Ok((map, program))
}

/// The instrument that is named, or the only one.
fn instrument(program: check::Program, name: Option<&str>) -> Result<Model, PyErr> {
    let names: Vec<String> = program
        .instruments
        .iter()
        .map(|model| model.name.clone())
        .collect();
    let mut found: Vec<Model> = program.instruments;
    if let Some(name) = name {
        found.retain(|model| model.name == name);
    }
    match found.len() {
        1 => Ok(found.remove(0)),
        _ => Err(PyValueError::new_err(format!(
            "name one instrument of the program; there are: {}",
            names.join(", ")
        ))),
    }
}

/// Compiles an instrument for traces.
pub fn compiled(
    sources: &[(String, String)],
    wanted: &Wanted,
    observe: bool,
) -> Result<(Compiled, Device), PyErr> {
    let (map, program) = checked(sources, wanted)?;
    let model = instrument(program.clone(), wanted.instrument.as_deref())?;
    let named = wanted.device.as_ref().map(OsString::from);
    let device =
        device::find(named.as_deref(), &map, &program, &model).map_err(|why| match why {
            NoDevice::Usage(message) => PyValueError::new_err(message),
            NoDevice::Program(diagnostic) => wrong(&map, &[*diagnostic]),
        })?;
    let compiled =
        pipeline::compile(model, device.scales(), observe).map_err(|error| match error {
            CompileError::Program(diagnostics) => wrong(&map, &diagnostics),
            CompileError::Defect(message) => {
                PyRuntimeError::new_err(format!("defect in Whippen: {message}"))
            }
        })?;
    Ok((compiled, device))
}
