//! Blocks of a replay: arrays (k, n) with a row an axis, read and filled in place.

use numpy::ndarray::{ArrayView2, ArrayViewMut2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The rows of a block, each without gaps between its samples.
pub fn rows<'a, T>(name: &str, block: &'a ArrayView2<'_, T>) -> PyResult<Vec<&'a [T]>> {
    let row = |i: usize| block.row(i).to_slice();
    (0..block.nrows()).map(|i| row(i).ok_or_else(|| gaps(name))).collect()
}

/// The rows of a block to be filled.
pub fn rows_mut<'a, T>(name: &str, block: ArrayViewMut2<'a, T>) -> PyResult<Vec<&'a mut [T]>> {
    let rows = block.into_outer_iter_mut();
    rows.map(|row| row.into_slice().ok_or_else(|| gaps(name))).collect()
}

/// Refuses a block of another shape.
pub fn check(name: &str, got: &[usize], expected: &[usize]) -> PyResult<()> {
    if got == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} must have shape {expected:?}, got {got:?}")))
}

fn gaps(name: &str) -> PyErr {
    PyValueError::new_err(format!("{name} must have rows without gaps"))
}
