//! Motions from Python: nothing for the bundled gesture, a file, an array, or an array for each
//! port.

use std::collections::HashMap;
use std::path::PathBuf;

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use whippen_compiler::model::Model;
use whippen_runtime::gesture;
use whippen_runtime::motion::{self, MotionOptions, Resampled};
use whippen_runtime::trajectory::Trajectory;

/// What moves an instrument, as Python gives it.
#[derive(FromPyObject)]
pub enum Given<'py> {
    /// Positions of a key (m or rad), evenly in time.
    Array(PyReadonlyArray1<'py, f64>),
    /// What each port senses (SI), by its name.
    Ports(HashMap<String, PyReadonlyArray1<'py, f64>>),
    /// A table with titles such as `t_s,x_mm`.
    File(PathBuf),
}

/// What each port senses at every tick, and when the first tick is (s).
pub struct Positions {
    pub places: Vec<Trajectory>,
    pub start_s: f64,
}

impl Positions {
    /// How many ticks they last.
    pub fn ticks(&self) -> usize {
        self.places.iter().map(Trajectory::ticks).max().unwrap_or(0)
    }
}

/// The motion of a model; arrays have `rate_hz` samples a second, or one a tick.
pub fn positions(
    model: &Model,
    given: Option<Given<'_>>,
    rate_hz: Option<f64>,
) -> PyResult<Positions> {
    let start_s = 0.0;
    match given {
        None => Ok(Positions {
            places: bundled(model),
            start_s,
        }),
        Some(Given::File(path)) => of_file(model, &path),
        Some(Given::Array(array)) => {
            if model.senses.len() != 1 {
                return Err(PyValueError::new_err(format!(
                    "`{}` has several ports; give a dict of arrays, one for each of: {}",
                    model.name,
                    ports(model).join(", ")
                )));
            }
            let places = vec![sampled(model, array.as_slice()?, rate_hz)?];
            Ok(Positions { places, start_s })
        }
        Some(Given::Ports(mut arrays)) => {
            let mut places = Vec::new();
            for name in ports(model) {
                let array = arrays.remove(name);
                let array = array.ok_or_else(|| {
                    PyValueError::new_err(format!("the port `{name}` has no array"))
                })?;
                places.push(sampled(model, array.as_slice()?, rate_hz)?);
            }
            let unknown = arrays.into_keys().next();
            if let Some(name) = unknown {
                return Err(PyValueError::new_err(format!(
                    "`{}` has no port `{name}`; there are: {}",
                    model.name,
                    ports(model).join(", ")
                )));
            }
            Ok(Positions { places, start_s })
        }
    }
}

/// The names of a model's ports.
fn ports(model: &Model) -> Vec<&str> {
    model
        .senses
        .iter()
        .map(|sense| sense.name.as_str())
        .collect()
}

/// The bundled gesture.
fn bundled(model: &Model) -> Vec<Trajectory> {
    let place = |gesture| Trajectory::of_gesture(gesture, model.rate_hz);
    gesture::bundled_ports(model)
        .into_iter()
        .map(place)
        .collect()
}

/// Samples at the tick rate.
fn sampled(model: &Model, values: &[f64], rate_hz: Option<f64>) -> PyResult<Trajectory> {
    if values.is_empty() || values.iter().any(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(
            "a motion is an array of finite numbers, at least one",
        ));
    }
    let Some(rate_hz) = rate_hz else {
        return Ok(values.to_vec().into());
    };
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(PyValueError::new_err(format!(
            "a rate of {rate_hz} Hz makes no sense"
        )));
    }
    let tick_rate_hz = f64::from(model.rate_hz);
    Ok(Resampled::new(values.to_vec(), rate_hz, tick_rate_hz).into())
}

/// A table.
fn of_file(model: &Model, path: &std::path::Path) -> PyResult<Positions> {
    let wrong = |error: whippen_runtime::files::FileError| PyValueError::new_err(error.to_string());
    if model.is_of_key() {
        let options = MotionOptions {
            turns: model.turns(),
            ..MotionOptions::default()
        };
        let motion = motion::load(path, &options, model.rate_hz).map_err(wrong)?;
        return Ok(Positions {
            places: vec![motion.positions],
            start_s: motion.start_s,
        });
    }
    let ports = motion::wanted_ports(model);
    let motion = motion::load_ports(path, &ports, None, model.rate_hz).map_err(wrong)?;
    Ok(Positions {
        places: motion.places,
        start_s: motion.start_s,
    })
}
