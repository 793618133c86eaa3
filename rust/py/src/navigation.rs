//! Inertial navigation aided by a satellite receiver, for Python.

mod aids;
mod bank;

use std::ops::Range;

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::navigation::{
    Adapt, Aid, AidParams, AidReport, Batch, Fix, FixCounts, Inertial, Kind, Known, Navigates,
    NavigationFilter as Core, NavigationParams, Next, OUTPUTS, Observed, Reading, Record, Rolling,
    STATES, Start, Wheels,
};
use zerorate_core::{Error, memory};

pub use bank::NavigationBank;

use aids::{aided, aids_of, limits_of, of_aids, one_sigma, take_aid};

use crate::common::arrays;
use crate::common::elements;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{exclusive, quoted, reading, streaming, text};

const ADAPTS: [&str; 3] = ["inflate", "free", "fixed"];
const KINDS: [&str; 2] = ["rate", "increment"];
/// Words for the filter's status, by number.
const STATUSES: [&str; 5] = ["waiting", "no heading", "navigating", "coasting", "missing"];
/// Words for the verdict on a fix, by number; a fix after the last sample has the next number.
const VERDICTS: [&str; 3] = ["used", "rejected", "refused"];
const NOT_REACHED: u8 = 3;

/// Position, velocity and attitude of a vehicle from inertial sensors and satellite fixes.
///
/// This is a loosely coupled Kalman filter of 15 errors: position, velocity, orientation, and the
/// biases of gyro and accelerometer. Each sample of the sensors is integrated. Fixes, rest and
/// wheel speeds correct the drift. Body axes are forward, right, down. The earth's axes are north,
/// east, down of WGS84.
///
/// A position or velocity is used if its normalised innovation squared is at most ``gate``. After
/// ten rejections in a row the filter is considered wrong and moves to the next position
/// (``move_count``). A long outage lasts at least two seconds and five usual intervals. The first
/// position after it is rejected until the next position agrees with it. Then the filter accepts
/// both, at any distance. A fix may be up to a second older than the last sample. The filter waits
/// until it knows the heading. With ``vehicle="wheeled"`` it takes the heading from the course
/// above 1 m/s.
///
/// A rate or force that is not finite, or beyond 1e4 rad/s or m/s^2, is missing. The last value
/// replaces it for a tenth of a second, then the standard deviations grow. More than one second
/// without samples, or two seconds without a gyro, is a gap. After a gap the filter waits for a fix
/// and keeps the biases. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// start : Alignment
///     State before the first sample, as returned by ``zr.align``.
/// gyro, accel : NoiseModel or sequence of three, optional
///     Noise of gyro, rad/s, and accelerometer, m/s^2: one model for all axes or one per axis. The
///     default is the noise of consumer sensors: 0.05 deg/s/sqrt(Hz) and 0.02 m/s^2/sqrt(Hz).
/// gyro_vibration : float, default 0.0
///     Additional noise of the gyro from vibration faster than its sampling. The value is a ratio
///     from 0 to 1: the standard deviation of the noise of an axis, divided by the standard
///     deviation of the rate's change between samples.
/// antenna : array_like, shape (3,), default (0, 0, 0)
///     Vector from the sensor to the antenna, body axes, m.
/// antenna_sigma : float or array_like, shape (3,), default 0.0
///     Standard deviation of ``antenna``, m, one or one per axis. If it is not 0, the filter
///     estimates the antenna's position, and the property ``antenna`` returns it.
/// consider_antenna : bool, default False
///     True: do not estimate the antenna's position, but include ``antenna_sigma`` in ``sigma`` and
///     in the gains (Schmidt).
/// vehicle : {None, "wheeled"}, default None
///     "wheeled": the vehicle neither slips sideways nor leaves the ground. Above 1 m/s this
///     corrects the filter five times a second.
/// axle : array_like, shape (3,), optional
///     Only "wheeled": vector from the sensor to the unsteered axle, body axes, m.
/// wheel_sigma : float, optional
///     Only "wheeled": standard deviation of the sideways and vertical velocity, m/s, default 0.3.
/// speed_sigma : float, optional
///     Only "wheeled": standard deviation of the wheels' speed, m/s, default 0.15.
/// gate : float, default 50.0
///     Normalised innovation squared, of three degrees of freedom, above which a fix is rejected.
/// adapt : {"inflate", "free", "fixed"}, default "inflate"
///     "inflate" raises the receiver's stated noise to the Allan variance of the innovations.
///     "free" raises or lowers the stated noise. "fixed" uses the stated noise.
/// covariance_step : float, default 0.1
///     Time between two steps of the covariance, s.
/// kind : {"rate", "increment"}, default "rate"
///     Meaning of the samples: rates and forces, or their integrals since the previous sample.
/// barometer_sigma : float, default 0.5
///     Standard deviation of a barometric height without a stated standard deviation, m.
/// barometer_walk : float, default 0.02
///     Random walk of the barometer's reference, m/sqrt(s).
/// compass_sigma : float, default 0.035
///     Standard deviation of the compass's constant offset before the first reading, rad; 0 means
///     no offset.
/// compass_walk : float, default 0.001
///     Random walk of the compass's offset, rad/sqrt(s).
/// baseline : array_like, shape (3,), optional
///     Vector from the first to the second antenna, body axes, m.
/// limits : dict of str to float, optional
///     Largest standard deviations of ``usable`` outputs: "position" (horizontal) and "height", m,
///     "velocity", m/s, "attitude" (roll and pitch) and "heading", rad. The defaults in this order
///     are 10, 10, 1, 0.05 and 0.17. For "wheeled" they are 5, 5, 0.5, 0.05 and 0.1.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the filter does not use it.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> drive = zr.simulate_drive(duration=120.0, seed=1)
/// >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
/// >>> nav = zr.NavigationFilter(start)
/// >>> track = nav.process(drive.recording(), drive.fixes)
/// >>> def horizontal(track):
/// ...     errors = track.errors(drive.truth_position)[track.time > 60.0, :2]
/// ...     return float(np.sqrt((errors**2).sum(axis=1).mean()))
/// >>> horizontal(track) < 1.5, horizontal(track.smooth()) < 0.8  # m, of fixes of 2 m
/// (True, True)
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct NavigationFilter {
    shared: Navigator<Core>,
}

/// Interface of a navigation filter, or of a bank that shows one filter, for the methods of all
/// streaming classes.
#[derive(Debug)]
pub struct Navigator<N> {
    pub channels: Option<usize>,
    pub bank: Box<N>,
}

impl<N: Navigates + Checkpoint> Navigator<N> {
    pub fn new(navigator: N) -> Self {
        Self { channels: None, bank: Box::new(navigator) }
    }

    pub fn restored(bytes: &[u8]) -> Result<Self, Error> {
        checkpoint::read(bytes).map(Self::new)
    }

    pub fn filter(&self) -> &Core {
        self.bank.filter()
    }

    pub fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        // A saved number takes at most twice its bytes.
        let mut buffer = memory::filled(0, 2 * size_of::<N>()).map_err(NativeError::from)?;
        let bytes = checkpoint::write(&*self.bank, &mut buffer).map_err(NativeError::from)?;
        Ok(PyBytes::new(py, bytes))
    }

    /// Words of the object's text.
    pub fn words(&self) -> Vec<String> {
        let filter = self.filter();
        let params = filter.params();
        let of = |v: &[f64; 3]| format!("({:?}, {:?}, {:?})", v[0], v[1], v[2]);
        let mut words = vec![STATUSES[filter.status() as usize].to_owned()];
        if params.antenna != [0.0; 3] {
            words.push(format!("antenna={}", of(&params.antenna)));
        }
        if let Some(wheels) = &params.wheels {
            words.push(format!("vehicle='wheeled', axle={}", of(&wheels.axle)));
        }
        words.push(format!(
            "gate={}, adapt='{}'",
            text(params.gate),
            ADAPTS[params.adapt as usize]
        ));
        words
    }
}

impl NavigationFilter {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        Ok(Self { shared: Navigator::restored(bytes)? })
    }
}

/// Common part of filters and banks: constructor, methods and properties.
macro_rules! navigating {
    ($class:ident, $core:ty) => {
        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(
                signature = (
                    start, *, gyro=None, accel=None, gyro_vibration=0.0, antenna=None, antenna_sigma=None,
                    consider_antenna=false, vehicle=None, axle=None, wheel_sigma=None, speed_sigma=None,
                    gate=50.0, adapt="inflate", covariance_step=0.1, kind="rate", barometer_sigma=0.5,
                    barometer_walk=0.02, compass_sigma=0.035, compass_walk=0.001, baseline=None,
                    limits=None
                ),
                text_signature = "(start, *, gyro=None, accel=None, gyro_vibration=0.0, antenna=(0.0, 0.0, 0.0), \
                    antenna_sigma=0.0, consider_antenna=False, vehicle=None, axle=None, wheel_sigma=None, \
                    speed_sigma=None, gate=50.0, adapt='inflate', covariance_step=0.1, kind='rate', \
                    barometer_sigma=0.5, barometer_walk=0.02, compass_sigma=0.035, compass_walk=0.001, \
                    baseline=None, limits=None)"
            )]
            // The arguments are the same as in the Python class.
            #[allow(clippy::too_many_arguments)]
            fn new(
                start: &Bound<'_, PyAny>,
                gyro: Option<&Bound<'_, PyAny>>,
                accel: Option<&Bound<'_, PyAny>>,
                gyro_vibration: f64,
                antenna: Option<&Bound<'_, PyAny>>,
                antenna_sigma: Option<&Bound<'_, PyAny>>,
                consider_antenna: bool,
                vehicle: Option<&str>,
                axle: Option<&Bound<'_, PyAny>>,
                wheel_sigma: Option<f64>,
                speed_sigma: Option<f64>,
                gate: f64,
                adapt: &str,
                covariance_step: f64,
                kind: &str,
                barometer_sigma: f64,
                barometer_walk: f64,
                compass_sigma: f64,
                compass_walk: f64,
                baseline: Option<&Bound<'_, PyAny>>,
                limits: Option<&Bound<'_, PyDict>>,
            ) -> PyResult<Self> {
                let (gyro_noise, gyro_walk) = densities("gyro", gyro, GYRO)?;
                let (accel_noise, accel_walk) = densities("accel", accel, ACCEL)?;
                let wheels = wheels(vehicle, axle, wheel_sigma, speed_sigma)?;
                let antenna = lever("antenna", antenna)?;
                let adapt = [Adapt::Inflate, Adapt::Free, Adapt::Fixed][choice("adapt", adapt, &ADAPTS)?];
                let kind = [Kind::Rate, Kind::Increment][choice("kind", kind, &KINDS)?];
                let baseline = baseline.map(|given| three("baseline", given)).transpose()?;
                let aids = AidParams {
                    barometer_sigma,
                    barometer_walk,
                    compass_sigma,
                    compass_walk,
                    baseline,
                };
                let params = NavigationParams {
                    gyro_noise,
                    accel_noise,
                    gyro_walk,
                    accel_walk,
                    gyro_vibration,
                    antenna,
                    antenna_sigma: sigmas("antenna_sigma", antenna_sigma, 0.0)?,
                    consider_antenna,
                    wheels,
                    gate,
                    adapt,
                    covariance_step,
                    kind,
                    aids,
                    limits: limits_of(limits, wheels.is_some())?,
                };
                let start = begun(start, wheels.is_some())?;
                let navigator = <$core>::new(start, params).map_err(NativeError::from)?;
                Ok(Self { shared: Navigator::new(navigator) })
            }

            /// Process one sample of the sensors and return the filter's ``status``.
            ///
            /// Arguments are the sample's time (s), the rate (rad/s, shape (3,)), and the specific
            /// force (m/s^2, shape (3,)). ``rest`` is True if the vehicle is known to stand. The times of the samples
            /// must increase. Otherwise a ValueError is raised, and the filter stays unchanged.
            #[pyo3(signature = (t, gyro, accel, rest=false))]
            fn update<'py>(
                slf: &Bound<'py, Self>,
                t: f64,
                gyro: &Bound<'py, PyAny>,
                accel: &Bound<'py, PyAny>,
                rest: bool,
            ) -> PyResult<&'static str> {
                let gyro = three("gyro", gyro)?;
                let accel = three("accel", accel)?;
                let mut this = exclusive(slf)?;
                let sample = Inertial { time: t, gyro, accel, rest };
                this.shared.bank.update(&sample).map_err(NativeError::from)?;
                Ok(STATUSES[this.shared.filter().status() as usize])
            }

            /// Process a fix of the receiver and return "used", "rejected" or "refused".
            ///
            /// Arguments:
            ///
            /// - the time of measurement, s;
            /// - latitude and longitude, deg, and height, m, (3,);
            /// - velocity north, east, down, m/s, (3,) or None;
            /// - standard deviations of position and velocity, one or three axes.
            ///
            /// Position and velocity are gated separately. A fix with a position is rejected if its
            /// position is rejected. A fix without a position is rejected if its velocity is
            /// rejected. A fix is refused in four cases:
            ///
            /// - It is more than a second older than the last sample.
            /// - It is more than a tenth of a second newer than the last sample.
            /// - It has no finite number.
            /// - Its latitude is beyond 89.5 deg.
            ///
            /// A ValueError is raised if a standard deviation is not positive.
            #[pyo3(signature = (t, position, velocity=None, position_sigma=None, velocity_sigma=None),
                text_signature = "($self, t, position, velocity=None, position_sigma=2.0, \
                    velocity_sigma=0.1)")]
            fn update_gnss<'py>(
                slf: &Bound<'py, Self>,
                t: f64,
                position: &Bound<'py, PyAny>,
                velocity: Option<&Bound<'py, PyAny>>,
                position_sigma: Option<&Bound<'py, PyAny>>,
                velocity_sigma: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<&'static str> {
                let position = three("position", position)?;
                let velocity = velocity.map(|v| three("velocity", v)).transpose()?;
                let fix = Fix {
                    time: t,
                    position: radians(position),
                    velocity: velocity.unwrap_or([f64::NAN; 3]),
                    position_sigma: sigmas("position_sigma", position_sigma, 2.0)?,
                    velocity_sigma: sigmas("velocity_sigma", velocity_sigma, 0.1)?,
                };
                let mut this = exclusive(slf)?;
                Ok(VERDICTS[this.shared.bank.update_gnss(&fix).map_err(NativeError::from)? as usize])
            }

            /// Process the speed of the wheels and return True if it will be used.
            ///
            /// Arguments are the middle of the measurement's time span, s; the speed forward, m/s;
            /// and its standard deviation, by default ``speed_sigma``. The filter estimates the
            /// scale of the wheels, and the direction in which they roll (``wheel_constants``). An
            /// innovation of more than three standard deviations means that a wheel slips. Its
            /// speeds are ignored for ten seconds and then have less weight. A speed is used only
            /// if the heading is known to 0.1 rad. It is not used if it is missing, or over a
            /// second old. A ValueError is raised if the vehicle is not "wheeled", or if the
            /// standard deviation is not positive.
            #[pyo3(signature = (t, speed, sigma=None))]
            fn update_wheels(
                slf: &Bound<'_, Self>,
                t: f64,
                speed: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<bool> {
                let mut this = exclusive(slf)?;
                let speed = speed.unwrap_or(f64::NAN);
                Ok(this.shared.bank.update_wheels(t, speed, sigma).map_err(NativeError::from)?)
            }
        }

        getters! { $class, slf, py, this;
            /// Latitude (deg), longitude (deg) and height (m) of the sensor, shape (3,).
            ///
            /// They are NaN before the first fix.
            position: Object<'py> = arrays::small(py, &degrees(this.shared.filter().snapshot().position));
            /// Velocity north, east and down, m/s, shape (3,); NaN before the first fix.
            velocity: Object<'py> = arrays::small(py, &this.shared.filter().snapshot().velocity);
            /// Quaternion w, x, y, z from the body's axes to north, east, down, shape (4,).
            quaternion: Object<'py> = arrays::small(py, &this.shared.filter().snapshot().quaternion);
            /// Bias of the gyro, rad/s, shape (3,).
            gyro_bias: Object<'py> = arrays::small(py, &this.shared.filter().snapshot().gyro_bias);
            /// Bias of the accelerometer, m/s^2, shape (3,).
            accel_bias: Object<'py> = arrays::small(py, &this.shared.filter().snapshot().accel_bias);
            /// Standard deviations of the state, shape (15,).
            ///
            /// They change at each step of the covariance (``covariance_step``) and at each
            /// correction by a measurement. They are NaN before the first fix. The state is:
            ///
            /// - position north, east and down, m;
            /// - velocity north, east and down, m/s;
            /// - orientation about these axes, rad;
            /// - bias of the gyro, rad/s;
            /// - bias of the accelerometer, m/s^2.
            sigma: Object<'py> = arrays::small(py, &this.shared.filter().snapshot().sigma);
            /// Covariance of the state's errors, in the order of ``sigma``, shape (15, 15).
            ///
            /// The error of the velocity is ``v_estimated - exp(-[phi x]) v``; phi is the error of
            /// the orientation. The error of a bias is the true minus the estimated value.
            covariance: Object<'py> = {
                let covariance = this.shared.filter().covariance();
                let places = (0..STATES * STATES).map(|k| covariance.at(k / STATES, k % STATES));
                arrays::array(py, places.collect(), &[STATES, STATES])?
            };
            /// Scale of the wheels, yaw and pitch (rad) of their rolling direction, shape (3,).
            ///
            /// The wheels roll (1 + scale) times as fast as measured. The constants are NaN before
            /// the first measurement.
            wheel_constants: Object<'py> = arrays::small(py, &this.shared.filter().wheels()[0]);
            /// Standard deviations of ``wheel_constants``, shape (3,).
            wheel_constants_sigma: Object<'py> = arrays::small(py, &this.shared.filter().wheels()[1]);
            /// Normalised innovations squared of the last position and velocity, shape (2,).
            ///
            /// Each is 3 on average if the filter is consistent. They are NaN before the first fix.
            nis: Object<'py> = arrays::small(py, &this.shared.filter().nis());
            /// Standard deviations of the receiver, learned from the innovations, shape (2, 3).
            ///
            /// The first row is for the position, m, the second row for the velocity, m/s. They are
            /// NaN before ten pairs of fixes.
            learned_sigma: Object<'py> = {
                let learned = this.shared.filter().learned_noise();
                arrays::array(py, learned.concat(), &[2, 3])?
            };
            /// Status of the filter.
            ///
            /// - "waiting": the filter waits for a fix.
            /// - "no heading": the heading is unknown.
            /// - "navigating": the normal status.
            /// - "coasting": there have been no fixes for two seconds.
            /// - "missing": a sensor has had no samples for a tenth of a second.
            status: &'static str = STATUSES[this.shared.filter().status() as usize];
            /// Present estimate of the vector from the sensor to the antenna, body axes, m, shape
            /// (3,).
            antenna: Object<'py> = arrays::small(py, &this.shared.filter().antenna()[0]);
            /// Standard deviations of ``antenna``, shape (3,); 0 if ``antenna`` is not estimated.
            antenna_sigma: Object<'py> = arrays::small(py, &this.shared.filter().antenna()[1]);
            /// Time of the last sample, s; NaN before the first.
            time: f64 = this.shared.filter().time();
            /// Samples of the sensors to date, missing ones included.
            samples_seen: u64 = this.shared.filter().samples_seen();
            /// Number of fixes to date for each verdict: "used", "rejected", "refused".
            fix_count: Bound<'py, PyDict> = {
                let FixCounts { used, rejected, refused, .. } = *this.shared.filter().fixes();
                let [one, two, three] = VERDICTS;
                named(py, [(one, used), (two, rejected), (three, refused)])?
            };
            /// Number of "positions" and of "velocities" that the gate has rejected to date.
            rejected_count: Bound<'py, PyDict> = {
                let [positions, velocities] = this.shared.filter().fixes().rejected_of;
                named(py, [("positions", positions), ("velocities", velocities)])?
            };
            /// Number of times that the filter moved to a position after ten rejections in a row.
            move_count: u64 = this.shared.filter().fixes().moved;
            /// Time (s) and distance (m) of the last move; None before the first move.
            last_move: Option<(f64, f64)> = {
                let FixCounts { moved, last_move: [at, by], .. } = *this.shared.filter().fixes();
                (moved > 0).then_some((at, by))
            };
        }
    };
}
pub(crate) use navigating;

streaming!(NavigationFilter);

navigating!(NavigationFilter, Core);
aided!(NavigationFilter);

#[pymethods]
impl NavigationFilter {
    /// Process a recording and a receiver's fixes, and return a `Track` that can be smoothed.
    ///
    /// The recording has a gyro and an accelerometer with times of the same clock. The result
    /// equals a loop over ``update`` and ``update_gnss``. ``rest``, bool (n,), is True where the
    /// vehicle is known to stand. ``wheel_speed`` is the speed of the wheels, m/s, (n,), NaN if
    /// unknown. It may also be `Wheels`, with times and standard deviations. ``time_offset``, s, a
    /// number or a `TimeOffset`, is added to the times of the fixes.
    ///
    /// ``height``, ``pressure``, ``heading`` and ``baseline`` are readings of aids. Each is an
    /// array with one row per sample, (n,) or (n, 3), NaN for no reading. It may also be an `Aid`,
    /// with times and standard deviations. Each wheel speed, reading or fix is processed after the
    /// first sample at or after its time. If several are due at one sample, the order is wheel
    /// speeds, readings by time, fixes.
    ///
    /// ``keep="track"`` omits the smoother's data, for long records. These data take about 2.5 kB
    /// per step of the covariance. They take 4.2 kB if wheels, antenna or constants of aids are
    /// estimated.
    #[pyo3(
        signature = (
            imu, gnss=None, *, rest=None, wheel_speed=None, time_offset=None, keep="all",
            height=None, pressure=None, heading=None, baseline=None
        ),
        text_signature = "($self, imu, gnss=None, *, rest=None, wheel_speed=None, \
            time_offset=0.0, keep='all', height=None, pressure=None, heading=None, baseline=None)"
    )]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        imu: &Bound<'py, PyAny>,
        gnss: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        wheel_speed: Option<&Bound<'py, PyAny>>,
        time_offset: Option<&Bound<'py, PyAny>>,
        keep: &str,
        height: Option<&Bound<'py, PyAny>>,
        pressure: Option<&Bound<'py, PyAny>>,
        heading: Option<&Bound<'py, PyAny>>,
        baseline: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        choice("keep", keep, &["all", "track"])?;
        let aids = (height, pressure, heading, baseline);
        rules::call(
            slf.py(),
            Rule::Navigate,
            (slf, imu, gnss, (rest, wheel_speed, aids), time_offset, keep == "all"),
        )
    }

    /// Process arrays as ``process`` does: times (n,) and samples (n, 3).
    ///
    /// ``fixes`` has one row per fix, shape (m, 13), NaN for missing values: time, position (deg,
    /// deg, m), velocity, and standard deviations of position and velocity. ``wheel_speed`` has a
    /// speed for each sample, (n,), or rows of time, speed and standard deviation, (w, 3). ``aids``
    /// has one row per reading, (a, 8), NaN for missing values: kind, time, reading of three axes
    /// and its standard deviations. The kind is 0 for height, 1 for pressure, 2 for heading and 3
    /// for baseline. The rows of ``wheel_speed`` and ``aids`` are in the order of their times. Each
    /// wheel speed, reading or fix is processed after the first sample at or after its time. At one
    /// sample the order is wheel speeds, readings, fixes.
    ///
    /// The first returned value is a dict of arrays:
    ///
    /// - For each sample: the state, and ``usable``. Bit 0 of ``usable`` is 1 if the position is
    ///   usable; bits 1 to 4 are for height, velocity, attitude and heading.
    /// - For each fix: ``verdict``, ``nis`` (m, 2), ``innovation`` (m, 6) and ``innovation_sigma``
    ///   (m, 6) of position and velocity. ``taken`` is the time at which the fix was used, s.
    /// - For each reading: ``aid_verdict``, ``aid_nis`` and ``aid_taken``.
    ///
    /// A verdict is 0 for used, 1 for rejected, 2 for refused, and 3 for a time after the last
    /// sample. The second returned value is the smoother's record, or None without ``record``. The
    /// interpreter lock is released.
    #[pyo3(signature = (time, gyro, accel, fixes, rest=None, record=false, wheel_speed=None, aids=None))]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process_arrays<'py>(
        slf: &Bound<'py, Self>,
        time: &Bound<'py, PyAny>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        fixes: &Bound<'py, PyAny>,
        rest: Option<&Bound<'py, PyAny>>,
        record: bool,
        wheel_speed: Option<&Bound<'py, PyAny>>,
        aids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyDict>, Option<NavigationRecord>)> {
        let [gyro, accel] = &arrays::taken(slf, ["gyro", "accel"], [Some(gyro), Some(accel)])?;
        let given = Arrays { time, gyro, accel, fixes, rest, wheel_speed, aids };
        let mut steps = Record::default();
        let mut this = exclusive(slf)?;
        let outputs =
            given.run(slf.py(), &mut this.shared, |batch, filter, piece, next, known| {
                if record {
                    let mut observed = Observed { filter, observer: &mut steps };
                    return batch.run(&mut observed, piece, next, known);
                }
                batch.run(filter, piece, next, known)
            })?;
        steps.validate().map_err(NativeError::from)?;
        Ok((outputs, record.then_some(NavigationRecord { steps })))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        Ok(format!("NavigationFilter({})", reading(slf)?.shared.words().join(", ")))
    }
}

/// A record from Python.
pub struct Arrays<'a, 'py> {
    pub time: &'a Bound<'py, PyAny>,
    pub gyro: &'a Bound<'py, PyAny>,
    pub accel: &'a Bound<'py, PyAny>,
    pub fixes: &'a Bound<'py, PyAny>,
    pub rest: Option<&'a Bound<'py, PyAny>>,
    pub wheel_speed: Option<&'a Bound<'py, PyAny>>,
    pub aids: Option<&'a Bound<'py, PyAny>>,
}

impl<'py> Arrays<'_, 'py> {
    /// Processes the record with an object's navigator, piece by piece.
    pub fn run<N: Clone + Send>(
        &self,
        py: Python<'py>,
        navigator: &mut Navigator<N>,
        mut run: impl FnMut(
            &Batch<'_>,
            &mut N,
            Range<usize>,
            &mut Next,
            &mut Known<'_>,
        ) -> Result<(), Error>
        + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let time = arrays::named("time", self.time, "(n,)", |found| found.len() == 1)?.values;
        let n = time.len();
        let expected = format!("({n}, 3)");
        let fits = |found: &[usize]| found == [n, 3];
        let gyro = arrays::named("gyro", self.gyro, &expected, fits)?.values;
        let accel = arrays::named("accel", self.accel, &expected, fits)?.values;
        let many = |found: &[usize]| found.len() == 2 && found[1] == FIX;
        let fixes = arrays::named("fixes", self.fixes, "(m, 13)", many)?.values;
        let rest =
            self.rest.map(|rest| arrays::flags("rest", rest, n)).transpose()?.unwrap_or_default();
        let wheels = self.wheel_speed.map(|given| rollings(given, &time)).transpose()?;
        let wheels = wheels.unwrap_or_default();
        let aids = self.aids.map(aids_of).transpose()?.unwrap_or_default();
        let rows = fixes.as_chunks::<FIX>().0;
        let mut fixes = memory::room(rows.len()).map_err(NativeError::from)?;
        fixes.extend(rows.iter().map(fix_of));
        let batch = Batch {
            time: &time,
            gyro: gyro.as_chunks().0,
            accel: accel.as_chunks().0,
            rest: &rest,
            wheels: &wheels,
            aids: &aids,
            fixes: &fixes,
        };
        let outputs = Outputs::new(py, n, fixes.len(), aids.len())?;
        // After an interrupt or failure the filter returns to its state before the batch.
        let mut bank = navigator.bank.clone();
        outputs.with(|known| {
            let mut next = Next::default();
            for first in (0..n).step_by(PIECE) {
                let piece = first..n.min(first + PIECE);
                let done = py.detach(|| run(&batch, &mut bank, piece, &mut next, known));
                done.map_err(NativeError::from)?;
                py.check_signals()?;
            }
            Ok(())
        })?;
        navigator.bank = bank;
        outputs.into_dict(py)
    }
}

fn named<'py, T: IntoPyObject<'py>, const N: usize>(
    py: Python<'py>,
    values: [(&str, T); N],
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    for (name, value) in values {
        found.set_item(name, value)?;
    }
    Ok(found)
}

/// Numbers of a fix: time, position, velocity, and standard deviations of position and velocity.
const FIX: usize = 13;

fn fix_of(row: &[f64; FIX]) -> Fix {
    let part = |i: usize| [row[i], row[i + 1], row[i + 2]];
    Fix {
        time: row[0],
        position: radians(part(1)),
        velocity: part(4),
        position_sigma: part(7),
        velocity_sigma: part(10),
    }
}

/// Wheel speeds: one per sample, NaN if missing, or rows of time, speed and standard deviation.
fn rollings(given: &Bound<'_, PyAny>, time: &[f64]) -> PyResult<Vec<Rolling>> {
    let n = time.len();
    let fits = |found: &[usize]| found == [n] || (found.len() == 2 && found[1] == 3);
    let found = arrays::named("wheel_speed", given, &format!("({n},)"), fits)?;
    let (rows, _) = found.values.as_chunks::<3>();
    let mut all = memory::room(n.max(rows.len())).map_err(NativeError::from)?;
    if found.shape.len() == 2 {
        all.extend(rows.iter().map(|&[time, speed, sigma]| Rolling { time, speed, sigma }));
    } else {
        let present = time.iter().zip(found.values.iter()).filter(|(_, speed)| !speed.is_nan());
        all.extend(present.map(|(&time, &speed)| Rolling { time, speed, sigma: f64::NAN }));
    }
    Ok(all)
}

/// Outputs of a batch: names and counts of the numbers for each sample, and for each fix.
pub const SAMPLE: [(&str, usize); 6] = [
    ("position", 3),
    ("velocity", 3),
    ("quaternion", 4),
    ("gyro_bias", 3),
    ("accel_bias", 3),
    ("sigma", STATES),
];
const OF_FIX: [(&str, usize); 4] =
    [("nis", 2), ("innovation", 6), ("innovation_sigma", 6), ("taken", 0)];
const OF_AID: [&str; 2] = ["aid_nis", "aid_taken"];
const WORDS: [&str; 4] = ["status", "verdict", "usable", "aid_verdict"];

/// Arrays for the outputs.
struct Outputs<'py> {
    numbers: Vec<Bound<'py, PyArrayDyn<f64>>>,
    words: Vec<Bound<'py, PyArrayDyn<u8>>>,
}

impl<'py> Outputs<'py> {
    fn new(py: Python<'py>, n: usize, fixes: usize, aids: usize) -> PyResult<Self> {
        let of_sample = SAMPLE.iter().map(|(_, size)| arrays::zeros(py, &[n, *size]));
        let mut numbers = of_sample.collect::<PyResult<Vec<_>>>()?;
        for (_, size) in OF_FIX {
            let shape: &[usize] = if size > 0 { &[fixes, size] } else { &[fixes] };
            numbers.push(arrays::filled(py, shape, f64::NAN)?);
        }
        for _ in OF_AID {
            numbers.push(arrays::filled(py, &[aids], f64::NAN)?);
        }
        let words = vec![
            arrays::zeros(py, &[n])?,
            arrays::filled(py, &[fixes], NOT_REACHED)?,
            arrays::zeros(py, &[n])?,
            arrays::filled(py, &[aids], NOT_REACHED)?,
        ];
        Ok(Self { numbers, words })
    }

    fn with(&self, work: impl FnOnce(&mut Known<'_>) -> PyResult<()>) -> PyResult<()> {
        let mut numbers: Vec<_> = self.numbers.iter().map(|array| array.readwrite()).collect();
        let mut words: Vec<_> = self.words.iter().map(|array| array.readwrite()).collect();
        if let [position, velocity, quaternion, gyro, accel, sigma, of_fix @ ..] = &mut numbers[..]
            && let [nis, innovation, innovation_sigma, taken, aid_nis, aid_taken] = of_fix
            && let [status, verdict, usable, aid_verdict] = &mut words[..]
        {
            work(&mut Known {
                position: position.as_slice_mut()?.as_chunks_mut().0,
                velocity: velocity.as_slice_mut()?.as_chunks_mut().0,
                quaternion: quaternion.as_slice_mut()?.as_chunks_mut().0,
                gyro_bias: gyro.as_slice_mut()?.as_chunks_mut().0,
                accel_bias: accel.as_slice_mut()?.as_chunks_mut().0,
                sigma: sigma.as_slice_mut()?.as_chunks_mut().0,
                status: status.as_slice_mut()?,
                verdict: verdict.as_slice_mut()?,
                nis: nis.as_slice_mut()?.as_chunks_mut().0,
                innovation: innovation.as_slice_mut()?.as_chunks_mut().0,
                innovation_sigma: innovation_sigma.as_slice_mut()?.as_chunks_mut().0,
                taken: taken.as_slice_mut()?,
                usable: usable.as_slice_mut()?,
                aid_verdict: aid_verdict.as_slice_mut()?,
                aid_nis: aid_nis.as_slice_mut()?,
                aid_taken: aid_taken.as_slice_mut()?,
            })?;
            position.as_slice_mut()?.as_chunks_mut().0.iter_mut().for_each(|p| *p = degrees(*p));
        }
        Ok(())
    }

    fn into_dict(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        let names = SAMPLE.iter().chain(&OF_FIX).map(|(name, _)| *name).chain(OF_AID);
        for (name, array) in names.zip(self.numbers) {
            found.set_item(name, array)?;
        }
        for (name, array) in WORDS.iter().zip(self.words) {
            found.set_item(name, array)?;
        }
        Ok(found)
    }
}

/// Steps of a filter over a batch for the smoother, about 2.5 kB each.
#[pyclass(module = "zerorate._native", frozen)]
#[derive(Debug)]
pub struct NavigationRecord {
    pub(crate) steps: Record,
}

#[pymethods]
impl NavigationRecord {
    /// Number of steps of the covariance.
    fn __len__(&self) -> usize {
        self.steps.len()
    }

    /// Smooth each of K steps with all fixes, and return arrays by name.
    ///
    /// ``sample`` is the index of the sample at the step's end. ``begins`` is True if the filter
    /// began at this sample. ``before`` and ``after`` are the errors of the state before and after
    /// the step's measurements. ``sigma`` are their standard deviations, (K, 15), in the order of
    /// `NavigationFilter.sigma`. With ``deviations=False``, ``sigma`` is left out: the call is then
    /// many times faster.
    #[pyo3(signature = (deviations=true))]
    fn smoothed<'py>(&self, py: Python<'py>, deviations: bool) -> PyResult<Bound<'py, PyDict>> {
        let count = self.steps.len();
        let room = |width: usize| memory::filled(0.0, count.saturating_mul(width));
        let mut numbers = Vec::new();
        let names =
            if deviations { &["before", "after", "sigma"][..] } else { &["before", "after"] };
        for _ in names {
            numbers.push(room(STATES).map_err(NativeError::from)?);
        }
        let mut sample = memory::filled(0_i64, count).map_err(NativeError::from)?;
        let mut begins = memory::filled(false, count).map_err(NativeError::from)?;
        let (mut steps, mut left) = (self.steps.smoothed(deviations), count);
        while left > 0 {
            py.detach(|| {
                for step in steps.by_ref().take(STEPS) {
                    left -= 1;
                    (sample[left], begins[left]) = (step.sample as i64, step.begins);
                    let parts = [&step.before, &step.after, &step.sigma];
                    for (numbers, part) in numbers.iter_mut().zip(parts) {
                        numbers[STATES * left..][..STATES].copy_from_slice(part);
                    }
                }
            });
            py.check_signals()?;
        }
        let found = PyDict::new(py);
        for (name, values) in names.iter().zip(numbers) {
            found.set_item(name, arrays::array(py, values, &[count, STATES])?)?;
        }
        found.set_item("sample", arrays::array(py, sample, &[count])?)?;
        found.set_item("begins", arrays::array(py, begins, &[count])?)?;
        Ok(found)
    }
}

/// Samples between two checks for signals, and steps of the smoother between two checks.
const PIECE: usize = 1 << 17;
const STEPS: usize = 1 << 12;

/// White noise and random walk of the bias of consumer sensors, SI: for sensors without a model.
const GYRO: [f64; 2] = [0.05 * (std::f64::consts::PI / 180.0), 1e-5];
const ACCEL: [f64; 2] = [0.02, 5e-4];

/// Squares of white noise and random walk of three axes, from one model or one model per axis.
fn densities(
    sensor: &str,
    model: Option<&Bound<'_, PyAny>>,
    usual: [f64; 2],
) -> PyResult<([f64; 3], [f64; 3])> {
    let squares = |all: [[f64; 2]; 3]| {
        let of = |i: usize| all.map(|axis| axis[i] * axis[i]);
        (of(0), of(1))
    };
    let Some(model) = model else { return Ok(squares([usual; 3])) };
    if let Some(axis) = of_axis(sensor, model, usual)? {
        return Ok(squares([axis; 3]));
    }
    let no_models = || {
        let text = format!("{sensor} must be a NoiseModel or three of them, one an axis");
        PyTypeError::new_err(text)
    };
    let mut axes = Vec::new();
    for model in model.try_iter().map_err(|_| no_models())? {
        axes.push(of_axis(sensor, &model?, usual)?.ok_or_else(no_models)?);
    }
    Ok(squares(axes.try_into().map_err(|_| no_models())?))
}

/// White noise and random walk of one axis, from a model.
fn of_axis(
    sensor: &str,
    model: &Bound<'_, PyAny>,
    [_, usual]: [f64; 2],
) -> PyResult<Option<[f64; 2]>> {
    let Some(ask) = model.getattr_opt("__noise_densities__")? else { return Ok(None) };
    let (white, walk): (f64, Option<f64>) = ask.call1((sensor,))?.extract()?;
    Ok(Some([white, walk.unwrap_or(usual)]))
}

/// State before the first sample, from an ``Alignment``.
fn begun(start: &Bound<'_, PyAny>, wheeled: bool) -> PyResult<Start> {
    let needed = "start must be an Alignment, as zr.align returns it";
    let get = |name: &str| {
        start.getattr(name).map_err(|_| {
            let found = start.get_type().name().map(|name| name.to_string()).unwrap_or_default();
            PyValueError::new_err(format!("{needed}, got {found}"))
        })
    };
    let number = |name: &str| get(name)?.extract::<f64>();
    let vector = |name: &str| get(name)?.extract::<[f64; 3]>();
    let quaternion: [f64; 4] = get("quaternion")?.extract()?;
    let heading_known: bool = get("heading_known")?.extract()?;
    Ok(Start {
        quaternion,
        heading_known,
        course: wheeled || get("course")?.extract()?,
        time: number("time")?,
        latitude: number("latitude")?.to_radians(),
        gyro_bias: vector("gyro_bias")?,
        accel_bias: vector("accel_bias")?,
        level_sigma: number("level_sigma")?,
        heading_sigma: number("heading_sigma")?,
        gyro_bias_sigma: number("gyro_bias_sigma")?,
        accel_bias_sigma: number("accel_bias_sigma")?,
    })
}

fn wheels(
    vehicle: Option<&str>,
    axle: Option<&Bound<'_, PyAny>>,
    sigma: Option<f64>,
    speed_sigma: Option<f64>,
) -> PyResult<Option<Wheels>> {
    match vehicle {
        Some("wheeled") => {
            let sigma = sigma.unwrap_or(WHEEL_SIGMA);
            let speed_sigma = speed_sigma.unwrap_or(SPEED_SIGMA);
            Ok(Some(Wheels { axle: lever("axle", axle)?, sigma, speed_sigma }))
        }
        Some(other) => {
            Err(PyValueError::new_err(format!("vehicle must be None or 'wheeled', got '{other}'")))
        }
        None => match (axle, sigma.or(speed_sigma)) {
            (None, None) => Ok(None),
            (Some(_), _) => Err(PyValueError::new_err("axle is used by vehicle='wheeled' only")),
            (None, Some(_)) => {
                let name = if sigma.is_some() { "wheel_sigma" } else { "speed_sigma" };
                Err(PyValueError::new_err(format!("{name} is used by vehicle='wheeled' only")))
            }
        },
    }
}

const WHEEL_SIGMA: f64 = 0.3;
const SPEED_SIGMA: f64 = 0.15;

fn choice(name: &str, given: &str, words: &[&str]) -> PyResult<usize> {
    words.iter().position(|word| *word == given).ok_or_else(|| {
        let words = quoted(words, "or");
        PyValueError::new_err(format!("{name} must be {words}, got '{given}'"))
    })
}

fn lever(name: &str, given: Option<&Bound<'_, PyAny>>) -> PyResult<[f64; 3]> {
    given.map_or(Ok([0.0; 3]), |given| three(name, given))
}

/// Three numbers; None becomes NaN.
#[inline]
fn three(name: &str, given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    if let Some(usual) = elements::three(given) {
        return Ok(usual);
    }
    if given.is_none() {
        return Ok([f64::NAN; 3]);
    }
    let found = arrays::named(name, given, "(3,)", |found| found == [3])?.values;
    Ok([found[0], found[1], found[2]])
}

/// One standard deviation for all axes, or three.
fn sigmas(name: &str, given: Option<&Bound<'_, PyAny>>, usual: f64) -> PyResult<[f64; 3]> {
    let Some(given) = given else { return Ok([usual; 3]) };
    match arrays::sample(given) {
        Ok(one) => Ok([one; 3]),
        Err(_) => three(name, given),
    }
}

fn radians([latitude, longitude, height]: [f64; 3]) -> [f64; 3] {
    [latitude.to_radians(), longitude.to_radians(), height]
}

#[inline(always)]
fn degrees([latitude, longitude, height]: [f64; 3]) -> [f64; 3] {
    [latitude.to_degrees(), longitude.to_degrees(), height]
}
