//! Allan variances of streams for Python: as measurement noise, and at all octaves.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::Bank;
use zerorate_core::allan::{self as core, AllanKind};

use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, reading, streaming, text};

/// Measurement noise variance R: the Allan variance at an averaging time of one sample interval.
///
/// R is an average with fading memory: ``R = (1 - w) R + w (z[k] - z[k-1])**2 / 2`` with
/// ``1/w = 1 + fading / w_before`` (Fu & Han 2019, equations 17, 18 and 26 to 31). A sample that is
/// not finite is missing, and differences with it are left out. One object serves one thread at a
/// time.
///
/// Parameters
/// ----------
/// fading : float, default 0.97
///     Fading factor b in (0, 1]: the weight of a difference falls by this factor at each sample. A
///     small factor follows changes quickly, a large factor averages. With 1 all differences have
///     equal weight, and R is the Allan variance of the whole record.
/// noise : {"allan", "hadamard"}, default "allan"
///     ``"allan"`` uses first differences. ``"hadamard"`` uses second differences,
///     ``(z[k] - 2 z[k-1] + z[k-2])**2 / 6``, which a constant angular acceleration does not
///     change.
/// floor : float, default 0.0
///     Smallest variance to return, in the square of the samples' unit. A coarsely quantised gyro
///     repeats one value at rest; without a floor, R would then fall to zero.
/// channels : int, optional
///     Number of signals; ``None`` is a single signal without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import zerorate as zr
/// >>> noise = zr.noise.AllanNoise(fading=1.0)
/// >>> float(noise.process([1.0, 2.0, 0.0])[-1])  # ((2-1)**2 + (0-2)**2) / 2 / 2
/// 1.25
#[pyclass(generic, module = "zerorate.noise")]
#[derive(Debug)]
pub struct AllanNoise {
    shared: Shared<Bank<core::AllanNoise<f64>>>,
}

streaming!(
    AllanNoise,
    update: "Process one sample and return the noise variance R.

    Sample and variance are floats, or arrays (k,) with k channels.",
    process: "Return the noise variance R after each sample of a batch.

    Samples and variances are (n,), or (n, k) with k channels. The interpreter lock is released.",
    out
);
streaming!(@bank AllanNoise, core::AllanNoise<f64>);

#[pymethods]
impl AllanNoise {
    #[new]
    #[pyo3(signature = (fading=0.97, noise="allan", floor=0.0, *, channels=None))]
    fn new(fading: f64, noise: &str, floor: f64, channels: Option<i128>) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let kind = AllanKind::of_name(noise).ok_or_else(|| {
            PyValueError::new_err(format!("noise must be 'allan' or 'hadamard', got '{noise}'"))
        })?;
        let noise = core::AllanNoise::new(fading, kind, floor).map_err(NativeError::from)?;
        let bank = Bank::new(&noise, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let noise = this.first();
        let arguments = [
            ("fading", text(noise.fading()), "0.97"),
            ("noise", format!("'{}'", noise.kind().name()), "'allan'"),
            ("floor", text(noise.floor()), "0.0"),
        ];
        Ok(call("AllanNoise", &arguments, this.shared.channels))
    }
}

getters! { AllanNoise, slf, py, this;
    /// Present variance R, in the square of the samples' unit.
    ///
    /// A float, or an array (k,) with k channels.
    variance: Object<'py> = this.shared.each(py, |noise| noise.variance())?;
}

/// Allan and Hadamard deviations of a stream at all octaves.
///
/// Averaging times are 1, 2, 4, … samples. The estimators are fully overlapping: they take a
/// difference at every sample. The deviations equal the deviations of the whole record to rounding.
/// The memory does not depend on the length of the record. It is ``16 * 2**octaves`` bytes per
/// channel, 1 MiB for 16 octaves.
///
/// A sample that is not finite (or ``update(None)``) is missing, and every difference that needs it
/// is left out. One object serves one thread at a time.
///
/// Differences are computed for 32 samples together: every 32nd sample does the work, in bounded
/// time and without allocation. The properties are always up to date.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second; only ``taus`` depends on it.
/// octaves : int, default 16
///     Number of averaging times, from 1 to 24. With 16 the longest averaging time is 32768
///     samples.
/// channels : int, optional
///     Number of signals; ``None`` is a single signal without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
/// MemoryError
///     There is not enough memory for these octaves and channels.
///
/// Notes
/// -----
/// The overlapping Allan and Hadamard variances of Riley, *Handbook of Frequency Stability
/// Analysis*, NIST SP 1065 (2008), section 5.2. Rates take the place of fractional frequencies. The
/// variances are the mean squares of the second and third differences of the phase, divided by
/// ``2 m**2`` and ``6 m**2``. The phase is the running sum of the samples, each minus an offset.
/// The offset is the first sample. After a missing sample the sum begins again, with the next
/// sample as offset. If the mean of n samples differs from their offset by D, rounding acts as
/// noise of standard deviation ``6e-17 * n * D`` on each sample.
///
/// Examples
/// --------
/// >>> import zerorate as zr
/// >>> allan = zr.StreamingAllan(rate=100.0, octaves=2)
/// >>> allan.process([1.0, 2.0, 0.0, 1.0])
/// >>> allan.taus.tolist(), allan.term_count.tolist()
/// ([0.01, 0.02], [3, 1])
/// >>> allan.deviation.round(3).tolist()  # of 1, -2, 1; and of the averages 1.5 and 0.5
/// [1.0, 0.707]
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct StreamingAllan {
    shared: Shared<Bank<core::StreamingAllan>>,
}

streaming!(
    StreamingAllan,
    update: "Process one sample: a float, or an array (k,) with k channels.",
    process: "Process a batch, shape (n,), or (n, k) with k channels.

    The interpreter lock is released."
);
streaming!(@bank StreamingAllan, core::StreamingAllan);

#[pymethods]
impl StreamingAllan {
    #[new]
    #[pyo3(signature = (rate, octaves=16, *, channels=None))]
    fn new(rate: f64, octaves: i128, channels: Option<i128>) -> PyResult<Self> {
        let most = core::StreamingAllan::MAX_OCTAVES;
        let octaves =
            usize::try_from(octaves).ok().filter(|n| (1..=most).contains(n)).ok_or_else(|| {
                PyValueError::new_err(format!("octaves must be from 1 to {most}, got {octaves}"))
            })?;
        let channels = streaming::channels(channels)?;
        let allan = core::StreamingAllan::new(rate, octaves).map_err(NativeError::from)?;
        let bank = Bank::new(&allan, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let (rate, octaves) = (this.first().rate(), this.first().octaves());
        let arguments = [("rate", text(rate), ""), ("octaves", octaves.to_string(), "16")];
        Ok(call("StreamingAllan", &arguments, this.shared.channels))
    }
}

getters! { StreamingAllan, slf, py, this;
    /// Samples per second.
    rate: f64 = this.first().rate();
    /// Number of averaging times.
    octaves: usize = this.first().octaves();
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Averaging times, s, shape (octaves,).
    taus: Object<'py> = {
        let first = this.first();
        let taus = (0..first.octaves()).map(|j| first.tau(j)).collect();
        arrays::array(py, taus, &[first.octaves()])?
    };
    /// Allan deviation in the samples' unit.
    ///
    /// It is NaN for an averaging time without a difference. An array (octaves,), or (octaves, k)
    /// with k channels.
    deviation: Object<'py> = this.table(py, |allan, j| allan.allan(j).0.sqrt())?;
    /// Hadamard deviation, with the unit and shape of ``deviation``.
    ///
    /// A constant angular acceleration does not change it.
    hadamard_deviation: Object<'py> = this.table(py, |allan, j| allan.hadamard(j).0.sqrt())?;
    /// Number of differences in each element of ``deviation``, int64.
    term_count: Object<'py> = this.table(py, |allan, j| allan.allan(j).1 as i64)?;
    /// Number of differences in each element of ``hadamard_deviation``, int64.
    hadamard_term_count: Object<'py> = this.table(py, |allan, j| allan.hadamard(j).1 as i64)?;
}

impl StreamingAllan {
    /// One number per octave, and one column per channel.
    fn table<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        number: impl Fn(&core::StreamingAllan, usize) -> T,
    ) -> PyResult<Bound<'py, PyAny>> {
        let octaves = self.first().octaves();
        let streams = self.shared.bank.streams();
        let rows = (0..octaves).flat_map(|j| streams.iter().map(move |allan| (allan, j)));
        let numbers = rows.map(|(allan, j)| number(allan, j)).collect();
        let axes: Vec<usize> = [octaves].into_iter().chain(self.shared.channels).collect();
        arrays::array(py, numbers, &axes)
    }
}
