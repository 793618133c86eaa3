//! Allan and Hadamard deviations of a stream for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::Error;
use zerorate_core::allan::StreamingAllan as Core;
use zerorate_core::checkpoint::{self, Kind, Label};

use crate::arrays;
use crate::errors::NativeError;
use crate::shared::{self, exclusive, reading};

const LABEL: Label = Label { kind: Kind::StreamingAllan, p: 0, q: 0 };

/// Rows of which a channel's samples are gathered at a time.
const ROWS: usize = 1 << 10;

/// Allan and Hadamard deviations at all octaves while samples arrive.
///
/// Averaging times are 1, 2, 4, … samples. The estimators are the fully overlapping ones, which take
/// a difference at every sample, and equal those of the whole record to rounding. For that the
/// object keeps the last three times the longest averaging time: ``16 * 2**octaves`` bytes a channel,
/// 1 MiB for 16 octaves, however long the record. Estimators that overlap in part only would need a
/// few numbers an octave, and be less certain.
///
/// A sample that is not finite (or ``update(None)``) is missing, and every difference that would
/// need it is left out. One object serves one thread at a time.
///
/// Differences are taken of 32 samples together, so the work comes with every 32nd sample, bounded
/// and without allocation; what is read is always up to date.
///
/// Parameters
/// ----------
/// rate : float
///     Samples a second; it scales ``taus`` alone.
/// octaves : int, default 16
///     Number of averaging times, from 1 to 24; 16 reach 32768 samples.
/// channels : int, optional
///     Number of signals side by side; ``None`` is a single one.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
/// MemoryError
///     There is no memory for so many octaves and channels.
///
/// Notes
/// -----
/// The overlapping Allan and Hadamard variances of Riley, *Handbook of Frequency Stability Analysis*,
/// NIST SP 1065 (2008), section 5.2, with rates in place of fractional frequencies: mean squares of
/// the second and third differences of the phase over ``2 m**2`` and ``6 m**2``. The phase is the
/// running sum of distances from the first sample, or the first after a missing one. If the mean of n
/// samples lies D off it, rounding is as noise of deviation ``6e-17 * n * D`` on each sample.
///
/// Examples
/// --------
/// >>> import zerorate as zr
/// >>> allan = zr.StreamingAllan(rate=100.0, octaves=2)
/// >>> allan.process([1.0, 2.0, 0.0, 1.0])
/// >>> allan.taus.tolist(), allan.terms.tolist()
/// ([0.01, 0.02], [3, 1])
/// >>> allan.deviation.round(3).tolist()  # of 1, -2, 1; and of the averages 1.5 and 0.5
/// [1.0, 0.707]
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct StreamingAllan {
    rate: f64,
    channels: Option<usize>,
    /// One a channel.
    estimators: Vec<Core>,
}

#[pymethods]
impl StreamingAllan {
    #[new]
    #[pyo3(signature = (rate, octaves=16, channels=None))]
    fn new(rate: f64, octaves: i128, channels: Option<i128>) -> PyResult<Self> {
        check_rate(rate).map_err(NativeError::from)?;
        let octaves = check_octaves(octaves)?;
        let channels = shared::channels(channels)?;
        let estimators = (0..channels.unwrap_or(1)).map(|_| Core::new(octaves));
        let estimators = estimators.collect::<Result<_, _>>().map_err(NativeError::from)?;
        Ok(Self { rate, channels, estimators })
    }

    /// Takes one sample: a float, with channels (k,).
    #[inline]
    fn update(slf: &Bound<'_, Self>, z: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        match this.channels {
            None => this.estimators[0].observe(arrays::sample(z)?),
            Some(channels) => {
                let row = arrays::row(z, channels)?;
                this.estimators.iter_mut().zip(row).for_each(|(allan, z)| allan.observe(z));
            }
        }
        Ok(())
    }

    /// Takes a batch: (n,), with channels (n, k); the interpreter lock is released.
    #[pyo3(signature = (z, threads=None))]
    fn process(slf: &Bound<'_, Self>, z: &Bound<'_, PyAny>, threads: Option<i128>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let threads = shared::threads(threads)?;
        let samples = arrays::batch(z, this.channels)?;
        let estimators = &mut this.estimators[..];
        z.py().detach(|| extend(estimators, &samples.values, threads));
        Ok(())
    }

    /// Back to before the first sample.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.estimators.iter_mut().for_each(Core::reset);
        Ok(())
    }

    /// Parameters and state as bytes, with a format version and a checksum.
    fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        let this = reading(slf)?;
        let state = (this.rate, this.channels, &this.estimators);
        let bytes = checkpoint::to_vec(LABEL, &state).map_err(NativeError::from)?;
        Ok(PyBytes::new(slf.py(), &bytes))
    }

    /// The object that `to_bytes` saved; ValueError if the bytes are not one.
    #[staticmethod]
    fn from_bytes(b: &[u8]) -> PyResult<Self> {
        Ok(restored(b).map_err(NativeError::from)?)
    }

    /// An independent object in the same state.
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Self> {
        let this = reading(slf)?;
        Ok(Self { estimators: this.estimators.clone(), ..*this })
    }

    fn __copy__(slf: &Bound<'_, Self>) -> PyResult<Self> {
        Self::copy(slf)
    }

    fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::copy(slf)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let bytes = Self::to_bytes(slf)?;
        Ok((slf.get_type().getattr("from_bytes")?, (bytes,)))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let octaves = this.octaves();
        let channels = this.channels.map_or(String::new(), |k| format!(", channels={k}"));
        Ok(format!("StreamingAllan(rate={:?}, octaves={octaves}{channels})", this.rate))
    }

    /// Samples a second.
    #[getter]
    fn rate(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(reading(slf)?.rate)
    }

    /// Number of averaging times.
    #[getter(octaves)]
    fn octaves_of(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(reading(slf)?.octaves())
    }

    /// Number of signals, None for a single one.
    #[getter]
    fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
        Ok(reading(slf)?.channels)
    }

    /// Samples given so far, missing ones included.
    #[getter]
    fn samples_seen(slf: &Bound<'_, Self>) -> PyResult<u64> {
        Ok(reading(slf)?.estimators[0].samples_seen())
    }

    /// Averaging times in seconds: (octaves,).
    #[getter]
    fn taus<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let this = reading(slf)?;
        let taus: Vec<f64> = (0..this.octaves()).map(|j| 2f64.powi(j as i32) / this.rate).collect();
        arrays::array(slf.py(), taus, &[this.octaves()])
    }

    /// Allan deviation in the samples' unit, NaN without a term: (octaves,), with channels
    /// (octaves, k).
    #[getter]
    fn deviation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        reading(slf)?.table(slf.py(), |allan, j| allan.allan(j).0.sqrt())
    }

    /// Hadamard deviation, as ``deviation``; a constant angular acceleration leaves it alone.
    #[getter]
    fn hadamard_deviation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        reading(slf)?.table(slf.py(), |allan, j| allan.hadamard(j).0.sqrt())
    }

    /// Number of differences in each element of ``deviation``, int64.
    #[getter]
    fn terms<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        reading(slf)?.table(slf.py(), |allan, j| allan.allan(j).1 as i64)
    }

    /// Number of differences in each element of ``hadamard_deviation``, int64.
    #[getter]
    fn hadamard_terms<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        reading(slf)?.table(slf.py(), |allan, j| allan.hadamard(j).1 as i64)
    }
}

impl StreamingAllan {
    fn octaves(&self) -> usize {
        self.estimators[0].octaves()
    }

    /// One number an octave, a column a channel.
    fn table<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        number: impl Fn(&Core, usize) -> T,
    ) -> PyResult<Bound<'py, PyAny>> {
        let octaves = self.octaves();
        let rows = (0..octaves).flat_map(|j| self.estimators.iter().map(move |allan| (allan, j)));
        let numbers = rows.map(|(allan, j)| number(allan, j)).collect();
        match self.channels {
            None => arrays::array(py, numbers, &[octaves]),
            Some(k) => arrays::array(py, numbers, &[octaves, k]),
        }
    }
}

fn check_rate(rate: f64) -> Result<(), Error> {
    if rate > 0.0 && rate.is_finite() {
        return Ok(());
    }
    let expected = "a positive number of samples a second";
    Err(Error::Parameter { name: "rate", expected, value: rate })
}

fn check_octaves(given: i128) -> PyResult<usize> {
    let allowed = 1..=Core::OCTAVES_MAX;
    usize::try_from(given).ok().filter(|octaves| allowed.contains(octaves)).ok_or_else(|| {
        let most = Core::OCTAVES_MAX;
        PyValueError::new_err(format!("octaves must be from 1 to {most}, got {given}"))
    })
}

/// Gives every estimator its column of `rows`, the columns spread over `threads` threads.
fn extend(estimators: &mut [Core], rows: &[f64], threads: usize) {
    let channels = estimators.len();
    if let [alone] = estimators {
        return alone.extend(rows);
    }
    if threads < 2 {
        return extend_from(0, estimators, rows, channels);
    }
    let share = channels.div_ceil(threads);
    std::thread::scope(|scope| {
        for (i, estimators) in estimators.chunks_mut(share).enumerate() {
            scope.spawn(move || extend_from(i * share, estimators, rows, channels));
        }
    });
}

/// Gives the estimators of the channels from `first` on their columns.
fn extend_from(first: usize, estimators: &mut [Core], rows: &[f64], channels: usize) {
    let mut column = Vec::with_capacity(ROWS);
    for (c, estimator) in estimators.iter_mut().enumerate() {
        for block in rows.chunks(ROWS * channels) {
            column.clear();
            column.extend(block.iter().skip(first + c).step_by(channels));
            estimator.extend(&column);
        }
    }
}

fn restored(bytes: &[u8]) -> Result<StreamingAllan, Error> {
    let (rate, channels, estimators): (f64, Option<usize>, Vec<Core>) =
        checkpoint::read(LABEL, bytes)?;
    let shape = |allan: &Core| (allan.octaves(), allan.samples_seen());
    let alike = estimators.windows(2).all(|pair| shape(&pair[0]) == shape(&pair[1]));
    if check_rate(rate).is_err()
        || estimators.is_empty()
        || estimators.len() != channels.unwrap_or(1)
        || !alike
    {
        return Err(Error::Content);
    }
    Ok(StreamingAllan { rate, channels, estimators })
}
