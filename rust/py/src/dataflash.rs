//! ArduPilot's binary logs, for Python.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::dataflash::Index;

use crate::common::work::interruptible;

/// Bytes that take as long as a sample of a filter.
const BYTES_A_SAMPLE: usize = 256;

/// Number, name, format, columns and length of a kind of messages, and where they begin.
type Kind<'py> = (
    u8,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    usize,
    Bound<'py, PyArray1<u64>>,
);

/// Returns the messages that a DataFlash log declares, and where the sound ones stand.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     The bytes of the log, which nobody changes meanwhile.
///
/// Returns
/// -------
/// kinds : list of tuple
///     Of each kind: its number, its name, its format (a letter a field), the names of its fields
///     with commas between, all as bytes without the zeros behind them, the bytes of a message, and
///     where its messages begin, uint64, shape (k,).
/// lost : int
///     Bytes that belong to no sound message.
/// cut : int
///     Bytes of a last message that the log ends within.
///
/// Raises
/// ------
/// TypeError
///     If the bytes are not contiguous.
#[pyfunction]
pub fn dataflash_index<'py>(
    py: Python<'py>,
    raw: PyReadonlyArray1<'py, u8>,
) -> PyResult<(Vec<Kind<'py>>, usize, usize)> {
    let bytes = raw.as_slice()?;
    let index = interruptible(py, bytes.len() / BYTES_A_SAMPLE, || Index::of(bytes))?;
    let text = |bytes: &[u8]| {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        PyBytes::new(py, &bytes[..end])
    };
    let kinds = index.kinds.into_iter().map(|kind| {
        let (name, format, columns) = (text(&kind.name), text(&kind.format), text(&kind.columns));
        (kind.number, name, format, columns, kind.length, kind.offsets.into_pyarray(py))
    });
    Ok((kinds.collect(), index.lost, index.cut))
}
