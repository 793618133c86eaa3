//! Every check and conversion of an array.

use numpy::ndarray::{Axis, Ix2};
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyList, PyTuple};

/// Samples copied out of an array, row after row.
#[derive(Debug)]
pub struct Samples {
    pub values: Vec<f64>,
    pub shape: Vec<usize>,
}

/// One sample: a float, anything that converts to one, or `None` for a missing one.
#[inline]
pub fn sample(z: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(value) = z.cast_exact::<PyFloat>() {
        return Ok(value.value());
    }
    if z.is_none() {
        return Ok(f64::NAN);
    }
    z.extract().map_err(|_| {
        PyTypeError::new_err(format!(
            "update() takes one number, got {}; a whole record goes to process()",
            describe(z)
        ))
    })
}

/// The samples of a batch: shape `(n,)`, or `(n, k)` for `k` channels.
pub fn batch(z: &Bound<'_, PyAny>, channels: Option<usize>) -> PyResult<Samples> {
    let samples = read(z)?;
    let fits = match (channels, samples.shape.as_slice()) {
        (None, [_]) => true,
        (Some(k), [_, columns]) => *columns == k,
        _ => false,
    };
    let expected = match channels {
        None => "(n,)".to_owned(),
        Some(k) => format!("(n, {k})"),
    };
    check_shape(fits, &expected, &samples.shape)?;
    Ok(samples)
}

/// One sample a channel, shape `(k,)`.
pub fn row(z: &Bound<'_, PyAny>, channels: usize) -> PyResult<Vec<f64>> {
    if let Some(values) = usual_row(z).filter(|values| values.len() == channels) {
        return Ok(values);
    }
    let samples = read(z)?;
    check_shape(samples.shape == [channels], &format!("({channels},)"), &samples.shape)?;
    Ok(samples.values)
}

/// What loops give most often, without what NumPy asks of any other: that takes ten times as long.
#[inline]
fn usual_row(z: &Bound<'_, PyAny>) -> Option<Vec<f64>> {
    if let Ok(list) = z.cast_exact::<PyList>() {
        return list.iter().map(float).collect();
    }
    if let Ok(tuple) = z.cast_exact::<PyTuple>() {
        return tuple.iter().map(float).collect();
    }
    // Exactly an array: a masked one is read otherwise.
    z.cast_exact::<PyUntypedArray>().ok()?;
    let array = z.cast::<PyArray1<f64>>().ok()?;
    let in_place = array.is_c_contiguous() && is_aligned(array.data());
    in_place.then(|| (0..array.len()).map_while(|i| array.get_owned(i)).collect())
}

fn float(z: Bound<'_, PyAny>) -> Option<f64> {
    z.cast_exact::<PyFloat>().ok().map(|z| z.value())
}

/// Records side by side, each in a buffer of its own.
#[derive(Debug)]
pub struct Columns {
    pub values: Vec<Vec<f64>>,
    /// The length of the second axis, if there is one.
    pub axes: Option<usize>,
}

/// Rows that are copied column by column before the next ones.
const ROWS: usize = 4096;

/// The columns of an array of shape `(n,)` or `(n, k)`, each with room for one more value.
pub fn columns(z: &Bound<'_, PyAny>) -> PyResult<Columns> {
    let floats = floats(z)?;
    let array = aligned(&floats)?;
    let shape = array.shape();
    check_shape(matches!(shape.len(), 1 | 2), "(n,) or (n, k)", shape)?;
    let axes = shape.get(1).copied();
    let array = array.try_readonly()?;
    let rows = array.as_array();
    let rows = match axes {
        None => rows.insert_axis(Axis(1)),
        Some(_) => rows,
    };
    let rows = rows.into_dimensionality::<Ix2>().map_err(|error| {
        PyValueError::new_err(format!("z must have shape (n,) or (n, k): {error}"))
    })?;
    let mut values: Vec<Vec<f64>> =
        rows.columns().into_iter().map(|_| Vec::with_capacity(shape[0] + 1)).collect();
    for block in rows.axis_chunks_iter(Axis(0), ROWS) {
        for (column, out) in block.columns().into_iter().zip(&mut values) {
            match column.to_slice() {
                Some(slice) => out.extend_from_slice(slice),
                None => out.extend(column.iter()),
            }
        }
    }
    Ok(Columns { values, axes })
}

/// One axis, shape `(n,)`, to be read in place; an array is copied only if it is not contiguous.
pub fn axis<'py>(z: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    let floats = floats(z)?;
    let array = aligned(&floats)?;
    check_shape(array.shape().len() == 1, "(n,)", array.shape())?;
    let plain = match is_plain(&array) {
        true => array.into_any(),
        false => array.call_method1("copy", ("C",))?,
    };
    Ok(plain.cast_into::<PyArray1<f64>>()?.try_readonly()?)
}

fn check_shape(fits: bool, expected: &str, shape: &[usize]) -> PyResult<()> {
    if fits {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("z must have shape {expected}, got {}", tuple(shape))))
}

/// A shape as Python writes it.
pub fn tuple(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn read(z: &Bound<'_, PyAny>) -> PyResult<Samples> {
    copied(&floats(z)?)
}

/// `z` as an array of float64; missing samples are NaN.
fn floats<'py>(z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = z.py().import("numpy")?;
    if numpy.getattr("ma")?.call_method1("isMaskedArray", (z,))?.is_truthy()? {
        let floats = z.call_method1("astype", ("float64",))?;
        return floats.call_method1("filled", (f64::NAN,));
    }
    if z.cast::<PyArrayDyn<f64>>().is_ok() {
        return Ok(z.clone());
    }
    let array = numpy.call_method1("asarray", (z,)).map_err(|_| {
        PyValueError::new_err(format!(
            "z must be a rectangular array of numbers, got {}",
            describe(z)
        ))
    })?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    let is_list = z.is_instance_of::<PyList>() || z.is_instance_of::<PyTuple>();
    if kind == "O" && is_list {
        // A list with `None` for a missing sample; an array of objects is refused below.
        if let Ok(floats) = numpy.call_method1("asarray", (z, "float64")) {
            return Ok(floats);
        }
    }
    if !matches!(kind.as_str(), "f" | "i" | "u" | "b") {
        return Err(PyTypeError::new_err(format!(
            "z must hold real numbers, got dtype {dtype}; convert with numpy.asarray(z, dtype=float)"
        )));
    }
    array.call_method1("astype", ("float64",))
}

/// The elements of a float64 array, row after row, whatever its layout.
fn copied(array: &Bound<'_, PyAny>) -> PyResult<Samples> {
    let array = array.cast::<PyArrayDyn<f64>>()?;
    let shape = array.shape().to_vec();
    if is_plain(array) {
        let values = array.try_readonly()?.as_slice()?.to_vec();
        return Ok(Samples { values, shape });
    }
    let plain = array.call_method1("copy", ("C",))?;
    let values = plain.cast::<PyArrayDyn<f64>>()?.try_readonly()?.as_slice()?.to_vec();
    Ok(Samples { values, shape })
}

/// The array itself, or a copy if an element or a stride is not where a float64 may stand.
fn aligned<'py>(floats: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = floats.cast::<PyArrayDyn<f64>>()?;
    let fits = |stride: &isize| stride.unsigned_abs().is_multiple_of(size_of::<f64>());
    if is_aligned(array.data()) && array.strides().iter().all(fits) {
        return Ok(array.clone());
    }
    Ok(array.call_method1("copy", ("C",))?.cast_into()?)
}

/// Row after row without gaps, each element where a float64 may stand.
fn is_plain(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    array.is_c_contiguous() && is_aligned(array.data())
}

fn is_aligned(data: *mut f64) -> bool {
    (data as usize).is_multiple_of(align_of::<f64>())
}

fn describe(z: &Bound<'_, PyAny>) -> String {
    let name = z.get_type().name().map_or_else(|_| "an object".to_owned(), |n| n.to_string());
    match z.getattr("shape").and_then(|shape| shape.str()) {
        Ok(shape) => format!("{name} of shape {shape}"),
        Err(_) => name,
    }
}

/// The array that `out=` names: float64, writeable, of the shape of the input.
pub fn check_out<'a, 'py>(
    out: &'a Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<&'a Bound<'py, PyArrayDyn<f64>>> {
    let expected = || format!("out must be a writeable float64 array of shape {}", tuple(shape));
    let array = out.cast::<PyArrayDyn<f64>>().map_err(|_| {
        let dtype = out.getattr("dtype").map_or(String::new(), |d| format!(" with dtype {d}"));
        PyTypeError::new_err(format!("{}, got {}{dtype}", expected(), describe(out)))
    })?;
    if array.shape() != shape {
        let got = tuple(array.shape());
        return Err(PyValueError::new_err(format!("{}, got shape {got}", expected())));
    }
    if !out.getattr("flags")?.getattr("writeable")?.is_truthy()? {
        return Err(PyValueError::new_err(format!("{}, got a read-only one", expected())));
    }
    Ok(array)
}

/// Copies `values`, row after row, into an array checked by [`check_out`].
pub fn fill(out: &Bound<'_, PyArrayDyn<f64>>, values: Vec<f64>) -> PyResult<()> {
    if is_plain(out) {
        out.try_readwrite()?.as_slice_mut()?.copy_from_slice(&values);
        return Ok(());
    }
    let py = out.py();
    let plain = array(py, values, out.shape())?;
    py.import("numpy")?.call_method1("copyto", (out, plain))?;
    Ok(())
}

/// A new array of one number a channel: for so few, copying them beats handing over their memory.
#[inline]
pub fn answers<'py>(py: Python<'py>, row: &[f64]) -> Bound<'py, PyAny> {
    PyArray1::from_slice(py, row).into_any()
}

/// A new array of `shape` that owns `values`.
pub fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
}
