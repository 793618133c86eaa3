//! Identification for Python: autoregressions, ARMA models, outliers, lagged products, reversals.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::identification::arma::{self, Estimate, MAX_ORDER, Method, Series};
use zerorate_core::identification::{self, Arma, Estimator, FitError, Hampel};

use crate::common::arrays;
use crate::common::streaming::positive;
use crate::common::work::interruptible;

type Vector<'py, T = f64> = Bound<'py, PyArray1<T>>;
type Matrix<'py, T = f64> = Bound<'py, PyArray2<T>>;

/// Return one autoregressive model of samples, shape (n,), NaN if missing.
///
/// Returns
/// -------
/// tuple
///     phi, constant, sigma2, covariance of [phi, constant], number of residuals, condition.
///
/// Raises
/// ------
/// ValueError
///     The method is unknown, or the record does not determine the model.
#[pyfunction]
pub fn fit_autoregression<'py>(
    z: &Bound<'py, PyAny>,
    order: usize,
    method: &str,
    constant: bool,
) -> PyResult<(Vector<'py>, f64, f64, Matrix<'py>, usize, f64)> {
    let (py, estimator) = (z.py(), estimator(method)?);
    let record = arrays::axis(z)?;
    let z = record.as_slice()?;
    let fit = interruptible(py, work_of(z, order), || estimator.fit(z, order, constant))?
        .map_err(value_error)?;
    let covariance = matrix(py, fit.covariance.as_slice().to_vec(), order + 1)?;
    Ok((fit.phi.into_pyarray(py), fit.constant, fit.sigma2, covariance, fit.n, fit.condition))
}

/// Return residual variances of orders 0..=order, shape (order + 1,), and the number of residuals.
#[pyfunction]
pub fn autoregression_variances<'py>(
    z: &Bound<'py, PyAny>,
    order: usize,
    method: &str,
    constant: bool,
) -> PyResult<(Vector<'py>, usize)> {
    let estimator = estimator(method)?;
    let record = arrays::axis(z)?;
    let (py, z) = (z.py(), record.as_slice()?);
    let found = interruptible(py, work_of(z, order), || estimator.variances(z, order, constant))?;
    let (variances, n) = found.map_err(value_error)?;
    Ok((variances.into_pyarray(py), n))
}

/// Number of samples that take a thousand times as long as one sample of this record. At low orders
/// a sample takes no longer than its copy.
fn work_of(z: &[f64], order: usize) -> usize {
    z.len().saturating_mul(order.saturating_add(1)) / 1000
}

fn estimator(method: &str) -> PyResult<Estimator> {
    Estimator::from_name(method).ok_or_else(|| {
        let names = Estimator::NAMES.map(|(_, name)| format!("'{name}'")).join(", ");
        PyValueError::new_err(format!("method must be one of {names}, got '{method}'"))
    })
}

fn value_error(error: FitError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

type Fit<'py> = (
    (Vector<'py>, Vector<'py>, f64, f64, Matrix<'py>),
    (usize, f64, f64, f64, f64, f64),
    (bool, bool, bool, usize),
);

/// Return the ARMA(p, q) model that fits a record best.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples, NaN if missing.
/// p, q : int
///     Orders, at most 8.
/// constant : bool
///     True if a constant is estimated.
/// exact : bool
///     True for the exact Gaussian likelihood, False for conditional least squares.
/// start : sequence of float, optional
///     [phi, theta, c] at which the search starts, without c if there is no constant. No other
///     start is tried.
///
/// Returns
/// -------
/// model : tuple
///     phi, theta, constant, sigma2 and the covariance of [phi, theta, constant].
/// numbers : tuple
///     Number of innovations, log-likelihood, condition, and standard error of the mean; then the
///     record's mean (zero without a constant) and standard deviation.
/// search : tuple
///     True if the search converged, True if a root of phi and a root of theta lie on the unit
///     circle, and the number of passes over the record.
///
/// Raises
/// ------
/// ValueError
///     An order is beyond 8, or there are too few samples.
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
    let (py, values) = (z.py(), arrays::record(z)?);
    check_start(start.as_deref(), p + q + usize::from(constant))?;
    let method = if exact { Method::Exact } else { Method::Conditional };
    let found = interruptible(py, values.len(), || {
        let series = Series::new(values, constant);
        check_residuals(&series, p, q)?;
        Ok::<_, PyErr>(arma::fit(&series, p, q, constant, method, start))
    })??;
    let Estimate { phi, theta, covariance, on_circle: (ar, ma), moments, .. } = found;
    let (mean, deviation) = moments;
    let [phi, theta] = [phi, theta].map(|values| values.into_pyarray(py));
    Ok((
        (phi, theta, found.constant, found.sigma2, matrix(py, covariance, p + q + 1)?),
        (found.count, found.log_likelihood, found.condition, found.mean_sigma, mean, deviation),
        (found.converged, ar, ma, found.evaluations),
    ))
}

type Grid<'py> = (Matrix<'py>, Matrix<'py, bool>, Matrix<'py, i64>, usize, Vec<Vector<'py>>);

/// Fit all orders up to (p, q) on the same residuals.
///
/// Returns
/// -------
/// sigma2, converged, evaluations : ndarray, float64, bool and int64, shape (p + 1, q + 1)
///     Variance of the innovations, True if a search converged, and passes over the record.
/// count : int
///     Number of residuals.
/// coefficients : list of ndarray
///     [phi, theta, c] of each order, row by row; each row is for one p.
///
/// Raises
/// ------
/// ValueError
///     An order is beyond 8, or there are too few samples.
#[pyfunction]
pub fn arma_grid<'py>(z: &Bound<'py, PyAny>, p: usize, q: usize) -> PyResult<Grid<'py>> {
    let (py, values) = (z.py(), arrays::record(z)?);
    let (cells, count) = interruptible(py, values.len(), || {
        let series = Series::new(values, true);
        let count = check_residuals(&series, p, q)?;
        Ok::<_, PyErr>((arma::grid(&series, p, q, true), count))
    })??;
    let evaluations = cells.iter().map(|cell| cell.evaluations as i64).collect();
    Ok((
        matrix(py, cells.iter().map(|cell| cell.sigma2).collect(), p + 1)?,
        matrix(py, cells.iter().map(|cell| cell.converged).collect(), p + 1)?,
        matrix(py, evaluations, p + 1)?,
        count,
        cells.into_iter().map(|cell| cell.coefficients.into_pyarray(py)).collect(),
    ))
}

/// Return the parts of the exact Gaussian likelihood of a record under a stationary process.
///
/// They are three numbers. The first is the sum of the squared innovations, each over its variance
/// at unit innovation variance. The second is the sum of the logarithms of these variances. The
/// third is the number of samples that are not missing.
///
/// Raises
/// ------
/// ValueError
///     `phi` is not stationary, or an order is beyond 8.
#[pyfunction]
pub fn arma_likelihood(
    z: &Bound<'_, PyAny>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    mean: f64,
) -> PyResult<(f64, f64, usize)> {
    check_orders(phi.len(), theta.len())?;
    let values = arrays::record(z)?;
    let n = values.len();
    let found = interruptible(z.py(), n, || arma::likelihood(&values, &phi, &theta, mean))?;
    let found = found.ok_or_else(|| {
        PyValueError::new_err(format!("phi must be stationary for a likelihood, got {phi:?}"))
    })?;
    Ok((found.sum_of_squares, found.log_determinant, found.count))
}

/// Return the conditional residuals of an ARMA model; they start again after missing samples.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples; a sample that is not finite is missing.
/// phi, theta : sequence of float
///     Coefficients of the model.
/// centre : float
///     Value that is subtracted from every sample first.
/// constant : float
///     Constant of the model for centred samples.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///     Residuals; NaN for missing samples and the first p samples of each segment.
#[pyfunction]
pub fn arma_residuals<'py>(
    z: &Bound<'py, PyAny>,
    phi: Vec<f64>,
    theta: Vec<f64>,
    centre: f64,
    constant: f64,
) -> PyResult<Vector<'py>> {
    let values = arrays::record(z)?;
    let model = Arma { phi: &phi, theta: &theta, centre, constant };
    let residuals = interruptible(z.py(), values.len(), || model.residuals(&values))?;
    Ok(residuals.into_pyarray(z.py()))
}

/// Number of residuals, if it is large enough.
fn check_residuals(series: &Series, p: usize, q: usize) -> PyResult<usize> {
    check_orders(p, q)?;
    let (count, least) = (series.residuals(p), 2 * (p + q + 1));
    if count < least {
        return Err(PyValueError::new_err(format!(
            "ARMA({p}, {q}) needs at least {least} residuals, got {count}: each stretch between \
             missing samples gives up its first {p} samples"
        )));
    }
    Ok(count)
}

fn check_orders(p: usize, q: usize) -> PyResult<()> {
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

/// Return a record with its outliers replaced by the median of a running window.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples; a sample that is not finite is missing.
/// width : int
///     Number of samples in a window, at least 1.
/// threshold : float
///     Limit in standard deviations; a standard deviation is 1.4826 times the median distance from
///     the median.
/// least_deviation : float
///     Smallest standard deviation, in the unit of ``z``.
///
/// Returns
/// -------
/// cleaned : ndarray, float64, shape (n,)
/// places : ndarray, int64, shape (m,)
///     Indices of the replaced samples.
///
/// Raises
/// ------
/// ValueError
///     The width is below 1, or ``z`` has a wrong shape.
#[pyfunction]
pub fn without_outliers<'py>(
    z: &Bound<'py, PyAny>,
    width: i128,
    threshold: f64,
    least_deviation: f64,
) -> PyResult<(Vector<'py>, Vector<'py, i64>)> {
    let hampel = Hampel { width: positive("width", width)?, threshold, least_deviation };
    let (py, mut values) = (z.py(), arrays::record(z)?);
    let places = interruptible(py, values.len(), || hampel.clean(&mut values))?;
    let places: Vec<i64> = places.into_iter().map(|k| k as i64).collect();
    Ok((values.into_pyarray(py), places.into_pyarray(py)))
}

/// Return sums of lagged products, without products across a missing sample.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples minus their mean; a sample that is not finite is missing.
/// lags : int
///     Largest lag in samples, at least 1.
///
/// Returns
/// -------
/// sums : ndarray, float64, shape (lags + 1,)
///     Sums of z_k z_(k+l).
/// pairs : ndarray, int64, shape (lags + 1,)
///     Number of products in each sum.
///
/// Raises
/// ------
/// ValueError
///     ``lags`` is below 1, or ``z`` has a wrong shape.
#[pyfunction]
pub fn lagged_products<'py>(
    z: &Bound<'py, PyAny>,
    lags: i128,
) -> PyResult<(Vector<'py>, Vector<'py, i64>)> {
    let lags = positive("lags", lags)?;
    let (py, values) = (z.py(), arrays::record(z)?);
    let products =
        interruptible(py, values.len(), || identification::lagged_products(&values, lags))?;
    let pairs: Vec<i64> = products.pairs.into_iter().map(|count| count as i64).collect();
    Ok((products.sums.into_pyarray(py), pairs.into_pyarray(py)))
}

/// Return the reversals of a record: pairs of values with the larger value first.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples, none missing.
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
///     ``z`` has a wrong shape, or a sample is missing.
#[pyfunction]
pub fn reversals(z: &Bound<'_, PyAny>) -> PyResult<(u64, u64, f64)> {
    let values = arrays::record(z)?;
    let found = interruptible(z.py(), values.len(), || {
        let complete = values.iter().all(|z| z.is_finite());
        complete.then(|| identification::reversals(values))
    })?;
    let found = found.ok_or_else(|| PyValueError::new_err("z must hold finite samples only"))?;
    Ok((found.count, found.ties, found.tie_weight))
}

/// A matrix with this number of rows, from values row after row.
fn matrix<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    rows: usize,
) -> PyResult<Matrix<'_, T>> {
    let columns = values.len() / rows;
    values.into_pyarray(py).reshape([rows, columns])
}
