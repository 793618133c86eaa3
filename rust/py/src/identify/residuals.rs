//! Residuals of a given model for Python.

use pyo3::prelude::*;
use zerorate_core::identify::Arma;

use crate::common::arrays;

/// Conditional residuals of an ARMA model, every stretch between missing samples starting anew.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples; those not finite are missing.
/// phi, theta : sequence of float
///     Coefficients.
/// centre : float
///     Subtracted from every sample first.
/// constant : float
///     Constant of the centred samples.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///     NaN for missing samples and the first p of each stretch.
#[pyfunction]
pub fn arma_residuals<'py>(
    z: &Bound<'py, PyAny>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    centre: f64,
    constant: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let samples = arrays::batch(z, None)?;
    let model = Arma { phi: &phi, theta: &theta, centre, constant };
    let residuals = z.py().detach(|| model.residuals(&samples.values));
    arrays::array(z.py(), residuals, &samples.shape)
}
