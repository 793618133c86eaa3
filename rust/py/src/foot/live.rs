//! Live filter for a sensor on a foot, for Python.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::Bank;
use zerorate_core::navigation::foot::{FootFilter as Core, FootParams};

use crate::attitude::samples::{self, Given};
use crate::common::arrays::{self, Record, Samples};
use crate::common::errors::{NativeError, about};
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, exclusive, reading, streaming, text};

/// Live position of a sensor on a foot, from the foot's stances and without a receiver.
///
/// This is the live form of `FootNavigation`, with the same filter. A stance is a minimum of the
/// same speed bound within the last 1.5 s. Outputs belong to the sample ``delay`` seconds ago,
/// because the bound needs samples on both sides. The delay is about 0.05 s, or 0.1 s with
/// ``gyro_range``. The frame begins at the start: x is the horizontal direction of the sensor's
/// first axis, y points left, z up.
///
/// The filter starts at a rest, and starts again at each rest with less motion. If there is no
/// rest, it starts in the lowest minimum of the bound within 1.5 s. It has no output until a rest
/// has lasted half a second, or this minimum has ended.
///
/// A sample that is not finite, or beyond 1e4 rad/s or m/s^2, is missing. The last sample replaces
/// it for a tenth of a second, then the standard deviations grow. Give NaN for lost samples, since
/// the filter computes the time from the number of samples. If too many samples are missing, the
/// filter restarts, and ``position`` is NaN until it has started again. One object serves one
/// thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second, 48 to 1200.
/// floor : {None, "level"}
///     "level": a stance within 0.1 m of the previous stance's height gets this height.
/// gyro_range : float, optional
///     Range of the gyro by its data sheet, rad/s; by default it is estimated from clipped peaks to
///     date. Clipped rates are restored from the samples before and after them, if these arrive
///     within ``delay``. Restored rates have a larger standard deviation.
/// channels : int, optional
///     Number of feet; ``None`` is a single foot without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> walk = zr.simulate_walk(strides=20, seed=1)
/// >>> foot = zr.FootFilter(walk.rate, floor="level")
/// >>> for gyro, accel in zip(walk.gyro, walk.accel):
/// ...     position = foot.update(gyro, accel)
/// >>> end = np.hypot(*(position - walk.position[-1])[:2])
/// >>> bool(end < 0.01 * walk.distance), foot.delay, foot.stance_count
/// (True, 0.05, 21)
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct FootFilter {
    shared: Shared<Bank<Core>>,
}

streaming!(FootFilter);
streaming!(@bank FootFilter, Core);

/// Numbers in a sample.
const WIDTH: usize = 6;

#[pymethods]
impl FootFilter {
    #[new]
    #[pyo3(signature = (rate, *, floor=None, gyro_range=None, channels=None))]
    fn new(
        rate: f64,
        floor: Option<&str>,
        gyro_range: Option<f64>,
        channels: Option<i128>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        if let Some(other) = floor.filter(|floor| *floor != "level") {
            return Err(about("floor", format!("floor must be None or 'level', got '{other}'")));
        }
        let params = FootParams { rate, level: floor.is_some(), gyro_range };
        let foot = Core::new(params).map_err(NativeError::from)?;
        let bank = Bank::new(&foot, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    /// Process rates, rad/s, and forces, m/s^2, and return the position ``delay`` seconds ago, m.
    ///
    /// Each array is (3,), or (k, 3) with k channels. The position is NaN if it is unknown.
    fn update<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let given = Given { gyro, accel, mag: None, dt: None };
        if let (None, Some(row)) = (this.shared.channels, given.usual()) {
            return this.shared.update_row(slf.py(), &row[..WIDTH]);
        }
        let wide = given.row(this.shared.channels)?;
        let mut row = Vec::with_capacity(wide.len());
        for sample in wide.chunks_exact(samples::WIDTH) {
            row.extend_from_slice(&sample[..WIDTH]);
        }
        this.shared.update_row(slf.py(), &row)
    }

    /// Process each sample of a batch and return the positions.
    ///
    /// Each array is (n, 3), or (n, k, 3) with k channels. The interpreter lock is released.
    #[pyo3(signature = (gyro, accel, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [Some(gyro), Some(accel)];
        let [gyro, accel] = arrays::taken(slf, ["gyro", "accel"], given)?;
        let mut this = exclusive(slf)?;
        let axes: Vec<usize> = this.shared.channels.into_iter().chain([3]).collect();
        let mut shape = vec![];
        let mut read = |name, given| {
            let expected = match axes.len() {
                1 => "(n, 3)".to_owned(),
                _ => format!("(n, {}, 3)", axes[0]),
            };
            let fits = |found: &[usize]| {
                found.len() == axes.len() + 1
                    && found[1..] == axes
                    && (shape.is_empty() || found == shape)
            };
            let record = arrays::named(name, given, &expected, fits)?;
            shape = record.shape.clone();
            PyResult::Ok(record.values)
        };
        let (rates, forces) = (read("gyro", &gyro)?, read("accel", &accel)?);
        let count = rates.len() / 3;
        let columns = [(0, 3, &rates[..]), (3, 3, &forces[..])];
        let values = arrays::side_by_side(WIDTH, count, &columns)?;
        if let Some(last) = shape.last_mut() {
            *last = WIDTH;
        }
        let record = Record { values, shape };
        this.shared.process_samples(slf.py(), Samples::Copied(record), out, threads)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let FootParams { rate, level, gyro_range } = *this.first().params();
        let floor = if level { "'level'" } else { "None" };
        let arguments = [
            ("rate", text(rate), ""),
            ("floor", floor.to_owned(), "None"),
            ("gyro_range", text(gyro_range), "None"),
        ];
        Ok(call("FootFilter", &arguments, this.shared.channels))
    }
}

getters! { FootFilter, slf, py, this;
    /// Position relative to the start, m, ahead, left and up.
    ///
    /// NaN if it is unknown. An array (3,), or (k, 3) with k channels.
    position: Object<'py> = this.vectors(py, Core::position)?;
    /// Velocity ahead, left and up, m/s.
    ///
    /// An array (3,), or (k, 3) with k channels.
    velocity: Object<'py> = this.vectors(py, Core::velocity)?;
    /// Quaternion w, x, y, z from the sensor's axes to ahead, left, up.
    ///
    /// An array (4,), or (k, 4) with k channels.
    quaternion: Object<'py> = this.vectors(py, Core::quaternion)?;
    /// Bias of the gyro, rad/s.
    ///
    /// An array (3,), or (k, 3) with k channels.
    gyro_bias: Object<'py> = this.vectors(py, Core::gyro_bias)?;
    /// Bias of the accelerometer, m/s^2.
    ///
    /// An array (3,), or (k, 3) with k channels.
    accel_bias: Object<'py> = this.vectors(py, Core::accel_bias)?;
    /// Standard deviations of position, velocity, orientation and biases, as in `FootTrack`.
    ///
    /// NaN if they are unknown. An array (15,), or (k, 15) with k channels.
    sigma: Object<'py> = this.vectors(py, Core::sigma)?;
    /// True if the foot stood at the last step of the covariance; a step is 0.02 s.
    ///
    /// A bool, or an array (k,) with k channels.
    standing: Object<'py> = this.shared.each(py, Core::is_standing)?;
    /// True if the foot has stood for half a second and the gyro's bias is learned.
    ///
    /// A bool, or an array (k,) with k channels.
    at_rest: Object<'py> = this.shared.each(py, Core::is_at_rest)?;
    /// Speed bound, m/s; NaN before it is known.
    ///
    /// Its minima are the stances. A float, or an array (k,) with k channels.
    bound: Object<'py> = this.shared.each(py, Core::bound)?;
    /// Number of stances to date.
    ///
    /// An int, or an array (k,) with k channels.
    stance_count: Object<'py> = this.shared.each(py, Core::stances)?;
    /// Largest rate about an axis to date, rad/s.
    ///
    /// Below 1.75 (100 deg/s) the sensor is not on a walking foot. If it is on a smoothly driving
    /// machine, the motion counts as standing, and the position is wrong. A float, or an array (k,)
    /// with k channels.
    fastest: Object<'py> = this.shared.each(py, Core::fastest)?;
    /// Number of zero-velocity measurements that were rejected since the start.
    ///
    /// An int, or an array (k,) with k channels.
    rejection_count: Object<'py> = this.shared.each(py, Core::rejections)?;
    /// Share of the last six swings' time in which the motion looks like a foot's, 0 to 1.
    ///
    /// NaN before six swings. Below 0.5 the sensor is on a wrist, in a hand or in a pocket, not on
    /// a foot. A float, or an array (k,) with k channels.
    foot_share: Object<'py> = this.shared.each(py, Core::foot_share)?;
    /// Number of restarts at the present position because the tilt was wrong.
    ///
    /// After a restart the heading is almost unknown. An int, or an array (k,) with k channels.
    relevel_count: Object<'py> = this.shared.each(py, Core::relevelled)?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Delay of the outputs behind the last sample, s.
    delay: f64 = this.first().delay();
    /// Samples per second.
    rate: f64 = this.first().params().rate;
}

impl FootFilter {
    /// One vector per channel.
    fn vectors<'py, const N: usize>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Core) -> [f64; N],
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.shared.bank.streams().iter().flat_map(of).collect();
        self.shared.arrays(py, values, &[N])
    }
}
