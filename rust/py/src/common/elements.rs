//! Fast reading of one row of numbers in a common type. A call into NumPy takes ten times as long.

use numpy::{
    Element, PyArray1, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyInt, PyList, PyTuple};

/// Return the numbers of a row of shape `axes`; None for other shapes and rarer types.
#[inline]
pub fn usual_row(z: &Bound<'_, PyAny>, axes: &[usize]) -> Option<Vec<f64>> {
    let mut row = vec![f64::NAN; axes.iter().product()];
    fill(z, axes, &mut row)?;
    Some(row)
}

/// Return a sample of three axes; None for other shapes and rarer types.
#[inline]
pub fn three(z: &Bound<'_, PyAny>) -> Option<[f64; 3]> {
    let mut row = [f64::NAN; 3];
    fill(z, &[3], &mut row)?;
    Some(row)
}

#[inline]
fn fill(z: &Bound<'_, PyAny>, axes: &[usize], row: &mut [f64]) -> Option<()> {
    // Only arrays of exactly this type: masked arrays are read elsewhere.
    if let Ok(array) = z.cast_exact::<PyUntypedArray>() {
        return (array.shape() == axes).then(|| fill_from_array(array, row))?;
    }
    if axes.len() != 1 {
        return None;
    }
    if let Ok(list) = z.cast_exact::<PyList>() {
        return (list.len() == row.len()).then(|| fill_from_numbers(list.iter(), row))?;
    }
    let tuple = z.cast_exact::<PyTuple>().ok()?;
    (tuple.len() == row.len()).then(|| fill_from_numbers(tuple.iter(), row))?
}

fn fill_from_numbers<'py>(
    numbers: impl Iterator<Item = Bound<'py, PyAny>>,
    row: &mut [f64],
) -> Option<()> {
    for (element, z) in row.iter_mut().zip(numbers) {
        *element = number(&z)?;
    }
    Some(())
}

/// Return the value of a Python or NumPy number; bool and complex are refused.
fn number(z: &Bound<'_, PyAny>) -> Option<f64> {
    if let Ok(float) = z.cast::<PyFloat>() {
        return Some(float.value());
    }
    (z.is_exact_instance_of::<PyInt>() || is_numpy_number(z).ok()?).then(|| z.extract().ok())?
}

fn is_numpy_number(z: &Bound<'_, PyAny>) -> PyResult<bool> {
    static REAL: PyOnceLock<Py<PyTuple>> = PyOnceLock::new();
    let real = REAL.get_or_try_init(z.py(), || {
        let numpy = z.py().import("numpy")?;
        let types = (numpy.getattr("floating")?, numpy.getattr("integer")?);
        Ok::<_, PyErr>(types.into_pyobject(z.py())?.unbind())
    })?;
    z.is_instance(real.bind(z.py()))
}

fn fill_from_array(array: &Bound<'_, PyUntypedArray>, row: &mut [f64]) -> Option<()> {
    let dtype = array.dtype();
    match (dtype.kind(), dtype.itemsize()) {
        (b'f', 8) => convert::<f64>(array, row, |value| value),
        (b'f', 4) => convert::<f32>(array, row, f64::from),
        (b'i', 2) => convert::<i16>(array, row, f64::from),
        (b'i', 4) => convert::<i32>(array, row, f64::from),
        (b'i', 8) => convert::<i64>(array, row, |value| value as f64),
        _ => None,
    }
}

#[inline]
fn convert<T: Element + Copy>(
    array: &Bound<'_, PyUntypedArray>,
    row: &mut [f64],
    to_float: impl Fn(T) -> f64,
) -> Option<()> {
    if let Ok(array) = array.cast::<PyArray1<T>>() {
        is_readable::<T>(array.data(), array.strides()).then_some(())?;
        for (k, element) in row.iter_mut().enumerate() {
            *element = to_float(array.get_owned(k)?);
        }
        return Some(());
    }
    let array = array.cast::<PyArrayDyn<T>>().ok()?;
    is_readable::<T>(array.data(), array.strides()).then_some(())?;
    let array = array.try_readonly().ok()?;
    for (element, value) in row.iter_mut().zip(array.as_array()) {
        *element = to_float(*value);
    }
    Some(())
}

/// Return true if every element is aligned, so that it may be read in place.
pub fn is_readable<T>(data: *mut T, strides: &[isize]) -> bool {
    let fits = |stride: &isize| stride.unsigned_abs().is_multiple_of(size_of::<T>());
    data.is_aligned() && strides.iter().all(fits)
}
