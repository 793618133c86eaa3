//! Errors of the core as Python exceptions.

use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use zerorate_core::Error;

/// Converts an error of the core: ValueError, MemoryError, or the reason why the work was stopped.
#[derive(Debug)]
pub struct NativeError(Error);

impl From<Error> for NativeError {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl From<NativeError> for PyErr {
    fn from(error: NativeError) -> Self {
        let message = error.0.to_string();
        match error.0 {
            Error::Memory { .. } => PyMemoryError::new_err(message),
            Error::Stopped => PyKeyboardInterrupt::new_err(message),
            Error::Parameter { name, .. } | Error::Matrix { name, .. } => about(name, message),
            _ => PyValueError::new_err(message),
        }
    }
}

/// A ValueError whose message begins with the argument's name, taken from `argument`.
pub fn about(argument: &str, message: String) -> PyErr {
    let error = PyValueError::new_err(message);
    // Without the attribute the message still names the argument.
    Python::attach(|py| error.value(py).setattr("argument", argument).ok());
    error
}

/// The error for two threads in one filter.
pub fn in_use() -> PyErr {
    PyRuntimeError::new_err(
        "this filter is in use by another thread: give each thread a filter of its own, \
         for example by copy()",
    )
}
