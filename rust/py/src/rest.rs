//! The rest detector for Python.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes};
use zerorate_core::checkpoint::{self, Kind, Label};
use zerorate_core::{Bank, Error, RestDetector as Core};

use crate::arrays;
use crate::errors::NativeError;
use crate::shared::{self, Shared, exclusive, reading};
use crate::stream::{Labelled, Stream};

const LABEL: Label = Label { kind: Kind::RestDetector, p: 0, q: 0 };

type Detectors = Bank<Core<f64>>;

/// Whether a gyro rests, told from its own output alone while samples arrive.
///
/// Samples are put together to ticks of a quarter of a second, four samples at least. How much they
/// vary within a tick at rest, and how far the level of a tick lies from averages of 1, 4 and 16 s,
/// is learned; a tick beyond what chance does once in a million ends the rest, 1.5 s near the level
/// of the last rest begin the next. Nothing depends on the unit, nor on a constant added.
///
/// The start is taken for rest after 1.5 s that look like noise. If that turns out to be wrong within
/// 10 s, no rest is believed in that has not lasted for 10 s. Slow turning at one rate and a bias
/// look alike: a new level that stands still is taken for rest after 10 s if it is near, after 60 s
/// if it lies five deviations of the samples off; so is a new noise, such as an engine's. What was
/// known before is kept and returned to in 1.5 s. Turning at less than about half of the samples'
/// deviation may pass for drift.
///
/// One that is not finite is a missing sample. A channel is judged by itself. One object serves one
/// thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples a second.
/// channels : int, optional
///     Number of signals side by side; ``None`` is a single one.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> z = np.random.default_rng(1).standard_normal(6000)
/// >>> z[3000:4000] += 50.0 * np.sin(np.arange(1000) / 100.0)
/// >>> rest = zr.RestDetector(rate=100.0).process(z)
/// >>> (np.flatnonzero(np.diff(rest)) + 1).tolist()  # begins at 1.5 s, ends at 30.25, begins at 41.5
/// [149, 3024, 4149]
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct RestDetector {
    rate: f64,
    shared: Shared<Labelled<Core<f64>>>,
}

#[pymethods]
impl RestDetector {
    #[new]
    #[pyo3(signature = (rate, channels=None))]
    fn new(rate: f64, channels: Option<i128>) -> PyResult<Self> {
        let channels = shared::channels(channels)?;
        let detector = Core::new(rate).map_err(NativeError::from)?;
        Ok(Self::wrap(rate, channels, Bank::new(&detector, channels.unwrap_or(1))))
    }

    /// Takes one sample, answers whether the sensor rests: float to bool, with channels (k,) to (k,).
    #[inline]
    fn update<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        match this.shared.channels {
            None => this.shared.filter.update(arrays::sample(z)?),
            Some(channels) => {
                this.shared.filter.update_row(&mut arrays::row(z, channels)?);
                0.0
            }
        };
        this.answers(slf.py())
    }

    /// Whether the sensor rests after each sample of a batch: (n,) to (n,), with channels (n, k) to
    /// (n, k); the interpreter lock is released.
    #[pyo3(signature = (z, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let threads = shared::threads(threads)?;
        let mut samples = arrays::batch(z, this.shared.channels)?;
        let filter = &mut *this.shared.filter;
        let answers: Vec<bool> = z.py().detach(|| {
            filter.process(&mut samples.values, threads);
            samples.values.iter().map(|answer| *answer == 1.0).collect()
        });
        arrays::array(z.py(), answers, &samples.shape)
    }

    /// Back to before the first sample.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.filter.reset();
        Ok(())
    }

    /// Parameters and state as bytes, with a format version and a checksum.
    fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        let this = reading(slf)?;
        let state = (this.rate, this.shared.channels, &this.shared.filter.bank);
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
        Ok(Self::wrap(this.rate, this.shared.channels, this.shared.filter.bank.clone()))
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
        let channels = this.shared.channels.map_or(String::new(), |k| format!(", channels={k}"));
        Ok(format!("RestDetector(rate={:?}{channels})", this.rate))
    }

    /// Whether the sensor rests: bool, with channels (k,).
    #[getter]
    fn at_rest<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        reading(slf)?.answers(slf.py())
    }

    /// Samples a second.
    #[getter]
    fn rate(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(reading(slf)?.rate)
    }

    /// Number of signals, None for a single one.
    #[getter]
    fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
        Ok(reading(slf)?.shared.channels)
    }
}

impl RestDetector {
    fn wrap(rate: f64, channels: Option<usize>, bank: Detectors) -> Self {
        Self { rate, shared: Shared::new(channels, Box::new(Labelled { label: LABEL, bank })) }
    }

    fn answers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let detectors = self.shared.filter.bank.filters();
        match self.shared.channels {
            None => Ok(PyBool::new(py, detectors[0].at_rest()).to_owned().into_any()),
            Some(k) => arrays::array(py, detectors.iter().map(Core::at_rest).collect(), &[k]),
        }
    }
}

fn restored(bytes: &[u8]) -> Result<RestDetector, Error> {
    let (rate, channels, bank): (f64, Option<usize>, Detectors) = checkpoint::read(LABEL, bytes)?;
    let fresh = Core::<f64>::new(rate).map_err(|_| Error::Content)?;
    let fits = bank.filters().len() == channels.unwrap_or(1)
        && !bank.filters().is_empty()
        && bank.filters().iter().all(|detector| detector.is_like(&fresh));
    if !fits {
        return Err(Error::Content);
    }
    Ok(RestDetector::wrap(rate, channels, bank))
}
