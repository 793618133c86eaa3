//! Quantiles for confidence bounds.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::arrays;

/// Quantiles of the chi-squared distribution.
///
/// Parameters
/// ----------
/// probability : float
///     In (0, 1).
/// edf : array_like, shape (t,)
///     Degrees of freedom, not necessarily whole; NaN where there are none.
///
/// Returns
/// -------
/// ndarray, float64, shape (t,)
///     NaN where the degrees of freedom are not positive and finite.
///
/// Raises
/// ------
/// ValueError
///     If the probability is not in (0, 1) or `edf` of another shape.
#[pyfunction]
pub fn chi_squared_quantile<'py>(
    probability: f64,
    edf: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    if !(probability > 0.0 && probability < 1.0) {
        return Err(PyValueError::new_err(format!(
            "probability must lie between 0 and 1, got {probability}"
        )));
    }
    let freedoms = arrays::batch(edf, None)?;
    let quantile = |freedom: &f64| match ChiSquared::new(*freedom) {
        Ok(distribution) if freedom.is_finite() => distribution.inverse_cdf(probability),
        _ => f64::NAN,
    };
    let values = freedoms.values.iter().map(quantile).collect();
    arrays::array(edf.py(), values, &freedoms.shape)
}
