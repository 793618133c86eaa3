//! Quantiles for confidence bounds.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

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
    let values = freedoms.values.iter().map(|freedom| quantile(probability, *freedom)).collect();
    arrays::array(edf.py(), values, &freedoms.shape)
}

fn quantile(probability: f64, freedom: f64) -> f64 {
    match ChiSquared::new(freedom) {
        Ok(distribution) if freedom.is_finite() => {
            let rough = distribution.inverse_cdf(probability);
            (0..STEPS).fold(rough, |x, _| refined(&distribution, probability, x))
        }
        _ => f64::NAN,
    }
}

/// Steps that bring an absolute error of 1e-10 down to rounding.
const STEPS: usize = 3;

/// Newton's step for the logarithm of a quantile, of which that of the probability is nearly a
/// straight line where both are small.
fn refined(distribution: &ChiSquared, probability: f64, x: f64) -> f64 {
    let below = distribution.cdf(x);
    let step = (probability / below).ln() * below / (x * distribution.pdf(x));
    if step.is_finite() { x * step.exp() } else { x }
}
