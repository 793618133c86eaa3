//! Autoregressive models for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::identify::{Estimator, Refusal};

use crate::common::arrays;

type Numbers<'py> = Bound<'py, PyAny>;
type Fitted<'py> = (Numbers<'py>, f64, f64, Numbers<'py>, usize, f64);

/// One model: phi, constant, sigma2, covariance of [phi, constant], n, condition.
#[pyfunction]
pub fn fit_autoregression<'py>(
    z: &Bound<'py, PyAny>,
    order: usize,
    method: &str,
    constant: bool,
) -> PyResult<Fitted<'py>> {
    let (py, estimator) = (z.py(), named(method)?);
    let record = arrays::axis(z)?;
    // A nanosecond or two a sample: less than a copy, so the lock is kept.
    let fit = estimator.fit(record.as_slice()?, order, constant).map_err(refused)?;
    let covariance = fit.covariance.as_slice().to_vec();
    Ok((
        arrays::array(py, fit.phi, &[order])?,
        fit.constant,
        fit.sigma2,
        arrays::array(py, covariance, &[order + 1, order + 1])?,
        fit.n,
        fit.condition,
    ))
}

/// Variances of the residuals of orders 0..=order, shape (order + 1,), and their number.
#[pyfunction]
pub fn autoregression_variances<'py>(
    z: &Bound<'py, PyAny>,
    order: usize,
    method: &str,
    constant: bool,
) -> PyResult<(Numbers<'py>, usize)> {
    let estimator = named(method)?;
    let record = arrays::axis(z)?;
    let (variances, n) =
        estimator.variances(record.as_slice()?, order, constant).map_err(refused)?;
    Ok((arrays::array(z.py(), variances, &[order + 1])?, n))
}

fn named(method: &str) -> PyResult<Estimator> {
    Estimator::from_name(method).ok_or_else(|| {
        let names = Estimator::NAMES.map(|(_, name)| format!("'{name}'")).join(", ");
        PyValueError::new_err(format!("method must be one of {names}, got '{method}'"))
    })
}

fn refused(refusal: Refusal) -> PyErr {
    PyValueError::new_err(refusal.to_string())
}
