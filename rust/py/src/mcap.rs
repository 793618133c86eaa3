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

/// Largest ratio of LZ4, and of nearly all real chunks.
const USUAL_RATIO: usize = 255;

/// Unpacks at most so many bytes. Memory grows with the unpacked bytes, not with the declared ones.
fn unpack(compression: &str, packed: &[u8], size: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    out.try_reserve_exact(size.min(packed.len().saturating_mul(USUAL_RATIO))).ok()?;
    let limit = u64::try_from(size).ok()?;
    match compression {
        "lz4" => FrameDecoder::new(packed).take(limit).read_to_end(&mut out).ok()?,
        "zstd" => StreamingDecoder::new(packed).ok()?.take(limit).read_to_end(&mut out).ok()?,
        _ => return None,
    };
    Some(out)
}

/// Return the channels of an MCAP recording, and the messages of the wanted channels.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     Bytes of the recording. They must not change during the call.
/// wanted : list of int
///     Numbers of the channels with messages to return.
/// limit : int
///     Largest number of messages to return.
/// kept : list of (int, int)
///     Parts of each message to keep, each from a first byte to an end (exclusive). A negative
///     number counts from the message's end. An empty list keeps whole messages.
///
/// Returns
/// -------
/// profile : str
///     Profile of the recording: the name of its conventions.
/// channels : list of tuple
///     For each channel: its number, its topic and the encoding of its messages; then name,
///     encoding and text of the messages' type, empty if not given.
/// messages : tuple of ndarray
///     Four arrays with one number per message, shape (k,), in the order of time: channel, uint16;
///     time of recording, ns, uint64; index of its first kept byte, uint64; number of its bytes in
///     the file, uint64. Then the kept bytes of all messages, uint8.
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

/// Return bytes as a frame of LZ4.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     Bytes to pack.
///
/// Returns
/// -------
/// bytes
///     Frame in the format of https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md.
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
