//! Reversals of order for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::identify;

use crate::common::arrays;

/// Reversals of a record's order: pairs of values of which the earlier one is the greater.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Without missing samples.
///
/// Returns
/// -------
/// reversals, ties : int
///     Pairs i < j with z_i > z_j, and with z_i = z_j.
/// tie_weight : float
///     Sum of t (t - 1) (2 t + 5) over groups of t equal values.
///
/// Raises
/// ------
/// ValueError
///     ``z`` of another shape, or a sample is missing.
#[pyfunction]
pub fn reversals(z: &Bound<'_, PyAny>) -> PyResult<(u64, u64, f64)> {
    let values = arrays::batch(z, None)?.values;
    let found = z.py().detach(|| {
        let complete = values.iter().all(|z| z.is_finite());
        complete.then(|| identify::reversals(values))
    });
    let found = found.ok_or_else(|| PyValueError::new_err("z must hold finite samples only"))?;
    Ok((found.count, found.ties, found.tie_weight))
}
