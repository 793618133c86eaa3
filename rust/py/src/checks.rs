//! Check of units and axes by motion, for Python.

use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::checks::{self, Trust};

use crate::common::arrays::{self, Record, array, named};
use crate::common::work::interruptible;

type Array<'py> = Bound<'py, PyAny>;
type Vector<'py, T = f64> = Bound<'py, PyArray1<T>>;

/// Means over ticks of 0.02 s of a sensor's samples at increasing times.
///
/// Parameters
/// ----------
/// time : array_like, shape (n,)
///     s.
/// values : array_like, shape (n, 3)
///     NaN and what is at the end of the sensor's range is missing.
/// start : float
///     Where the first tick begins, s.
/// count : int
///     Of ticks.
///
/// Returns
/// -------
/// ndarray, shape (count, 3)
///     NaN where the half of a tick or more is missing.
///
/// Raises
/// ------
/// ValueError
///     An array of another shape.
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

/// Costs of units and senses of a gyro, by ticks of it and of an accelerometer.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     rad/s, as the gyro's unit is named; NaN where missing.
/// forces : array_like, shape (n, 3)
///     By their median size.
///
/// Returns
/// -------
/// costs : ndarray, shape (3, 48, w)
///     Of units, senses and windows; what was given is the first.
/// null : ndarray, shape (w,)
///     Of the force as the sensor has it.
/// biases : ndarray, shape (3, 48, 3)
///     rad/s.
/// starts : ndarray of int, shape (w,)
///     First tick of each window.
/// length : int
///     Ticks of a window.
///
/// Raises
/// ------
/// ValueError
///     An array of another shape.
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

/// The bias, matrix and delay of a gyro that fit an accelerometer best.
///
/// Parameters
/// ----------
/// rates, forces : array_like, shape (n, 3)
///     As in ``check_gyro``.
/// starts : array_like of int, shape (w,)
///     First tick of each window, from there.
/// length : int
///     Ticks of a window.
/// bias : array_like, shape (3,)
///     To begin with, rad/s.
/// fits : bool
///     Whether the gyro is known to fit: deviations are then right. Else its errors are kept small.
///
/// Returns
/// -------
/// costs : ndarray, shape (w,)
/// numbers, sigmas : ndarray, shape (13,)
///     Bias, rad/s; the matrix minus 1, by rows; delay of the gyro, s.
///
/// Raises
/// ------
/// ValueError
///     An array of another shape, or a window that is not within the ticks.
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

/// Costs of senses of a magnetometer, by ticks of it and of a gyro.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     rad/s, without bias; NaN where missing.
/// fields : array_like, shape (n, 3)
///     By their median size.
///
/// Returns
/// -------
/// costs : ndarray, shape (24, w)
///     Of rotations and windows.
/// null : ndarray, shape (w,)
///     Of the field as the sensor has it.
/// starts : ndarray of int, shape (w,)
///     First tick of each window.
/// length : int
///     Ticks of a window.
///
/// Raises
/// ------
/// ValueError
///     An array of another shape.
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
