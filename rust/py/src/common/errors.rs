//! Errors of the core as Python exceptions.

use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use zerorate_core::Error;

/// Carries an error of the core to Python: a bad value, unless memory ran out or work was stopped.
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

/// A ValueError of an argument, with whose name the message begins: it is in `argument`.
pub fn about(argument: &str, message: String) -> PyErr {
    let error = PyValueError::new_err(message);
    // Without it the message still says which one it is.
    Python::attach(|py| error.value(py).setattr("argument", argument).ok());
    error
}

/// Two threads in one filter.
pub fn in_use() -> PyErr {
    PyRuntimeError::new_err(
        "this filter is in use by another thread: give each thread a filter of its own, \
         for example by copy()",
    )
}
