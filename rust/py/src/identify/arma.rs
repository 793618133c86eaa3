//! ARMA fits for Python. The callers have checked records and orders.

use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::identify::arma::{
    self, Cell, Estimate, MAX_ORDER, Method, Series, grid, likelihood,
};

use crate::common::arrays;

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type Fit<'py> = (
    (Floats<'py>, Floats<'py>, f64, f64, Bound<'py, PyArray2<f64>>),
    (usize, f64, f64, f64, f64, f64),
    (bool, bool, bool, usize),
);

type Grid<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, usize, Vec<Floats<'py>>);

/// The ARMA(p, q) model that fits a record best.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples, NaN where missing.
/// p, q : int
///     Orders, at most 8.
/// constant : bool
///     Whether a constant is estimated.
/// exact : bool
///     Whether by the exact Gaussian likelihood, not by conditional least squares.
/// start : sequence of float, optional
///     [phi, theta, c], without c if there is no constant: where to search, and nowhere else.
///
/// Returns
/// -------
/// model : tuple
///     phi, theta, constant, sigma2 and the covariance of [phi, theta, constant].
/// numbers : tuple
///     Count of innovations, log-likelihood, condition, standard error of the mean; mean (zero
///     without a constant) and deviation of the record.
/// search : tuple
///     Whether it converged, whether a root of phi and one of theta lies on the unit circle, and
///     its passes over the record.
///
/// Raises
/// ------
/// ValueError
///     An order beyond 8, or too few samples.
#[pyfunction]
#[pyo3(signature = (z, p, q, constant, exact, start=None))]
pub fn arma_fit<'py>(
    z: &Bound<'py, PyAny>,
    p: usize,
    q: usize,
    constant: bool,
    exact: bool,
    start: Option<Vec<f64>>,
) -> PyResult<Fit<'py>> {
    let py = z.py();
    let values = arrays::batch(z, None)?.values;
    check_start(start.as_deref(), p + q + usize::from(constant))?;
    let method = if exact { Method::Exact } else { Method::Conditional };
    let found = py.detach(|| {
        let series = Series::new(values, constant);
        checked(&series, p, q, p)?;
        Ok::<_, PyErr>(arma::fit(&series, p, q, constant, method, start))
    })?;
    let size = p + q + 1;
    let Estimate { phi, theta, covariance, on_circle: (ar, ma), moments, .. } = found;
    let (mean, deviation) = moments;
    let covariance = Array2::from_shape_vec((size, size), covariance)
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let [phi, theta] = [phi, theta].map(|values| PyArray1::from_vec(py, values));
    Ok((
        (phi, theta, found.constant, found.sigma2, PyArray2::from_owned_array(py, covariance)),
        (found.count, found.log_likelihood, found.condition, found.mean_sigma, mean, deviation),
        (found.converged, ar, ma, found.evaluations),
    ))
}

/// Innovation variances of all orders up to (p, q) on the same residuals.
///
/// Returns
/// -------
/// sigma2 : ndarray, float64, shape (p + 1, q + 1)
/// converged : ndarray, bool, shape (p + 1, q + 1)
/// evaluations : ndarray, int64, shape (p + 1, q + 1)
///     Passes over the record.
/// count : int
///     Number of residuals.
/// coefficients : list of ndarray
///     [phi, theta, c] of each order, row after row of one p.
///
/// Raises
/// ------
/// ValueError
///     An order beyond 8, or too few samples.
#[pyfunction]
pub fn arma_grid<'py>(z: &Bound<'py, PyAny>, p: usize, q: usize) -> PyResult<Grid<'py>> {
    let py = z.py();
    let values = arrays::batch(z, None)?.values;
    let (cells, count) = py.detach(|| {
        let series = Series::new(values, true);
        let count = checked(&series, p, q, p)?;
        Ok::<_, PyErr>((grid(&series, p, q, true), count))
    })?;
    let shape = [p + 1, q + 1];
    let column = |of: fn(&Cell) -> f64| cells.iter().map(of).collect();
    Ok((
        arrays::array(py, column(|cell| cell.sigma2), &shape)?,
        arrays::array(py, cells.iter().map(|cell| cell.converged).collect(), &shape)?,
        arrays::array(py, cells.iter().map(|cell| cell.evaluations as i64).collect(), &shape)?,
        count,
        cells.into_iter().map(|cell| PyArray1::from_vec(py, cell.coefficients)).collect(),
    ))
}

/// Parts of the exact Gaussian likelihood of a record under a stationary process.
///
/// Returns
/// -------
/// sum_of_squares : float
///     Of the innovations over their deviations at unit innovation variance.
/// log_determinant : float
///     Sum of the logarithms of these variances.
/// count : int
///     Number of samples present.
///
/// Raises
/// ------
/// ValueError
///     If `phi` is not stationary or an order is beyond 8.
#[pyfunction]
pub fn arma_likelihood(
    z: &Bound<'_, PyAny>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    mean: f64,
) -> PyResult<(f64, f64, usize)> {
    within(phi.len(), theta.len())?;
    let values = arrays::batch(z, None)?.values;
    let found = z.py().detach(|| likelihood(&values, &phi, &theta, mean));
    let found = found.ok_or_else(|| {
        PyValueError::new_err(format!("phi must be stationary for a likelihood, got {phi:?}"))
    })?;
    Ok((found.sum_of_squares, found.log_determinant, found.count))
}

/// Number of residuals, if there are enough of them.
fn checked(series: &Series, p: usize, q: usize, skip: usize) -> PyResult<usize> {
    within(p, q)?;
    let (count, least) = (series.residuals(skip), 2 * (p + q + 1));
    if count < least {
        return Err(PyValueError::new_err(format!(
            "ARMA({p}, {q}) needs at least {least} residuals, got {count}: each stretch between \
             missing samples gives up its first {skip} samples"
        )));
    }
    Ok(count)
}

fn within(p: usize, q: usize) -> PyResult<()> {
    if p.max(q) > MAX_ORDER {
        return Err(PyValueError::new_err(format!(
            "orders must be at most {MAX_ORDER}, got ({p}, {q})"
        )));
    }
    Ok(())
}

fn check_start(start: Option<&[f64]>, size: usize) -> PyResult<()> {
    match start {
        Some(start) if start.len() != size || start.iter().any(|c| !c.is_finite()) => {
            Err(PyValueError::new_err(format!(
                "start must be {size} finite coefficients [phi, theta, c], got {start:?}"
            )))
        }
        _ => Ok(()),
    }
}
