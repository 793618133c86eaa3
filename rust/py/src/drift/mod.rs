//! The drift filter for Python.

pub mod any;
mod channel;
mod readings;
mod settings;
mod start;
pub mod trace;

use numpy::{PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::Params;

use self::any::{AnyDrift, Order};
use self::readings::Beside;
use self::settings::{Arguments, Settings};
use self::trace::{Readings, Trace};
use crate::errors::NativeError;
use crate::shared::{self, Shared, exclusive, reading};
use crate::{allan, arrays, blocks};

/// Online random-drift filter of a gyro, one or more axes.
///
/// ``"auto"`` needs no tuning: it finds rest and motion itself, weighs random walks of every
/// strength by their likelihood, learns the drift at rest and holds it in motion.
///
/// The other methods are those of Fu & Han 2019, equations 8 to 31: an ARMA(p, q) model of the drift
/// by recursive least squares, the measurement noise R from the Allan variance at the shortest
/// averaging time, the process noise G by Sage-Husa, and the Kalman filter of that model.
///
/// Nothing needs a unit: offset and scale come from the first samples, during which the answer is
/// the mean so far. A sample that is not finite (or ``update(None)``) is missing: it is predicted,
/// not corrected. One filter serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples a second.
/// order : (int, int), default (2, 1)
///     Orders p from 1 to 3 and q from 0 to 3; (p, 0) is AR(p).
/// method : {"kf", "akf", "fading", "auto"}, default "fading"
///     ``"kf"`` keeps G and R as the start-up says; ``"akf"`` adapts R with equal weights;
///     ``"fading"`` adapts R with fading memory, and G. ``"auto"`` tunes itself and takes, of the
///     parameters, only rate, channels, motion, output, startup and scale.
/// fading : float, default 0.97
///     Memory b of R in (0, 1] for ``"fading"``: small follows changes of the noise quickly, large
///     averages (Fu & Han: 0.95 to 0.99 for an MTi-100, 0.90 to 0.95 for a 3DM-GX4-25).
/// adapt_for : float or None, default 120.0
///     Seconds after the start-up during which the model is learned; None is always.
/// forgetting_factor : float, default 1.0
///     λ of the least squares in (0, 1]: small forgets old samples quickly, 1 never forgets.
/// channels : int, optional
///     Number of signals side by side; None is a single one.
/// motion : {"hold", "ignore"}, optional
///     ``"hold"`` learns at rest only, as a ``RestDetector`` sees it, and takes back what came just
///     before a motion was seen (half a second, for ``"auto"`` up to two); ``"ignore"`` takes every
///     sample for rest, as the published filters do. Default: ``"hold"`` for ``"auto"``, ``"ignore"``
///     for the others.
/// output : {"estimate", "compensated"}, default "estimate"
///     What ``update`` and ``process`` answer: the estimate, or the sample minus ``bias``, which has
///     no delay (NaN for a missing sample).
/// process_noise : float, default 0.1
///     Initial process noise G and covariance P, in variances of the start-up window. Large follows
///     the signal, small smooths it.
/// process_noise_memory : float, default 0.0
///     Samples that the initial G counts for besides those seen: large keeps it longer.
/// noise : {"allan", "hadamard"}, default "allan"
///     Variance that R is taken from; "hadamard" ignores a constant angular acceleration.
/// startup : float, default 1.0
///     Seconds from which offset, scale and first noise are learned (at least ten samples, and
///     until two samples differ).
/// scale : float, optional
///     Deviation of the noise in the samples' unit where it is known; else it is learned.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
/// >>> f = zr.DriftFilter(rate=100.0)
/// >>> bool(f.process(z).std() < 0.6 * z.std())
/// True
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct DriftFilter {
    settings: Settings,
    shared: Shared<dyn AnyDrift>,
}

#[pymethods]
impl DriftFilter {
    #[new]
    #[pyo3(signature = (
        rate, order=Order::default(), method="fading", fading=0.97, adapt_for=Some(120.0),
        forgetting_factor=1.0, channels=None, *, motion=None, output="estimate", process_noise=0.1,
        process_noise_memory=0.0, noise="allan", startup=1.0, scale=None,
    ), text_signature = "(rate, order=(2, 1), method='fading', fading=0.97, adapt_for=120.0, \
        forgetting_factor=1.0, channels=None, *, motion=None, output='estimate', \
        process_noise=0.1, process_noise_memory=0.0, noise='allan', startup=1.0, scale=None)")]
    #[allow(clippy::too_many_arguments)]
    fn new(
        rate: f64,
        order: Order,
        method: &str,
        fading: f64,
        adapt_for: Option<f64>,
        forgetting_factor: f64,
        channels: Option<i128>,
        motion: Option<&str>,
        output: &str,
        process_noise: f64,
        process_noise_memory: f64,
        noise: &str,
        startup: f64,
        scale: Option<f64>,
    ) -> PyResult<Self> {
        let params = Params {
            rate,
            fading,
            noise: allan::kind(noise)?,
            adapt_for,
            forgetting_factor,
            process_noise,
            process_noise_memory,
            startup,
            scale,
            ..Params::default()
        };
        let params = params.checked().map_err(NativeError::from)?;
        let settings = Settings::read(Arguments { order, method, motion, output, params })?;
        let channels = shared::channels(channels)?;
        let filter = any::new(settings, channels.unwrap_or(1))?;
        Ok(Self::wrap(channels, filter))
    }

    /// A filter that is ready at its first sample because its signal is known already.
    ///
    /// ``ArmaModel.to_filter`` makes such filters from a record. R and the weight of Sage-Husa
    /// stand as if ``startup`` seconds had been spent; ``process_noise`` and ``scale`` of the
    /// parameters are not used.
    ///
    /// Parameters
    /// ----------
    /// start : dict
    ///     With channels every array has a first axis (k,). ``offset`` and ``scale``, the mean and
    ///     deviation of the signal; ``coefficients`` [φ…, θ…, c], (p + q + 1,); ``covariance`` of
    ///     [φ…, θ…, c / scale] over the noise variance, samples being centred and scaled,
    ///     (p + q + 1, p + q + 1); variances ``measurement_noise`` R and ``process_noise`` G₀₀;
    ///     ``state_covariance`` P before the first sample, (p + 1, p + 1).
    /// **params
    ///     Those of ``DriftFilter``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A parameter or a part of the start is missing, of another shape, or out of range.
    /// TypeError
    ///     A part of the start does not hold numbers.
    #[staticmethod]
    #[pyo3(signature = (start, **params))]
    fn started(start: &Bound<'_, PyDict>, params: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let plain = start.py().get_type::<Self>().call((), params)?;
        let plain = plain.cast::<Self>()?.borrow();
        let order = plain.settings.order().ok_or_else(any::start_error)?;
        let starts = start::read(start, plain.shared.channels, order)?;
        let filter = any::started(plain.settings, &starts)?;
        Ok(Self::wrap(plain.shared.channels, filter))
    }

    /// Takes one sample, answers the filtered rate at once: float to float, with channels (k,) to
    /// (k,).
    #[inline]
    fn update<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.update(z)
    }

    /// Filters a batch, equal to the last bit to ``update`` sample by sample.
    ///
    /// Parameters
    /// ----------
    /// z : array_like, shape (n,), with channels (n, k)
    ///     Samples; those not finite are missing.
    /// out : ndarray, optional
    ///     A float64 array of the same shape for the answers; may be ``z`` itself.
    /// threads : int, optional
    ///     Threads over which several channels are spread, as far as they do not share a vector
    ///     register; the result does not depend on it.
    ///
    /// Returns
    /// -------
    /// ndarray, float64, shape of ``z``
    ///     The filtered rate, in the unit of ``z``. The interpreter lock is released meanwhile.
    #[pyo3(signature = (z, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.process(z, out, threads)
    }

    /// ``process`` for a replay: a row an axis in, (k, n), the drift out, and beside it, if asked for,
    /// what the trace says of its deviation and of rest. The interpreter lock is released.
    #[pyo3(signature = (z, out, bias_sigma=None, at_rest=None))]
    fn _replay(
        slf: &Bound<'_, Self>,
        z: PyReadonlyArray2<'_, f64>,
        mut out: PyReadwriteArray2<'_, f64>,
        bias_sigma: Option<PyReadwriteArray2<'_, f64>>,
        at_rest: Option<PyReadwriteArray2<'_, bool>>,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let shape = [this.shared.channels.unwrap_or(1), z.shape()[1]];
        blocks::check("z", z.shape(), &shape)?;
        blocks::check("out", out.shape(), &shape)?;
        let (mut bias_sigma, mut at_rest) = (bias_sigma, at_rest);
        let beside = match (&mut bias_sigma, &mut at_rest) {
            (Some(sigma), Some(rest)) => {
                blocks::check("bias_sigma", sigma.shape(), &shape)?;
                blocks::check("at_rest", rest.shape(), &shape)?;
                Some(Beside {
                    bias_sigma: blocks::rows_mut("bias_sigma", sigma.as_array_mut())?,
                    at_rest: blocks::rows_mut("at_rest", rest.as_array_mut())?,
                })
            }
            _ => None,
        };
        let z = z.as_array();
        let z = blocks::rows("z", &z)?;
        let mut out = blocks::rows_mut("out", out.as_array_mut())?;
        let filter = &mut *this.shared.filter;
        slf.py().detach(|| readings::replay(filter, &z, &mut out, beside));
        Ok(())
    }

    /// Like ``process``, but answers a ``Trace`` of all that the filter knew after each sample.
    fn trace(slf: &Bound<'_, Self>, z: &Bound<'_, PyAny>) -> PyResult<Trace> {
        let py = z.py();
        let mut this = exclusive(slf)?;
        let samples = arrays::batch(z, this.shared.channels)?;
        let filter = &mut *this.shared.filter;
        let record = py.detach(|| filter.trace(&samples.values));
        Trace::new(py, record, this.shared.channels, this.settings.sizes())
    }

    /// Back to before the first sample, with the same parameters and the same start.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.filter.reset();
        Ok(())
    }

    /// Forgets the drift, but not what was learned about the noise: for a sensor that was switched
    /// off and on, whose drift begins anew and whose noise does not.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The method is not ``"auto"``.
    fn power_on(slf: &Bound<'_, Self>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        if this.shared.filter.power_on() {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "power_on() is for method 'auto', this is '{}': make a new filter or reset() it",
            this.settings.method()
        )))
    }

    /// Parameters and state as bytes, with a format version and a checksum.
    fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        reading(slf)?.shared.to_bytes(slf.py())
    }

    /// The filter that ``to_bytes`` saved, which goes on equal to the last bit; ValueError if the
    /// bytes are no such filter.
    #[staticmethod]
    fn from_bytes(b: &[u8]) -> PyResult<Self> {
        let (channels, filter) = any::from_bytes(b).map_err(NativeError::from)?;
        Ok(Self::wrap(channels, filter))
    }

    /// An independent filter in the same state.
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Self> {
        let this = reading(slf)?;
        Ok(Self::wrap(this.shared.channels, this.shared.filter.clone_box()))
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
        let settings = &this.settings;
        let model = match settings {
            Settings::Published { order, params, .. } => {
                format!(
                    ", order={order:?}, method='{}', fading={:?}",
                    settings.method(),
                    params.fading
                )
            }
            Settings::Auto(_) => ", method='auto'".to_owned(),
        };
        Ok(format!("DriftFilter(rate={:?}{model}{channels})", settings.rate()))
    }

    /// The last filtered rate: float, with channels (k,).
    #[getter]
    fn estimate<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.estimate)
    }

    /// The last sample minus its prediction, zero if it was missing: float, with channels (k,).
    #[getter]
    fn innovation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.innovation)
    }

    /// Variance of the innovation: float, with channels (k,).
    #[getter]
    fn innovation_variance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.innovation_variance)
    }

    /// The drift learned at rest, held in motion: float, with channels (k,). The estimate for
    /// every method.
    #[getter]
    fn bias<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.bias)
    }

    /// Standard deviation of the bias as the filter sees it: float, with channels (k,). Before
    /// anything is known, the size of the largest sample.
    #[getter]
    fn bias_sigma<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.bias_sigma)
    }

    /// The sensor is not seen to move, so the filter learns: bool, with channels (k,). Always true
    /// with ``motion="ignore"``.
    #[getter]
    fn at_rest<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let at_rest = this.shared.filter.readings().iter().map(|r| r.at_rest).collect();
        this.shared.numbers(py, at_rest)
    }

    /// What the filter is doing: ``"starting"`` (the bias is the mean so far), ``"at rest"`` (it
    /// learns), ``"in motion"`` (it holds the bias) or ``"no rest yet"`` (the sensor moved before
    /// anything was learned; the bias is 0). With channels a list of k.
    #[getter]
    fn status<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let status = this.shared.filter.status();
        match this.shared.channels {
            None => status[0].into_bound_py_any(py),
            Some(_) => status.into_bound_py_any(py),
        }
    }

    /// Density of the white noise as learned, unit of the samples over root Hz: float, with channels
    /// (k,). For ``"auto"`` of noise slower than a quarter second, for the others from R. NaN until
    /// it is known.
    #[getter]
    fn angle_random_walk<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.shared.numbers(py, this.density(0))
    }

    /// How far the drift walks in a root second as learned by ``"auto"``, unit of the samples: float,
    /// with channels (k,). NaN until it is known, and for the other methods.
    #[getter]
    fn rate_random_walk<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.shared.numbers(py, this.density(1))
    }

    /// Measurement noise variance R: float, with channels (k,).
    #[getter]
    fn measurement_noise<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.number(py, |r| r.measurement_noise)
    }

    /// Kalman gain: (p + 1,), with channels (k, p + 1).
    #[getter]
    fn gain<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.array(py, &[this.settings.sizes().0], |r| &r.gain)
    }

    /// Process noise covariance G: (p + 1, p + 1), with channels (k, p + 1, p + 1).
    #[getter]
    fn process_noise<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.array(py, &[this.settings.sizes().0; 2], |r| &r.process_noise)
    }

    /// Model ``[φ…, θ…, c]``, c in the unit of the samples: (p + q + 1,), with channels
    /// (k, p + q + 1).
    #[getter]
    fn coefficients<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.array(py, &[this.settings.sizes().1], |r| &r.coefficients)
    }

    /// State covariance P: (p + 1, p + 1), with channels (k, p + 1, p + 1).
    #[getter]
    fn covariance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.array(py, &[this.settings.sizes().0; 2], |r| &r.covariance)
    }

    /// Samples given so far, missing ones included.
    #[getter]
    fn samples_seen(slf: &Bound<'_, Self>) -> PyResult<u64> {
        Ok(reading(slf)?.shared.filter.samples_seen())
    }

    /// How often a step of the process noise was shortened to keep it positive semidefinite: int,
    /// with channels (k,).
    #[getter]
    fn guard_count<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let counts = this.shared.filter.guard_counts();
        this.shared.numbers(py, counts)
    }

    /// The start-up is over: bool, with channels (k,).
    #[getter]
    fn ready<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let ready = this.shared.filter.ready();
        this.shared.numbers(py, ready)
    }

    /// Number of signals, None for a single one.
    #[getter]
    fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
        Ok(reading(slf)?.shared.channels)
    }

    /// Samples a second.
    #[getter]
    fn rate(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(reading(slf)?.settings.rate())
    }

    /// Orders (p, q) of the model; None for ``"auto"``, which has no ARMA model.
    #[getter]
    fn order(slf: &Bound<'_, Self>) -> PyResult<Option<(usize, usize)>> {
        Ok(reading(slf)?.settings.order())
    }

    /// ``"kf"``, ``"akf"``, ``"fading"`` or ``"auto"``.
    #[getter]
    fn method(slf: &Bound<'_, Self>) -> PyResult<&'static str> {
        Ok(reading(slf)?.settings.method())
    }

    /// What ``DriftFilter.started`` was given, None for a filter that learns it from its start-up.
    #[getter]
    fn start<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let starts = this.shared.filter.starts();
        if starts.is_empty() {
            return Ok(None);
        }
        start::write(py, &starts, &this.shared, this.settings.order().unwrap_or_default()).map(Some)
    }

    /// Every argument that makes such a filter anew: ``DriftFilter(**f.params)``, or
    /// ``DriftFilter.started(f.start, **f.params)`` for one that was started.
    #[getter]
    fn params<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let (py, this) = (slf.py(), reading(slf)?);
        this.settings.write(py, this.shared.channels)
    }
}

impl DriftFilter {
    fn wrap(channels: Option<usize>, filter: Box<dyn AnyDrift>) -> Self {
        Self { settings: filter.settings(), shared: Shared::new(channels, filter) }
    }

    fn density(&self, i: usize) -> Vec<f64> {
        self.shared.filter.densities().iter().map(|both| both[i]).collect()
    }

    fn number<'py>(
        &self,
        py: Python<'py>,
        reading: impl Fn(&Readings) -> f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.shared.filter.readings().iter().map(reading).collect();
        self.shared.numbers(py, values)
    }

    fn array<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        reading: impl Fn(&Readings) -> &Vec<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let readings = self.shared.filter.readings();
        let values = readings.iter().flat_map(|r| reading(r).iter().copied()).collect();
        self.shared.arrays(py, values, shape)
    }
}
