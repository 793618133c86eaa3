//! Rules of the package for the compiled classes. The package registers them at import, and nothing
//! here depends on a name in the package.

use std::sync::{PoisonError, RwLock};

use pyo3::call::PyCallArgs;
use pyo3::exceptions::{PyKeyError, PyRuntimeError};
use pyo3::prelude::*;

/// Rules that the package has registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Converts a value from one unit to another; the arguments are value and units.
    Convert,
    /// Converts to an array in which masked values, None and the NA of pandas are NaN.
    WithoutMasks,
    /// Converts an object's arguments: logs and data frames become samples in its units.
    Samples,
    /// Creates the run of a linear filter on a record, from arrays by name.
    LinearRun,
    /// Creates the trace of a drift filter on a record, from arrays by name.
    Trace,
    /// Creates the track of a recording, from a filter and the arguments of its `process`.
    Navigate,
}

const NAMES: [&str; 6] = ["convert", "without_masks", "samples", "linear_run", "trace", "navigate"];
static RULES: [RwLock<Option<Py<PyAny>>>; 6] = [const { RwLock::new(None) }; 6];

/// Registers the functions that compiled classes call, by name.
#[pyfunction]
#[pyo3(signature = (**rules))]
pub fn register(rules: Option<&Bound<'_, pyo3::types::PyDict>>) -> PyResult<()> {
    for (name, rule) in rules.into_iter().flatten() {
        let name: String = name.extract()?;
        let place = NAMES.iter().position(|known| *known == name);
        let place = place.ok_or_else(|| PyKeyError::new_err(format!("no rule '{name}'")))?;
        *RULES[place].write().unwrap_or_else(PoisonError::into_inner) = Some(rule.unbind());
    }
    Ok(())
}

/// The registered function.
pub fn function(py: Python<'_>, rule: Rule) -> PyResult<Bound<'_, PyAny>> {
    let known = RULES[rule as usize].read().unwrap_or_else(PoisonError::into_inner);
    let known = known.as_ref().map(|known| known.bind(py).clone());
    known.ok_or_else(|| {
        PyRuntimeError::new_err(format!("nobody registered the rule '{}'", NAMES[rule as usize]))
    })
}

/// Calls the rule.
pub fn call<'py>(
    py: Python<'py>,
    rule: Rule,
    given: impl PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    function(py, rule)?.call1(given)
}
