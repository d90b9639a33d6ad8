//! The extension module `whippen._whippen` (PyO3): programs, runs, the command. What Python's users
//! see is `python/whippen/`, which stands on this.
//!
//! ```text
//!   Program(sources, ..)  --run(motion, set, engine)-->  Run: columns as NumPy arrays, events, a picture
//!   command(words)        what the command `whippen` does, in this process; its exit code
//! ```

mod load;
mod motion;
mod program;
mod run;

use std::ffi::OsString;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    _whippen,
    ProgramError,
    PyException,
    "A program is wrong; the text is what `whippen check` prints."
);

/// Runs a command line, whose first word is the command's own name, and gives its exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| whippen_command::command(words))
}

#[pymodule]
fn _whippen(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("ProgramError", module.py().get_type::<ProgramError>())?;
    module.add_class::<program::Program>()?;
    module.add_class::<run::Run>()?;
    module.add_function(wrap_pyfunction!(command, module)?)
}
