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

/// Numbers in a sample: position, speed, strength, rest and the time since the previous sample.
const WIDTH: usize = 7;

/// Position filter for a slow or standing receiver; it removes most of the wandering of its fixes.
///
/// A fix is a position east and north of a nearby point, m. Optional inputs:
///
/// - ``speed``: Doppler velocity east and north, m/s.
/// - ``cn0``: strength of the signals, dB-Hz.
/// - ``rest``: True if the platform is known to stand, from a ``RestDetector`` or a wheel.
///
/// The methods:
///
/// - **aided** uses all inputs. The Doppler velocity moves the position, and rest stops it. Fixes
///   from weak signals have less weight. The slow error of the receiver is estimated separately, so
///   the position does not follow it.
/// - **moving_average** is the mean of the last ``window`` fixes. In motion it lags by half of
///   these fixes.
/// - **kalman** assumes a constant velocity with a white acceleration.
/// - **heading** ignores a fix if two conditions are met: the step to it is shorter than ``step``,
///   and the course turns by more than ``turn``.
/// - **strength** is "kalman" with less weight for fixes from weak signals. Below 45 dB-Hz the
///   variance is ``sigma**2 * 10**((45 - cn0) / 10)`` (the sigma-epsilon form).
///
/// All methods except "aided" are from papers and serve for comparison. **No method removes the
/// slow error itself**: an error of metres that lasts for minutes cannot be distinguished from a
/// position. Only a mean over a long time reduces it.
///
/// Missing values are NaN or None. Without a fix the position is only predicted. A missing velocity
/// is replaced by the last velocity, with a standard deviation of ``acceleration`` times its age. A
/// missing strength counts as a strong signal. A method ignores inputs that it does not use. The
/// output is NaN before the first fix. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Fixes per second.
/// method : {"aided", "moving_average", "kalman", "heading", "strength"}, default "aided"
///     Name of the method.
/// channels : int, optional
///     Number of receivers; ``None`` is a single receiver without a channel axis.
/// window : int, default 10
///     Only "moving_average": number of fixes, 1 to 64.
/// sigma : float, default 0.7
///     Only "aided", "kalman" and "strength": standard deviation of the white noise of a fix with
///     strong signals, per axis, m. With a small value the position follows the fixes.
/// process_noise : float, default 0.5
///     Only "kalman" and "strength": power spectral density of the acceleration, m^2/s^3. A small
///     value smooths more, and lags in turns.
/// step, turn : float, default 3.0 and pi / 3
///     Only "heading": largest step that is ignored, m, and smallest turn of the course, rad.
/// error_sigma, error_time : float, default 2.5 and 120.0
///     Only "aided": standard deviation of the receiver's slow error per axis, m, and its
///     correlation time, s. With large values the position follows the fixes less.
/// speed_sigma : float, default 0.1
///     Only "aided": standard deviation of the white noise of the Doppler velocity, per axis, m/s.
/// acceleration : float, default 1.0
///     Only "aided": acceleration by which the velocity can change while it is unknown, m/s^2.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the method does not use it.
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

    /// Process a fix and return the position, m east and north, shape (2,).
    ///
    /// With k channels the shape is (k, 2). The arguments ``position`` and ``speed`` have the same
    /// shape. ``cn0`` is a number and ``rest`` a bool; with k channels they are arrays (k,). ``dt``
    /// is the time since the previous fix, s, by default one period.
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

    /// Process each fix of a batch and return the positions, shape (n, 2).
    ///
    /// With k channels the shape is (n, k, 2). ``cn0`` and ``rest`` are (n,), or (n, k) with k
    /// channels. ``dt`` is one time for all fixes, or an array (n,). The interpreter lock is
    /// released.
    #[pyo3(signature = (
        position, speed=None, cn0=None, rest=None, dt=None, out=None, threads=None
    ))]
    // The arguments are the same as in the Python method.
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

    /// Process a batch and return all estimates after each fix, as arrays by name.
    ///
    /// position, velocity and receiver_error are (n, 2); sigma, missing and held are (n,). With k
    /// channels the shapes are (n, k, …). ``missing`` marks missing fixes. ``held`` marks fixes
    /// that the method "heading" ignored.
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
            // A number of fixes is a whole number.
            let whole = if *name == "window" { value.strip_suffix(".0") } else { None };
            let value = if value == usual { usual } else { whole.unwrap_or(value) };
            arguments.push((*name, value.to_owned(), usual.as_str()));
        }
        Ok(call("PositionFilter", &arguments, this.shared.channels))
    }
}

getters! { PositionFilter, slf, py, this;
    /// Position east and north, m; NaN before the first fix.
    ///
    /// An array (2,), or (k, 2) with k channels.
    position: Object<'py> = each(slf, &[2], |known| known.position.to_vec())?;
    /// Standard deviation of ``position`` per axis, m.
    ///
    /// NaN for "moving_average" and "heading". A float, or an array (k,) with k channels.
    sigma: Object<'py> = each(slf, &[], |known| vec![known.sigma])?;
    /// Velocity east and north, m/s.
    ///
    /// For "aided" it is the last given velocity, and zero at rest. It is NaN for "moving_average"
    /// and "heading". An array (2,), or (k, 2) with k channels.
    velocity: Object<'py> = each(slf, &[2], |known| known.velocity.to_vec())?;
    /// Slow error of the receiver, m east and north.
    ///
    /// "aided" estimates it; for other methods it is NaN. An array (2,), or (k, 2) with k channels.
    receiver_error: Object<'py> = each(slf, &[2], |known| known.receiver_error.to_vec())?;
    /// True if the last fix was missing.
    ///
    /// A bool, or an array (k,) with k channels.
    missing: Object<'py> = this.shared.each(py, |one| one.snapshot().missing)?;
    /// True if "heading" ignored the last fix.
    ///
    /// A bool, or an array (k,) with k channels.
    held: Object<'py> = this.shared.each(py, |one| one.snapshot().held)?;
    /// Fixes to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Fixes per second.
    rate: f64 = this.first().params().rate;
    /// Name of the method.
    method: &'static str = this.first().params().method.name();
}

/// Numbers with this shape, for each channel.
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
    /// Interleaved inputs; `before` are the axes before a sample's axes. `dt` is the time of each
    /// instant.
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
            // None and bool from Python are no arrays.
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

/// The arguments of a batch; logs and data frames become arrays.
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

/// Return the table of the constants of ``PositionFilter`` as dictionaries, as for ``Attitude``.
#[pyfunction]
pub fn position_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let meaning = "'aided' uses Doppler, strength and rest and takes a slow receiver error for what \
                   it is; the others are those of papers";
    let (methods, usual) = (&POSITION_METHODS, POSITION_METHODS[0]);
    constants::table::<PositionConstants>(py, methods, usual, meaning, POSITION_CONSTANTS)
}
