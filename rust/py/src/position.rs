//! Positions from fixes, for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::position::{
    POSITION_CONSTANTS, POSITION_METHODS, PositionConstants, PositionFilter as Core,
    PositionMethod, PositionParams, PositionSnapshot,
};
use zerorate_core::stream::{Output, Parts};
use zerorate_core::{Bank, Traced};

use crate::attitude::{options as constants, samples};
use crate::common::arrays::{self, Record, Samples};
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{
    self, AnyBank, Shared, arrays_of, call, exclusive, quoted, reading, streaming, text,
};
use crate::common::work::in_pieces;

/// Numbers in a sample: position, speed, strength, rest and the time since the sample before.
const WIDTH: usize = 7;

/// Position filter for a receiver that stands or moves slowly, which removes most of the fixes'
/// wandering.
///
/// A fix is a position east and north of a nearby point, m. Optional inputs: ``speed``, the Doppler
/// velocity east and north in m/s; ``cn0``, the strength of the signals in dB-Hz; ``rest``, True if
/// the platform is known to stand, from a ``RestDetector`` or a wheel.
///
/// - **aided** uses all of them: Doppler moves the position, rest stops it, fixes of weak signals
///   have less weight, and the slow error of the receiver is a state, so its wandering is not
///   followed.
/// - **moving_average** is the mean of the last ``window`` fixes, delayed by half of them in motion.
/// - **kalman** assumes a constant velocity with a white acceleration.
/// - **heading** rejects a step shorter than ``step`` that turns the course by more than ``turn``.
/// - **strength** is "kalman" with less weight for fixes of weak signals: a variance of
///   ``sigma**2 * 10**((45 - cn0) / 10)`` below 45 dB-Hz (the sigma-epsilon form).
///
/// The last four are from papers and serve for comparison. **None of them removes the slow error
/// itself**: an error of metres that lasts for minutes looks like a position. Only a long time of
/// observation averages it out.
///
/// Missing values are NaN or None. A missing fix is predicted, not corrected; a missing velocity is
/// replaced by the last one, with a standard deviation of ``acceleration`` times its age; a missing
/// strength counts as strong. A method ignores inputs that it does not use. Before the first fix
/// NaN is returned. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Fixes a second.
/// method : {"aided", "moving_average", "kalman", "heading", "strength"}, default "aided"
///     Method of filtering.
/// channels : int, optional
///     Number of receivers; ``None`` is a single one.
/// window : int, default 10
///     Of "moving_average": fixes, 1 to 64.
/// sigma : float, default 0.7
///     Of "aided", "kalman" and "strength": white noise of a fix with strong signals, per axis, m.
///     A small one follows the fixes.
/// process_noise : float, default 0.5
///     Of "kalman" and "strength": power spectral density of the acceleration, m^2/s^3. A small one
///     smooths and lags in turns.
/// step, turn : float, default 3.0 and pi / 3
///     Of "heading": m and rad.
/// error_sigma, error_time : float, default 2.5 and 120.0
///     Of "aided": slow error of the receiver, an axis, m, and its correlation time, s. Large ones
///     trust the fixes less.
/// speed_sigma : float, default 0.1
///     Of "aided": white noise of the Doppler velocity, per axis, m/s.
/// acceleration : float, default 1.0
///     Of "aided": rate of change of the velocity while it is unknown, m/s^2.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or is not used by the method.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> rng = np.random.default_rng(1)
/// >>> fixes = 5.0 + 0.7 * rng.standard_normal((300, 2))  # it stands at (5, 5)
/// >>> path = zr.PositionFilter(1.0).process(fixes, rest=np.ones(300, bool))
/// >>> raw, aided = (np.hypot(*np.diff(x, axis=0).T).sum() for x in (fixes, path))
/// >>> round(raw), round(aided)  # metres that were drawn
/// (362, 34)
/// >>> live = zr.PositionFilter(1.0)
/// >>> for fix in fixes:
/// ...     position = live.update(fix, speed=(0.0, 0.0), cn0=42.0)
/// >>> position.round(1).tolist(), round(live.sigma, 1)
/// ([4.9, 4.9], 1.9)
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct PositionFilter {
    shared: Shared<Bank<Core>>,
}

streaming!(PositionFilter);
streaming!(@bank PositionFilter, Core);

#[pymethods]
impl PositionFilter {
    #[new]
    #[pyo3(
        signature = (rate, *, method="aided", channels=None, **constants),
        text_signature = "(rate, *, method='aided', channels=None, window=10, sigma=0.7, \
            process_noise=0.5, step=3.0, turn=1.0471975511965976, error_sigma=2.5, \
            error_time=120.0, speed_sigma=0.1, acceleration=1.0)"
    )]
    fn new(
        rate: f64,
        method: &str,
        channels: Option<i128>,
        constants: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let Some(known) = PositionMethod::of_name(method) else {
            let methods = quoted(&POSITION_METHODS, "or");
            return Err(PyValueError::new_err(format!("method must be {methods}, got '{method}'")));
        };
        let constants = constants::read("PositionFilter", POSITION_CONSTANTS, method, constants)?;
        let filter = Core::new(PositionParams { rate, method: known, constants });
        let bank = filter.and_then(|filter| Bank::new(&filter, channels.unwrap_or(1)));
        let bank = bank.and_then(|bank| Self::of(channels, bank));
        Ok(bank.map_err(NativeError::from)?)
    }

    /// Process a fix and return the position, m east and north: (2,) to (2,), with channels (k, 2)
    /// to (k, 2). ``speed`` is of the shape of ``position``, ``cn0`` and ``rest`` are a number and
    /// a bool, with channels (k,); ``dt`` is the time since the previous fix, s, by default one
    /// period.
    #[pyo3(signature = (position, speed=None, cn0=None, rest=None, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        position: &Bound<'py, PyAny>,
        speed: Option<&Bound<'py, PyAny>>,
        cn0: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let dt = samples::checked(dt.unwrap_or(f64::NAN))?;
        let axes: Vec<usize> = this.shared.channels.into_iter().collect();
        let given = Given { position, speed, cn0, rest };
        let rows = given.rows(&axes, Some(&[dt]))?;
        this.shared.update_row(slf.py(), &rows)
    }

    /// Update with each fix of a batch: (n, 2) to (n, 2), with channels (n, k, 2) to (n, k, 2);
    /// ``cn0`` and ``rest`` are (n,), with channels (n, k); ``dt`` is one time for all fixes or
    /// (n,). The interpreter lock is released.
    #[pyo3(signature = (
        position, speed=None, cn0=None, rest=None, dt=None, out=None, threads=None
    ))]
    // The arguments are those of the method in Python.
    #[allow(clippy::too_many_arguments)]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        position: &Bound<'py, PyAny>,
        speed: Option<&Bound<'py, PyAny>>,
        cn0: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        dt: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let taken = taken(slf, [Some(position), speed, cn0, rest, dt])?;
        let mut this = exclusive(slf)?;
        let batch = batch(&taken, this.shared.channels)?;
        this.shared.process_samples(slf.py(), Samples::Copied(batch), out, threads)
    }

    /// Like ``process``, but return all estimates after each fix, as arrays by name:
    /// position, velocity and receiver_error (n, 2), sigma, missing and held (n,); with channels
    /// (n, k, …). ``missing`` marks missing fixes, ``held`` fixes ignored by "heading".
    #[pyo3(signature = (position, speed=None, cn0=None, rest=None, dt=None))]
    fn trace<'py>(
        slf: &Bound<'py, Self>,
        position: &Bound<'py, PyAny>,
        speed: Option<&Bound<'py, PyAny>>,
        cn0: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        dt: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let taken = taken(slf, [Some(position), speed, cn0, rest, dt])?;
        let (py, mut this) = (slf.py(), exclusive(slf)?);
        let batch = batch(&taken, this.shared.channels)?;
        let (n, bank) = (batch.shape[0], &mut *this.shared.bank);
        let width = WIDTH * bank.channels();
        let parts = Parts::new(PositionSnapshot::FIELDS, n.saturating_mul(bank.channels()));
        let mut parts = parts.map_err(NativeError::from)?;
        in_pieces(py, bank, n, 1, |bank, piece| {
            let rows = &batch.values[streaming::places(piece, width)];
            parts.add_rows(bank.channels(), rows, width, |rows, numbers, flags| {
                bank.trace(rows, numbers, flags);
            })
        })?;
        let found = PyDict::new(py);
        let arrays = arrays_of(py, parts, &this.shared.batch_axes(n))?;
        for (field, array) in PositionSnapshot::FIELDS.iter().zip(arrays) {
            found.set_item(field.name, array)?;
        }
        Ok(found)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let PositionParams { rate, method, constants } = *this.first().params();
        let written = constants::written(POSITION_CONSTANTS, method.name(), &constants);
        let mut arguments =
            vec![("rate", text(rate), ""), ("method", format!("'{}'", method.name()), "'aided'")];
        for (name, value, usual) in &written {
            // A number of fixes has no point.
            let whole = if *name == "window" { value.strip_suffix(".0") } else { None };
            let value = if value == usual { usual } else { whole.unwrap_or(value) };
            arguments.push((*name, value.to_owned(), usual.as_str()));
        }
        Ok(call("PositionFilter", &arguments, this.shared.channels))
    }
}

getters! { PositionFilter, slf, py, this;
    /// East and north, m, NaN before the first fix: (2,), with channels (k, 2).
    position: Object<'py> = each(slf, &[2], |known| known.position.to_vec())?;
    /// Standard deviation of ``position`` per axis, m; NaN for "moving_average" and "heading":
    /// float, with channels (k,).
    sigma: Object<'py> = each(slf, &[], |known| vec![known.sigma])?;
    /// Velocity east and north, m/s: for "aided" the last given one, zero at rest; NaN for
    /// "moving_average" and "heading": (2,), with channels (k, 2).
    velocity: Object<'py> = each(slf, &[2], |known| known.velocity.to_vec())?;
    /// Slow error of the receiver estimated by "aided", m east and north, else NaN: (2,), with
    /// channels (k, 2).
    receiver_error: Object<'py> = each(slf, &[2], |known| known.receiver_error.to_vec())?;
    /// True if the last fix was missing: bool, with channels (k,).
    missing: Object<'py> = this.shared.each(py, |one| one.snapshot().missing)?;
    /// True if "heading" ignored the last fix: bool, with channels (k,).
    held: Object<'py> = this.shared.each(py, |one| one.snapshot().held)?;
    /// Fixes to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Fixes a second.
    rate: f64 = this.first().params().rate;
    /// Treatment of the fixes.
    method: &'static str = this.first().params().method.name();
}

/// Numbers of a shape, of each channel.
fn each<'py>(
    filter: &Bound<'py, PositionFilter>,
    shape: &[usize],
    of: fn(&PositionSnapshot) -> Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(filter)?;
    let values = this.shared.bank.streams().iter().flat_map(|one| of(&one.snapshot())).collect();
    this.shared.arrays(filter.py(), values, shape)
}

/// Arguments of one call.
#[derive(Debug, Clone, Copy)]
struct Given<'a, 'py> {
    position: &'a Bound<'py, PyAny>,
    speed: Option<&'a Bound<'py, PyAny>>,
    cn0: Option<&'a Bound<'py, PyAny>>,
    rest: Option<&'a Bound<'py, PyAny>>,
}

impl Given<'_, '_> {
    /// Side by side, `before` being the axes before those of a sample; with `dt` of each instant.
    fn rows(&self, before: &[usize], dt: Option<&[f64]>) -> PyResult<Vec<f64>> {
        let mut columns = Vec::new();
        let parts = [
            ("position", 0, 2, Some(self.position)),
            ("speed", 2, 2, self.speed),
            ("cn0", 4, 1, self.cn0),
            ("rest", 5, 1, self.rest),
        ];
        for (name, first, width, given) in parts {
            let Some(given) = given else { continue };
            let axes = if width > 1 { [before, &[width]].concat() } else { before.to_vec() };
            // Python's None and bool of one sample are no arrays.
            let values = match axes.as_slice() {
                [] => vec![arrays::sample(given)?],
                _ => {
                    arrays::named(name, given, &arrays::tuple(&axes), |found| found == axes)?.values
                }
            };
            columns.push((first, width, values));
        }
        let mut columns: Vec<_> =
            columns.iter().map(|(first, width, values)| (*first, *width, &values[..])).collect();
        columns.extend(dt.map(|dt| (WIDTH - 1, 1, dt)));
        arrays::side_by_side(WIDTH, before.iter().product(), &columns)
    }

    /// The samples of a batch.
    fn batch(&self, channels: Option<usize>, dt: Option<&Bound<'_, PyAny>>) -> PyResult<Record> {
        let expected = channels.map_or("(n, 2)".to_owned(), |k| format!("(n, {k}, 2)"));
        let after: Vec<usize> = channels.into_iter().chain([2]).collect();
        let fits = |found: &[usize]| found.len() > 1 && found[1..] == after;
        let n = arrays::named("position", self.position, &expected, fits)?.shape[0];
        let dt = dt.map(|dt| samples::times(dt, n)).transpose()?;
        let before: Vec<usize> = [n].into_iter().chain(channels).collect();
        let values = self.rows(&before, dt.as_deref())?;
        Ok(Record { values, shape: [before.as_slice(), &[WIDTH]].concat() })
    }
}

/// The arguments of a batch, logs and data frames as arrays.
fn taken<'py>(
    filter: &Bound<'py, PositionFilter>,
    given: [Option<&Bound<'py, PyAny>>; 5],
) -> PyResult<[Bound<'py, PyAny>; 5]> {
    arrays::taken(filter, ["position", "speed", "cn0", "rest", "dt"], given)
}

fn batch(taken: &[Bound<'_, PyAny>; 5], channels: Option<usize>) -> PyResult<Record> {
    let [position, speed, cn0, rest, dt] = taken.each_ref().map(arrays::present);
    let position = position.unwrap_or(&taken[0]);
    Given { position, speed, cn0, rest }.batch(channels, dt)
}

/// The table of the constants of ``PositionFilter`` as dictionaries, as that of ``Attitude``.
#[pyfunction]
pub fn position_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let meaning = "'aided' uses Doppler, strength and rest and takes a slow receiver error for what \
                   it is; the others are those of papers";
    let (methods, usual) = (&POSITION_METHODS, POSITION_METHODS[0]);
    constants::table::<PositionConstants>(py, methods, usual, meaning, POSITION_CONSTANTS)
}
