//! The recursive Allan variance for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::allan::{self as core, AllanKind};
use zerorate_core::checkpoint::{self, Kind, Label};
use zerorate_core::{Bank, Error};

use crate::errors::NativeError;
use crate::shared::{self, Shared, exclusive, reading};
use crate::stream::{Labelled, Stream};

const LABEL: Label = Label { kind: Kind::AllanNoise, p: 0, q: 0 };

/// The variance that a name stands for.
pub fn kind(name: &str) -> PyResult<AllanKind> {
    match name {
        "allan" => Ok(AllanKind::Allan),
        "hadamard" => Ok(AllanKind::Hadamard),
        _ => {
            Err(PyValueError::new_err(format!("noise must be 'allan' or 'hadamard', got '{name}'")))
        }
    }
}

/// The name of a variance.
pub fn name(kind: AllanKind) -> &'static str {
    match kind {
        AllanKind::Allan => "allan",
        AllanKind::Hadamard => "hadamard",
    }
}

type Filters = Labelled<core::AllanNoise<f64>>;

/// Measurement noise variance R while samples arrive, from the Allan variance at the shortest
/// averaging time with fading memory.
///
/// ``R = (1 - w) R + w (z[k] - z[k-1])**2 / 2`` with ``1/w = 1 + fading / w_before`` (Fu & Han 2019,
/// equations 17, 18 and 26 to 31). One that is not finite is a missing sample; differences across
/// it are left out. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// fading : float, default 0.97
///     Memory b in (0, 1]: the weight of a difference falls by this factor a sample. Small follows
///     changes quickly, large averages; 1 weighs all alike and equals the Allan variance of the
///     whole record.
/// noise : {"allan", "hadamard"}, default "allan"
///     First differences, or second differences ``(z[k] - 2 z[k-1] + z[k-2])**2 / 6``, which a
///     constant angular acceleration leaves alone.
/// floor : float, default 0.0
///     Smallest variance to answer, in the square of the samples' unit. Equal samples, as a coarsely
///     quantised gyro at rest gives them, drive R to zero.
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
/// >>> import zerorate as zr
/// >>> noise = zr.AllanNoise(fading=1.0)
/// >>> float(noise.process([1.0, 2.0, 0.0])[-1])  # ((2-1)**2 + (0-2)**2) / 2 / 2
/// 1.25
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct AllanNoise {
    fading: f64,
    noise: AllanKind,
    shared: Shared<Filters>,
}

#[pymethods]
impl AllanNoise {
    #[new]
    #[pyo3(signature = (fading=0.97, noise="allan", floor=0.0, channels=None))]
    fn new(fading: f64, noise: &str, floor: f64, channels: Option<i128>) -> PyResult<Self> {
        let channels = shared::channels(channels)?;
        let noise = kind(noise)?;
        let filter = core::AllanNoise::new(fading, noise, floor).map_err(NativeError::from)?;
        let bank = Bank::new(&filter, channels.unwrap_or(1));
        Ok(Self::wrap(channels, bank))
    }

    /// Takes one sample, answers R: float to float, with channels (k,) to (k,).
    #[inline]
    fn update<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.update(z)
    }

    /// R after each sample of a batch: (n,) to (n,), with channels (n, k) to (n, k); the
    /// interpreter lock is released.
    #[pyo3(signature = (z, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.process(z, out, threads)
    }

    /// Back to before the first sample.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.filter.reset();
        Ok(())
    }

    /// Parameters and state as bytes, with a format version and a checksum.
    fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        reading(slf)?.shared.to_bytes(slf.py())
    }

    /// The object that `to_bytes` saved; ValueError if the bytes are not one.
    #[staticmethod]
    fn from_bytes(b: &[u8]) -> PyResult<Self> {
        let (channels, bank): (Option<usize>, Bank<core::AllanNoise<f64>>) =
            checkpoint::read(LABEL, b).map_err(NativeError::from)?;
        if bank.filters().len() != channels.unwrap_or(1) || bank.filters().is_empty() {
            return Err(NativeError::from(Error::Content).into());
        }
        Ok(Self::wrap(channels, bank))
    }

    /// An independent object in the same state.
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Self> {
        let this = reading(slf)?;
        Ok(Self::wrap(this.shared.channels, this.shared.filter.bank.clone()))
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
        Ok(format!("AllanNoise(fading={:?}, noise='{}')", this.fading, name(this.noise)))
    }

    /// R so far, in the square of the samples' unit: float, with channels (k,).
    #[getter]
    fn variance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let this = reading(slf)?;
        let values = this.shared.filter.bank.filters().iter().map(|f| f.variance()).collect();
        this.shared.numbers(slf.py(), values)
    }

    /// Number of signals, None for a single one.
    #[getter]
    fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
        Ok(reading(slf)?.shared.channels)
    }
}

impl AllanNoise {
    fn wrap(channels: Option<usize>, bank: Bank<core::AllanNoise<f64>>) -> Self {
        let filter = bank.filters()[0];
        Self {
            fading: filter.fading(),
            noise: filter.kind(),
            shared: Shared::new(channels, Box::new(Labelled { label: LABEL, bank })),
        }
    }
}
