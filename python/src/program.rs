//! `Program`: texts, and what is to be made of them.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use whippen_compiler::check;
use whippen_compiler::rate::Rate;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::session::{self, Recording};

use crate::load::{Wanted, checked, compiled};
use crate::motion::{Given, Positions, positions};
use crate::run::Run;

/// Whether Ctrl-C has come: it ends all runs of the process.
static STOPPED: AtomicBool = AtomicBool::new(false);
/// How many runs there are; the first one makes [`STOPPED`] false.
static RUNNING: AtomicUsize = AtomicUsize::new(0);

/// A checked program: its texts, one instrument of it, its device.
#[pyclass(frozen, module = "whippen._whippen")]
pub struct Program {
    sources: Vec<(String, String)>,
    wanted: Wanted,
}

/// A value of a parameter as text, and whether it is a plain number in SI.
fn value(given: &Bound<'_, PyAny>) -> PyResult<(String, bool)> {
    if given.is_instance_of::<PyBool>() {
        let text = if given.extract()? { "on" } else { "off" };
        return Ok((text.to_string(), false));
    }
    if let Ok(text) = given.extract::<String>() {
        return Ok((text, false));
    }
    if let Ok(number) = given.extract::<f64>() {
        return Ok((number.to_string(), true));
    }
    Err(PyValueError::new_err(
        "a value is a number in SI, a text with a unit such as \"0.4N\", or a bool",
    ))
}

impl Wanted {
    /// The same with more parameters set.
    fn with(&self, set: Option<&Bound<'_, PyDict>>) -> PyResult<Wanted> {
        let mut wanted = self.clone();
        for (name, given) in set.into_iter().flatten() {
            let name: String = name.extract()?;
            let (text, in_si) = value(&given)?;
            wanted.sets.retain(|(known, _)| *known != name);
            wanted.in_si.retain(|known| *known != name);
            wanted.sets.push((name.clone(), text));
            if in_si {
                wanted.in_si.push(name);
            }
        }
        Ok(wanted)
    }
}

#[pymethods]
impl Program {
    /// Reads and checks `sources`, names and texts.
    #[new]
    #[pyo3(signature = (sources, instrument=None, device=None, tick_rate=None, set=None))]
    fn new(
        sources: Vec<(String, String)>,
        instrument: Option<String>,
        device: Option<String>,
        tick_rate: Option<f64>,
        set: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Program> {
        let wanted = Wanted {
            instrument,
            device,
            rate_hz: tick_rate
                .map(check::tick_rate)
                .transpose()
                .map_err(PyValueError::new_err)?,
            ..Wanted::default()
        };
        let wanted = wanted.with(set.as_ref())?;
        checked(&sources, &wanted)?;
        Ok(Program { sources, wanted })
    }

    /// The names of its instruments.
    #[getter]
    fn instruments(&self) -> PyResult<Vec<String>> {
        let (_, program) = checked(&self.sources, &self.wanted)?;
        Ok(program
            .instruments
            .into_iter()
            .map(|model| model.name)
            .collect())
    }

    /// Moves the instrument and keeps every tick.
    #[pyo3(signature = (motion=None, *, set=None, engine="jit", motion_rate_hz=None, seconds=None, columns=None))]
    #[expect(clippy::too_many_arguments, reason = "they are Python's, by name")]
    fn run(
        &self,
        py: Python<'_>,
        motion: Option<Given<'_>>,
        set: Option<Bound<'_, PyDict>>,
        engine: &str,
        motion_rate_hz: Option<f64>,
        seconds: Option<f64>,
        columns: Option<Vec<String>>,
    ) -> PyResult<Run> {
        let kind: EngineKind = engine.parse().map_err(PyValueError::new_err)?;
        let wanted = self.wanted.with(set.as_ref())?;
        let (compiled, device) = compiled(&self.sources, &wanted, kind.board().is_none())?;
        let mut moved = positions(&compiled.model, motion, motion_rate_hz)?;
        if let Some(seconds) = seconds {
            moved = lasting(moved, seconds, compiled.model.rate_hz)?;
        }
        let recorded = session::recorded_of_motion(&compiled, &device, kind);
        let names = columns.unwrap_or_default();
        let chosen = match names.is_empty() {
            true => recorded,
            false => session::choose(&recorded, &names).map_err(PyValueError::new_err)?,
        };
        let places = &moved.places;
        let move_to = |tick: usize, at: &mut [f64]| {
            for (place, trajectory) in at.iter_mut().zip(places) {
                *place = trajectory.at(tick);
            }
        };
        let motion = (moved.ticks(), move_to);
        if RUNNING.fetch_add(1, Ordering::AcqRel) == 0 {
            STOPPED.store(false, Ordering::Release);
        }
        let mut interrupted = None;
        let played = py.detach(|| {
            let recording = Recording::new(chosen, session::Keep::Everything);
            let recording = recording.starting(moved.start_s).until(Some(&STOPPED));
            session::record(&compiled, &device, kind, motion, recording, |_| {
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    STOPPED.store(true, Ordering::Release);
                    interrupted.get_or_insert(error);
                }
            })
        });
        RUNNING.fetch_sub(1, Ordering::AcqRel);
        if let Some(error) = interrupted {
            return Err(error);
        }
        let mut played = played.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        played.is_chosen = !names.is_empty();
        if played.counts.ticks < played.ticks_wanted {
            return Err(PyKeyboardInterrupt::new_err("another run was interrupted"));
        }
        Run::new(py, compiled, kind, played)
    }
}

/// The same for so many seconds, if it is long enough: a gesture is repeated.
fn lasting(positions: Positions, seconds: f64, rate_hz: Rate) -> PyResult<Positions> {
    if !(seconds.is_finite() && seconds > 0.0) {
        return Err(PyValueError::new_err(format!(
            "{seconds} seconds make no sense"
        )));
    }
    let ticks = ((seconds * f64::from(rate_hz)).ceil() as usize).max(1);
    let places = positions.places.into_iter();
    Ok(Positions {
        places: places.map(|place| place.lasting(ticks)).collect(),
        ..positions
    })
}
