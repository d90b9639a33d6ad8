//! `Run`: what a run leaves behind, its columns as NumPy arrays that were not copied.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::record::Record;
use whippen_runtime::session;
use whippen_runtime::trace::{Column, Heading};

/// A finished run.
#[pyclass(frozen, module = "whippen._whippen")]
pub struct Run {
    compiled: Compiled,
    kind: EngineKind,
    /// Without the values of its columns, which are in `columns`.
    run: session::Run,
    columns: Vec<(Heading, Py<PyArray1<f64>>)>,
}

impl Run {
    /// Gives the values of the columns to Python.
    pub fn new(
        py: Python<'_>,
        compiled: Compiled,
        kind: EngineKind,
        mut run: session::Run,
    ) -> PyResult<Run> {
        let columns = std::mem::take(&mut run.trace.columns).into_iter();
        let columns = columns.map(|column| {
            let values = PyArray1::from_vec(py, column.record.into_values());
            (column.heading, values.unbind())
        });
        Ok(Run {
            columns: columns.collect(),
            compiled,
            kind,
            run,
        })
    }

    /// The run with what a figure shows of its columns.
    fn drawn(&self, py: Python<'_>) -> PyResult<session::Run> {
        let mut run = self.run.clone();
        for (heading, values) in &self.columns {
            let mut record = match heading.labels.is_empty() {
                true => Record::bounded(),
                false => Record::bounded_states(),
            };
            let values = values.bind(py).try_readonly()?;
            values
                .as_slice()?
                .iter()
                .for_each(|value| record.push(*value));
            run.trace.columns.push(Column {
                heading: heading.clone(),
                record,
            });
        }
        Ok(run)
    }
}

#[pymethods]
impl Run {
    /// The name of the instrument.
    #[getter]
    fn instrument(&self) -> &str {
        &self.compiled.model.name
    }

    /// The engine.
    #[getter]
    fn engine(&self) -> String {
        self.kind.to_string()
    }

    /// Ticks per second.
    #[getter]
    fn rate_hz(&self) -> f64 {
        f64::from(self.run.trace.rate_hz)
    }

    /// When the first tick was (s).
    #[getter]
    fn start_s(&self) -> f64 {
        self.run.trace.start_s
    }

    /// How many ticks were played.
    #[getter]
    fn ticks(&self) -> usize {
        self.run.counts.ticks
    }

    /// Title and values of every column.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for (heading, values) in &self.columns {
            columns.set_item(heading.title(), values.bind(py))?;
        }
        Ok(columns)
    }

    /// Of each column of a state machine the names of its states, which its values count from 0.
    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let labels = PyDict::new(py);
        for (heading, _) in self
            .columns
            .iter()
            .filter(|(heading, _)| !heading.labels.is_empty())
        {
            labels.set_item(heading.title(), &heading.labels)?;
        }
        Ok(labels)
    }

    /// What happened: a dict with `t_s`, `event` and the arguments for each.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let events = PyList::empty(py);
        for event in &self.run.trace.events {
            let row = PyDict::new(py);
            row.set_item("t_s", event.t_s)?;
            row.set_item("event", &event.event)?;
            for (title, value) in &event.args {
                row.set_item(title, value)?;
            }
            events.append(row)?;
        }
        Ok(events)
    }

    /// What was cut off: ticks in which a sensor, a range or a drive was at its end.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counts = PyDict::new(py);
        let of = self.run.counts;
        for (name, count) in [
            ("sensor_clipped", of.sensor_clipped),
            ("sense_clamped", of.sense_clamped),
            ("slew_held", of.slew_held),
            ("drive_clipped", of.drive_clipped),
        ] {
            counts.set_item(name, count)?;
        }
        Ok(counts)
    }

    /// The picture that `whippen run --plot` draws, as SVG.
    fn svg(&self, py: Python<'_>) -> PyResult<String> {
        let run = self.drawn(py)?;
        Ok(session::figure(&self.compiled, &run).svg())
    }
}
