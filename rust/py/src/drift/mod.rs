//! The drift filter for Python.

mod bank;
mod options;
mod readings;
mod start;

use numpy::{PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::Error;
use zerorate_core::drift::options::Options;
use zerorate_core::stream::Parts;

use self::bank::{AnyDrift, DriftBank, Noted};
pub(crate) use self::bank::{Order, for_order, order_error};
pub use self::options::filter_options;
use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{Shared, arrays_of, exclusive, places, reading, streaming};
use crate::common::work::in_pieces;

/// Bias of a gyro, learned and removed sample by sample, for one or more axes.
///
/// The default, ``DriftFilter(rate)``, needs no tuning. It detects rest and motion, learns the bias
/// at rest, holds it in motion, and returns each sample minus the bias. It removes the slowly
/// changing bias and does not smooth: the noise of the samples stays.
///
/// The other methods are for research. ``"kf"``, ``"akf"`` and ``"fading"`` are the methods of Fu &
/// Han 2019 (equations 8 to 31), ``"robust"`` is the method of Wu & Ran 2021. By default they treat
/// every sample as rest (``motion="ignore"``). Motion then enters their estimate and is missing
/// from the compensated rate. Their ``process_noise`` must suit the sensor.
///
/// Samples may have any unit. Results have the unit of the samples. In the first second the bias is
/// the mean to date: keep the sensor still. Without ``rest_limit`` a motion at the very start can
/// be mistaken for rest, and its rate for bias. While this is possible, ``status`` is
/// ``"provisional"``. A sample that is not finite (or ``update(None)``) is missing. One filter
/// serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// method : {"auto", "kf", "akf", "fading", "robust"}, default "auto"
///     ``"auto"`` tunes itself. ``"kf"`` is a Kalman filter of an ARMA model. ``"akf"`` also adapts
///     the measurement noise R, with equal weights. ``"fading"`` adapts R with fading memory, and
///     adapts the process noise G. ``"robust"`` is ``"akf"`` with zones that reject outliers.
/// channels : int, optional
///     Number k of parallel axes; None is a single axis without a channel axis. With channels,
///     ``update`` takes k samples, and each property has k values.
/// output : {"compensated", "estimate"}, default "compensated"
///     Output of ``update`` and ``process``. ``"compensated"`` is the sample minus ``bias``,
///     without delay, and NaN for a missing sample. ``"estimate"`` is the property ``estimate``:
///     the bias for ``"auto"``, the smoothed rate for the published filters.
/// motion : {"hold", "ignore"}, optional
///     ``"hold"`` learns only at rest, as detected by a ``RestDetector``. When a motion begins, it
///     undoes the learning of the last half second, with ``"auto"`` of up to two seconds.
///     ``"ignore"`` treats every sample as rest. The default is ``"hold"`` for ``"auto"`` and
///     ``"ignore"`` for the other methods.
/// limit : float, optional
///     End of the sensor's range, in the samples' unit. A sample of this size or more is saturated
///     and counts as missing.
/// rest_limit : float, optional
///     Only ``"auto"``: largest standard deviation of the samples within a quarter second at rest,
///     in their unit. 10 deg/s suits MEMS gyros. With a limit, a record may begin in motion.
///     Without a limit, a motion from the first sample on can count as rest, and its rate as bias.
///
/// Other Parameters
/// ----------------
/// bias_limit : float, optional
///     Only ``"auto"``: largest level that can be a bias, in the samples' unit; 20 deg/s suits MEMS
///     gyros. Below this limit, a constant rotation can look like rest.
/// order : (int, int), default (2, 1), for ``"robust"`` (1, 0)
///     All but ``"auto"``: orders p (1 to 3) and q (0 to 3) of the drift's ARMA model; (p, 0) is
///     AR(p).
/// process_noise : float, default 0.1
///     All but ``"auto"``: process noise G and initial covariance P, as shares of the samples'
///     variance in the start-up. A small value (1e-6) smooths and lags, a large value (1) follows
///     the signal.
/// fading : float, default 0.97
///     Only ``"fading"``: fading factor b of R in (0, 1]. A small factor follows changes of the
///     noise quickly, a large factor averages. Fu & Han use 0.95 to 0.99 for an MTi-100 and 0.90 to
///     0.95 for a 3DM-GX4-25.
/// process_noise_memory : float, default 0.0
///     Only ``"fading"``: weight of the initial process noise, in samples. A large weight keeps the
///     initial process noise longer.
/// noise : {"allan", "hadamard"}, default "allan"
///     All but ``"auto"``: kind of variance from which R is computed. A constant angular
///     acceleration does not change ``"hadamard"``.
/// outliers : {"keep", "reject"}, default "keep"
///     Only ``"kf"``, ``"akf"`` and ``"fading"``: ``"reject"`` leaves out samples more than four
///     standard deviations from the level of the last ticks (quarter seconds). ``"auto"`` always
///     does this. If there are many such samples, or many in a row, they count as motion and are
///     kept.
/// adapt_for : float or None, default 120.0
///     All but ``"auto"``: time after the start-up in which the model is learned, s. With None,
///     learning never ends.
/// forgetting_factor : float, default 1.0
///     All but ``"auto"``: forgetting factor λ of the model's least squares, in (0, 1]. A small λ
///     forgets old samples quickly, 1 never forgets.
/// zones : (float, float) or "published", default (4.0, 0.75)
///     Only ``"robust"``: (kappa, beta). An innovation beyond kappa standard deviations of the
///     accepted innovations is an outlier. Outliers with one sign for 0.03 s, at least three
///     samples, are accepted as a step. An innovation beyond beta times kappa standard deviations
///     is reduced to this bound. A large kappa accepts outliers, a small kappa leaves out good
///     samples. ``"published"`` compares an innovation with a variance, as in the paper. The result
///     then depends on the samples' unit, and a run of outliers never ends.
/// damping : float, default 0.0
///     Only ``"robust"``: share of the gain that is applied to an outlier, from 0 to 1.
/// correction : float, default 0.0
///     Only ``"robust"``: share of an innovation that corrects the prediction, from 0 to 1. It
///     applies to innovations between beta times kappa and kappa. With 0, the better choice, these
///     innovations are reduced to the bound.
/// startup : float, default 1.0
///     All methods, rarely needed: duration of the start-up, in which offset, scale and first noise
///     are learned, s. It lasts at least ten samples, and until two samples differ.
/// scale : float, optional
///     All methods, rarely needed: standard deviation of the noise in the samples' unit; by default
///     it is learned.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the method does not use it.
///
/// Examples
/// --------
/// Two minutes of a gyro at rest, in deg/s:
///
/// >>> import numpy as np, zerorate as zr
/// >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(12_000)
/// >>> gyro = zr.DriftFilter(rate=100.0)
/// >>> rate = gyro.process(z)  # z minus the bias as known at each sample
/// >>> gyro.status, round(gyro.bias, 2), gyro.bias_sigma < 0.01
/// ('at rest', 0.5, True)
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct DriftFilter {
    options: Options,
    shared: Shared<dyn DriftBank>,
}

streaming!(
    DriftFilter,
    update: "Process one sample and return the output, by default the compensated rate.

    The sample is a float, or an array (k,) with k channels. The output has the shape and unit of
    the sample. None or NaN is a missing sample. Its output is NaN, or the estimate if ``output``
    selects the estimate. ``moving`` states that the body moves, as a ``MotionDetector`` detects
    from an accelerometer. A constant rate is then no bias.",
    process: "Filter a batch, with results identical to ``update`` sample by sample.

    Parameters
    ----------
    z : array_like, shape (n,), or (n, k) with k channels
        Samples; a sample that is not finite is missing. A float64 array in C order is not copied:
        no thread may write to it during the call.
    out : ndarray, optional
        A float64 array of the same shape for the result; may be ``z`` itself.
    threads : int, optional
        Largest number of threads for several channels. Fewer threads are used if more are not
        faster. Results do not depend on it.
    moving : array_like of bool, shape (n,), optional
        True where the body moves, as a ``MotionDetector`` detects from an accelerometer. A single
        thread is then used. Only for a filter with ``motion='hold'``.

    Returns
    -------
    ndarray, float64, shape of ``z``
        The output, by default the compensated rate, in the unit of ``z``. The interpreter lock is
        released during the call.",
    moving
);

#[pymethods]
impl DriftFilter {
    #[new]
    #[pyo3(signature = (rate, **options), text_signature = "(rate, *, method='auto', \
        channels=None, output='compensated', motion=None, limit=None, rest_limit=None, \
        bias_limit=None, order=(2, 1), process_noise=0.1, fading=0.97, process_noise_memory=0.0, \
        noise='allan', outliers='keep', adapt_for=120.0, forgetting_factor=1.0, \
        zones=(4.0, 0.75), damping=0.0, correction=0.0, startup=1.0, scale=None)")]
    fn new(rate: f64, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let (options, channels) = options::read(rate, options)?;
        let bank = bank::new(&options, channels.unwrap_or(1))?;
        Ok(Self { options, shared: Shared::new(channels, bank).map_err(NativeError::from)? })
    }

    /// Return a filter with a known model of the signal, ready at its first sample.
    ///
    /// ``ArmaModel.to_filter`` creates such filters from a record. R and the weight of Sage-Husa's
    /// update are the same as after ``startup`` seconds. ``process_noise`` and ``scale`` are not
    /// used. The method must be stated. It cannot be ``"auto"``, which learns its own start.
    ///
    /// Parameters
    /// ----------
    /// start : dict
    ///     Initial values. With k channels every array has a first axis of length k. ``offset`` and
    ///     ``scale`` are the mean and standard deviation of the signal. ``coefficients`` are [φ…,
    ///     θ…, c], (p + q + 1,). ``covariance`` is the covariance of [φ…, θ…, c / scale] for
    ///     centred and scaled samples, divided by the noise variance, (p + q + 1, p + q + 1).
    ///     ``measurement_noise`` is the variance R, and ``process_noise`` the variance G₀₀.
    ///     ``state_covariance`` is P before the first sample, (p + 1, p + 1).
    /// **params
    ///     Arguments of ``DriftFilter``, with a ``method`` among ``"kf"``, ``"akf"``, ``"fading"``
    ///     and ``"robust"``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A parameter or a part of the start is missing, out of range, or has a wrong shape.
    /// TypeError
    ///     A part of the start does not hold numbers.
    #[staticmethod]
    #[pyo3(signature = (start, **params))]
    fn started(start: &Bound<'_, PyDict>, params: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        start::check_method(params)?;
        let plain = start.py().get_type::<Self>().call((), params)?;
        let plain = plain.cast::<Self>()?.borrow();
        let bank = start::started(&plain.options, plain.shared.channels, start)?;
        let shared = Shared::new(plain.shared.channels, bank).map_err(NativeError::from)?;
        Ok(Self { options: plain.options, shared })
    }

    /// Process a replay with one row per axis, (k, n), and write the drift to ``out``.
    ///
    /// ``noted`` are arrays for the standard deviation, rest and stuck sensor after each sample.
    /// ``moving`` is the argument of ``process`` and needs ``noted``. The interpreter lock is
    /// released.
    #[pyo3(signature = (z, out, noted=None, moving=None))]
    fn _replay(
        slf: &Bound<'_, Self>,
        z: PyReadonlyArray2<'_, f64>,
        mut out: PyReadwriteArray2<'_, f64>,
        mut noted: Option<NotedArrays<'_>>,
        moving: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let shape = [this.shared.channels.unwrap_or(1), z.shape()[1]];
        arrays::check("z", z.shape(), &shape)?;
        arrays::check("out", out.shape(), &shape)?;
        let mut noted = noted.as_mut().map(|noted| rows_of(noted, &shape)).transpose()?;
        let moving = this.motion(moving, shape[1])?;
        let z = z.as_array();
        let z = arrays::rows("z", &z)?;
        let mut out = arrays::rows_mut("out", out.as_array_mut())?;
        in_pieces(
            slf.py(),
            &mut *this.shared.bank,
            shape[1],
            1,
            |filters, piece| match &mut noted {
                Some(noted) => {
                    filters.drift_rows(piece, &z, &moving, &mut out, noted);
                    Ok(())
                }
                None => bank::process_rows(filters, piece, &z, &mut out),
            },
        )
    }

    /// Process a batch and return a ``zerorate.tasks.Trace``: the filter's state after each sample.
    #[pyo3(signature = (z, moving=None))]
    fn trace(
        slf: &Bound<'_, Self>,
        z: &Bound<'_, PyAny>,
        moving: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let (py, [z]) = (z.py(), arrays::taken(slf, ["z"], [Some(z)])?);
        let mut this = exclusive(slf)?;
        let axes: Vec<usize> = this.shared.channels.into_iter().collect();
        let samples = arrays::samples(&z, &axes)?;
        let moving = this.motion(moving, samples.shape()[0])?;
        let (rows, bank) = (samples.values()?, &mut *this.shared.bank);
        let (n, fields, channels) =
            (samples.shape()[0], bank.filter(0).readings(), bank.channels());
        let mut parts = Parts::new(fields, n * channels).map_err(NativeError::from)?;
        in_pieces(py, bank, n, 1, |bank, piece| {
            let moving = if moving.is_empty() { &[] } else { &moving[piece.clone()] };
            bank.trace(&rows[places(piece, channels)], moving, &mut parts)
        })?;
        let arrays = arrays_of(py, parts, &this.shared.batch_axes(n))?;
        let named = PyDict::new(py);
        for (field, array) in fields.iter().zip(arrays) {
            named.set_item(field.name, array)?;
        }
        Ok(rules::function(py, Rule::Trace)?.call((), Some(&named))?.unbind())
    }

    /// Forget the bias and keep the noise, for a sensor that was switched off and on.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The method is not ``"auto"``.
    fn power_on(slf: &Bound<'_, Self>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        if this.shared.bank.power_on() {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "power_on() is for method 'auto', this is '{}': make a new filter or reset() it",
            this.options.method_name()
        )))
    }

    /// Return the standard deviation of the mean bias over the next ``seconds``.
    ///
    /// It is relative to ``bias``: ``seconds`` times this value is the heading error after this
    /// time. Only with ``"auto"``.
    ///
    /// Parameters
    /// ----------
    /// seconds : float
    ///     Time from now on, s. 10 gives ``bias_sigma``; in motion the result is up to two seconds
    ///     newer. 0 gives the standard deviation of the present bias. This value includes fast
    ///     flicker noise of an assumed size, because fast flicker cannot be observed. For a drift
    ///     without flicker it is up to twice the true value.
    ///
    /// Returns
    /// -------
    /// float, or ndarray of shape (k,) with k channels
    ///     Standard deviation in the samples' unit.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     ``seconds`` is negative or not finite, or the method is not ``"auto"``.
    fn bias_sigma_over<'py>(slf: &Bound<'py, Self>, seconds: f64) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let sigmas: Option<Result<Vec<f64>, Error>> =
            this.shared.bank.each(|filter| filter.bias_sigma_over(seconds)).into_iter().collect();
        match sigmas {
            Some(sigmas) => this.shared.numbers(py, sigmas.map_err(NativeError::from)?),
            None => Err(PyValueError::new_err(format!(
                "bias_sigma_over() is for method 'auto', this is '{}': use bias_sigma",
                this.options.method_name()
            ))),
        }
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let started = this.shared.bank.starts().is_some();
        options::call(slf.py(), &this.options, this.shared.channels, started)
    }

    /// Status of the filter: a str, or a list of k str with k channels.
    ///
    /// - ``"starting"``: the bias is the mean to date.
    /// - ``"at rest"``: the filter learns.
    /// - ``"provisional"``: it learns from apparent rest that may be motion.
    /// - ``"in motion"``: it holds the bias.
    /// - ``"no rest yet"``: the sensor moved before anything was learned; the bias is 0.
    /// - ``"restarting"``: the filter starts again, since the initial noise was wrong by orders of
    ///   magnitude.
    /// - ``"stuck"``: the sensor repeats one sample for longer than can be chance; the bias is
    ///   held.
    #[getter]
    fn status<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let status = this.shared.bank.each(|filter| filter.status());
        match this.shared.channels {
            None => status[0].into_bound_py_any(py),
            Some(_) => status.into_bound_py_any(py),
        }
    }
}

getters! { DriftFilter, slf, py, this;
    /// Learned density of the white noise, samples' unit over root Hz.
    ///
    /// ``"auto"`` computes it from noise slower than a quarter second, other methods from R. NaN
    /// until it is known. A float, or an array (k,) with k channels.
    angle_random_walk: Object<'py> = this.each(py, |filter| filter.densities()[0])?;
    /// Random walk of the bias per root second, in the samples' unit.
    ///
    /// Learned by ``"auto"``; NaN until it is known, and for the other methods. A float, or an
    /// array (k,) with k channels.
    rate_random_walk: Object<'py> = this.each(py, |filter| filter.densities()[1])?;
    /// Bias instability B, in the samples' unit.
    ///
    /// ``"auto"`` learns it as flicker noise with the two-sided density B²/(2πf). For a drift
    /// without flicker it is an upper bound. NaN until it is known, and for the other methods. A
    /// float, or an array (k,) with k channels.
    bias_instability: Object<'py> = this.each(py, |filter| filter.bias_instability())?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.shared.bank.filter(0).samples_seen();
    /// Number of samples at which the change of the process noise was limited.
    ///
    /// The limit keeps the process noise positive semidefinite. An int, or an array (k,) with k
    /// channels.
    guard_count: Object<'py> = this.each(py, |filter| filter.guard_count())?;
    /// Number of runs of outliers that ``"robust"`` accepted as a step of the signal.
    ///
    /// An int, or an array (k,) with k channels.
    exit_count: Object<'py> = this.each(py, |filter| filter.exit_count())?;
    /// Number of times that noise and drift were learned again.
    ///
    /// They are learned again if the initial scale was wrong by orders of magnitude. An int, or an
    /// array (k,) with k channels.
    restart_count: Object<'py> = this.each(py, |filter| filter.restarts())?;
    /// Number of samples at or beyond ``limit`` to date.
    ///
    /// An int, or an array (k,) with k channels.
    saturated_count: Object<'py> = this.each(py, |filter| filter.tally().saturated)?;
    /// Number of rejected outliers to date.
    ///
    /// It is updated every quarter second, with ``"robust"`` at each sample. It is 0 for methods
    /// without rejection. An int, or an array (k,) with k channels.
    outlier_count: Object<'py> = this.each(py, |filter| filter.tally().outliers)?;
    /// Number of samples of a stuck sensor to date.
    ///
    /// It is updated every quarter second. Published methods need ``outliers="reject"`` or
    /// ``motion="hold"`` to count; otherwise it is 0. An int, or an array (k,) with k channels.
    stuck_count: Object<'py> = this.each(py, |filter| filter.tally().stuck)?;
    /// True after the start-up.
    ///
    /// A bool, or an array (k,) with k channels.
    ready: Object<'py> = this.each(py, |filter| filter.ready())?;
    /// Samples per second.
    rate: f64 = this.options.params.rate;
    /// Orders (p, q) of the model; None for ``"auto"``, which has no ARMA model.
    order: Option<(usize, usize)> = {
        let options = this.options;
        options.method.map(|_| options.order)
    };
    /// Name of the method.
    method: &'static str = this.options.method_name();
    /// Start of ``DriftFilter.started``; None for a filter that learns its start.
    start: Option<Bound<'py, PyDict>> = start::write(py, &this.shared)?;
    /// Arguments that create an equal filter: ``DriftFilter(**f.params)``.
    ///
    /// For a filter with a stated start use ``DriftFilter.started(f.start, **f.params)``.
    params: Bound<'py, PyDict> = options::write(py, &this.options, this.shared.channels)?;
}

/// Standard deviation of the drift, rest and stuck sensor, to be written.
type NotedArrays<'py> =
    (PyReadwriteArray2<'py, f64>, PyReadwriteArray2<'py, bool>, PyReadwriteArray2<'py, bool>);

fn rows_of<'a>(noted: &'a mut NotedArrays<'_>, shape: &[usize]) -> PyResult<Noted<'a>> {
    let (sigma, at_rest, stuck) = noted;
    arrays::check("bias_sigma", sigma.shape(), shape)?;
    arrays::check("at_rest", at_rest.shape(), shape)?;
    arrays::check("stuck", stuck.shape(), shape)?;
    Ok(Noted {
        sigma: arrays::rows_mut("bias_sigma", sigma.as_array_mut())?,
        at_rest: arrays::rows_mut("at_rest", at_rest.as_array_mut())?,
        stuck: arrays::rows_mut("stuck", stuck.as_array_mut())?,
    })
}

impl DriftFilter {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        let (channels, bank) = bank::restored(bytes)?;
        Ok(Self { options: bank.filter(0).options(), shared: Shared::new(channels, bank)? })
    }

    /// Known motion of the body at each of these samples; empty if it is unknown.
    fn motion(&self, moving: Option<&Bound<'_, PyAny>>, n: usize) -> PyResult<Vec<bool>> {
        let Some(moving) = moving else { return Ok(vec![]) };
        self.check_motion()?;
        arrays::flags("moving", moving, n)
    }

    fn check_motion(&self) -> PyResult<()> {
        match self.options.behaviour.hold_in_motion {
            true => Ok(()),
            false => Err(PyValueError::new_err(
                "moving is for motion='hold': this filter takes every sample for rest",
            )),
        }
    }

    /// One value per channel.
    fn each<'py, T>(
        &self,
        py: Python<'py>,
        of: impl Fn(&dyn AnyDrift) -> T,
    ) -> PyResult<Bound<'py, PyAny>>
    where
        T: numpy::Element + IntoPyObjectExt<'py> + Copy,
    {
        self.shared.numbers(py, self.shared.bank.each(of))
    }

    fn reading<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let bank = &self.shared.bank;
        let (numbers, flags) = bank.snapshots().map_err(NativeError::from)?;
        self.shared.field(py, bank.filter(0).readings(), name, &numbers, &flags)
    }
}
