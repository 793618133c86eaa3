//! MCAP recordings, for Python.

use std::io::{Read, Write};

use lz4_flex::frame::{BlockSize, FrameDecoder, FrameEncoder, FrameInfo};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use ruzstd::decoding::StreamingDecoder;
use zerorate_core::mcap::{Fault, Recording};

use crate::common::errors::NativeError;
use crate::common::work::interruptible;

/// Bytes that take as long as a sample of a filter.
const BYTES_A_SAMPLE: usize = 256;

/// Number, topic, encoding, and name, encoding and text of the type of a channel's messages.
type Channel<'py> = (u16, String, String, String, String, Bound<'py, PyBytes>);
/// Channels, times, where what is kept of each message begins, its bytes in the file; what is kept.
type Messages<'py> = (
    Bound<'py, PyArray1<u16>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u8>>,
);

/// Fills `out` with what is packed, to its last byte.
fn unpack(compression: &str, packed: &[u8], out: &mut [u8]) -> Option<()> {
    match compression {
        "lz4" => FrameDecoder::new(packed).read_exact(out).ok(),
        "zstd" => StreamingDecoder::new(packed).ok()?.read_exact(out).ok(),
        _ => None,
    }
}

/// Returns the channels of an MCAP recording, and the messages of some of them.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     The bytes of the recording, which nobody changes meanwhile.
/// wanted : list of int
///     Numbers of the channels whose messages are returned.
/// limit : int
///     Messages to return at most.
/// kept : list of (int, int)
///     Parts of each message to keep, from one byte to another, counted from its end where they are
///     negative; empty for all of it.
///
/// Returns
/// -------
/// profile : str
///     The conventions that the recording follows.
/// channels : list of tuple
///     Of each channel: its number, its topic, the encoding of its messages, and the name, the
///     encoding and the text of their type, empty where none is given.
/// messages : tuple of ndarray
///     In the order of time: the channel of each message, uint16, the time of its recording, ns,
///     uint64, where what is kept of it begins and how many bytes it has in the file, uint64, each
///     of shape (k,); and the bytes that are kept, uint8.
///
/// Raises
/// ------
/// ValueError
///     If the recording is truncated or damaged.
/// TypeError
///     If the bytes are not contiguous.
#[pyfunction]
pub fn read_mcap<'py>(
    py: Python<'py>,
    raw: PyReadonlyArray1<'py, u8>,
    wanted: Vec<u16>,
    limit: usize,
    kept: Vec<(isize, isize)>,
) -> PyResult<(String, Vec<Channel<'py>>, Messages<'py>)> {
    let bytes = raw.as_slice()?;
    let read = || Recording::read(bytes, &wanted, limit, &kept, unpack);
    let found = interruptible(py, bytes.len() / BYTES_A_SAMPLE, read)?.map_err(|f| match f {
        Fault::Memory(error) => NativeError::from(error).into(),
        fault => PyValueError::new_err(fault.to_string()),
    })?;
    let channels = found.channels.into_iter().map(|channel| {
        let (name, form, text) = channel.schema;
        (channel.id, channel.topic, channel.encoding, name, form, PyBytes::new(py, &text))
    });
    let messages = found.messages;
    let arrays = (
        messages.channels.into_pyarray(py),
        messages.times.into_pyarray(py),
        messages.begins.into_pyarray(py),
        messages.lengths.into_pyarray(py),
        messages.raw.into_pyarray(py),
    );
    Ok((found.profile, channels.collect(), arrays))
}

/// Returns bytes as a frame of LZ4.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     The bytes.
///
/// Returns
/// -------
/// bytes
///     The frame, by https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md.
#[pyfunction]
pub fn pack_lz4<'py>(
    py: Python<'py>,
    raw: PyReadonlyArray1<'py, u8>,
) -> PyResult<Bound<'py, PyBytes>> {
    let bytes = raw.as_slice()?;
    let info = FrameInfo::new().block_size(BlockSize::Max4MB);
    let mut frame = FrameEncoder::with_frame_info(info, Vec::new());
    let packed = frame.write_all(bytes).ok().and_then(|()| frame.finish().ok());
    let packed = packed.ok_or_else(|| PyValueError::new_err("bytes cannot be packed"))?;
    Ok(PyBytes::new(py, &packed))
}
