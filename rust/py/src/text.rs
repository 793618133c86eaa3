//! Rows of plain numbers in a text, for Python.

use numpy::{PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::stream::on_pool;
use zerorate_core::text::{Cell, Form};

use crate::common::work::interruptible;

/// Number of bytes that take as long as one sample of a filter.
const BYTES_A_SAMPLE: usize = 16;

/// Write the numbers in the rows of a text to `out`, if the rows hold only plain numbers.
///
/// Parameters
/// ----------
/// text : bytes
///     Text with the rows.
/// begin, end : int
///     First byte of the rows and their end (exclusive); the last row has no line end.
/// delimiter : int or None
///     Byte between cells; None for any run of blanks.
/// point : int
///     Byte before decimals.
/// places : sequence of int
///     For each cell of a row: its row in `out`, -1 for none.
/// whole : sequence of bool
///     For each row of `out`: True if it takes whole numbers of 64 bits.
/// missing : sequence of bytes
///     Texts of a missing value.
/// out : ndarray of float64, shape (k, n)
///     Array for the numbers, with one column per line.
///
/// Returns
/// -------
/// bool
///     False if anything is not a plain number: quotes, remarks, empty lines, texts, infinities, or
///     rows with more or fewer cells. `out` then holds arbitrary numbers.
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
