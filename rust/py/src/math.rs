//! Distributions for Python.

use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::math::distributions;

use crate::common::arrays;

type Vector<'py> = Bound<'py, PyArray1<f64>>;

/// Return quantiles of the chi-squared distribution.
///
/// Parameters
/// ----------
/// probability : float
///     Probability in (0, 1).
/// edf : array_like, shape (t,)
///     Degrees of freedom; they may be fractions. NaN if there are none.
///
/// Returns
/// -------
/// ndarray, float64, shape (t,)
///     Quantiles; NaN if the degrees of freedom are not positive and finite.
///
/// Raises
/// ------
/// ValueError
///     The probability is not in (0, 1), or `edf` has a wrong shape.
#[pyfunction]
pub fn chi_squared_quantile<'py>(
    probability: f64,
    edf: &Bound<'py, PyAny>,
) -> PyResult<Vector<'py>> {
    if !(probability > 0.0 && probability < 1.0) {
        return Err(PyValueError::new_err(format!(
            "probability must lie between 0 and 1, got {probability}"
        )));
    }
    let mut values = arrays::record(edf)?;
    values.iter_mut().for_each(|x| *x = distributions::chi_squared_quantile(probability, *x));
    Ok(values.into_pyarray(edf.py()))
}

/// Return the probability that chi-squared exceeds a value, accurate in the tail.
///
/// Parameters
/// ----------
/// value : float
///     Value of chi-squared.
/// freedom : float
///     Degrees of freedom, positive and finite.
///
/// Raises
/// ------
/// ValueError
///     The degrees of freedom are not positive and finite, or the value is NaN.
#[pyfunction]
pub fn chi_squared_survival(value: f64, freedom: f64) -> PyResult<f64> {
    distributions::chi_squared_survival(value, freedom).ok_or_else(|| {
        let needed = "chi-squared needs a number and positive finite degrees of freedom";
        PyValueError::new_err(format!("{needed}, got {value} and {freedom}"))
    })
}

/// Return the logarithm of the cumulative standard normal distribution, accurate in its lower tail.
///
/// Parameters
/// ----------
/// x : array_like, shape (n,)
///     Values in standard deviations.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///
/// Raises
/// ------
/// ValueError
///     ``x`` has a wrong shape.
#[pyfunction]
pub fn log_normal_cdf<'py>(x: &Bound<'py, PyAny>) -> PyResult<Vector<'py>> {
    let mut values = arrays::record(x)?;
    x.py().detach(|| values.iter_mut().for_each(|x| *x = distributions::log_normal_cdf(*x)));
    Ok(values.into_pyarray(x.py()))
}
