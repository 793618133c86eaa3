//! Errors of the core as Python exceptions.

use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use zerorate_core::Error;

/// Carries an error of the core to Python: every one is a bad value.
#[derive(Debug)]
pub struct NativeError(Error);

impl From<Error> for NativeError {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl From<NativeError> for PyErr {
    fn from(error: NativeError) -> Self {
        PyValueError::new_err(error.0.to_string())
    }
}

/// Two threads in one filter.
pub fn in_use() -> PyErr {
    PyRuntimeError::new_err(
        "this filter is in use by another thread: give each thread a filter of its own, \
         for example by copy()",
    )
}
