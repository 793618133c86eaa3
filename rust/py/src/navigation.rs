//! Inertial navigation aided by a satellite receiver, for Python.

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::navigation::{
    AID_SENSORS, Adapt, Aid, AidParams, AidReport, Batch, Fix, FixCounts, Inertial, Kind, Known,
    LIMITS, Limits, NavigationFilter as Core, NavigationParams, Next, OUTPUTS, Reading, Record,
    Rolling, STATES, Start, WHEELED_LIMITS, Wheels,
};
use zerorate_core::{Error, checkpoint, memory};

use crate::common::arrays;
use crate::common::elements;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{exclusive, quoted, reading, streaming, text};

const ADAPTS: [&str; 3] = ["inflate", "free", "fixed"];
const KINDS: [&str; 2] = ["rate", "increment"];
/// Words for what the filter is doing, by number.
const STATUSES: [&str; 5] = ["waiting", "no heading", "navigating", "coasting", "missing"];
/// Words for what became of a fix, by number; one after the last sample has the next number.
const VERDICTS: [&str; 3] = ["used", "rejected", "refused"];
const NOT_REACHED: u8 = 3;
/// Bytes that a saved filter has at most.
const BYTES: usize = 1 << 13;

/// Position, velocity and attitude of a vehicle from its gyro, accelerometer and satellite receiver.
///
/// A loosely coupled Kalman filter of 15 errors: position, velocity, orientation and the biases of gyro
/// and accelerometer. The sensors are integrated at every sample; fixes of the receiver, rest and wheels
/// correct what drifts. Body axes are forward, right, down; the earth's north, east, down, WGS84.
///
/// A position or velocity is used if its normalised innovation squared is at most ``gate``. After
/// ten rejections in a row the filter is considered wrong and moves to the next position
/// (``move_count``). After an outage of two seconds, and of five usual intervals, a position is
/// rejected until the next one agrees with it; then the filter accepts both, however far it has
/// drifted. A fix may be up to a second late. Without a known heading the filter waits, and with
/// ``vehicle= "wheeled"`` takes it from the course above 1 m/s.
///
/// A rate or force that is not finite, or beyond 1e4 rad/s or m/s^2, is missing: the last one
/// replaces it for a tenth of a second, then the standard deviations grow. After a gap of more than
/// a second, or two without a gyro, the filter waits for a fix; biases are kept. One object serves
/// one thread at a time.
///
/// Parameters
/// ----------
/// start : Alignment
///     State before the first sample, as ``zr.align`` returns it.
/// gyro, accel : NoiseModel or sequence of three, optional
///     Noise of the sensors, rad/s and m/s^2, the same for all axes or one each; by default that of
///     consumer sensors: 0.05 deg/s/sqrt(Hz) and 0.02 m/s^2/sqrt(Hz).
/// antenna : array_like, shape (3,), default (0, 0, 0)
///     Vector from the sensor to the antenna, body axes, m.
/// antenna_sigma : float or array_like, shape (3,), default 0.0
///     Its standard deviation, m, one or one per axis: if it is not 0, the antenna's position is
///     estimated (``antenna``).
/// consider_antenna : bool, default False
///     Do not estimate the position; its standard deviation counts in ``sigma`` and gains (Schmidt).
/// vehicle : {None, "wheeled"}, default None
///     "wheeled": it neither slips sideways nor leaves the ground; applied five times a second
///     above 1 m/s.
/// axle : array_like, shape (3,), optional
///     Of "wheeled": vector from the sensor to the unsteered axle, body axes, m.
/// wheel_sigma : float, optional
///     Of "wheeled": standard deviation of the velocity across, m/s, default 0.3.
/// speed_sigma : float, optional
///     Of "wheeled": standard deviation of the wheels' speed, m/s, default 0.15.
/// gate : float, default 50.0
///     Normalised innovation squared, of three degrees of freedom, above which a fix is rejected.
/// adapt : {"inflate", "free", "fixed"}, default "inflate"
///     "inflate" raises the receiver's stated noise to the Allan variance of the innovations,
///     "free" also lowers it, "fixed" uses the stated noise.
/// covariance_step : float, default 0.1
///     Time between two steps of the covariance, s.
/// kind : {"rate", "increment"}, default "rate"
///     Samples are rates and forces, or their integrals since the sample before.
/// barometer_sigma : float, default 0.5
///     Standard deviation of a barometric height for which none is given, m.
/// barometer_walk : float, default 0.02
///     Random walk of the barometer's reference, m/sqrt(s).
/// compass_sigma : float, default 0.035
///     Standard deviation of the compass's constant offset before the first reading, rad; 0: none.
/// compass_walk : float, default 0.001
///     Random walk of that offset, rad/sqrt(s).
/// baseline : array_like, shape (3,), optional
///     Vector from the first to the second antenna, body axes, m.
/// limits : dict of str to float, optional
///     Standard deviations up to which outputs are ``usable``: "position" (horizontal) and "height",
///     m, "velocity", m/s, "attitude" (roll and pitch) and "heading", rad; default 10, 10, 1, 0.05,
///     0.17, or 5, 5, 0.5, 0.05, 0.1 for "wheeled".
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or is not used.
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
    shared: Navigator,
}

/// Interface of a bank for the methods of all streaming classes: one filter.
#[derive(Debug)]
struct Navigator {
    channels: Option<usize>,
    bank: Box<Core>,
}

impl Navigator {
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut buffer = memory::filled(0, BYTES).map_err(NativeError::from)?;
        let bytes = checkpoint::write(&*self.bank, &mut buffer).map_err(NativeError::from)?;
        Ok(PyBytes::new(py, bytes))
    }
}

impl NavigationFilter {
    fn of(filter: Core) -> Self {
        Self { shared: Navigator { channels: None, bank: Box::new(filter) } }
    }

    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        checkpoint::read(bytes).map(Self::of)
    }
}

streaming!(NavigationFilter);

#[pymethods]
impl NavigationFilter {
    #[new]
    #[pyo3(
        signature = (
            start, *, gyro=None, accel=None, antenna=None, antenna_sigma=None,
            consider_antenna=false, vehicle=None, axle=None, wheel_sigma=None, speed_sigma=None,
            gate=50.0, adapt="inflate", covariance_step=0.1, kind="rate", barometer_sigma=0.5,
            barometer_walk=0.02, compass_sigma=0.035, compass_walk=0.001, baseline=None, limits=None
        ),
        text_signature = "(start, *, gyro=None, accel=None, antenna=(0.0, 0.0, 0.0), \
            antenna_sigma=0.0, consider_antenna=False, vehicle=None, axle=None, wheel_sigma=None, \
            speed_sigma=None, gate=50.0, adapt='inflate', covariance_step=0.1, kind='rate', \
            barometer_sigma=0.5, barometer_walk=0.02, compass_sigma=0.035, compass_walk=0.001, \
            baseline=None, limits=None)"
    )]
    // The arguments are those of the class in Python.
    #[allow(clippy::too_many_arguments)]
    fn new(
        start: &Bound<'_, PyAny>,
        gyro: Option<&Bound<'_, PyAny>>,
        accel: Option<&Bound<'_, PyAny>>,
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
        let aids =
            AidParams { barometer_sigma, barometer_walk, compass_sigma, compass_walk, baseline };
        let params = NavigationParams {
            gyro_noise,
            accel_noise,
            gyro_walk,
            accel_walk,
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
        let filter = Core::new(start, params).map_err(NativeError::from)?;
        Ok(Self::of(filter))
    }

    /// Takes one sample of the sensors: its time, s, and gyro and accelerometer, rad/s and m/s^2, (3,);
    /// ``rest`` says that the vehicle is known to stand. Returns ``status``; ValueError if the time is not
    /// later than that of the sample before, which changes nothing.
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
        Ok(STATUSES[this.shared.bank.status() as usize])
    }

    /// Takes a fix of the receiver: when it was measured, s, latitude and longitude, deg, and height, m,
    /// (3,); velocity north, east, down, m/s, (3,) or None; their deviations, one or three axes. Returns
    /// "used", "rejected" or "refused". The gate judges position and velocity apart; a fix is rejected if
    /// its position is, or the velocity of one without a position. It is refused if it is over a second
    /// old, a tenth of a second ahead of the sensors, without a number, or beyond 89.5 deg. ValueError if
    /// a deviation is not positive.
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

    /// Takes the speed that wheels tell: when, s, the middle of the time over which it is measured, how
    /// fast they roll forward, m/s, and its deviation, by default ``speed_sigma``. Their scale, and the yaw
    /// and pitch of the axis along which they roll, are estimated (``wheel_constants``). A wheel that
    /// slips, with an innovation of over three deviations, is not believed for ten seconds, then less.
    /// Returns True if it will be used: not before the heading is known to 0.1 rad, nor if it is
    /// over a second old or missing. ValueError if the vehicle is not "wheeled", or the deviation
    /// not positive.
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

    /// Takes a barometric height above any reference, which is estimated (``height_reference``): when,
    /// s, m, and its standard deviation, m, by default ``barometer_sigma``. Returns "used", "rejected"
    /// or "refused". A reading that disagrees with the filter is rejected, and so are those after a
    /// disturbance until they agree for a second; if they disagree by a constant amount for three, the
    /// reference has changed. One is refused if it is over a second old, a tenth of a second ahead of the
    /// sensors, not later than the one before, or missing. ValueError if ``sigma`` is not positive.
    #[pyo3(signature = (t, height, sigma=None))]
    fn update_height(
        slf: &Bound<'_, Self>,
        t: f64,
        height: Option<f64>,
        sigma: Option<f64>,
    ) -> PyResult<&'static str> {
        aided(slf, t, Reading::Height(height.unwrap_or(f64::NAN)), one_sigma(sigma))
    }

    /// Takes a pressure, Pa, as a height of the standard atmosphere, and as ``update_height`` does; its
    /// standard deviation is in Pa. One below 5474.89 or above 115000 Pa is refused: hPa and kPa are.
    #[pyo3(signature = (t, pressure, sigma=None))]
    fn update_pressure(
        slf: &Bound<'_, Self>,
        t: f64,
        pressure: Option<f64>,
        sigma: Option<f64>,
    ) -> PyResult<&'static str> {
        aided(slf, t, Reading::Pressure(pressure.unwrap_or(f64::NAN)), one_sigma(sigma))
    }

    /// Takes the heading of the body's forward axis from a compass: when, s, true north over east, rad,
    /// and its standard deviation, rad. Its constant offset is estimated (``compass_offset``). Before
    /// the first fix it is the heading if none is known. A reading that disagrees with the filter is
    /// rejected, and so are those after a disturbance until they agree for two seconds; if they
    /// disagree by a constant amount for ten, the offset has changed. A value that stays the same to the
    /// bit for two seconds while the vehicle moves is that of a frozen compass. Returns as
    /// ``update_height``; a heading beyond 4 pi, or of a forward axis within 10 deg of the vertical, is
    /// refused.
    #[pyo3(signature = (t, heading, sigma=None), text_signature = "($self, t, heading, sigma=0.05)")]
    fn update_heading(
        slf: &Bound<'_, Self>,
        t: f64,
        heading: Option<f64>,
        sigma: Option<f64>,
    ) -> PyResult<&'static str> {
        aided(slf, t, Reading::Heading(heading.unwrap_or(f64::NAN)), one_sigma(sigma))
    }

    /// Takes the vector from the first to the second antenna: when, s, north, east, down, m, (3,); the
    /// same in body axes, m, (3,), by default that of the constructor; its standard deviation, m, one or
    /// three axes. It is rejected unless it is as long as ``baseline``, and agrees with the filter, also
    /// on average; after a disturbance it must agree for two seconds. Returns as ``update_height``. ValueError if no baseline is given.
    #[pyo3(signature = (t, vector, baseline=None, sigma=None),
        text_signature = "($self, t, vector, baseline=None, sigma=0.02)")]
    fn update_baseline<'py>(
        slf: &Bound<'py, Self>,
        t: f64,
        vector: &Bound<'py, PyAny>,
        baseline: Option<&Bound<'py, PyAny>>,
        sigma: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<&'static str> {
        let vector = three("vector", vector)?;
        let baseline = baseline.map(|given| three("baseline", given)).transpose()?;
        let sigma = sigmas("sigma", sigma, f64::NAN)?;
        aided(slf, t, Reading::Baseline(vector, baseline), sigma)
    }

    /// Takes a recording with a gyro and an accelerometer on one clock, and the fixes of a receiver;
    /// returns the `Track`: what a loop over ``update`` and ``update_gnss`` would have said after each
    /// sample, and the smoother. ``rest``, bool (n,), says where the vehicle is known to stand,
    /// ``wheel_speed``, (n,), how fast its wheels roll, m/s, NaN where they do not tell, or `Wheels` with
    /// times and deviations of their own; ``time_offset``, a number or a `TimeOffset`, is added to the times
    /// of the fixes, s. ``height``, ``pressure``, ``heading`` and ``baseline``, (n,) or (n, 3), NaN where
    /// there is no reading, or `Aid` with times and deviations of its own, are the readings of aids.
    /// After each sample come the wheels that are due, then the aids in the order of their times, then
    /// the fixes. ``keep="track"`` leaves out what the smoother needs, about 2.5 kB a step of the
    /// covariance and 1.7 more where wheels, antenna or aids are estimated: for long records.
    #[pyo3(
        signature = (
            imu, gnss=None, *, rest=None, wheel_speed=None, time_offset=None, keep="all",
            height=None, pressure=None, heading=None, baseline=None
        ),
        text_signature = "($self, imu, gnss=None, *, rest=None, wheel_speed=None, \
            time_offset=0.0, keep='all', height=None, pressure=None, heading=None, baseline=None)"
    )]
    // The arguments are those of the method in Python.
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

    /// Do the work of ``process`` with arrays: times (n,), samples (n, 3), and of m fixes the rows
    /// time, position (deg, deg, m), velocity, standard deviations of both, shape (m, 13), NaN for
    /// what a fix lacks. ``wheel_speed`` has a speed for each sample, (n,), or rows of time, speed
    /// and standard deviation, (w, 3), in order. ``aids`` has rows of kind (0 height, 1 pressure, 2
    /// heading, 3 baseline), time, reading and standard deviation of three axes, (a, 8), in order, NaN
    /// for what is not there. A fix is taken after the first sample that is not before it, after the
    /// aids and wheels that are due. Returns by name the state after each sample, with the bits of its
    /// ``usable`` outputs, of each reading its ``aid_verdict``, ``aid_nis`` and ``aid_taken``, and of each fix
    /// its ``verdict`` (used, rejected, refused, or 3 if it comes after the last sample), ``nis``
    /// (m, 2), the ``innovation`` of each axis of position and velocity (m, 6), its standard
    /// deviation ``innovation_sigma`` (m, 6), and the time at which it was ``taken``, s; with
    /// ``record`` also the record for the smoother, else None. The interpreter lock is released.
    #[pyo3(signature = (time, gyro, accel, fixes, rest=None, record=false, wheel_speed=None, aids=None))]
    // The arguments are those of the method in Python.
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
        let given = [Some(gyro), Some(accel)];
        let [gyro, accel] = arrays::taken(slf, ["gyro", "accel"], given)?;
        let (py, mut this) = (slf.py(), exclusive(slf)?);
        let time = arrays::named("time", time, "(n,)", |found| found.len() == 1)?.values;
        let n = time.len();
        let expected = format!("({n}, 3)");
        let fits = |found: &[usize]| found == [n, 3];
        let gyro = arrays::named("gyro", &gyro, &expected, fits)?.values;
        let accel = arrays::named("accel", &accel, &expected, fits)?.values;
        let many = |found: &[usize]| found.len() == 2 && found[1] == FIX;
        let fixes = arrays::named("fixes", fixes, "(m, 13)", many)?.values;
        let rest = rest.map(|rest| arrays::flags("rest", rest, n)).transpose()?.unwrap_or_default();
        let wheels = wheel_speed.map(|given| rollings(given, &time)).transpose()?;
        let wheels = wheels.unwrap_or_default();
        let aids = aids.map(aids_of).transpose()?.unwrap_or_default();
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
        // A batch that is interrupted or fails leaves the filter as it was.
        let (mut filter, mut steps) = (this.shared.bank.clone(), Record::default());
        outputs.with(|known| {
            let mut next = Next::default();
            for first in (0..n).step_by(PIECE) {
                let piece = first..n.min(first + PIECE);
                let done = py.detach(|| match record {
                    true => batch.run(&mut filter, piece, &mut next, known, &mut steps),
                    false => batch.run(&mut filter, piece, &mut next, known, &mut ()),
                });
                done.map_err(NativeError::from)?;
                py.check_signals()?;
            }
            Ok(())
        })?;
        steps.validate().map_err(NativeError::from)?;
        this.shared.bank = filter;
        Ok((outputs.into_dict(py)?, record.then_some(NavigationRecord { steps })))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let params = this.shared.bank.params();
        let of = |v: &[f64; 3]| format!("({:?}, {:?}, {:?})", v[0], v[1], v[2]);
        let mut words = vec![STATUSES[this.shared.bank.status() as usize].to_owned()];
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
        Ok(format!("NavigationFilter({})", words.join(", ")))
    }
}

getters! { NavigationFilter, slf, py, this;
    /// Latitude and longitude, deg, and height, m, of the sensor; NaN before the first fix: (3,).
    position: Object<'py> = arrays::small(py, &degrees(this.shared.bank.snapshot().position));
    /// North, east and down, m/s; NaN before the first fix: (3,).
    velocity: Object<'py> = arrays::small(py, &this.shared.bank.snapshot().velocity);
    /// Quaternion w, x, y, z from the body's axes to north, east, down: (4,).
    quaternion: Object<'py> = arrays::small(py, &this.shared.bank.snapshot().quaternion);
    /// Bias of the gyro, rad/s: (3,).
    gyro_bias: Object<'py> = arrays::small(py, &this.shared.bank.snapshot().gyro_bias);
    /// Bias of the accelerometer, m/s^2: (3,).
    accel_bias: Object<'py> = arrays::small(py, &this.shared.bank.snapshot().accel_bias);
    /// Standard deviations at the last step of the covariance: position and velocity north, east and
    /// down, m and m/s, orientation about these axes, rad, biases of gyro and accelerometer, rad/s and
    /// m/s^2; NaN before the first fix: (15,).
    sigma: Object<'py> = arrays::small(py, &this.shared.bank.snapshot().sigma);
    /// Covariance of the errors at its last step, in the order of ``sigma``; that of the velocity is
    /// ``v_estimated - exp(-[phi x]) v`` with phi the error of the orientation, those of biases are true
    /// less estimated: (15, 15).
    covariance: Object<'py> = {
        let covariance = this.shared.bank.covariance();
        let places = (0..STATES * STATES).map(|k| covariance.at(k / STATES, k % STATES));
        arrays::array(py, places.collect(), &[STATES, STATES])?
    };
    /// Scale of the wheels, and yaw and pitch, rad, of the axis along which they roll: they roll
    /// (1 + scale) times as fast as they tell; NaN before they tell anything: (3,).
    wheel_constants: Object<'py> = arrays::small(py, &this.shared.bank.wheels()[0]);
    /// Standard deviations of ``wheel_constants``: (3,).
    wheel_constants_sigma: Object<'py> = arrays::small(py, &this.shared.bank.wheels()[1]);
    /// Normalised innovations squared of the last position and velocity, 3 on average in a filter that
    /// is consistent; NaN before the first: (2,).
    nis: Object<'py> = arrays::small(py, &this.shared.bank.nis());
    /// Standard deviations of the receiver that the innovations show, position and velocity, m and m/s;
    /// NaN until ten pairs of fixes were seen: (2, 3).
    learned_sigma: Object<'py> = {
        let learned = this.shared.bank.learned_noise();
        arrays::array(py, learned.concat(), &[2, 3])?
    };
    /// "waiting" for a fix, "no heading", "navigating", "coasting" without fixes for two seconds, or
    /// "missing": without samples of a sensor for a tenth of a second.
    status: &'static str = STATUSES[this.shared.bank.status() as usize];
    /// From the sensor to the antenna, body axes, m, as far as is known: (3,).
    antenna: Object<'py> = arrays::small(py, &this.shared.bank.antenna()[0]);
    /// Standard deviations of ``antenna``, 0 if it is not estimated: (3,).
    antenna_sigma: Object<'py> = arrays::small(py, &this.shared.bank.antenna()[1]);
    /// Time of the last sample, s; NaN before the first.
    time: f64 = this.shared.bank.time();
    /// Samples of the sensors to date, missing ones included.
    samples_seen: u64 = this.shared.bank.samples_seen();
    /// Fixes to date by what became of them: "used", "rejected", "refused".
    fix_count: Bound<'py, PyDict> = {
        let FixCounts { used, rejected, refused, .. } = *this.shared.bank.fixes();
        let [one, two, three] = VERDICTS;
        named(py, [(one, used), (two, rejected), (three, refused)])?
    };
    /// Counts of fixes that the gate has rejected to date: "positions" and "velocities".
    rejected_count: Bound<'py, PyDict> = {
        let [positions, velocities] = this.shared.bank.fixes().rejected_of;
        named(py, [("positions", positions), ("velocities", velocities)])?
    };
    /// Barometric less ellipsoidal height, m; NaN before the first reading.
    height_reference: f64 = this.shared.bank.height_reference()[0];
    /// Standard deviation of ``height_reference``.
    height_reference_sigma: f64 = this.shared.bank.height_reference()[1];
    /// Reading of the compass minus the true heading, rad; NaN before the first reading.
    compass_offset: f64 = this.shared.bank.compass_offset()[0];
    /// Standard deviation of ``compass_offset``.
    compass_offset_sigma: f64 = this.shared.bank.compass_offset()[1];
    /// Readings to date of "barometer", "compass" and "baseline" by what became of them: "used",
    /// "rejected", "refused".
    aid_count: Bound<'py, PyDict> = {
        let counts = |report: &AidReport| {
            let [used, rejected, refused] = report.counts;
            let [one, two, three] = VERDICTS;
            named(py, [(one, used), (two, rejected), (three, refused)])
        };
        of_aids(py, &this.shared.bank, counts)?
    };
    /// Normalised innovation squared of the last reading of each aid, 1 on average, 3 of a baseline;
    /// NaN before the first.
    aid_nis: Bound<'py, PyDict> = of_aids(py, &this.shared.bank, |report| Ok(report.nis))?;
    /// Standard deviation of each aid that the innovations show, m, rad and m; NaN until ten pairs
    /// of readings were seen.
    aid_sigma: Bound<'py, PyDict> = of_aids(py, &this.shared.bank, |report| Ok(report.sigma))?;
    /// True for each aid whose readings are rejected until they agree with the filter again.
    aid_disturbed: Bound<'py, PyDict> = of_aids(py, &this.shared.bank, |report| Ok(report.disturbed))?;
    /// True for each output whose standard deviation is within its limit; once lost, from 0.7 of it.
    usable: Bound<'py, PyDict> = {
        let bits = this.shared.bank.usable();
        named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], bits >> k & 1 == 1)))?
    };
    /// Standard deviations up to which outputs are usable.
    limits: Bound<'py, PyDict> = {
        let limits = this.shared.bank.params().limits;
        named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], limits[k])))?
    };
    /// Number of moves of the filter to the positions, after ten in a row that were rejected.
    move_count: u64 = this.shared.bank.fixes().moved;
    /// Time of the last move, s, and its distance, m; None before the first.
    last_move: Option<(f64, f64)> = {
        let FixCounts { moved, last_move: [at, by], .. } = *this.shared.bank.fixes();
        (moved > 0).then_some((at, by))
    };
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

/// One value for each aid.
fn of_aids<'py, T: IntoPyObject<'py>>(
    py: Python<'py>,
    filter: &Core,
    of: impl Fn(&AidReport) -> PyResult<T>,
) -> PyResult<Bound<'py, PyDict>> {
    let [one, two, three] = filter.aids();
    let [first, second, third] = AID_SENSORS;
    named(py, [(first, of(&one)?), (second, of(&two)?), (third, of(&three)?)])
}

fn aided(
    slf: &Bound<'_, NavigationFilter>,
    time: f64,
    reading: Reading,
    sigma: [f64; 3],
) -> PyResult<&'static str> {
    let mut this = exclusive(slf)?;
    let aid = Aid { time, reading, sigma };
    Ok(VERDICTS[this.shared.bank.update_aid(&aid).map_err(NativeError::from)? as usize])
}

/// NaN for a standard deviation that is not given; one that is NaN is no number.
fn one_sigma(given: Option<f64>) -> [f64; 3] {
    [given.map_or(f64::NAN, |sigma| if sigma.is_nan() { 0.0 } else { sigma }); 3]
}

/// The usual limits, or those given.
fn limits_of(given: Option<&Bound<'_, PyDict>>, wheeled: bool) -> PyResult<Limits> {
    let mut limits = if wheeled { WHEELED_LIMITS } else { LIMITS };
    for (name, limit) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        limits[choice("limits", &name, &OUTPUTS)?] = limit.extract()?;
    }
    Ok(limits)
}

/// Numbers of a reading: kind, time, values and standard deviations.
const AID: usize = 8;

fn aids_of(given: &Bound<'_, PyAny>) -> PyResult<Vec<Aid>> {
    let fits = |found: &[usize]| found.len() == 2 && found[1] == AID;
    let rows = arrays::named("aids", given, "(a, 8)", fits)?.values;
    let rows = rows.as_chunks::<AID>().0;
    let mut aids = memory::room(rows.len()).map_err(NativeError::from)?;
    for [kind, time, x, y, z, sigma @ ..] in rows {
        let reading = match *kind as u8 {
            0 => Reading::Height(*x),
            1 => Reading::Pressure(*x),
            2 => Reading::Heading(*x),
            _ => Reading::Baseline([*x, *y, *z], None),
        };
        aids.push(Aid { time: *time, reading, sigma: *sigma });
    }
    Ok(aids)
}

/// Numbers of a fix: time, position, velocity and deviations of both.
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

/// Wheel speeds: one at each sample, NaN for none, or rows of time, speed and standard deviation.
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

/// Outputs of a batch: names and counts of the numbers after each sample, and of each fix.
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

/// Arrays for it.
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

/// The steps of a filter over a batch, as the smoother needs them: about 2.5 kB each.
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

    /// Smooth each of K steps with all fixes, and return arrays by name: ``sample``, the index of
    /// the sample that the step ends at; ``begins``, True where the filter began there; the errors
    /// of its state ``before`` and ``after`` the measurements there, and their standard deviations
    /// ``sigma``, (K, 15) in the order of `NavigationFilter.sigma`. Without ``deviations`` these
    /// are left out, which is many times as fast.
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

/// Samples between two looks for signals, and steps of the smoother.
const PIECE: usize = 1 << 17;
const STEPS: usize = 1 << 12;

/// White noise and walk of the bias, SI, of consumer sensors: of those of which nothing is known.
const GYRO: [f64; 2] = [0.05 * (std::f64::consts::PI / 180.0), 1e-5];
const ACCEL: [f64; 2] = [0.02, 5e-4];

/// White noise and walk of the bias of three axes, squares, of one model or of one an axis.
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

/// White noise and walk of one axis, which a model tells.
fn of_axis(
    sensor: &str,
    model: &Bound<'_, PyAny>,
    [_, usual]: [f64; 2],
) -> PyResult<Option<[f64; 2]>> {
    let Some(ask) = model.getattr_opt("__noise_densities__")? else { return Ok(None) };
    let (white, walk): (f64, Option<f64>) = ask.call1((sensor,))?.extract()?;
    Ok(Some([white, walk.unwrap_or(usual)]))
}

/// The state before the first sample, of an ``Alignment``.
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

/// Three numbers, NaN for what is None.
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

/// One deviation for all axes, or three.
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
