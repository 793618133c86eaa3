//! Blackbox logs of flight controllers, for Python.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use zerorate_core::blackbox::Log;

use crate::common::errors::NativeError;
use crate::common::work::interruptible;

/// Bytes that take as long as a sample of a filter.
const BYTES_A_SAMPLE: usize = 16;

/// Headers, names of fields, their values, and lost and all bytes of a log.
type Content<'py> =
    (Vec<(String, String)>, Vec<String>, Vec<Bound<'py, PyArray1<i64>>>, usize, usize);

/// Return the logs in a blackbox file.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     Bytes of the file. They must not change during the call.
/// wanted : list of str
///     Beginnings of the names of the fields to return, such as ``gyroADC``.
///
/// Returns
/// -------
/// logs : list of tuple
///     For each log: its headers as pairs of key and value; the names of the returned fields, of
///     which the first is the clock, us; their values, int64, shape (n,) each; the number of bytes
///     that were lost to damage; and the number of bytes of its frames. A log without main frames
///     has no fields.
///
/// Raises
/// ------
/// MemoryError
///     If there is no memory for the values.
/// TypeError
///     If the bytes are not contiguous.
#[pyfunction]
pub fn read_blackbox<'py>(
    py: Python<'py>,
    raw: PyReadonlyArray1<'py, u8>,
    wanted: Vec<String>,
) -> PyResult<Vec<Content<'py>>> {
    let bytes = raw.as_slice()?;
    let is_wanted = |name: &str| wanted.iter().any(|own| name.starts_with(own));
    let read = || Log::all(bytes, is_wanted);
    let logs = interruptible(py, bytes.len() / BYTES_A_SAMPLE, read)?.map_err(NativeError::from)?;
    let content = logs.into_iter().map(|log| {
        let columns = log.columns.into_iter().map(|column| column.into_pyarray(py)).collect();
        (log.headers, log.names, columns, log.lost, log.bytes)
    });
    Ok(content.collect())
}
