//! Every check and conversion of an array.

use std::fmt::Display;

use numpy::ndarray::{ArrayView2, ArrayViewMut2};
use numpy::ndarray::{Axis, Ix2};
use numpy::{
    Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn,
    PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyException, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyList, PyTuple};
use zerorate_core::memory;

use super::elements::{is_readable, usual_row};
use super::errors::NativeError;
use super::rules::{self, Rule};

/// Numbers copied out of an array, row after row.
#[derive(Debug)]
pub struct Record {
    pub values: Vec<f64>,
    pub shape: Vec<usize>,
}

/// One sample: a float, a value that converts to a float, or `None` for a missing sample.
#[inline]
pub fn sample(z: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(value) = z.cast_exact::<PyFloat>() {
        return Ok(value.value());
    }
    if z.is_none() {
        return Ok(f64::NAN);
    }
    z.extract().or_else(|_| missing(z)).map_err(|_: PyErr| {
        PyTypeError::new_err(format!(
            "update() takes one number, got {}; a whole record goes to process()",
            describe(z)
        ))
    })
}

/// The number in a missing value that only the package's rule recognises, such as the NA of pandas.
#[cold]
fn missing(z: &Bound<'_, PyAny>) -> PyResult<f64> {
    let read = floats(z)?;
    check_shape("z", read.getattr("ndim")?.extract::<usize>()? == 0, "()", &[])?;
    read.call_method0("item")?.extract()
}

/// The samples of one signal, shape `(n,)`, copied.
pub fn record(z: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let record = read(z)?;
    check_shape("z", record.shape.len() == 1, "(n,)", &record.shape)?;
    Ok(record.values)
}

/// Samples of a batch, read in place or copied.
///
/// While they are read in place, the interpreter lock is released. If another thread writes into
/// the array meanwhile, outputs mix old and new samples.
#[derive(Debug)]
pub enum Samples<'py> {
    InPlace(PyReadonlyArrayDyn<'py, f64>),
    Copied(Record),
}

impl Samples<'_> {
    pub fn values(&self) -> PyResult<&[f64]> {
        Ok(match self {
            Self::InPlace(array) => array.as_slice()?,
            Self::Copied(samples) => &samples.values,
        })
    }

    pub fn shape(&self) -> &[usize] {
        match self {
            Self::InPlace(array) => array.shape(),
            Self::Copied(samples) => &samples.shape,
        }
    }

    /// The same samples as a copy; the array is then free for changes.
    pub fn copied(self) -> PyResult<Self> {
        let (values, shape) = (copy(self.values()?)?, self.shape().to_vec());
        Ok(Self::Copied(Record { values, shape }))
    }
}

/// The samples of a batch, for rows of these axes.
pub fn samples<'py>(z: &Bound<'py, PyAny>, axes: &[usize]) -> PyResult<Samples<'py>> {
    let floats = floats(z)?;
    let array = floats.cast::<PyArrayDyn<f64>>()?;
    let shape = array.shape();
    if shape.is_empty() || shape[1..] != *axes {
        let axes: String = axes.iter().map(|k| format!(" {k},")).collect();
        let axes = axes.strip_suffix(',').unwrap_or("");
        check_shape("z", false, &format!("(n,{axes})"), shape)?;
    }
    if is_plain(array) {
        return Ok(Samples::InPlace(array.try_readonly()?));
    }
    copied(&floats).map(Samples::Copied)
}

/// Arguments of an object's method, in which logs and data frames have become arrays.
///
/// Arguments that are not given are Python's None. The package's rule asks the object for its rate
/// and units: call this before the object is borrowed.
pub fn taken<'py, T, const N: usize>(
    owner: &Bound<'py, T>,
    names: [&str; N],
    given: [Option<&Bound<'py, PyAny>>; N],
) -> PyResult<[Bound<'py, PyAny>; N]> {
    if given.into_iter().flatten().all(is_usual) {
        let missing = owner.py().None().into_bound(owner.py());
        return Ok(given.map(|z| z.unwrap_or(&missing).clone()));
    }
    rules::call(owner.py(), Rule::Samples, (owner.as_any(), names, given))?.extract()
}

/// True if the value has neither a rate nor a unit.
fn is_usual(z: &Bound<'_, PyAny>) -> bool {
    z.is_exact_instance_of::<PyUntypedArray>()
        || z.is_exact_instance_of::<PyFloat>()
        || z.is_exact_instance_of::<PyList>()
        || z.is_exact_instance_of::<PyTuple>()
}

/// An optional argument.
pub fn present<'a, 'py>(z: &'a Bound<'py, PyAny>) -> Option<&'a Bound<'py, PyAny>> {
    (!z.is_none()).then_some(z)
}

/// One row of samples with these axes; None is a missing row.
pub fn row(z: &Bound<'_, PyAny>, axes: &[usize]) -> PyResult<Vec<f64>> {
    if z.is_none() {
        return Ok(vec![f64::NAN; axes.iter().product()]);
    }
    if let Some(values) = usual_row(z, axes) {
        return Ok(values);
    }
    let samples = read(z)?;
    check_shape("z", samples.shape == axes, &tuple(axes), &samples.shape)?;
    Ok(samples.values)
}

/// Parallel records, each in its own buffer.
#[derive(Debug)]
pub struct Columns {
    pub values: Vec<Vec<f64>>,
    /// Length of the second axis, if there is a second axis.
    pub axes: Option<usize>,
}

/// Number of rows that are copied column by column before the next rows.
const ROWS: usize = 4096;

/// The columns of an array of shape `(n,)` or `(n, k)`, each with room for one more value.
pub fn columns(z: &Bound<'_, PyAny>) -> PyResult<Columns> {
    let floats = floats(z)?;
    let array = aligned(&floats)?;
    let shape = array.shape();
    check_shape("z", matches!(shape.len(), 1 | 2), "(n,) or (n, k)", shape)?;
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
    let column = |_| memory::room(shape[0] + 1).map_err(NativeError::from);
    let mut values: Vec<Vec<f64>> =
        rows.columns().into_iter().map(column).collect::<Result<_, _>>()?;
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

/// One axis, shape `(n,)`, read in place; an array is copied only if it is not contiguous.
pub fn axis<'py>(z: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    let floats = floats(z)?;
    let array = aligned(&floats)?;
    check_shape("z", array.shape().len() == 1, "(n,)", array.shape())?;
    let plain = match is_plain(&array) {
        true => array.into_any(),
        false => array.call_method1("copy", ("C",))?,
    };
    Ok(plain.cast_into::<PyArray1<f64>>()?.try_readonly()?)
}

/// The numbers of a named argument, row after row, if its shape fits.
pub fn named(
    name: &str,
    z: &Bound<'_, PyAny>,
    expected: &str,
    fits: impl Fn(&[usize]) -> bool,
) -> PyResult<Record> {
    let record = read(z)?;
    check_shape(name, fits(&record.shape), expected, &record.shape)?;
    Ok(record)
}

/// The flags of a named argument, one per sample, copied.
pub fn flags(name: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<bool>> {
    let array = given.py().import("numpy")?.call_method1("ascontiguousarray", (given,))?;
    let array = array.cast::<PyArrayDyn<bool>>().map_err(|_| {
        let dtype = array.getattr("dtype").map_or(String::new(), |d| format!(" of dtype {d}"));
        PyTypeError::new_err(format!("{name} must be a bool array, got one{dtype}"))
    })?;
    if array.shape() != [n] {
        let (expected, got) = (tuple(&[n]), tuple(array.shape()));
        return Err(PyValueError::new_err(format!("{name} must have shape {expected}, got {got}")));
    }
    Ok(memory::copied(array.try_readonly()?.as_slice()?).map_err(NativeError::from)?)
}

fn check_shape(name: &str, fits: bool, expected: &str, shape: &[usize]) -> PyResult<()> {
    if fits {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} must have shape {expected}, got {}", tuple(shape))))
}

/// A shape as Python writes it.
pub fn tuple(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn read(z: &Bound<'_, PyAny>) -> PyResult<Record> {
    copied(&floats(z)?)
}

/// Imports the functions of NumPy that later calls need. An interrupt during the first later call
/// would be a panic.
pub fn find_numpy(py: Python<'_>) -> PyResult<()> {
    numpy::get_array_module(py).map(|_| ())
}

/// `z` as an array of float64; missing samples are NaN.
fn floats<'py>(z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    find_numpy(z.py())?;
    let masks = z.py().import("numpy")?.getattr("ma")?;
    let masked = masks.call_method1("isMaskedArray", (z,))?.is_truthy()?;
    if !masked && z.cast::<PyArrayDyn<f64>>().is_ok() {
        return Ok(z.clone());
    }
    if z.is_none() {
        return Err(no_numbers("object"));
    }
    let array = rules::call(z.py(), Rule::WithoutMasks, (z,)).map_err(|error| {
        // An interrupt of the rule's first call, which imports it, is no error of the array.
        if !error.is_instance_of::<PyException>(z.py()) {
            return error;
        }
        PyValueError::new_err(format!(
            "z must be a rectangular array of numbers, got {}",
            describe(z)
        ))
    })?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u" | "b") {
        return Err(no_numbers(dtype));
    }
    array.call_method1("astype", ("float64",))
}

fn no_numbers(dtype: impl Display) -> PyErr {
    PyTypeError::new_err(format!(
        "z must hold real numbers, got dtype {dtype}; convert with numpy.asarray(z, dtype=float)"
    ))
}

/// The elements of a float64 array, row after row, for any layout.
fn copied(array: &Bound<'_, PyAny>) -> PyResult<Record> {
    let array = array.cast::<PyArrayDyn<f64>>()?;
    let shape = array.shape().to_vec();
    if is_plain(array) {
        let values = copy(array.try_readonly()?.as_slice()?)?;
        return Ok(Record { values, shape });
    }
    let plain = array.call_method1("copy", ("C",))?;
    let values = copy(plain.cast::<PyArrayDyn<f64>>()?.try_readonly()?.as_slice()?)?;
    Ok(Record { values, shape })
}

fn copy(values: &[f64]) -> PyResult<Vec<f64>> {
    Ok(memory::copied(values).map_err(NativeError::from)?)
}

/// The array itself, or a copy if an element or a stride is not aligned for float64.
fn aligned<'py>(floats: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = floats.cast::<PyArrayDyn<f64>>()?;
    if is_readable(array.data(), array.strides()) {
        return Ok(array.clone());
    }
    Ok(array.call_method1("copy", ("C",))?.cast_into()?)
}

/// True if the rows are contiguous and each element is aligned.
pub fn is_plain<T: Element>(array: &Bound<'_, PyArrayDyn<T>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

fn describe(z: &Bound<'_, PyAny>) -> String {
    let name = z.get_type().name().map_or_else(|_| "an object".to_owned(), |n| n.to_string());
    match z.getattr("shape").and_then(|shape| shape.str()) {
        Ok(shape) => format!("{name} of shape {shape}"),
        Err(_) => name,
    }
}

/// The array of `out=`, if it has these elements, is writeable and has the input's shape.
pub fn check_out<'a, 'py, T: Element>(
    out: &'a Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<&'a Bound<'py, PyArrayDyn<T>>> {
    let dtype = T::get_dtype(out.py());
    let expected = || format!("out must be a writeable {dtype} array of shape {}", tuple(shape));
    let array = out.cast::<PyArrayDyn<T>>().map_err(|_| {
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

/// Copies `values`, row after row, into an array of any layout.
pub fn copy_to<T: Element>(out: &Bound<'_, PyArrayDyn<T>>, values: Vec<T>) -> PyResult<()> {
    let py = out.py();
    let plain = array(py, values, out.shape())?;
    py.import("numpy")?.call_method1("copyto", (out, plain))?;
    Ok(())
}

/// A new array with one number per channel. For few numbers a copy is faster than a transfer of
/// memory.
#[inline]
pub fn small<'py, T: Element>(py: Python<'py>, row: &[T]) -> Bound<'py, PyAny> {
    PyArray1::from_slice(py, row).into_any()
}

/// Elements of an array that is copied, not transferred.
const FEW: usize = 16;

/// Elements of an array that NumPy's C interface creates; it fails if there is no memory.
const SMALL: usize = 1 << 12;

/// Rows of `width` numbers from columns; NaN where there is no column.
///
/// A column has its first position in the row and its count of numbers per row. A column with fewer
/// rows repeats each row equally often, for example one time for all channels.
pub fn side_by_side(
    width: usize,
    rows: usize,
    columns: &[(usize, usize, &[f64])],
) -> PyResult<Vec<f64>> {
    let length = rows.saturating_mul(width);
    let mut all = memory::filled(f64::NAN, length).map_err(NativeError::from)?;
    for (first, size, values) in columns {
        let each = (rows * size / values.len().max(1)).max(1);
        for (i, row) in all.chunks_exact_mut(width).enumerate() {
            row[*first..][..*size].copy_from_slice(&values[i / each * size..][..*size]);
        }
    }
    Ok(all)
}

/// A new array of zeros.
pub fn zeros<'py, T: Element>(
    py: Python<'py>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    if shape.iter().product::<usize>() <= SMALL {
        return Ok(PyArrayDyn::zeros(py, shape, false));
    }
    let shape = PyTuple::new(py, shape)?;
    let array = py.import("numpy")?.call_method1("zeros", (shape, T::get_dtype(py)))?;
    Ok(array.cast_into()?)
}

/// A new array of one value.
pub fn filled<'py, T: Element + Copy>(
    py: Python<'py>,
    shape: &[usize],
    value: T,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = zeros(py, shape)?;
    array.readwrite().as_slice_mut()?.fill(value);
    Ok(array)
}

/// A new array of `shape` that owns `values`.
pub fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    // A small array is created faster directly than by a transfer of memory and a change of shape.
    match shape {
        [n] if *n <= FEW => Ok(small(py, &values)),
        _ => Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any()),
    }
}

/// The rows of a block (k, n), one row per axis; the samples of a row are contiguous.
pub fn rows<'a, T>(name: &str, block: &'a ArrayView2<'_, T>) -> PyResult<Vec<&'a [T]>> {
    let row = |i: usize| block.row(i).to_slice();
    (0..block.nrows()).map(|i| row(i).ok_or_else(|| gaps(name))).collect()
}

/// The rows of a block, to be written.
pub fn rows_mut<'a, T>(name: &str, block: ArrayViewMut2<'a, T>) -> PyResult<Vec<&'a mut [T]>> {
    let rows = block.into_outer_iter_mut();
    rows.map(|row| row.into_slice().ok_or_else(|| gaps(name))).collect()
}

/// Refuses a block with another shape.
pub fn check(name: &str, got: &[usize], expected: &[usize]) -> PyResult<()> {
    if got == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} must have shape {expected:?}, got {got:?}")))
}

fn gaps(name: &str) -> PyErr {
    PyValueError::new_err(format!("{name} must have rows without gaps"))
}
