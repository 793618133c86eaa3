//! Tilt about one axis, for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::Bank;
use zerorate_core::attitude::{TILT_CONSTANTS, TILT_METHODS, Tilt as Core, TiltMethod, TiltParams};

use super::{options, samples};
use crate::common::arrays::{self, Record, Samples};
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, exclusive, quoted, reading, streaming, text};

/// Numbers in a sample: rate, angle and the time since the previous sample.
const WIDTH: usize = 3;

/// Tilt about one axis, from the rate about it and the accelerometer's angle.
///
/// This is the usual filter for an MPU-6050. The angle of the accelerometer is an arc tangent of
/// two of its axes: noisy but stable. The integral of the gyro is smooth but drifts.
///
/// The **complementary** filter is ``angle = a (angle + gyro dt) + (1 - a) accelerometer`` with
/// ``a = time_constant / (time_constant + dt)``. With 0.49 s and 100 Hz, a is 0.98. A bias b of the
/// gyro leaves a constant error of ``b * time_constant``. The **kalman** filter has the states
/// angle and bias, and learns the bias.
///
/// Any unit of angle works if the gyro has the same unit per second. The filter treats a single
/// axis. The measured rate equals the tilt's rate at small angles only, and the arc tangent fails
/// near 90 degrees. `Attitude` has neither limit and separates motion from tilt.
///
/// A missing rate (NaN, infinite or None) is replaced by the last rate for 50 ms, then by zero. A
/// missing angle corrects nothing. The tilt is NaN before the first angle. One object serves one
/// thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// method : {"complementary", "kalman"}, default "complementary"
///     Filter that combines rate and angle.
/// channels : int, optional
///     Number of axes; ``None`` is a single axis without a channel axis.
/// time_constant : float, default 0.5
///     Only "complementary": time constant, s. A short time constant follows the accelerometer and
///     its vibration. A long time constant follows the gyro and its bias.
/// q_angle, q_bias : float, default 1e-3 and 3e-3
///     Only "kalman": variance that angle and bias gain per second, unit^2/s and (unit/s)^2/s.
/// r_measure : float, default 3e-2
///     Only "kalman": variance of one accelerometer angle, unit^2. The effect of the same number
///     depends on ``rate``. The defaults of ``q_angle``, ``q_bias`` and ``r_measure`` are from
///     common MPU-6050 code, for degrees at 100 Hz. They give a time constant of a third of a
///     second.
/// p_start : float, default 1.0
///     Only "kalman": variance of angle and bias before the first sample, unit^2 and (unit/s)^2.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the method does not use it.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> gyro = np.full(3000, 0.05)  # the bias, in rad/s, of a sensor at rest
/// >>> ay, az = np.zeros(3000), np.full(3000, 9.81)
/// >>> accelerometer = np.arctan2(ay, az)
/// >>> tilt = zr.Tilt(100.0, time_constant=0.49)
/// >>> round(float(tilt.process(gyro, accelerometer)[-1]), 4)  # 0.05 * 0.49
/// 0.0245
/// >>> tilt = zr.Tilt(100.0, method="kalman")
/// >>> angle = tilt.process(gyro, accelerometer)
/// >>> round(tilt.bias, 4)
/// 0.05
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct Tilt {
    shared: Shared<Bank<Core>>,
}

streaming!(Tilt);
streaming!(@bank Tilt, Core);

#[pymethods]
impl Tilt {
    #[new]
    #[pyo3(
        signature = (rate, *, method="complementary", channels=None, **constants),
        text_signature = "(rate, *, method='complementary', channels=None, time_constant=0.5, \
            q_angle=0.001, q_bias=0.003, r_measure=0.03, p_start=1.0)"
    )]
    fn new(
        rate: f64,
        method: &str,
        channels: Option<i128>,
        constants: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let Some(known) = TiltMethod::of_name(method) else {
            let methods = quoted(&TILT_METHODS, "or");
            return Err(PyValueError::new_err(format!("method must be {methods}, got '{method}'")));
        };
        let constants = options::read("Tilt", TILT_CONSTANTS, method, constants)?;
        let tilt = Core::new(TiltParams { rate, method: known, constants });
        let bank = tilt.and_then(|tilt| Bank::new(&tilt, channels.unwrap_or(1)));
        let bank = bank.and_then(|bank| Self::of(channels, bank));
        Ok(bank.map_err(NativeError::from)?)
    }

    /// Process a rate and the accelerometer's angle, and return the tilt.
    ///
    /// Each argument is a float or None, and the result a float. With k channels, arguments and
    /// result have the shape (k,). ``dt`` is the time since the previous sample, s, by default one
    /// period.
    #[pyo3(signature = (gyro, angle, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        angle: &Bound<'py, PyAny>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let dt = samples::checked(dt.unwrap_or(f64::NAN))?;
        let Some(channels) = this.shared.channels else {
            let row = [arrays::sample(gyro)?, arrays::sample(angle)?, dt];
            return this.shared.update_row(slf.py(), &row);
        };
        let rates = arrays::row(gyro, &[channels])?;
        let angles = arrays::row(angle, &[channels])?;
        let columns = [(0, 1, &rates[..]), (1, 1, &angles), (2, 1, &[dt])];
        let row = arrays::side_by_side(WIDTH, channels, &columns)?;
        this.shared.update_row(slf.py(), &row)
    }

    /// Process each sample of a batch and return the tilts.
    ///
    /// Arguments and result have the shape (n,), with k channels (n, k). ``dt`` is one time for all
    /// samples, or an array (n,). The interpreter lock is released.
    #[pyo3(signature = (gyro, angle, dt=None, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        angle: &Bound<'py, PyAny>,
        dt: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [Some(gyro), Some(angle), dt];
        let [gyro, angle, dt] = arrays::taken(slf, ["gyro", "angle", "dt"], given)?;
        let mut this = exclusive(slf)?;
        let axes: Vec<usize> = this.shared.channels.into_iter().collect();
        let rates = arrays::samples(&gyro, &axes)?;
        let shape = rates.shape().to_vec();
        let expected = arrays::tuple(&shape);
        let angles = arrays::named("angle", &angle, &expected, |found| found == shape)?;
        let dt = arrays::present(&dt).map(|dt| samples::times(dt, shape[0])).transpose()?;
        let mut columns = vec![(0, 1, rates.values()?), (1, 1, &angles.values)];
        columns.extend(dt.as_deref().map(|dt| (2, 1, dt)));
        let values = arrays::side_by_side(WIDTH, angles.values.len(), &columns)?;
        let record = Record { values, shape: [shape.as_slice(), &[WIDTH]].concat() };
        drop(rates);
        this.shared.process_samples(slf.py(), Samples::Copied(record), out, threads)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let TiltParams { rate, method, constants } = *this.first().params();
        let written = options::written(TILT_CONSTANTS, method.name(), &constants);
        let mut arguments = vec![
            ("rate", text(rate), ""),
            ("method", format!("'{}'", method.name()), "'complementary'"),
        ];
        arguments.extend(
            written.iter().map(|(name, value, usual)| (*name, value.clone(), usual.as_str())),
        );
        Ok(call("Tilt", &arguments, this.shared.channels))
    }
}

getters! { Tilt, slf, py, this;
    /// Tilt, NaN before the first angle of the accelerometer.
    ///
    /// A float, or an array (k,) with k channels.
    angle: Object<'py> = this.shared.each(py, Core::angle)?;
    /// Standard deviation of ``angle``; NaN for method "complementary".
    ///
    /// A float, or an array (k,) with k channels.
    angle_sigma: Object<'py> = this.shared.each(py, Core::angle_sigma)?;
    /// Output of the gyro without rotation.
    ///
    /// It is NaN for method "complementary". A float, or an array (k,) with k channels.
    bias: Object<'py> = this.shared.each(py, Core::bias)?;
    /// Standard deviation of ``bias``; NaN for method "complementary".
    ///
    /// A float, or an array (k,) with k channels.
    bias_sigma: Object<'py> = this.shared.each(py, Core::bias_sigma)?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Samples per second.
    rate: f64 = this.first().params().rate;
    /// Name of the method.
    method: &'static str = this.first().params().method.name();
}
