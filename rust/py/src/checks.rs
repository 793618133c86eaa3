//! Check of units and axes by motion, for Python.

use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::checks::{self, Trust};

use crate::common::arrays::{self, Record, array, named};
use crate::common::work::interruptible;

type Array<'py> = Bound<'py, PyAny>;
type Vector<'py, T = f64> = Bound<'py, PyArray1<T>>;

/// Return the means of a sensor's samples over ticks of 0.02 s, at increasing times.
///
/// Parameters
/// ----------
/// time : array_like, shape (n,)
///     Times of the samples, s.
/// values : array_like, shape (n, 3)
///     Samples. NaN is missing, and a sample at the end of the sensor's range is missing.
/// start : float
///     Time at which the first tick begins, s.
/// count : int
///     Number of ticks.
///
/// Returns
/// -------
/// ndarray, shape (count, 3)
///     Means; NaN if half of a tick's samples or more are missing.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape.
#[pyfunction]
pub fn check_ticks<'py>(
    py: Python<'py>,
    time: &Bound<'py, PyAny>,
    values: &Bound<'py, PyAny>,
    start: f64,
    count: usize,
) -> PyResult<Array<'py>> {
    let values = vectors("values", values, None)?;
    let n = values.shape[0];
    let time = named("time", time, &arrays::tuple(&[n]), |shape| shape == [n])?;
    let found = interruptible(py, n, || {
        checks::ticks(&time.values, values.values.as_chunks::<3>().0, start, count)
    })?;
    array(py, found.into_flattened(), &[count, 3])
}

/// Return the costs of a gyro's units and axis senses, from ticks of the gyro and an accelerometer.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     Rates in the named unit, converted to rad/s; NaN if missing.
/// forces : array_like, shape (n, 3)
///     Forces, divided by their median size.
///
/// Returns
/// -------
/// costs : ndarray, shape (3, 48, w)
///     Costs by unit, sense and window; the stated unit and sense come first.
/// null : ndarray, shape (w,)
///     Cost of the forces if the gyro's rotation is ignored.
/// biases : ndarray, shape (3, 48, 3)
///     Bias for each unit and sense, rad/s.
/// starts : ndarray of int, shape (w,)
///     First tick of each window.
/// length : int
///     Number of ticks in a window.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape.
#[pyfunction]
pub fn check_gyro<'py>(
    py: Python<'py>,
    rates: &Bound<'py, PyAny>,
    forces: &Bound<'py, PyAny>,
) -> PyResult<(Array<'py>, Vector<'py>, Array<'py>, Vector<'py, usize>, usize)> {
    let (rates, forces) = pair(rates, "forces", forces)?;
    let found = interruptible(py, usize::MAX, || {
        checks::gyro_costs(rates.values.as_chunks::<3>().0, forces.values.as_chunks::<3>().0)
    })?;
    let windows = found.starts.len();
    Ok((
        array(py, found.costs, &[3, 48, windows])?,
        found.null.into_pyarray(py),
        array(py, found.biases.into_flattened(), &[3, 48, 3])?,
        found.starts.into_pyarray(py),
        found.length,
    ))
}

/// Return the bias, matrix and delay of a gyro that fit an accelerometer best.
///
/// Parameters
/// ----------
/// rates, forces : array_like, shape (n, 3)
///     As in ``check_gyro``.
/// starts : array_like of int, shape (w,)
///     First tick of each window, as returned by ``check_gyro``.
/// length : int
///     Number of ticks in a window.
/// bias : array_like, shape (3,)
///     Initial bias, rad/s.
/// fits : bool
///     True if the gyro is known to fit: the standard deviations are then correct. With False the
///     gyro's errors are kept small.
///
/// Returns
/// -------
/// costs : ndarray, shape (w,)
/// numbers, sigmas : ndarray, shape (13,)
///     Bias, rad/s; matrix minus 1, row by row; delay of the gyro, s.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape, or a window is not within the ticks.
#[pyfunction]
pub fn check_fit<'py>(
    py: Python<'py>,
    rates: &Bound<'py, PyAny>,
    forces: &Bound<'py, PyAny>,
    starts: Vec<usize>,
    length: usize,
    bias: [f64; 3],
    fits: bool,
) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>)> {
    let (rates, forces) = pair(rates, "forces", forces)?;
    let n = rates.shape[0];
    let is_inside = |first: &usize| first.checked_add(length).is_some_and(|last| last <= n);
    if length == 0 || !length.is_multiple_of(4) || !starts.iter().all(is_inside) {
        return Err(PyValueError::new_err(format!(
            "windows must be of a multiple of 4 ticks within {n}, got {length} from {starts:?}"
        )));
    }
    let trust = if fits { Trust::Full } else { Trust::Little };
    let found = interruptible(py, usize::MAX, || {
        let (rates, forces) = (rates.values.as_chunks::<3>().0, forces.values.as_chunks::<3>().0);
        checks::fit(rates, forces, &starts, length, &bias, trust)
    })?;
    let numbers = |all: [f64; 13]| all.to_vec().into_pyarray(py);
    Ok((found.costs.into_pyarray(py), numbers(found.numbers), numbers(found.sigmas)))
}

/// Return the costs of a magnetometer's axis senses, from ticks of the magnetometer and a gyro.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     Rates without bias, rad/s; NaN if missing.
/// fields : array_like, shape (n, 3)
///     Fields, divided by their median size.
///
/// Returns
/// -------
/// costs : ndarray, shape (24, w)
///     Costs by rotation and window.
/// null : ndarray, shape (w,)
///     Cost of the fields if the gyro's rotation is ignored.
/// starts : ndarray of int, shape (w,)
///     First tick of each window.
/// length : int
///     Number of ticks in a window.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape.
#[pyfunction]
pub fn check_field<'py>(
    py: Python<'py>,
    rates: &Bound<'py, PyAny>,
    fields: &Bound<'py, PyAny>,
) -> PyResult<(Array<'py>, Vector<'py>, Vector<'py, usize>, usize)> {
    let (rates, fields) = pair(rates, "fields", fields)?;
    let found = interruptible(py, usize::MAX, || {
        checks::field_costs(rates.values.as_chunks::<3>().0, fields.values.as_chunks::<3>().0)
    })?;
    let windows = found.starts.len();
    Ok((
        array(py, found.costs, &[24, windows])?,
        found.null.into_pyarray(py),
        found.starts.into_pyarray(py),
        found.length,
    ))
}

/// Ticks of two sensors.
fn pair(
    rates: &Bound<'_, PyAny>,
    name: &'static str,
    others: &Bound<'_, PyAny>,
) -> PyResult<(Record, Record)> {
    let rates = vectors("rates", rates, None)?;
    let others = vectors(name, others, Some(rates.shape[0]))?;
    Ok((rates, others))
}

fn vectors(
    name: &'static str,
    values: &Bound<'_, PyAny>,
    length: Option<usize>,
) -> PyResult<Record> {
    match length {
        None => named(name, values, "(n, 3)", |shape| matches!(shape, [_, 3])),
        Some(n) => named(name, values, &arrays::tuple(&[n, 3]), |shape| shape == [n, 3]),
    }
}
