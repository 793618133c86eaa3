//! A sensor on a foot, and rates clipped by a gyro, for Python.

mod live;

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::memory;
use zerorate_core::navigation::Record;
use zerorate_core::navigation::foot::{
    Clipped, Feet, Plan, Stand, Swing, Trodden, Walk, go_back, restore_clipped,
};

pub use self::live::FootFilter;
use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::work::interruptible;
use crate::navigation::{NavigationRecord, SAMPLE};

/// A clipped side of an axis: axis number, sign, limit, rad/s, and number of restored samples.
type Limit = (usize, f64, f64, usize);

/// Number of samples between two checks for signals.
const PIECE: usize = 1 << 17;

/// Restore rates that a gyro clipped at its range.
///
/// Parameters
/// ----------
/// gyro : array_like, shape (n, 3)
///     Rates, rad/s, all finite.
/// dt : float
///     Time between two samples, s.
///
/// Returns
/// -------
/// tuple
///     First the rates, (n, 3). Then for each clipped side of an axis: axis, sign, limit, rad/s,
///     and number of restored samples. Then the error of each restored rate, as density of a white
///     noise, rad^2/s, (n,).
///
/// Raises
/// ------
/// ValueError
///     A rate is not finite, or ``dt`` is not a positive number.
#[pyfunction]
pub fn restore_clipped_rates<'py>(
    gyro: &Bound<'py, PyAny>,
    dt: f64,
) -> PyResult<(Bound<'py, PyAny>, Vec<Limit>, Bound<'py, PyAny>)> {
    let py = gyro.py();
    let record = arrays::named("gyro", gyro, "(n, 3)", |found| found.len() == 2 && found[1] == 3)?;
    let mut values = record.values;
    if !(dt.is_finite() && dt > 0.0) {
        return Err(PyValueError::new_err(format!("dt must be a positive number, got {dt}")));
    }
    if values.iter().any(|x| !x.is_finite()) {
        return Err(PyValueError::new_err("gyro must be finite: fill what is missing first"));
    }
    let n = values.len() / 3;
    let mut variance = memory::filled(0.0, n).map_err(NativeError::from)?;
    let sides =
        interruptible(py, n, || restore_clipped(values.as_chunks_mut().0, dt, &mut variance))?
            .map_err(NativeError::from)?;
    let sides = limits(&sides);
    let values = arrays::array(py, values, &[n, 3])?.into_any();
    Ok((values, sides, arrays::array(py, variance, &[n])?.into_any()))
}

fn limits(sides: &[Clipped]) -> Vec<Limit> {
    sides.iter().map(|one| (one.axis, one.sign, one.limit, one.samples)).collect()
}

/// Return the track of a sensor on a foot.
///
/// Parameters
/// ----------
/// time : array_like, shape (n,)
///     Times of the samples, s, increasing.
/// gyro, accel : array_like, shape (n, 3)
///     Rates, rad/s, and forces, m/s^2; a row that is not finite is missing.
/// level : bool
///     True if the floor is level, except for steps.
/// restore : bool
///     True if clipped rates are restored.
/// record : bool
///     True if the smoother's data are kept.
///
/// Returns
/// -------
/// tuple
///     A dict of arrays, and the record or None. The arrays are the state after each sample, in
///     metres ahead, right and down of the start, and:
///
///     - ``bound``, (n,), m/s.
///     - ``stances``, (s, 3): first sample, end (exclusive) and lowest sample.
///     - ``rests``, (r, 2): first sample and end (exclusive).
///     - ``rest_rates``, (r, 4): rate and its standard deviation, rad/s.
///     - ``clipped``: as from ``restore_clipped_rates``.
///     - ``rejections`` and ``relevelled``: counts.
///     - ``swings``, (m, 10): samples of the nodes before and after; seconds; largest rate, rad/s;
///       bound of the stances over bound of the swing; angle between the verticals, rad; angle
///       between force and vertical, rad; distance, m; removed vertical velocity, m/s, and its
///       standard deviation.
///     - ``every``: samples between two nodes.
///     - ``begin``: the filter's first sample, and the first known sample before it.
///     - ``lead_gyro`` and ``lead_accel``: the samples between these two.
///
/// Raises
/// ------
/// ValueError
///     Shapes do not fit, times do not increase, or the record is shorter than a second.
#[pyfunction]
pub fn foot_track<'py>(
    time: &Bound<'py, PyAny>,
    gyro: &Bound<'py, PyAny>,
    accel: &Bound<'py, PyAny>,
    level: bool,
    restore: bool,
    record: bool,
) -> PyResult<(Bound<'py, PyDict>, Option<NavigationRecord>)> {
    let py = time.py();
    let time = arrays::named("time", time, "(n,)", |found| found.len() == 1)?.values;
    let n = time.len();
    let expected = format!("({n}, 3)");
    let fits = |found: &[usize]| found == [n, 3];
    let gyro = arrays::named("gyro", gyro, &expected, fits)?.values;
    let accel = arrays::named("accel", accel, &expected, fits)?.values;
    let given = [gyro.as_chunks().0, accel.as_chunks().0];
    let feet = Feet { level, restore };
    let plan = interruptible(py, n, || Plan::of(&time, given[0], given[1], &feet))?
        .map_err(NativeError::from)?;
    let numbers = SAMPLE.iter().map(|(_, size)| arrays::zeros(py, &[n, *size]));
    let numbers = numbers.collect::<PyResult<Vec<Bound<'py, PyArrayDyn<f64>>>>>()?;
    let mut steps = Record::default();
    let (counts, swings) = {
        let mut open: Vec<_> = numbers.iter().map(|array| array.readwrite()).collect();
        let [position, velocity, quaternion, gyro_bias, accel_bias, sigma] = &mut open[..] else {
            return Err(PyValueError::new_err("six arrays"));
        };
        let mut trodden = Trodden {
            position: position.as_slice_mut()?.as_chunks_mut().0,
            velocity: velocity.as_slice_mut()?.as_chunks_mut().0,
            quaternion: quaternion.as_slice_mut()?.as_chunks_mut().0,
            gyro_bias: gyro_bias.as_slice_mut()?.as_chunks_mut().0,
            accel_bias: accel_bias.as_slice_mut()?.as_chunks_mut().0,
            sigma: sigma.as_slice_mut()?.as_chunks_mut().0,
        };
        let began = match record {
            true => Walk::begin(&plan, level, time[plan.begin.0], &mut steps),
            false => Walk::begin(&plan, level, time[plan.begin.0], &mut ()),
        };
        let mut walk = began.map_err(NativeError::from)?;
        for first in (0..n).step_by(PIECE) {
            let piece = first..n.min(first + PIECE);
            let done = py.detach(|| match record {
                true => walk.run(&time, given, piece, &mut trodden, &mut steps),
                false => walk.run(&time, given, piece, &mut trodden, &mut ()),
            });
            done.map_err(NativeError::from)?;
            py.check_signals()?;
        }
        ([walk.rejections(), walk.relevelled()], rows_of(walk.swings()))
    };
    steps.validate().map_err(NativeError::from)?;
    let found = PyDict::new(py);
    for ((name, _), array) in SAMPLE.iter().zip(numbers) {
        found.set_item(*name, array)?;
    }
    let lead = plan.begin.1..plan.begin.0 + 1;
    for (name, values) in [("lead_gyro", &plan.gyro), ("lead_accel", &plan.accel)] {
        let values = values[lead.clone()].as_flattened().to_vec();
        found.set_item(name, arrays::array(py, values, &[lead.len(), 3])?)?;
    }
    put_plan(&found, plan)?;
    found.set_item("rejections", counts[0])?;
    found.set_item("relevelled", counts[1])?;
    let count = swings.len() / 10;
    found.set_item("swings", arrays::array(py, swings, &[count, 10])?)?;
    Ok((found, record.then_some(NavigationRecord { steps })))
}

/// Return the states of a foot before it stood, by backward integration.
///
/// Parameters
/// ----------
/// time : array_like, shape (n,)
///     Times of the samples, s, increasing; the foot stands at the last sample.
/// gyro, accel : array_like, shape (n, 3)
///     Rates, rad/s, and forces, m/s^2, all finite.
/// quaternion : array_like, shape (4,)
///     Quaternion w, x, y, z at the last sample, from the sensor's axes to ahead, right and down.
/// biases : array_like, shape (2, 3)
///     Biases of gyro, rad/s, and accelerometer, m/s^2.
///
/// Returns
/// -------
/// tuple
///     Positions, m, velocities, m/s, both (n - 1, 3), and quaternions, (n - 1, 4), of all samples
///     except the last. Positions are ahead, right and down of the last position.
///
/// Raises
/// ------
/// ValueError
///     Shapes do not fit.
#[pyfunction]
pub fn foot_lead<'py>(
    time: &Bound<'py, PyAny>,
    gyro: &Bound<'py, PyAny>,
    accel: &Bound<'py, PyAny>,
    quaternion: &Bound<'py, PyAny>,
    biases: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let py = time.py();
    let time = arrays::named("time", time, "(n,)", |found| found.len() == 1)?.values;
    let n = time.len();
    let expected = format!("({n}, 3)");
    let fits = |found: &[usize]| found == [n, 3];
    let gyro = arrays::named("gyro", gyro, &expected, fits)?.values;
    let accel = arrays::named("accel", accel, &expected, fits)?.values;
    let turn = arrays::named("quaternion", quaternion, "(4,)", |found| found == [4])?.values;
    let biases = arrays::named("biases", biases, "(2, 3)", |found| found == [2, 3])?.values;
    let stand = Stand::new([turn[0], turn[1], turn[2], turn[3]], biases.as_chunks().0);
    let before = n.saturating_sub(1);
    let zeros = |width: usize| memory::filled(0.0, width * before).map_err(NativeError::from);
    let (mut positions, mut velocities, mut turns) = (zeros(3)?, zeros(3)?, zeros(4)?);
    go_back(
        &time,
        [gyro.as_chunks().0, accel.as_chunks().0],
        &stand,
        |k, position, velocity, turn| {
            positions[3 * k..3 * k + 3].copy_from_slice(&position);
            velocities[3 * k..3 * k + 3].copy_from_slice(velocity.as_slice());
            turns[4 * k..4 * k + 4].copy_from_slice(&turn);
        },
    );
    let array = |values, width| arrays::array(py, values, &[before, width]);
    Ok((
        array(positions, 3)?.into_any(),
        array(velocities, 3)?.into_any(),
        array(turns, 4)?.into_any(),
    ))
}

fn rows_of(swings: &[Swing]) -> Vec<f64> {
    let row = |swing: &Swing| {
        let Swing { samples: (first, last), seconds, turn, depth, tilt, lean, way, sink } = *swing;
        [first as f64, last as f64, seconds, turn, depth, tilt, lean, way, sink[0], sink[1]]
    };
    swings.iter().flat_map(row).collect()
}

fn put_plan(found: &Bound<'_, PyDict>, plan: Plan) -> PyResult<()> {
    let py = found.py();
    let (mut stances, mut static_intervals, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    for one in &plan.stances {
        stances.extend([one.samples.0 as i64, one.samples.1 as i64, one.lowest as i64]);
    }
    for one in &plan.static_intervals {
        static_intervals.extend([one.samples.0 as i64, one.samples.1 as i64]);
        rates.extend([one.rate.x, one.rate.y, one.rate.z, one.sigma]);
    }
    let n = plan.bound.len();
    found.set_item("begin", plan.begin)?;
    found.set_item("every", plan.every())?;
    found.set_item("bound", arrays::array(py, plan.bound, &[n])?)?;
    found.set_item("stances", arrays::array(py, stances, &[plan.stances.len(), 3])?)?;
    found.set_item(
        "rests",
        arrays::array(py, static_intervals, &[plan.static_intervals.len(), 2])?,
    )?;
    found.set_item("rest_rates", arrays::array(py, rates, &[plan.static_intervals.len(), 4])?)?;
    found.set_item("clipped", limits(&plan.clipped))
}
