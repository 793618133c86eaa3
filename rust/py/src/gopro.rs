//! Telemetry in videos of GoPro cameras, for Python.

use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::gopro::{Fault, MARKS, Telemetry};

use crate::common::errors::NativeError;
use crate::common::work::interruptible;

/// Bytes that take as long as a sample of a filter.
const BYTES_A_SAMPLE: usize = 256;

/// Numbers of a packet.
const PACKET_WIDTH: usize = 3 + MARKS.len();

type Bytes<'py> = Bound<'py, PyBytes>;
/// Key, description, unit and axes of a stream, its values, and its packets.
type Stream<'py> = (
    Bytes<'py>,
    Bytes<'py>,
    Bytes<'py>,
    Bytes<'py>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);
/// Camera, streams, names of the other streams, and counts of all and of damaged packets.
type Content<'py> = (Bytes<'py>, Vec<Stream<'py>>, Vec<Bytes<'py>>, [usize; 2]);

/// Return the sensors in the telemetry of a video.
///
/// Parameters
/// ----------
/// raw : ndarray of uint8, shape (n,)
///     Bytes of the video. They must not change during the call.
/// wanted : list of bytes
///     Keys of the streams to return, such as ``b"GYRO"``.
///
/// Returns
/// -------
/// camera : bytes
///     Model of the camera, empty if not given.
/// streams : list of tuple
///     For each stream: key, description, unit, axes of the channels, values, shape (n, width), and
///     one row for each packet, shape (k, 8): index of its first sample; start and duration in the
///     video, s; number of samples to date (TSMP); clock, us (STMP), and clock, ms (TICK), of the
///     first sample; temperature, degC (TMPC); kind of fix (GPSF). Absent numbers are NaN.
/// others : list of bytes
///     Descriptions of the other streams.
/// counts : (int, int)
///     Number of packets, and number of damaged packets, which are left out.
///
/// None is returned if the video has no telemetry of a GoPro.
///
/// Raises
/// ------
/// ValueError
///     If the index of the packets is damaged.
/// TypeError
///     If the bytes are not contiguous.
#[pyfunction]
pub fn read_gopro<'py>(
    py: Python<'py>,
    raw: PyReadonlyArray1<'py, u8>,
    wanted: Vec<[u8; 4]>,
) -> PyResult<Option<Content<'py>>> {
    let bytes = raw.as_slice()?;
    let read = || Telemetry::read(bytes, &wanted);
    let telemetry = match interruptible(py, bytes.len() / BYTES_A_SAMPLE, read)? {
        Ok(telemetry) => telemetry,
        Err(Fault::Absent) => return Ok(None),
        Err(Fault::Memory(error)) => return Err(NativeError::from(error).into()),
        Err(fault) => return Err(PyValueError::new_err(fault.to_string())),
    };
    let text = |bytes: &[u8]| PyBytes::new(py, bytes);
    let streams = telemetry.streams.into_iter().map(|stream| {
        let samples = stream.values.len() / stream.width;
        let values = stream.values.into_pyarray(py).reshape([samples, stream.width])?;
        let rows = stream.packets.iter().flat_map(|packet| {
            [packet.begin as f64].into_iter().chain(packet.span).chain(packet.marks)
        });
        let packets = rows.collect::<Vec<_>>().into_pyarray(py);
        let packets = packets.reshape([stream.packets.len(), PACKET_WIDTH])?;
        let [name, unit, axes] = [&stream.name, &stream.unit, &stream.axes].map(|own| text(own));
        Ok((text(&stream.key), name, unit, axes, values, packets))
    });
    let others = telemetry.others.iter().map(|name| text(name)).collect();
    let streams = streams.collect::<PyResult<_>>()?;
    Ok(Some((text(&telemetry.camera), streams, others, telemetry.packets)))
}
