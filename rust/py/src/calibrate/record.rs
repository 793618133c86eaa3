//! Calibration from a record, for Python: rotations between static intervals, and orientation.

use numpy::{IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::calibrate::{Integration, Turn, integrate, propagate_turn};

use crate::common::arrays::{self, Record, array, named};
use crate::common::work::interruptible;

type Array<'py> = Bound<'py, PyAny>;

/// Return rotations between static intervals, and their sensitivities to gyro errors.
///
/// The corrected rate is ``w = matrix @ (rate - bias)``. The rotation of a step is
/// ``(w0 + w1) / 2 * dt + dt**2 / 12 * cross(w0, w1)``. A gyro error adds a small rotation psi
/// after the whole rotation. At rest, a vector u then moves by ``cross(P.T @ u, psi)``.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     Raw samples of the gyro; a missing sample makes its rotation NaN.
/// steps : array_like, shape (n - 1,)
///     Time from each sample to the next, s.
/// spans : array_like of int, shape (m, 2)
///     Samples of each rotation: the first sample, and the sample after the last.
/// biases : array_like, shape (m, 3)
///     Bias in each rotation, in the unit of ``rates``.
/// matrix : array_like, shape (3, 3)
///     Correction matrix, to rad/s.
///
/// Returns
/// -------
/// rotations : ndarray, shape (m, 3, 3)
///     Matrix P, from the body's axes after the rotation to its axes before it.
/// by_matrix : ndarray, shape (m, 3, 3, 3)
///     Derivative of psi_a by element (b, c) of the matrix, at ``[:, a, b, c]``.
/// by_rate : ndarray, shape (m, 3, 3)
///     Derivative of psi by a constant error of the corrected rate.
/// angles : ndarray, shape (m,)
///     Sum of the angles of all steps, rad.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape, or a rotation is not within the samples.
#[pyfunction]
pub fn propagate_turns<'py>(
    py: Python<'py>,
    rates: &Bound<'py, PyAny>,
    steps: &Bound<'py, PyAny>,
    spans: &Bound<'py, PyAny>,
    biases: &Bound<'py, PyAny>,
    matrix: &Bound<'py, PyAny>,
) -> PyResult<(Array<'py>, Array<'py>, Array<'py>, Bound<'py, PyArray1<f64>>)> {
    let (rates, steps) = timed(rates, steps)?;
    let matrix = named("matrix", matrix, "(3, 3)", |shape| shape == [3, 3])?;
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| matrix.values[3 * i + j]));
    let spans = named("spans", spans, "(m, 2)", |shape| matches!(shape, [_, 2]))?;
    let m = spans.shape[0];
    let expected = arrays::tuple(&[m, 3]);
    let biases = named("biases", biases, &expected, |shape| shape == [m, 3])?;
    let rates = rates.values.as_chunks::<3>().0;
    let spans: PyResult<Vec<_>> =
        spans.values.as_chunks::<2>().0.iter().map(|span| within(span, rates.len())).collect();
    let spans = spans?;
    let samples = spans.iter().map(|span| span.len()).sum();
    let biases = biases.values.as_chunks::<3>().0;
    let rotations: Vec<Turn> = interruptible(py, samples, || {
        let rotations = spans.into_iter().zip(biases).map(|(span, bias)| {
            let steps = &steps.values[span.start..span.end - 1];
            propagate_turn(&rates[span], steps, bias, &matrix)
        });
        rotations.collect()
    })?;
    let square = |of: fn(&Turn, usize, usize) -> f64| -> Vec<f64> {
        let elements = |turn| (0..9).map(move |i| of(turn, i / 3, i % 3));
        rotations.iter().flat_map(elements).collect()
    };
    let cube = |turn| (0..27).map(move |i| element(turn, i / 9, i / 3 % 3, i % 3));
    let by_matrix = rotations.iter().flat_map(cube).collect();
    let angles: Vec<f64> = rotations.iter().map(|turn| turn.angle).collect();
    Ok((
        array(py, square(|turn, a, b| turn.rotation[(a, b)]), &[m, 3, 3])?,
        array(py, by_matrix, &[m, 3, 3, 3])?,
        array(py, square(|turn, a, b| turn.by_rate[(a, b)]), &[m, 3, 3])?,
        angles.into_pyarray(py),
    ))
}

fn element(turn: &Turn, a: usize, b: usize, c: usize) -> f64 {
    turn.by_matrix[c][(a, b)]
}

/// Return the orientation at each sample of a gyro, by integration of its rates.
///
/// Parameters
/// ----------
/// rates : array_like, shape (n, 3)
///     Corrected rates, rad/s; orientations after a missing sample are NaN.
/// steps : array_like, shape (n - 1,)
///     Time from each sample to the next, s.
/// method : str
///     "backward-euler" uses the rate at the step's end, "trapezoid" the mean of start and end.
///     "coning" adds the effect of a changing axis, for a rate that changes linearly.
///
/// Returns
/// -------
/// ndarray, shape (n, 4)
///     Quaternions w, x, y, z, from the body's axes at the sample to its axes at the first sample.
///     The first quaternion is 1, 0, 0, 0.
///
/// Raises
/// ------
/// ValueError
///     The method is unknown, or an array has a wrong shape.
#[pyfunction]
pub fn integrate_rates<'py>(
    py: Python<'py>,
    rates: &Bound<'py, PyAny>,
    steps: &Bound<'py, PyAny>,
    method: &str,
) -> PyResult<Array<'py>> {
    let method = Integration::of_name(method).ok_or_else(|| {
        let names = Integration::NAMES.map(|(_, name)| format!("'{name}'")).join(", ");
        PyValueError::new_err(format!("method must be one of {names}, got '{method}'"))
    })?;
    let (rates, steps) = timed(rates, steps)?;
    let n = rates.shape[0];
    let quaternions = arrays::zeros::<f64>(py, &[n, 4])?;
    {
        let mut places = quaternions.try_readwrite()?;
        let places = places.as_slice_mut()?.as_chunks_mut::<4>().0;
        let rates = rates.values.as_chunks::<3>().0;
        interruptible(py, n, || integrate(rates, &steps.values, method, places))?;
    }
    Ok(quaternions.into_any())
}

/// Rates (n, 3) and the steps between them.
fn timed(rates: &Bound<'_, PyAny>, steps: &Bound<'_, PyAny>) -> PyResult<(Record, Record)> {
    let rates = named("rates", rates, "(n, 3)", |shape| matches!(shape, [_, 3]))?;
    let n = rates.shape[0].saturating_sub(1);
    let steps = named("steps", steps, &arrays::tuple(&[n]), |shape| shape == [n])?;
    Ok((rates, steps))
}

/// Sample range of a rotation, at least one of `n` samples.
fn within([first, last]: &[f64; 2], n: usize) -> PyResult<std::ops::Range<usize>> {
    let whole = |x: f64| (x >= 0.0 && x <= n as f64 && x.trunc() == x).then_some(x as usize);
    match (whole(*first), whole(*last)) {
        (Some(first), Some(last)) if first < last => Ok(first..last),
        _ => Err(PyValueError::new_err(format!(
            "each of spans must be a first sample and one after it, from 0 to {n}, \
             got ({first}, {last})"
        ))),
    }
}
