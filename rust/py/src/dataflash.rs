//! ArduPilot's DataFlash logs, for Python.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::dataflash::Index;

use crate::common::work::interruptible;

/// Number of bytes that take as long as one sample of a filter.
const BYTES_A_SAMPLE: usize = 256;

/// Number, name, format, columns and length of a message type, and the positions of its messages.
type Kind<'py> = (
    u8,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    Bound<'py, PyBytes>,
    usize,
    Bound<'py, PyArray1<u64>>,
);

/// Return the message types of a DataFlash log, and the positions of the valid messages.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     Bytes of the log; they must not change during the call.
///
/// Returns
/// -------
/// kinds : list of tuple
///     For each message type: its number, name, format (one letter per field) and field names, with
///     commas between. Name, format and field names are bytes without the zeros behind them. Then
///     the bytes per message, and the positions of its messages, uint64, shape (k,).
/// lost : int
///     Number of bytes outside of valid messages.
/// cut : int
///     Number of bytes of a last message that the log cuts off.
///
/// Raises
/// ------
/// TypeError
///     The bytes are not contiguous.
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
