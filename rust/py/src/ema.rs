//! The exponential moving average for Python.

use pyo3::prelude::*;

use crate::common::arrays;
use crate::common::errors::NativeError;

/// Exponential moving average of one axis that starts as the running mean.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples; at those not finite the average is held.
/// gain : float
///     From 0, which is the running mean, to 1, which is the samples themselves.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///     NaN before the first sample that is there.
///
/// Raises
/// ------
/// ValueError
///     A gain that is not in its range, or `z` of another shape.
#[pyfunction]
pub fn exponential_mean<'py>(z: &Bound<'py, PyAny>, gain: f64) -> PyResult<Bound<'py, PyAny>> {
    let mut samples = arrays::batch(z, None)?;
    z.py()
        .detach(|| zerorate_core::exponential_mean(&mut samples.values, gain))
        .map_err(NativeError::from)?;
    arrays::array(z.py(), samples.values, &samples.shape)
}
