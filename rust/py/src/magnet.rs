//! A magnetometer's hard and soft iron from ordinary motion, for Python.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::calibrate::magnet::{self, Element, Fit, Ticks, Turned};

use crate::common::arrays::{array, named, tuple};
use crate::common::work::interruptible;

type Array<'py> = Bound<'py, PyAny>;
/// First second, end (exclusive), s, and a flag for outliers.
type Piece = (usize, usize, bool);
type Fitted<'py> =
    (Array<'py>, Bound<'py, PyArray1<f64>>, Array<'py>, f64, Bound<'py, PyArray1<f64>>);

/// Return the spans with a constant hard iron, and the outliers, that have the least cost.
///
/// Parameters
/// ----------
/// number : array_like of int, shape (n,)
///     Index of each tick of 0.1 s since the first sample, increasing.
/// turned : array_like, shape (n, 3)
///     Mean field of each tick in a frame that the gyro holds, divided by the median size.
/// rotation : array_like, shape (n, 3, 3)
///     Mean rotation from the sensor to that frame.
/// noise : float
///     Variance of one axis of a tick.
/// walks : array_like, shape (w,)
///     Random walks of the field, standard deviations of the noise per sqrt(s).
///
/// Returns
/// -------
/// list
///     For each walk: its cost, and its spans. A span has its first second, its end (exclusive) and
///     a flag for outliers.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape, numbers do not increase, or a value is not finite.
#[pyfunction]
pub fn magnet_partition(
    py: Python<'_>,
    number: &Bound<'_, PyAny>,
    turned: &Bound<'_, PyAny>,
    rotation: &Bound<'_, PyAny>,
    noise: f64,
    walks: Vec<f64>,
) -> PyResult<Vec<(f64, Vec<Piece>)>> {
    let number = places("number", number)?;
    let n = number.len();
    let turned = numbers("turned", turned, &[n, 3])?;
    let rotation = numbers("rotation", rotation, &[n, 3, 3])?;
    if !number.is_sorted_by(|one, next| one < next) {
        return Err(PyValueError::new_err("number must increase from tick to tick"));
    }
    if !(noise > 0.0 && noise.is_finite()) {
        return Err(PyValueError::new_err(format!("noise must be positive, got {noise}")));
    }
    let found = interruptible(py, usize::MAX, || {
        let (turned, rotation) = (turned.as_chunks().0, rotation.as_chunks().0);
        magnet::partition(&Turned { number: &number, turned, rotation }, noise, &walks)
    })?;
    let spans = |pieces: Vec<magnet::Piece>| {
        pieces.iter().map(|piece| (piece.start, piece.stop, piece.outlier)).collect()
    };
    Ok(found.into_iter().map(|one| (one.cost, spans(one.pieces))).collect())
}

/// Fit the hard iron of each group, the elements of the soft iron, and the fields to ticks.
///
/// Parameters
/// ----------
/// rotation : array_like, shape (n, 3, 3)
///     Mean rotation from the sensor to a frame that the gyro holds.
/// field, turned : array_like, shape (n, 3)
///     Mean field in the sensor's axes and in that frame, divided by the median size.
/// group, window : array_like of int, shape (n,)
///     Index of each tick's hard iron and of its field, from 0 on; windows never decrease.
/// elements : array_like, shape (k, 3, 3)
///     Matrices whose sum, weighted by the elements, is the soft iron minus 1.
///
/// Returns
/// -------
/// iron : ndarray, shape (groups, 3)
/// elements : ndarray, shape (k,)
/// fields : ndarray, shape (windows, 3)
/// scatter : float
///     RMS residual of an axis.
/// weights : ndarray, shape (n,)
///     Weights of the ticks, at most 1.
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape, windows decrease, or numbers are too large.
#[pyfunction]
pub fn magnet_fit<'py>(
    py: Python<'py>,
    rotation: &Bound<'py, PyAny>,
    field: &Bound<'py, PyAny>,
    turned: &Bound<'py, PyAny>,
    group: &Bound<'py, PyAny>,
    window: &Bound<'py, PyAny>,
    elements: &Bound<'py, PyAny>,
) -> PyResult<Fitted<'py>> {
    let given = Given::read(rotation, field, Some(turned), group, window)?;
    let elements = matrices(elements)?;
    let found = interruptible(py, usize::MAX, || magnet::fit(&given.ticks(), &elements))?;
    let found = found.ok_or_else(beyond)?;
    Ok((
        rows(py, found.iron.iter().map(|v| (*v).into()))?,
        found.elements.into_pyarray(py),
        rows(py, found.fields.iter().map(|v| (*v).into()))?,
        found.scatter,
        found.weights.into_pyarray(py),
    ))
}

/// Return the covariance of a fit: elements of the soft iron first, then the hard irons.
///
/// Parameters
/// ----------
/// rotation, field, group, window, elements
///     As in ``magnet_fit``.
/// fit : tuple
///     Result of ``magnet_fit``, with one number for each of these elements.
/// doubt : array_like, shape (k,)
///     Prior standard deviations of the elements.
///
/// Returns
/// -------
/// ndarray, shape (k + 3 groups, k + 3 groups)
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape, windows decrease, or numbers are too large.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are Python's")]
pub fn magnet_covariance<'py>(
    py: Python<'py>,
    rotation: &Bound<'py, PyAny>,
    field: &Bound<'py, PyAny>,
    group: &Bound<'py, PyAny>,
    window: &Bound<'py, PyAny>,
    elements: &Bound<'py, PyAny>,
    fit: (Array<'py>, Vec<f64>, Array<'py>, f64, Vec<f64>),
    doubt: Vec<f64>,
) -> PyResult<Array<'py>> {
    let given = Given::read(rotation, field, None, group, window)?;
    let elements = matrices(elements)?;
    let (iron, values, fields, scatter, weights) = fit;
    let (groups, windows) = (given.ticks().groups(), given.ticks().windows());
    let fields = numbers("fields", &fields, &[windows, 3])?;
    let iron = numbers("iron", &iron, &[groups, 3])?;
    let sizes = [values.len(), doubt.len()];
    if sizes != [elements.len(); 2] || weights.len() != given.group.len() {
        return Err(PyValueError::new_err("fit and doubt must be of these elements and ticks"));
    }
    let fit = Fit {
        iron: iron.as_chunks::<3>().0.iter().map(|v| (*v).into()).collect(),
        elements: values,
        fields: fields.as_chunks::<3>().0.iter().map(|v| (*v).into()).collect(),
        weights,
        scatter,
    };
    let work = || magnet::covariance(&given.ticks(), &fit, &elements, &doubt);
    let found = interruptible(py, usize::MAX, work)?.ok_or_else(beyond)?;
    let size = found.nrows();
    array(py, found.as_slice().to_vec(), &[size, size])
}

/// Ticks from the arguments.
struct Given {
    rotation: Vec<f64>,
    field: Vec<f64>,
    turned: Vec<f64>,
    group: Vec<usize>,
    window: Vec<usize>,
}

impl Given {
    fn read(
        rotation: &Bound<'_, PyAny>,
        field: &Bound<'_, PyAny>,
        turned: Option<&Bound<'_, PyAny>>,
        group: &Bound<'_, PyAny>,
        window: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (group, window) = (places("group", group)?, places("window", window)?);
        let n = group.len();
        if window.len() != n || n == 0 || !window.is_sorted() {
            return Err(PyValueError::new_err(
                "group and window must be as long, of at least one tick, and windows never decrease",
            ));
        }
        // There are at most as many groups and windows as ticks. A larger number is an error and
        // would need much memory.
        if group.iter().chain(&window).any(|place| *place >= n) {
            return Err(PyValueError::new_err(format!(
                "groups and windows are numbered from 0, got one of {n} or more"
            )));
        }
        let turned = turned.map(|given| numbers("turned", given, &[n, 3])).transpose()?;
        Ok(Self {
            rotation: numbers("rotation", rotation, &[n, 3, 3])?,
            field: numbers("field", field, &[n, 3])?,
            turned: turned.unwrap_or_default(),
            group,
            window,
        })
    }

    fn ticks(&self) -> Ticks<'_> {
        Ticks {
            rotation: self.rotation.as_chunks().0,
            field: self.field.as_chunks().0,
            turned: self.turned.as_chunks().0,
            group: &self.group,
            window: &self.window,
        }
    }
}

fn numbers(name: &str, given: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    let found = named(name, given, &tuple(shape), |found| found == shape)?.values;
    match found.iter().all(|x| x.is_finite()) {
        true => Ok(found),
        false => Err(PyValueError::new_err(format!("{name} must be finite"))),
    }
}

/// Numbers of ticks, groups or windows, read at once: there may be thousands.
fn places(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let expected =
        || PyValueError::new_err(format!("{name} must be int64 of shape (n,), from 0 on"));
    let array: PyReadonlyArray1<'_, i64> = given.extract().map_err(|_| expected())?;
    let places = array.as_array().iter().map(|k| usize::try_from(*k)).collect::<Result<_, _>>();
    places.map_err(|_| expected())
}

fn matrices(given: &Bound<'_, PyAny>) -> PyResult<Vec<Element>> {
    let fits = |found: &[usize]| matches!(found, [_, 3, 3]);
    let found = named("elements", given, "(k, 3, 3)", fits)?.values;
    Ok(found.as_chunks::<9>().0.iter().map(|row| Element::from_row_slice(row)).collect())
}

fn rows<'py>(py: Python<'py>, vectors: impl Iterator<Item = [f64; 3]>) -> PyResult<Array<'py>> {
    let values: Vec<f64> = vectors.flatten().collect();
    let count = values.len() / 3;
    array(py, values, &[count, 3])
}

fn beyond() -> PyErr {
    PyValueError::new_err("the numbers are beyond reason: no fit was found")
}
