//! The detectors of rest and of motion for Python.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::{
    Bank, MotionDetector as MotionCore, QuietLimits, RestDetector as Core, RestLimits,
};

use crate::common::arrays::named;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, reading, streaming, text};

/// Live detection of rest from a gyro's own output.
///
/// Samples are grouped into ticks of a quarter of a second, at least four samples. The detector
/// learns two values at rest: the variance within a tick, and the distance of a tick's mean from
/// averages over 1, 4 and 16 s. A tick ends the rest if chance explains its value only once in a
/// million. The next rest begins after 1.5 s near the mean (level) of the last rest. Results do not
/// depend on the unit or on an added constant.
///
/// The start counts as rest after 1.5 s of samples that look like noise. If this proves wrong
/// within 10 s, only a level that has lasted for 10 s counts as rest.
///
/// Slow rotation at a constant rate cannot be distinguished from a bias. A new constant level
/// counts as rest after some time. This time is 10 s, plus about 11 s for each standard deviation
/// of the samples between the old and the new level, at most 60 s. A new noise level, such as an
/// engine's, is accepted in the same way. The detector keeps the old level: a return to it takes
/// 1.5 s. A rotation slower than about half of the samples' standard deviation is not noticed, and
/// counts as drift. An accelerometer distinguishes many rotations from rest: ``MotionDetector``.
///
/// A sample that is not finite is missing. Each channel is treated on its own. One object serves
/// one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// channels : int, optional
///     Number of signals; ``None`` is a single signal without a channel axis.
/// rest_limit : float, optional
///     Largest standard deviation of the samples within a tick at rest, in the samples' unit. The
///     means of six ticks may spread by at most 0.3 times this limit. 10 deg/s suits MEMS gyros:
///     vibration from motors hardly changes the means.
/// bias_limit : float, optional
///     Largest level at rest, in the samples' unit.
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
/// >>> (np.flatnonzero(np.diff(rest)) + 1).tolist()  # begins, ends and begins again
/// [149, 3024, 4149]
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct RestDetector {
    shared: Shared<Bank<Core<f64>>>,
}

streaming!(
    RestDetector,
    update: "Process one sample and return True if the sensor rests.

    The sample is a float and the result a bool. With k channels both are arrays (k,). ``moving``
    states that the body moves, as a ``MotionDetector`` detects.",
    process: "Return the mask of rest after each sample of a batch.

    Samples and mask are (n,), or (n, k) with k channels. ``moving``, bool, (n,), is True where the
    body moves, as a ``MotionDetector`` detects; a single thread is then used. The interpreter lock
    is released.",
    moving
);
streaming!(@bank RestDetector, Core<f64>);

#[pymethods]
impl RestDetector {
    #[new]
    #[pyo3(signature = (rate, *, channels=None, rest_limit=None, bias_limit=None))]
    fn new(
        rate: f64,
        channels: Option<i128>,
        rest_limit: Option<f64>,
        bias_limit: Option<f64>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let limits = RestLimits { rest: rest_limit, bias: bias_limit };
        let detector = Core::new(rate, limits).map_err(NativeError::from)?;
        let bank = Bank::new(&detector, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let (rate, limits) = (this.first().rate(), this.first().limits());
        let arguments = [
            ("rate", text(rate), ""),
            ("rest_limit", text(limits.rest), "None"),
            ("bias_limit", text(limits.bias), "None"),
        ];
        Ok(call("RestDetector", &arguments, this.shared.channels))
    }
}

getters! { RestDetector, slf, py, this;
    /// True if the sensor rests.
    ///
    /// A bool, or an array (k,) with k channels.
    at_rest: Object<'py> = this.shared.each(py, Core::at_rest)?;
    /// Samples per second.
    rate: f64 = this.first().rate();
}

impl RestDetector {
    fn check_motion(&self) -> PyResult<()> {
        Ok(())
    }
}

/// Live detection of a body's motion from its accelerometer alone.
///
/// A gyro that turns slowly at a constant rate has the same output as a biased gyro at rest. The
/// accelerometer sees gravity turn, except in a rotation about the vertical.
///
/// Means of 1, 2, 4, …, 64 ticks of a quarter second are compared with the previous means. If the
/// body moves, the difference exceeds two limits: the samples' noise, and a rotation of gravity by
/// 0.4 degrees. A rotation of 0.4 deg/s about a level axis is detected within 2 s. A rotation of
/// 0.05 deg/s is detected after half a minute.
///
/// Motion ends when two conditions are met. First, no motion has been detected for 1.5 times the
/// time that its detection took. Second, the samples are about as quiet as before the motion; after
/// a minute this condition is not needed. The detector returns True if the body moves, and False if
/// its motion is unknown.
///
/// The accelerometer may have any unit and any axes. A sample with an axis that is not finite is
/// missing. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// channels : int, optional
///     Number of parallel accelerometers; ``None`` is a single sensor without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// A body rests for a minute, then turns for a minute at 2 deg/s about a level axis:
///
/// >>> import numpy as np, zerorate as zr
/// >>> rng, t = np.random.default_rng(1), np.arange(12_000) / 100.0
/// >>> angle = np.radians(2.0) * np.maximum(t - 60.0, 0.0)
/// >>> accel = 9.81 * np.stack((np.zeros_like(t), np.sin(angle), np.cos(angle)), axis=1)
/// >>> accel += 0.03 * rng.standard_normal(accel.shape)
/// >>> gyro = 0.3 + 2.0 * (t > 60.0) + 0.1 * rng.standard_normal(12_000)
/// >>> moving = zr.noise.MotionDetector(rate=100.0).process(accel)
/// >>> bool(moving[:6000].any()), float(moving[6200:].mean()) > 0.9
/// (False, True)
///
/// With this mask a drift filter does not mistake the rotation for a bias:
///
/// >>> plain, held = zr.DriftFilter(rate=100.0), zr.DriftFilter(rate=100.0)
/// >>> _, _ = plain.process(gyro), held.process(gyro, moving=moving)
/// >>> round(plain.bias, 1), round(held.bias, 1)
/// (2.3, 0.3)
#[pyclass(generic, module = "zerorate.noise")]
#[derive(Debug)]
pub struct MotionDetector {
    shared: Shared<Bank<MotionCore>>,
}

streaming!(
    MotionDetector,
    update: "Process one sample of the accelerometer and return True if the body moves.

    The sample is (3,) and the result a bool. With k channels the sample is (k, 3), the result (k,).",
    process: "Return the mask of motion after each sample of a batch.

    The samples are (n, 3), the mask is (n,). With k channels they are (n, k, 3) and (n, k). The
    interpreter lock is released.",
    out
);
streaming!(@bank MotionDetector, MotionCore);

#[pymethods]
impl MotionDetector {
    #[new]
    #[pyo3(signature = (rate, *, channels=None))]
    fn new(rate: f64, channels: Option<i128>) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let detector = MotionCore::new(rate).map_err(NativeError::from)?;
        let bank = Bank::new(&detector, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let arguments = [("rate", text(this.first().rate()), "")];
        Ok(call("MotionDetector", &arguments, this.shared.channels))
    }
}

getters! { MotionDetector, slf, py, this;
    /// True if the body is known to move.
    ///
    /// A bool, or an array (k,) with k channels.
    moving: Object<'py> = this.shared.each(py, MotionCore::is_moving)?;
    /// Samples per second.
    rate: f64 = this.first().rate();
}

/// Return the longest stretch of ticks with constant means: its first tick and its end.
///
/// The end is exclusive; it equals the first tick if there is no such stretch.
///
/// Parameters
/// ----------
/// means : array_like, shape (n, 6)
///     Mean rate, rad/s, and mean force, m/s^2, of each tick. NaN is missing and ends a stretch.
/// gyro, accel : float
///     Largest variation, as norm of the three axes, rad/s and m/s^2. It limits the standard
///     deviation, and half the distance of a tick from the mean.
/// turned : float
///     Largest rotation of gravity within the stretch, as a change of force, m/s^2.
/// bias : float
///     Mean rate above which the body rotates, rad/s.
///
/// Returns
/// -------
/// tuple of int
///
/// Raises
/// ------
/// ValueError
///     An array has a wrong shape.
#[pyfunction]
pub fn longest_quiet(
    means: &Bound<'_, PyAny>,
    gyro: f64,
    accel: f64,
    turned: f64,
    bias: f64,
) -> PyResult<(usize, usize)> {
    let means = named("means", means, "(n, 6)", |shape| matches!(shape, [_, 6]))?;
    let limits = QuietLimits { gyro, accel, turned };
    Ok(zerorate_core::longest_quiet(means.values.as_chunks::<6>().0, &limits, bias))
}
