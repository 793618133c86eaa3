//! Rows of plain numbers in a text, for Python.

use numpy::{PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::stream::on_pool;
use zerorate_core::text::{Cell, Form};

use crate::common::work::interruptible;

/// Bytes that take as long as a sample of a filter.
const BYTES_A_SAMPLE: usize = 16;

/// Fills `out` with the numbers in the rows of a text, if these hold nothing but plain numbers.
///
/// Parameters
/// ----------
/// text : bytes
/// begin, end : int
///     Of the rows, the last of which has no line end.
/// delimiter : int or None
///     The byte between cells; None for any run of blanks.
/// point : int
///     The byte before decimals.
/// places : sequence of int
///     Of each cell of a row: which row of `out` it goes to, -1 for none.
/// whole : sequence of bool
///     Of each row of `out`: whether it takes the 64 bits of whole numbers.
/// missing : sequence of bytes
///     What stands for no value.
/// out : ndarray of float64, shape (k, n)
///     Of as many columns as there are lines.
///
/// Returns
/// -------
/// bool
///     False where anything is not plain, as quotes, remarks, empty lines, texts, infinities, rows of
///     more or fewer cells; `out` then holds anything.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn parse_rows(
    text: &Bound<'_, PyBytes>,
    begin: usize,
    end: usize,
    delimiter: Option<u8>,
    point: u8,
    places: Vec<isize>,
    whole: Vec<bool>,
    missing: Vec<Vec<u8>>,
    out: &Bound<'_, PyArray2<f64>>,
) -> PyResult<bool> {
    let (py, mut out) = (text.py(), out.try_readwrite()?);
    let mut out = out.as_array_mut();
    let columns: Option<Vec<&mut [f64]>> =
        out.outer_iter_mut().map(|column| column.into_slice()).collect();
    let cell = |place| match usize::try_from(place) {
        Err(_) => Some(Cell::Unwanted),
        Ok(place) => match whole.get(place)? {
            true => Some(Cell::Whole(place)),
            false => Some(Cell::Double(place)),
        },
    };
    let cells: Option<Vec<Cell>> = places.into_iter().map(cell).collect();
    let (Some(text), Some(columns), Some(cells)) =
        (text.as_bytes().get(begin..end), columns, cells)
    else {
        return Ok(false);
    };
    if whole.len() != columns.len() {
        return Ok(false);
    }
    let form = Form { delimiter, point, cells, missing };
    interruptible(py, text.len() / BYTES_A_SAMPLE, || on_pool(|| form.read(text, columns, true)))
}
