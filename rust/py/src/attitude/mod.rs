//! Attitude for Python.

mod bank;
pub(crate) mod options;
pub(crate) mod samples;
mod tilt;

use std::any::Any;
use std::ops::Range;

use numpy::PyArrayMethods;
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use zerorate_core::attitude::{
    AttitudeParams, AutoOptions, CONSTANTS, Frame, LearnedIron, METHODS, NamedOptions, Reading,
};
use zerorate_core::stream::Parts;
use zerorate_core::{Error, memory};

use self::bank::AttitudeBank;
pub use self::options::{attitude_options, tilt_options};
use self::samples::{Batch, Given};
pub use self::tilt::Tilt;
use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{
    self, Shared, arrays_of, call, exclusive, reading, streaming, text,
};
use crate::common::work::{in_pieces, interruptible};

/// Samples that are interleaved before the next block; for work on threads.
const ROWS: usize = 1 << 8;
const ROWS_OF_THREADS: usize = 1 << 14;

/// Orientation of a body, from its gyro, accelerometer and, if present, magnetometer.
///
/// ``update`` and ``process`` return the orientation: a quaternion w, x, y, z that rotates vectors
/// from the sensor's axes to the earth's axes. The default method needs no tuning. It integrates
/// the gyro and corrects the tilt ten times a second. From gravity it learns bias, scale and
/// misalignment of the gyro. The magnetometer corrects only the heading. The other methods are
/// textbook filters.
///
/// Sensors may have different rates. A missing sample is NaN, ``None``, a vector of zeros, or a
/// vector beyond 1000 rad/s or m/s^2. A missing rate is replaced by the last rate for 50 ms.
///
/// Zeros of a gyro are true rates if the gyro has a dead band or is simulated. Zeros after a rate
/// below 5 deg/s are accepted if the gyro has shown no noise at rest. Zeros are also accepted after
/// they have lasted for some time at rest.
///
/// ``dt`` is the time since the previous sample, s, by default ``1 / rate``. More than 1 s is a
/// gap. A negative value means that the clock was set back. A value below -1 s means that the
/// recorder restarted. In all these cases the body may have rotated: ``tilt_sigma`` and
/// ``heading_sigma`` grow accordingly.
///
/// North is magnetic north. Without a magnetometer a level sensor starts with its axes along the
/// frame's axes, and the heading drifts. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples of the gyro per second.
/// mag : bool, default True
///     True if samples may include a magnetometer. With False, samples of a magnetometer raise an
///     error, and ``heading_sigma`` is the standard deviation of the drift since the start.
/// frame : {"enu", "ned", "nwu"}
///     Axes of the earth: "enu" is east, north, up; "ned" is north, east, down; "nwu" is north,
///     west, up. With the identity quaternion, a resting accelerometer shows +9.81 m/s^2 on z, with
///     "ned" -9.81 m/s^2.
/// method : {"auto", "complementary", "mahony", "madgwick", "ekf", "ukf"}
///     Filter method.
/// gyro_unit, accel_unit : str
///     Units of the samples, as in `zerorate.units`. The magnetometer may have any unit.
/// bias : array_like, shape (3,), DriftFilter or Calibration, optional
///     Known output of the gyro without rotation, in ``gyro_unit``. A `DriftFilter` must have three
///     channels in that unit. A `Calibration` is for raw samples and also gives the gyro's matrix.
/// bias_sigma : array_like, shape () or (3,), optional
///     Standard deviation of ``bias``. For a filter or a calibration, the default is its own
///     standard deviation, at least 0.05 deg/s. For numbers the default is 0.5 deg/s. Without
///     ``bias`` it is 1 deg/s.
/// bias_limit : float, optional
///     Only "auto": largest possible bias, in ``gyro_unit``, default 10 deg/s. A steady rate above
///     this limit counts as rotation. With a small limit, a slowly turning table is not mistaken
///     for rest. With a large limit, the filter can find the bias of a bad gyro.
/// gyro_range : float, optional
///     Range of the gyro, in ``gyro_unit``. If the rate about any axis is beyond this range, the
///     sample is missing and counts in ``rates_left_out``. At a rate equal to the range, ``status``
///     is "clipped".
/// magnetometer : MagnetometerCalibration, optional
///     Only "auto": result of `calibrate_magnetometer`. Each sample is first corrected by the soft
///     iron and by the hard iron of the longest group. The samples must be in the calibration's
///     unit.
/// learn_magnetometer : bool, default False
///     Only "auto": learn the magnetometer's hard iron from the motion; with ``magnetometer``,
///     learn the remaining hard iron. Until the hard iron is known, the output is bit-identical to
///     a filter without learning.
/// channels : int, optional
///     Number of bodies; ``None`` is a single body without a channel axis.
/// time_constant : float, default 0.5
///     Only "complementary": time constant of the corrections by accelerometer and magnetometer, s.
///     With a short time constant, accelerations change the orientation. The gyro's bias causes an
///     error of the bias times the time constant.
/// kp, ki : float, default 1.0 and 0.3
///     Only "mahony": proportional gain, 1/s, and integral gain, 1/s^2. With ``ki=0`` no bias is
///     learned.
/// beta : float, optional
///     Only "madgwick": gradient step of the quaternion, rad/s; a body rate is twice this value.
///     The default is from the report: 0.041 with a magnetometer, 0.033 without a magnetometer.
/// gyro_noise, accel_noise : float, default 0.0002 and 0.1
///     Only "ekf" and "ukf": white noise of gyro, rad/s/sqrt(Hz), and accelerometer,
///     m/s^2/sqrt(Hz). The accelerometer's value includes the body's own accelerations. It is about
///     fifty times the noise in a data sheet.
/// mag_noise : float, default 0.1
///     Only "ekf" and "ukf": white noise of the magnetic heading, rad/sqrt(Hz).
/// bias_walk : float, default 0.0001
///     Only "ekf" and "ukf": random walk of the gyro's bias, rad/s/sqrt(s).
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the method does not use it.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> attitude = zr.Attitude(rate=100.0, mag=False)
/// >>> gyro = np.tile([0.0, 0.0, 0.5], (300, 1))  # rad/s about z, upright
/// >>> accel = np.tile([0.0, 0.0, 9.81], (300, 1))
/// >>> attitude.process(gyro, accel).shape
/// (300, 4)
/// >>> [round(float(x), 3) + 0.0 for x in attitude.euler]  # roll, pitch, yaw
/// [0.0, 0.0, 1.5]
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct Attitude {
    /// True if there is a magnetometer.
    mag: bool,
    shared: Shared<dyn AttitudeBank>,
}

streaming!(Attitude);

#[pymethods]
impl Attitude {
    #[new]
    #[pyo3(
        signature = (
            rate, *, mag=true, frame="enu", method="auto", gyro_unit="rad/s",
            accel_unit="m/s^2", bias=None, bias_sigma=None, bias_limit=None, gyro_range=None,
            magnetometer=None, learn_magnetometer=false, channels=None, **constants
        ),
        text_signature = "(rate, *, mag=True, frame='enu', method='auto', gyro_unit='rad/s', \
            accel_unit='m/s^2', bias=None, bias_sigma=None, bias_limit=None, gyro_range=None, \
            magnetometer=None, \
            learn_magnetometer=False, channels=None, time_constant=0.5, \
            kp=1.0, ki=0.3, beta=None, gyro_noise=0.0002, accel_noise=0.1, mag_noise=0.1, \
            bias_walk=0.0001)"
    )]
    // The arguments are the same as in the Python class.
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        rate: f64,
        mag: bool,
        frame: &str,
        method: &str,
        gyro_unit: &str,
        accel_unit: &str,
        bias: Option<&Bound<'_, PyAny>>,
        bias_sigma: Option<&Bound<'_, PyAny>>,
        bias_limit: Option<f64>,
        gyro_range: Option<f64>,
        magnetometer: Option<&Bound<'_, PyAny>>,
        learn_magnetometer: bool,
        channels: Option<i128>,
        constants: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let unit = factor(py, gyro_unit, "rad/s", "gyro_unit")?;
        let params = AttitudeParams {
            rate,
            frame: frame_of(frame)?,
            mag,
            gyro_unit: unit,
            gyro_range: gyro_range.map(|range| range * unit),
            accel_unit: factor(py, accel_unit, "m/s^2", "accel_unit")?,
        };
        let (bias_given, sigma) = (bias.is_some(), bias_sigma.is_some());
        options::check_bias(method, bias_given, sigma, bias_limit.is_some())?;
        options::check_field(mag, constants)?;
        let mut auto = AutoOptions { mag, ..AutoOptions::default() };
        prior(py, bias, bias_sigma, (gyro_unit, params.gyro_unit), method, &mut auto)?;
        if let Some(limit) = bias_limit {
            auto.bias_limit = limit * params.gyro_unit;
        }
        let usual =
            if bias_given || sigma { auto.bias_sigma } else { NamedOptions::default().bias_sigma };
        let named = NamedOptions {
            mag,
            bias: auto.bias,
            bias_sigma: usual,
            constants: options::read("Attitude", CONSTANTS, method, constants)?,
        };
        let correction = options::correction(magnetometer, method, mag)?;
        options::check_learns(learn_magnetometer, method, mag)?;
        let count = channels.unwrap_or(1);
        let bank = bank::new(method, params, auto, named, correction, learn_magnetometer, count)?;
        let shared = Shared::new(channels, bank).map_err(NativeError::from)?;
        Ok(Self { mag, shared })
    }

    /// Process one sample of each sensor and return the orientation, (4,).
    ///
    /// Each sensor's sample is (3,); six or nine floats are also accepted. With k channels the
    /// samples are (k, 3) and the orientations (k, 4).
    #[pyo3(signature = (gyro, accel, mag=None, *floats, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        floats: &Bound<'py, PyTuple>,
        dt: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        this.check_mag(mag.is_some())?;
        let given = Given { gyro, accel, mag, dt };
        if this.shared.channels.is_none()
            && floats.is_empty()
            && let Some(row) = given.usual()
        {
            let mut orientation = [0.0; 4];
            let out = &mut orientation;
            // A batch of one sample: only batches select the processor's widest instructions.
            this.shared.bank.process(&row, out, &mut [], 1).map_err(NativeError::from)?;
            return Ok(arrays::small(slf.py(), &orientation));
        }
        let row = match floats.is_empty() {
            true => given.row(this.shared.channels)?,
            false => samples::of_floats([gyro, accel], mag, floats, dt)?,
        };
        this.shared.update_row(slf.py(), &row)
    }

    /// Process each sample of a batch and return the orientations, (n, 4).
    ///
    /// Each sensor's samples are (n, 3). With k channels the samples are (n, k, 3) and the
    /// orientations (n, k, 4). ``dt`` is one time for all samples, or an array (n,). The
    /// interpreter lock is released.
    #[pyo3(signature = (gyro, accel, mag=None, dt=None, out=None, threads=None))]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        dt: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let taken = samples::taken(slf, [Some(gyro), Some(accel), mag, dt])?;
        let mut this = exclusive(slf)?;
        this.check_mag(mag.is_some())?;
        let batch = Given::of(&taken).batch(this.shared.channels)?;
        let shape = [this.shared.batch_axes(batch.n), vec![4]].concat();
        let given = out.map(|out| arrays::check_out::<f64>(out, &shape)).transpose()?;
        let array = arrays::zeros::<f64>(slf.py(), &shape)?;
        let mut places = array.try_readwrite()?;
        let (rows_out, threads) = (places.as_slice_mut()?, streaming::threads(threads)?);
        let before = this.shared.bank.try_clone().ok();
        let width = 4 * this.shared.bank.channels();
        this.in_blocks(slf.py(), &batch, threads, |bank, rows, instants| {
            let out = &mut rows_out[streaming::places(instants, width)];
            bank.process(rows, out, &mut [], threads)
        })?;
        drop(places);
        this.warn(slf.py(), before)?;
        let Some(given) = given else { return Ok(array.into_any()) };
        array.copy_to(given)?;
        Ok(given.clone().into_any())
    }

    /// Process a batch and return all estimates after each sample, as arrays by name.
    ///
    /// quaternion is (n, 4); bias, bias_sigma and linear_acceleration are (n, 3); gyro_matrix and
    /// gyro_matrix_sigma are (n, 3, 3). tilt_sigma, heading_sigma, at_rest, disturbed and events
    /// are (n,); each number in events is a sum of `zerorate.attitude.Event` members. With k
    /// channels the shapes are (n, k, …).
    #[pyo3(signature = (gyro, accel, mag=None, dt=None))]
    fn trace<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        dt: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let taken = samples::taken(slf, [Some(gyro), Some(accel), mag, dt])?;
        let (py, mut this) = (slf.py(), exclusive(slf)?);
        this.check_mag(mag.is_some())?;
        let batch = Given::of(&taken).batch(this.shared.channels)?;
        let (n, channels) = (batch.n, this.shared.bank.channels());
        let mut parts = Parts::new(bank::fields(), n * channels).map_err(NativeError::from)?;
        let before = this.shared.bank.try_clone().ok();
        this.in_blocks(py, &batch, 1, |bank, rows, _| bank.trace(rows, &mut parts))?;
        let found = named_arrays(py, parts, &this.shared.batch_axes(n))?;
        this.warn(py, before)?;
        Ok(found)
    }

    /// Smooth a record: return each estimate from the whole record, with the names of ``trace``.
    #[pyo3(signature = (gyro, accel, mag=None, dt=None))]
    fn smooth<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        dt: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let taken = samples::taken(slf, [Some(gyro), Some(accel), mag, dt])?;
        let (py, this) = (slf.py(), reading(slf)?);
        this.check_mag(mag.is_some())?;
        let batch = Given::of(&taken).batch(this.shared.channels)?;
        let (columns, bank) = (batch.columns()?, &*this.shared.bank);
        if !bank.smooths() {
            let method = bank.method();
            return Err(PyValueError::new_err(format!(
                "smooth is for method 'auto', this Attitude has '{method}'"
            )));
        }
        let parts = interruptible(py, batch.n, || bank.smooth(&columns, batch.n));
        named_arrays(py, parts?.map_err(NativeError::from)?, &this.shared.batch_axes(batch.n))
    }

    /// Continue from a known orientation, before the first sample or later.
    ///
    /// The orientation is a quaternion, w first, or a ``scipy`` rotation. It rotates vectors from
    /// the sensor's axes to the earth's axes. The standard deviations of tilt and heading are in
    /// rad.
    #[pyo3(signature = (orientation, tilt_sigma=0.01, heading_sigma=0.01))]
    fn align(
        slf: &Bound<'_, Self>,
        orientation: &Bound<'_, PyAny>,
        tilt_sigma: f64,
        heading_sigma: f64,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let given = quaternions(orientation)?;
        let axes = [this.shared.channels.as_slice(), &[4]].concat();
        let expected = arrays::tuple(&axes);
        let found = arrays::named("orientation", &given, &expected, |shape| shape == axes)?;
        for (name, sigma) in [("tilt_sigma", tilt_sigma), ("heading_sigma", heading_sigma)] {
            if !(sigma > 0.0 && sigma <= std::f64::consts::PI) {
                return Err(PyValueError::new_err(format!(
                    "{name} must be an angle above 0 and up to pi, got {sigma:?}"
                )));
            }
        }
        let orientations = found.values.as_chunks::<4>().0;
        let is_one = |q: &[f64; 4]| (0.5..2.0).contains(&q.iter().map(|x| x * x).sum::<f64>());
        if !orientations.iter().all(is_one) {
            return Err(PyValueError::new_err("orientation must be a quaternion of length 1"));
        }
        this.shared.bank.align(orientations, tilt_sigma, heading_sigma);
        Ok(())
    }

    /// Reset to the state before the first sample, but keep scale and misalignment of the gyro.
    fn power_on(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.bank.power_on();
        Ok(())
    }

    /// Orientation as a ``scipy.spatial.transform.Rotation``.
    #[getter]
    fn rotation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let scalar_first = PyDict::new(py);
        scalar_first.set_item("scalar_first", true)?;
        py.import("scipy.spatial.transform")?.getattr("Rotation")?.call_method(
            "from_quat",
            (Self::quaternion(slf)?,),
            Some(&scalar_first),
        )
    }

    /// Status of the filter: a str, or a list of k str with k channels.
    ///
    /// - "starting": the first second.
    /// - "clipped": a rate is at ``gyro_range``.
    /// - "rate missing": the gyro has no sample.
    /// - "wrong unit": the force at rest is not gravity.
    /// - "wrong unit?": gravity turns 57 times faster or slower than the gyro. The gyro's unit may
    ///   be deg/s instead of rad/s, or the reverse.
    /// - "magnetometer stuck": the magnetometer repeats one value while the body turns.
    /// - "at rest, or on a rate table: bias_limit": the rate is steady and beyond ``bias_limit``.
    ///   The filter cannot distinguish rest from a rate table.
    /// - "disturbed": the magnetic field is not the known field.
    /// - "at rest": the body rests.
    /// - "moving": the body moves.
    #[getter]
    fn status<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let this = reading(slf)?;
        let status: Vec<&str> = this.shared.bank.readings().iter().map(|b| b.status).collect();
        match this.shared.channels {
            None => Ok(status[0].into_pyobject(slf.py())?.into_any()),
            Some(_) => Ok(status.into_pyobject(slf.py())?.into_any()),
        }
    }

    /// Use of the magnetometer: a str, or a list of k str with k channels.
    ///
    /// - "raw": the field is used without correction. No hard iron is known, or none is learned.
    /// - "known": the present motion determines the hard iron, which is subtracted.
    /// - "kept": an earlier hard iron or zero is subtracted, whichever keeps the field constant.
    /// - "withheld": no hard iron explains the field. For at most a minute, the heading comes from
    ///   the gyro.
    #[getter]
    fn magnetometer_state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let this = reading(slf)?;
        let count = this.shared.bank.channels();
        let states: Vec<&str> = match this.shared.bank.irons() {
            Some(irons) => irons.iter().map(|iron| iron.state).collect(),
            None => vec!["raw"; count],
        };
        match this.shared.channels {
            None => Ok(states[0].into_pyobject(slf.py())?.into_any()),
            Some(_) => Ok(states.into_pyobject(slf.py())?.into_any()),
        }
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let (py, this) = (slf.py(), reading(slf)?);
        let bank = &this.shared.bank;
        let (params, method, chosen) = (bank.params(), bank.method(), bank.options());
        let mut usual = NamedOptions::default();
        if method == METHODS[0] {
            usual.bias_sigma = AutoOptions::default().bias_sigma;
        }
        let constants = options::written(CONSTANTS, method, &chosen.constants);
        // A calibration's text is long: a call with an ellipsis creates no filter.
        let bias = match bank.is_calibrated() {
            true => "...".to_owned(),
            false => in_unit(chosen.bias, usual.bias, params.gyro_unit),
        };
        let limit = bank.bias_limit().map(|limit| text(quotient(limit, params.gyro_unit)));
        let limit = limit.unwrap_or_else(|| "None".to_owned());
        let range = params.gyro_range.map(|range| text(quotient(range, params.gyro_unit)));
        let range = range.unwrap_or_else(|| "None".to_owned());
        let mut arguments = vec![
            ("rate", text(params.rate), ""),
            ("mag", if chosen.mag { "True" } else { "False" }.to_owned(), "True"),
            ("frame", format!("'{}'", frame_name(params.frame)), "'enu'"),
            ("method", format!("'{method}'"), "'auto'"),
            ("gyro_unit", format!("'{}'", unit_of(py, params.gyro_unit, &GYRO_UNITS)?), "'rad/s'"),
            (
                "accel_unit",
                format!("'{}'", unit_of(py, params.accel_unit, &ACCEL_UNITS)?),
                "'m/s^2'",
            ),
            ("bias", bias, "None"),
            ("bias_sigma", in_unit(chosen.bias_sigma, usual.bias_sigma, params.gyro_unit), "None"),
            ("bias_limit", limit, "None"),
            ("gyro_range", range, "None"),
            ("magnetometer", if bank.is_corrected() { "..." } else { "None" }.to_owned(), "None"),
            (
                "learn_magnetometer",
                if bank.irons().is_some() { "True" } else { "False" }.to_owned(),
                "False",
            ),
        ];
        arguments.extend(
            constants.iter().map(|(name, value, usual)| (*name, value.clone(), usual.as_str())),
        );
        Ok(call("Attitude", &arguments, this.shared.channels))
    }
}

getters! { Attitude, slf, py, this;
    /// Quaternion from the sensor's axes to the earth's axes, w first.
    ///
    /// An array (4,), or (k, 4) with k channels.
    quaternion: Object<'py> = vectors(slf, &[4], |body| body.snapshot.quaternion.to_vec())?;
    /// Roll, pitch and yaw, rad.
    ///
    /// An array (3,), or (k, 3) with k channels.
    euler: Object<'py> = vectors(slf, &[3], |body| body.euler.to_vec())?;
    /// Horizontal direction of the sensor's x axis, rad.
    ///
    /// The angle is clockwise from north, 0 to 2 pi. A float, or an array (k,) with k channels.
    heading: Object<'py> = vectors(slf, &[], |body| vec![body.heading])?;
    /// Unit vector upwards, in the sensor's axes.
    ///
    /// An array (3,), or (k, 3) with k channels.
    up: Object<'py> = vectors(slf, &[3], |body| body.up.to_vec())?;
    /// Specific force of gravity alone, in the accelerometer's unit and axes.
    ///
    /// An array (3,), or (k, 3) with k channels.
    gravity: Object<'py> = vectors(slf, &[3], |body| body.gravity.to_vec())?;
    /// Last specific force minus gravity.
    ///
    /// Its axes and unit are the accelerometer's. It is NaN if the force was missing. An array
    /// (3,), or (k, 3) with k channels.
    linear_acceleration: Object<'py> =
        vectors(slf, &[3], |body| body.snapshot.linear_acceleration.to_vec())?;
    /// Output of the gyro without rotation, in its unit.
    ///
    /// An array (3,), or (k, 3) with k channels.
    bias: Object<'py> =
        vectors(slf, &[3], |body| body.snapshot.knowledge.bias.as_slice().to_vec())?;
    /// Standard deviation of ``bias``.
    ///
    /// An array (3,), or (k, 3) with k channels.
    bias_sigma: Object<'py> =
        vectors(slf, &[3], |body| body.snapshot.knowledge.bias_sigma.as_slice().to_vec())?;
    /// Matrix M in ``rate = M (gyro - bias)``.
    ///
    /// An array (3, 3), or (k, 3, 3) with k channels.
    gyro_matrix: Object<'py> =
        vectors(slf, &[3, 3], |body| { body.snapshot.knowledge.gyro_matrix.transpose().as_slice().to_vec() })?;
    /// Standard deviations of the elements of ``gyro_matrix``.
    ///
    /// An array (3, 3), or (k, 3, 3) with k channels.
    gyro_matrix_sigma: Object<'py> =
        vectors(slf, &[3, 3], |body| { body.snapshot.knowledge.gyro_matrix_sigma.transpose().as_slice().to_vec() })?;
    /// Standard deviation of the angle between estimated and true vertical, rad.
    ///
    /// A float, or an array (k,) with k channels.
    tilt_sigma: Object<'py> = vectors(slf, &[], |body| vec![body.snapshot.knowledge.tilt_sigma])?;
    /// Standard deviation of the heading, rad.
    ///
    /// Without a magnetometer it is the standard deviation of the drift since the start. A float,
    /// or an array (k,) with k channels.
    heading_sigma: Object<'py> =
        vectors(slf, &[], |body| vec![body.snapshot.knowledge.heading_sigma])?;
    /// True if the body rests.
    ///
    /// A bool, or an array (k,) with k channels.
    at_rest: Object<'py> = flags(slf, |body| body.snapshot.knowledge.at_rest)?;
    /// True if the magnetic field's strength or dip is not the known value.
    ///
    /// A bool, or an array (k,) with k channels.
    disturbed: Object<'py> = flags(slf, |body| body.snapshot.knowledge.disturbed)?;
    /// Hard iron that is subtracted from each magnetometer sample.
    ///
    /// Its unit is the magnetometer's; with a calibration its axes are the corrected axes. It is
    /// zero before it is known, and NaN if none is learned. An array (3,), or (k, 3) with k
    /// channels.
    hard_iron: Object<'py> = irons(slf, |iron| iron.value.as_slice().to_vec())?;
    /// Standard deviation of ``hard_iron``, NaN before it is known.
    ///
    /// An array (3,), or (k, 3) with k channels.
    hard_iron_sigma: Object<'py> = irons(slf, |iron| iron.sigma.as_slice().to_vec())?;
    /// Number of rates beyond ``gyro_range`` or 1000 rad/s.
    ///
    /// Infinities and NaN are missing samples and are not counted. An int, or an array (k,) with k
    /// channels.
    rates_left_out: Object<'py> = this.shared.numbers(py, this.shared.bank.rates_left_out())?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.shared.bank.samples_seen();
    /// Samples per second.
    rate: f64 = this.shared.bank.params().rate;
    /// Name of the method.
    method: &'static str = this.shared.bank.method();
    /// True if samples may include a magnetometer.
    mag: bool = this.mag;
    /// Unit of the gyro's samples.
    gyro_unit: String = unit_of(py, this.shared.bank.params().gyro_unit, &GYRO_UNITS)?;
    /// Unit of the accelerometer's samples.
    accel_unit: String = unit_of(py, this.shared.bank.params().accel_unit, &ACCEL_UNITS)?;
}

impl Attitude {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        let (channels, bank) = bank::restored(bytes)?;
        Ok(Self { mag: bank.options().mag, shared: Shared::new(channels, bank)? })
    }

    fn check_mag(&self, given: bool) -> PyResult<()> {
        match given && !self.mag {
            false => Ok(()),
            true => Err(PyValueError::new_err("mag is given, but this Attitude has mag=False")),
        }
    }

    /// Works on blocks of samples that stay in the cache; threads are faster only with larger
    /// blocks.
    fn in_blocks(
        &mut self,
        py: Python<'_>,
        batch: &Batch<'_>,
        threads: usize,
        mut work: impl FnMut(&mut dyn AttitudeBank, &[f64], Range<usize>) -> Result<(), Error> + Send,
    ) -> PyResult<()> {
        let columns = batch.columns()?;
        let bank = &mut *self.shared.bank;
        let width = samples::WIDTH * bank.channels();
        let most = if threads > 1 { ROWS_OF_THREADS } else { ROWS };
        let length = most.min(batch.n).max(1);
        let rows = memory::filled(0.0, length.saturating_mul(width));
        let mut rows = rows.map_err(NativeError::from)?;
        in_pieces(py, bank, batch.n, threads, |bank, piece| {
            for first in piece.clone().step_by(length) {
                let instants = first..piece.end.min(first + length);
                let rows = &mut rows[..instants.len() * width];
                columns.fill(instants.clone(), rows);
                work(bank, rows, instants)?;
            }
            Ok(())
        })
    }

    /// Warns that the unit of the accelerometer is wrong. If warnings are errors, the filter
    /// returns to its state before the batch, because the caller does not get the batch's results.
    fn warn(&mut self, py: Python<'_>, before: Option<Box<dyn Any + Send>>) -> PyResult<()> {
        let Some(gravity) = self.shared.bank.wrong_gravity() else { return Ok(()) };
        let text = format!(
            "the accelerometer shows {gravity:.3} m/s^2 at rest, gravity is 9.81: is accel_unit right?"
        );
        let text = std::ffi::CString::new(text).unwrap_or_default();
        let said = PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1);
        if let (Err(_), Some(before)) = (&said, before) {
            self.shared.bank.replace_with(before);
        }
        said
    }
}

/// One array per field, by its name.
fn named_arrays<'py>(
    py: Python<'py>,
    parts: Parts,
    axes: &[usize],
) -> PyResult<Bound<'py, PyDict>> {
    let names: Vec<&str> = bank::fields().iter().map(|field| field.name).collect();
    let found = PyDict::new(py);
    for (name, array) in names.into_iter().zip(arrays_of(py, parts, axes)?) {
        found.set_item(name, array)?;
    }
    Ok(found)
}

fn vectors<'py>(
    slf: &Bound<'py, Attitude>,
    shape: &[usize],
    of: impl Fn(&Reading) -> Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(slf)?;
    let values = this.shared.bank.readings().iter().flat_map(of).collect();
    this.shared.arrays(slf.py(), values, shape)
}

/// Hard-iron values of each body, NaN if none is learned.
fn irons<'py>(
    slf: &Bound<'py, Attitude>,
    of: impl Fn(&LearnedIron) -> Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(slf)?;
    let values = match this.shared.bank.irons() {
        Some(irons) => irons.iter().flat_map(of).collect(),
        None => vec![f64::NAN; 3 * this.shared.bank.channels()],
    };
    this.shared.arrays(slf.py(), values, &[3])
}

fn flags<'py>(
    slf: &Bound<'py, Attitude>,
    of: impl Fn(&Reading) -> bool,
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(slf)?;
    let values = this.shared.bank.readings().iter().map(of).collect();
    this.shared.numbers(slf.py(), values)
}

/// Components of a rotation, w first, or the argument unchanged.
fn quaternions<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if !given.hasattr("as_quat")? {
        return Ok(given.clone());
    }
    let scalar_first = PyDict::new(given.py());
    scalar_first.set_item("scalar_first", true)?;
    given.call_method("as_quat", (), Some(&scalar_first))
}

/// Prior of the gyro before its first sample.
fn prior(
    py: Python<'_>,
    bias: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    (unit, factor): (&str, f64),
    method: &str,
    options: &mut AutoOptions,
) -> PyResult<()> {
    let zero = vec![0.0; 3].into_pyobject(py)?;
    let given = match (bias, sigma) {
        (None, None) => return Ok(()),
        (bias, _) => bias.unwrap_or(&zero),
    };
    options.bias_sigma = match sigma {
        Some(given) => spread(given)?.map(|x| x * factor),
        None => believed(given, factor)?.unwrap_or(options.bias_sigma),
    };
    let Some(ask) = given.getattr_opt("__gyro_prior__")? else {
        let bias = if is_filter(given)? { &given.getattr("bias")? } else { given };
        options.bias = axes("bias", bias)?.map(|x| x * factor);
        return Ok(());
    };
    let (bias, matrix, sigma): (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>) =
        ask.call1((unit,))?.extract()?;
    if method != "auto" {
        return Err(PyValueError::new_err(format!(
            "bias must be that of the gyro alone for method '{method}', got a calibration: apply \
             it to the samples"
        )));
    }
    options.bias = axes("bias", &bias)?.map(|x| x * factor);
    options.matrix = square("gyro_matrix", &matrix)?;
    options.matrix_sigma = square("gyro_matrix_sigma", &sigma)?;
    Ok(())
}

/// True for a filter that has learned biases.
fn is_filter(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.hasattr("bias")? && given.hasattr("bias_sigma")?)
}

/// Standard deviation of a bias without a stated one, rad/s. Numbers have a fixed value. A learned
/// bias has a tenth of that value, or its own if larger. The bias of a filter without samples is
/// unknown.
fn believed(given: &Bound<'_, PyAny>, unit: f64) -> PyResult<Option<[f64; 3]>> {
    let numbers = NamedOptions::default().bias_sigma;
    if given.hasattr("__gyro_prior__")? {
        return Ok(Some(numbers.map(|x| LEARNED * x)));
    }
    if !is_filter(given)? {
        return Ok(Some(numbers));
    }
    let own = spread(&given.getattr("bias_sigma")?)?;
    let known = own.iter().all(|x| *x > 0.0);
    Ok(known.then(|| std::array::from_fn(|i| (own[i] * unit).max(LEARNED * numbers[i]))))
}

/// Standard deviation of a learned bias, as a share of the standard deviation of stated numbers.
const LEARNED: f64 = 0.1;

/// Standard deviation of each axis, or one for all axes.
fn spread(given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let fits = |shape: &[usize]| shape.is_empty() || shape == [3];
    let found = arrays::named("bias_sigma", given, "(3,)", fits)?.values;
    Ok(std::array::from_fn(|i| found[i % found.len()]))
}

fn axes(name: &str, given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let found = arrays::named(name, given, "(3,)", |shape| shape == [3])?;
    Ok(std::array::from_fn(|i| found.values[i]))
}

fn square(name: &str, given: &Bound<'_, PyAny>) -> PyResult<[[f64; 3]; 3]> {
    let found = arrays::named(name, given, "(3, 3)", |shape| shape == [3, 3])?;
    Ok(std::array::from_fn(|i| std::array::from_fn(|j| found.values[3 * i + j])))
}

fn frame_of(name: &str) -> PyResult<Frame> {
    match name {
        "enu" => Ok(Frame::Enu),
        "ned" => Ok(Frame::Ned),
        "nwu" => Ok(Frame::Nwu),
        _ => {
            Err(PyValueError::new_err(format!("frame must be 'enu', 'ned' or 'nwu', got '{name}'")))
        }
    }
}

fn frame_name(frame: Frame) -> &'static str {
    match frame {
        Frame::Enu => "enu",
        Frame::Ned => "ned",
        Frame::Nwu => "nwu",
    }
}

/// Units of the sensors; the SI unit comes first.
const GYRO_UNITS: [&str; 4] = ["rad/s", "deg/s", "mdeg/s", "deg/h"];
const ACCEL_UNITS: [&str; 4] = ["m/s^2", "g", "mg", "ug"];

/// Name of the unit with this size in SI.
fn unit_of(py: Python<'_>, value: f64, units: &[&str]) -> PyResult<String> {
    for unit in units {
        if factor(py, unit, units[0], "unit")? == value {
            return Ok((*unit).to_owned());
        }
    }
    Ok("...".to_owned())
}

/// Axes in the unit of the gyro, as Python writes them; None for the default.
fn in_unit(axes: [f64; 3], usual: [f64; 3], unit: f64) -> String {
    match axes == usual {
        true => "None".to_owned(),
        false => format!("{:?}", axes.map(|x| quotient(x, unit))),
    }
}

/// Number that gives exactly `x` when multiplied by the unit; short if possible.
fn quotient(x: f64, unit: f64) -> f64 {
    let near = x / unit;
    let short = format!("{near:.14e}").parse().unwrap_or(near);
    let tried = [short, near, near.next_up(), near.next_down()];
    tried.into_iter().find(|found| found * unit == x).unwrap_or(near)
}

/// SI value of one unit of a sensor.
fn factor(py: Python<'_>, unit: &str, si: &str, name: &str) -> PyResult<f64> {
    let found = rules::call(py, Rule::Convert, (1.0, unit, si)).map_err(|_| {
        PyValueError::new_err(format!("{name} must be a unit such as '{si}', got '{unit}'"))
    })?;
    found.extract()
}
